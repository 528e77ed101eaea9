"""Gradients of smooth quantities by the parameters of a system."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.integration import Integration
from snapbeam.model.parameters import lookup
from snapbeam.model.system import System
from snapbeam.solver import native
from snapbeam.solver.assemble import make_ensemble
from snapbeam.solver.statistics import STATISTICS, name_in, rows_for, statistics_of
from snapbeam.sweeps.points import Columns, PointList
from snapbeam.sweeps.sweep import sweep
from snapbeam.util.diagnostics import Diagnostic, tell, to_json
from snapbeam.util.differences import differences
from snapbeam.util.provenance import canonical_json
from snapbeam.util.validation import InputError, checked, finite, instance, shown

if TYPE_CHECKING:
    import xarray as xr

_Array = NDArray[np.float64]
_STEP = 1e-5
"""Relative change of a parameter over which numbers of a run and the formulas of statistics are differentiated."""
_SQUARES = ("square_displacement", "square_center", "square_velocity", "square_midspan_velocity", "energy_time")
_FAR = 1e-3
"""Relative change of the sums under a root or in a quotient over that step, beyond which the formulas are not linear: the motion is chaotic."""
_DOUBTFUL = 1e-4
"""Relative error of a derivative that is reported."""
_NOT_SMOOTH = {
    "last_zero_crossing": "jumps where a crossing appears or vanishes",
    "early_stop_time": "is the time of an event that a criterion chooses",
}


@checked
def gradient(
    system: System,
    quantity: str | Sequence[str] | Callable[[System], float],
    parameters: str | Sequence[str],
    *,
    integration: Integration | None = None,
) -> xr.Dataset:
    """Derivatives of smooth quantities by parameters of the system, with error estimates.

    Statistics have exact derivatives through the run, with those of the times of impacts and of the jumps of motions, by
    the parameters of the beam, its ends and damping (through the derivatives of the assembled matrices), of motions,
    contacts, forces and circuits. The step is a quarter of the usual one, and the error a third of the change that this
    makes.

    With a user's laws, engine = "python" or a tolerance, where a parameter changes the number of pieces of a motion, and
    of a function, central differences of order six are taken, with a step that is shortened until orders six and four
    agree and all runs have the same number of impacts.

    Parameters
    ----------
    system : System
        System at which derivatives are taken.
    quantity : str, sequence of str or callable
        One or several names of statistics, such as ``"peak_force"`` or ``"energy_harvested"``, or a function of a
        system that returns a number, such as a natural frequency.
    parameters : str or sequence of str
        Numbers of the system that are not zero.
    integration : Integration, optional
        Solver settings; early termination is off.

    Returns
    -------
    xarray.Dataset
        Variables over ``parameter``: ``derivative`` (per unit of the parameter); ``elasticity`` (relative change of the
        quantity per relative change of the parameter, NaN where the quantity is zero); ``relative_error``, infinite
        where neighbouring runs have other numbers of impacts (of exact ones at a relative change of 1e-5, or with the
        other step); ``method`` ("exact" or "differences"); ``growth``, the change of the state at the end over the
        distance of the wells per relative change of the parameter, NaN with differences. In chaotic motion it grows
        exponentially with the cycles, and a derivative says little. The attributes are ``quantity``, ``value`` and
        ``units``. Of several statistics the variables, except ``growth``, are over ``statistic`` and ``parameter``;
        ``value``, ``statistic_unit`` and ``no_derivative`` are over ``statistic``. The last is the reason why one has
        no derivative (NaN, no method): a class, a count, or a value that is not finite.

    Raises
    ------
    InputError
        For a parameter that is zero or not a number, or if no quantity has a derivative.

    See Also
    --------
    snapbeam.uncertainty.sensitivity

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> model = sb.ReducedModel.from_beam(paper.BEAM, modes=1, damping_ratio=0.005)
    >>> system = sb.System(model)
    >>> first = lambda system: float(system.model.natural_frequencies[0])
    >>> found = sb.uncertainty.gradient(system, first, ["beam.young_modulus", "beam.density"])
    >>> found["elasticity"].values.round(6).tolist()
    [0.5, -0.5]
    """
    instance("system", system, System, "a System")
    how = instance(
        "integration", Integration() if integration is None else integration, Integration, "an Integration"
    ).replace(early_termination=False)
    names = [system.parameter(name).name for name in ([parameters] if isinstance(parameters, str) else parameters)]
    if not names or len(set(names)) < len(names):
        raise InputError(f"parameters = {shown(parameters)}: must be different names, at least one")
    here = np.array([_value(system, name) for name in names])
    if callable(quantity):
        labels, units, reasons = [getattr(quantity, "__name__", "quantity")], ["1"], [""]
        evaluate = _by_systems(system, quantity, names)
    else:
        rows = rows_for(len(system.contacts))
        labels = [name_in(rows, each) for each in ([quantity] if isinstance(quantity, str) else quantity)]
        reasons = _reasons(labels)
        units = [STATISTICS[label].unit for label in labels]
        evaluate = _by_runs(system, labels, names, how)
    values = evaluate(here[None])[0][0]
    reasons = [
        reason or ("" if np.isfinite(value) else f"is {value} for the system itself; it must be finite")
        for reason, value in zip(reasons, values, strict=True)
    ]
    smooth = [k for k, reason in enumerate(reasons) if not reason]
    if not smooth:
        raise InputError("; ".join(f"quantity = {label}: {why}" for label, why in zip(labels, reasons, strict=True)))

    moved, error = np.full((2, len(labels), here.size), np.nan)
    growth = np.full(here.size, np.nan)
    if not callable(quantity):
        moved[smooth], error[smooth], growth = _exact(system, [labels[k] for k in smooth], names, here, how)
    differenced = np.zeros(moved.shape, dtype=bool)
    for k in smooth:
        left = np.isnan(error[k])
        if left.any():

            def advance_rows(rows: _Array, runs: NDArray[np.intp], k: int = k) -> tuple[_Array, _Array | None]:
                found, impacts = evaluate(rows * here)
                return found[:, k : k + 1], impacts

            slopes, doubts = differences(advance_rows, np.ones((1, here.size)), np.eye(here.size)[None, left])
            moved[k, left], error[k, left], differenced[k, left] = slopes[0, :, 0], doubts[0], True
    method = np.where(np.isnan(error), "", np.where(differenced, "differences", "exact"))
    found = _dataset(system, names, here, moved, error, method, growth, (labels, values, units, reasons))
    if not (callable(quantity) or isinstance(quantity, str)):
        return found
    only = {"quantity": labels[0], "value": float(values[0]), "units": units[0]}
    found = found.isel(statistic=0, drop=True).drop_vars(["value", "statistic_unit", "no_derivative"])
    return found.assign_attrs(only)


def _exact(
    system: System, quantities: list[str], names: list[str], here: _Array, how: Integration
) -> tuple[_Array, _Array, _Array]:
    """Derivatives per relative change, their relative errors, of shape (quantities, parameters), and the growth of the state.

    NaN where the core takes none.
    """
    moved, error = np.full((2, len(quantities), here.size), np.nan)
    growth = np.full(here.size, np.nan)
    exact = [k for k, name in enumerate(quantities) if STATISTICS[name].update is None]
    if how.engine == "python" or how.tolerance is not None or not exact:
        return moved, error, growth
    sides = (1.0 + _STEP, 1.0 - _STEP)
    found, impacts = [], []
    which = list(range(here.size))
    for factor in (1.0, 0.25):
        ensemble = make_ensemble(system, how, step_factor=factor)
        if ensemble.channels.of_user:
            return moved, error, growth
        beside = []
        for i in which:
            above, below = (
                make_ensemble(system.replace(**{names[i]: here[i] * side}), how, step_factor=factor) for side in sides
            )
            beside.append((above, below, 2.0 * _STEP * here[i]))
        same = [native.differentiable(above, below) for above, below, _ in beside]
        which = [i for i, each in zip(which, same, strict=True) if each]
        if not which:
            return moved, error, growth
        beside = [pair for pair, each in zip(beside, same, strict=True) if each]
        pairs, grown, whole = native.changed_accumulators(ensemble, beside, how.threads)
        with np.errstate(invalid="ignore"):  # chaos: a sum of squares may become negative; the error says so
            of_runs = [
                [statistics_of(near, rows) for near, rows in zip(both, each, strict=False)]
                for both, each in zip(beside, pairs, strict=True)
            ]
        values = np.array([[[run[quantities[k]][0] for run in both] for both in of_runs] for k in exact], dtype=float)
        far = [
            any(abs(high[name][0] - low[name][0]) > _FAR * whole[name][0] for name in _SQUARES) for high, low in pairs
        ]
        found.append((values @ (1.0, -1.0)) / (2.0 * _STEP))
        counts = np.array(
            [[native.run_ensemble(near, how.threads)["impacts"][0] for near in each[:2]] for each in beside]
        )
        impacts.append((int(whole["impacts"][0]), counts))
        size = np.linalg.norm(ensemble.structure.omega * ensemble.structure.shift)
        growth[which] = grown[0] * np.abs(here[which]) / (size or np.nan)
    change = np.abs(found[1] - found[0]) / 3.0  # of first order in the step, at least
    (one, some), (other, others) = impacts
    grazes = (np.hstack((some, others)) != one).any(axis=1) | (one != other) | np.array(far) | ~np.isfinite(found[1])
    at = np.ix_(exact, which)
    moved[at] = found[1]
    error[at] = np.where(change == 0.0, 0.0, change / np.maximum(np.abs(found[1]), 1e-300))
    error[at] = np.where(grazes, np.inf, error[at])
    return moved, error, growth


def slopes_of_runs(
    system: System, how: Integration, columns: Columns, beside: Sequence[tuple[Columns, Columns]]
) -> tuple[Columns, list[Columns]] | None:
    """Statistics of runs and their exact changes between pairs of columns beside; None where the core takes no derivative.

    The columns of each pair differ a little, by a parameter of a design.  ``length_scale`` and ``velocity_scale`` are among the statistics.
    """
    structural = [name for name in columns if not lookup(name).is_run]
    if (
        any(name.startswith("initial_state.") for name in columns)
        or how.engine == "python"
        or how.tolerance is not None
    ):
        return None
    sides = [columns, *(side for pair in beside for side in pair)]
    count = next(iter(columns.values())).size
    of_system = np.stack([columns[name] for name in structural], axis=1) if structural else np.zeros((count, 0))
    _, group = np.unique(of_system, axis=0, return_inverse=True)
    whole: Columns = {}
    changes: list[Columns] = [{} for _ in beside]
    for number in range(int(group.max()) + 1):
        rows = np.flatnonzero(group.ravel() == number)
        ensembles, scales = [], []
        for side in sides:
            own = {name: values[rows] for name, values in side.items()}
            near = system.replace(**{name: float(own.pop(name)[0]) for name in structural}) if structural else system
            ensembles.append(make_ensemble(near, how, own))
            scales.append({"length_scale": near.scale.length, "velocity_scale": near.scale.length * near.scale.omega})
        here, pairs = ensembles[0], list(zip(ensembles[1::2], ensembles[2::2], strict=True))
        if here.channels.of_user or not all(native.differentiable(*pair) for pair in pairs):
            return None
        found, _, records = native.changed_accumulators(here, [(*pair, 1.0) for pair in pairs], how.threads)
        tables = [(scales[0], here, records)]
        tables += [
            (scales[1 + i], ensembles[1 + i], own) for i, own in enumerate(own for pair in found for own in pair)
        ]
        of_sides = [
            statistics_of(near, own) | {name: np.full(rows.size, size) for name, size in scale.items()}
            for scale, near, own in tables
        ]
        for name, values in of_sides[0].items():
            whole.setdefault(name, np.zeros(count, np.asarray(values).dtype))[rows] = values
            for k, change in enumerate(changes if np.asarray(values).dtype == np.float64 else []):
                change.setdefault(name, np.zeros(count))[rows] = of_sides[1 + 2 * k][name] - of_sides[2 + 2 * k][name]
    return whole, changes


def _value(system: System, name: str) -> float:
    """A parameter that may be changed in proportion."""
    row = lookup(name)
    given = system.get(name)
    if row.quantity.kind is not float or given is None:
        raise InputError(f"{name} = {shown(given)}: must be a number, for a derivative by it")
    found = finite(name, given)
    if found == 0.0:
        raise InputError(f"{name} = 0: must not be 0, since its step is in proportion to it")
    return found


def _reasons(quantities: list[str]) -> list[str]:
    """Reasons why statistics have no derivative; empty texts where they have one."""
    if not quantities or len({*quantities}) < len(quantities):
        raise InputError(f"quantity = {shown(quantities)}: must be different statistics, at least one")
    for name in quantities:
        if name not in STATISTICS:
            smooth = [each for each, row in STATISTICS.items() if row.dtype == "float64" and each not in _NOT_SMOOTH]
            raise InputError(f"quantity = {shown(name)}: must be one of {', '.join(smooth)}, or a function of a system")
    return [f"{why}, so that it has no derivative" if (why := not_smooth(name)) else "" for name in quantities]


def not_smooth(name: str) -> str:
    """Reason why a statistic is no smooth function of parameters; empty if it is one."""
    counted = STATISTICS[name].dtype != "float64"
    if STATISTICS[name].update is not None:
        return "is updated by a function of its own"
    return "is a class or a count, which changes by jumps" if counted else _NOT_SMOOTH.get(name, "")


_Evaluation = Callable[[_Array], tuple[_Array, _Array | None]]


def _by_runs(system: System, quantities: list[str], names: list[str], how: Integration) -> _Evaluation:
    """Evaluate statistics at rows of parameters by runs."""

    def evaluate(rows: _Array) -> tuple[_Array, _Array | None]:
        different, back = np.unique(rows, axis=0, return_inverse=True)
        points = PointList({name: different[:, i] for i, name in enumerate(names)})
        found = sweep(system, points, how)
        values = np.stack([np.asarray(found[name].values, dtype=np.float64) for name in quantities], axis=1)
        return values[back.ravel()], np.asarray(found["impacts"].values)[back.ravel()]

    return evaluate


def _by_systems(system: System, quantity: Callable[[System], float], names: list[str]) -> _Evaluation:
    """Evaluate a function at rows of parameters."""

    def evaluate(rows: _Array) -> tuple[_Array, _Array | None]:
        found = [float(quantity(system.replace(**dict(zip(names, row.tolist(), strict=True))))) for row in rows]
        return np.array(found)[:, None], None

    return evaluate


def _dataset(
    system: System,
    names: list[str],
    here: _Array,
    moved: _Array,
    error: _Array,
    method: NDArray[np.str_],
    growth: _Array,
    quantities: tuple[list[str], _Array, list[str], list[str]],
) -> xr.Dataset:
    from snapbeam.util.datasets import xr

    labels, values, units, reasons = quantities
    diagnostics = tuple(
        Diagnostic(
            "gradient.doubtful",
            f"{label}: estimated relative error of the derivative by "
            f"{', '.join(f'{name} {each:.1g}' for name, each in large.items())}: an impact grazes, or begins or ends with the run, the "
            "motion is chaotic, or the derivative is what is left of larger parts; change the parameter a little or the number of cycles, or "
            "take accuracy = 'reference'",
            {"relative_error": max(large.values())},
        )
        for label, reason, errors in zip(labels, reasons, error, strict=True)
        if not reason
        and (large := {name: float(each) for name, each in zip(names, errors, strict=True) if not each <= _DOUBTFUL})
    )
    tell(diagnostics)
    elasticity = np.divide(moved, values[:, None], out=np.full_like(moved, np.nan), where=values[:, None] != 0.0)
    both, text = (
        ("statistic", "parameter"),
        {"units": "1", "long_name": "relative change of the quantity per relative change of the parameter"},
    )
    return xr.Dataset(
        {
            "derivative": (both, moved / here, {"long_name": "derivative of the quantity by the parameter"}),
            "elasticity": (both, elasticity, text),
            "relative_error": (both, error, {"units": "1", "long_name": "estimated error of the derivative"}),
            "method": (both, method, {"long_name": "way in which the derivative was taken"}),
            "growth": ("parameter", growth, {"units": "1", "long_name": "change of the state at the end per relative change of the parameter"}),
            "unit": ("parameter", [lookup(name).quantity.unit for name in names], {"long_name": "unit of the parameter"}),
            "nominal_value": ("parameter", here, {"long_name": "value of the parameter"}),
            "value": ("statistic", values, {"long_name": "value of the statistic"}),
            "statistic_unit": ("statistic", units, {"long_name": "unit of the statistic"}),
            "no_derivative": ("statistic", reasons, {"long_name": "reason why the statistic has no derivative"}),
        },
        {"statistic": labels, "parameter": names},
        {
            "title": "gradient", "system_hash": system.hash, "snapbeam_system": canonical_json(system.to_mapping()),
            "diagnostics": to_json(diagnostics),
        },
    )  # fmt: skip
