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
from snapbeam.solver.statistics import STATISTICS, statistics_of
from snapbeam.sweeps.points import PointList
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
    quantity: str | Callable[[System], float],
    parameters: str | Sequence[str],
    *,
    integration: Integration | None = None,
) -> xr.Dataset:
    """Derivatives of a smooth quantity by parameters of the system, with error estimates.

    Of a statistic the core takes exact derivatives through the run, with those of the times of impacts, by all parameters that
    leave the modes, the laws of a user and the times of jumps of a motion as they are, such as a frequency, an amplitude, a gap, a
    contact's stiffness or location, a resistance; the step is a quarter of the usual one, and the error a third of what this changes.  The formula from what a run adds
    up to the statistic, and the numbers of a run by the parameter, are differentiated by a small difference; no run is.

    By other parameters, and of a function, central differences of order six between neighbouring systems, whose step is shortened
    until orders six and four agree and all runs have the same number of impacts.

    Parameters
    ----------
    system : System
        System at which derivatives are taken.
    quantity : str or callable
        A statistic of a run by its name, such as ``"peak_force"`` or ``"energy_harvested"``, or a function of a system that returns a
        number, such as a natural frequency or the amplitude of an orbit.
    parameters : str or sequence of str
        Numbers of the system that are not zero, by dotted or short name.
    integration : Integration, optional
        Settings of the runs; early termination is off.

    Returns
    -------
    xarray.Dataset
        Variables over ``parameter``: ``derivative`` (per unit of the parameter), ``elasticity`` (relative change of the
        quantity per relative change of the parameter), ``relative_error``, infinite where neighbouring runs have
        other numbers of impacts at any distance (of exact ones at a relative change of 1e-5, or with the other step), ``method`` ("exact" or "differences") and ``growth``: the change of the
        state at the end over the distance of the wells, per relative change of the parameter, NaN with differences.  In chaotic
        motion it grows exponentially with the number of cycles, and a derivative says little.
        The elasticity is NaN where the quantity is zero.  The attributes have the ``quantity``, its ``value`` and its ``units``.

    Raises
    ------
    InputError
        For a parameter that is zero or not a number, a quantity without a derivative (a class, a count), or a quantity that is not finite.

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
    if isinstance(quantity, str):
        label, units, evaluate = quantity, _unit(quantity), _by_runs(system, quantity, names, how)
    else:
        label, units = getattr(quantity, "__name__", "quantity"), "1"
        evaluate = _by_systems(system, quantity, names)
    value = float(evaluate(here[None])[0][0])
    if not np.isfinite(value):
        raise InputError(f"quantity = {label}: is {value} for the system itself; it must be finite")

    def advance_rows(rows: _Array, runs: NDArray[np.intp]) -> tuple[_Array, _Array | None]:
        found, impacts = evaluate(rows * here)
        return found[:, None], impacts

    moved, error, growth = np.full((3, here.size), np.nan)
    if isinstance(quantity, str):
        moved, error, growth = _exact(system, quantity, names, here, how)
    left = np.isnan(error)
    if left.any():
        slopes, doubts = differences(advance_rows, np.ones((1, here.size)), np.eye(here.size)[None, left])
        moved[left], error[left] = slopes[0, :, 0], doubts[0]
    return _dataset(system, names, here, moved, error, left, growth, label, value, units)


def _exact(
    system: System, quantity: str, names: list[str], here: _Array, how: Integration
) -> tuple[_Array, _Array, _Array]:
    """Derivatives per relative change, their relative errors and the growth of the state; NaN where the core takes none."""
    moved, error, growth = np.full((3, here.size), np.nan)
    if how.engine == "python" or how.tolerance is not None or STATISTICS[quantity].update is not None:
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
            values = [
                [float(statistics_of(near, rows)[quantity][0]) for near, rows in zip(both, each, strict=False)]
                for both, each in zip(beside, pairs, strict=True)
            ]
        far = [
            any(abs(high[name][0] - low[name][0]) > _FAR * whole[name][0] for name in _SQUARES) for high, low in pairs
        ]
        found.append((np.array(values) @ (1.0, -1.0)) / (2.0 * _STEP))
        counts = np.array(
            [[native.run_ensemble(near, how.threads)["impacts"][0] for near in each[:2]] for each in beside]
        )
        impacts.append((int(whole["impacts"][0]), counts))
        size = np.linalg.norm(ensemble.structure.omega * ensemble.structure.shift)
        growth[which] = grown[0] * np.abs(here[which]) / (size or np.nan)
    moved[which] = found[1]
    change = np.abs(found[1] - found[0]) / 3.0  # of first order in the step, at least
    error[which] = np.where(change == 0.0, 0.0, change / np.maximum(np.abs(found[1]), 1e-300))
    (one, some), (other, others) = impacts
    grazes = (np.hstack((some, others)) != one).any(axis=1) | (one != other) | np.array(far) | ~np.isfinite(found[1])
    error[which] = np.where(grazes, np.inf, error[which])
    return moved, error, growth


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


def _unit(quantity: str) -> str:
    """Unit of a statistic that has a derivative."""
    if quantity not in STATISTICS:
        smooth = [name for name, row in STATISTICS.items() if row.dtype == "float64" and name not in _NOT_SMOOTH]
        raise InputError(f"quantity = {shown(quantity)}: must be one of {', '.join(smooth)}, or a function of a system")
    row = STATISTICS[quantity]
    if row.dtype != "float64" or quantity in _NOT_SMOOTH:
        why = _NOT_SMOOTH.get(quantity, "is a class or a count, which changes by jumps")
        raise InputError(f"quantity = {quantity!r}: {why}, so that it has no derivative")
    return row.unit


_Evaluation = Callable[[_Array], tuple[_Array, _Array | None]]


def _by_runs(system: System, quantity: str, names: list[str], how: Integration) -> _Evaluation:
    """Evaluate a statistic at rows of parameters by runs."""

    def evaluate(rows: _Array) -> tuple[_Array, _Array | None]:
        different, back = np.unique(rows, axis=0, return_inverse=True)
        points = PointList({name: different[:, i] for i, name in enumerate(names)})
        found = sweep(system, points, how)
        values = np.asarray(found[quantity].values, dtype=np.float64)
        return values[back.ravel()], np.asarray(found["impacts"].values)[back.ravel()]

    return evaluate


def _by_systems(system: System, quantity: Callable[[System], float], names: list[str]) -> _Evaluation:
    """Evaluate a function at rows of parameters."""

    def evaluate(rows: _Array) -> tuple[_Array, _Array | None]:
        found = [float(quantity(system.replace(**dict(zip(names, row.tolist(), strict=True))))) for row in rows]
        return np.array(found), None

    return evaluate


def _dataset(
    system: System,
    names: list[str],
    here: _Array,
    moved: _Array,
    error: _Array,
    differenced: NDArray[np.bool_],
    growth: _Array,
    label: str,
    value: float,
    units: str,
) -> xr.Dataset:
    from snapbeam.util.datasets import xr

    diagnostics = tuple(
        Diagnostic(
            "gradient.doubtful",
            f"{name}: the derivative of {label} has an estimated relative error of {each:.1g}: an impact grazes, or begins or ends "
            "with the run, or the motion is chaotic; change the parameter a little or the number of cycles",
            {"relative_error": float(each)},
        )
        for name, each in zip(names, error, strict=True)
        if not each <= _DOUBTFUL
    )
    tell(diagnostics)
    elasticity = moved / value if value != 0.0 else np.full_like(moved, np.nan)
    text = {"units": "1", "long_name": "relative change of the quantity per relative change of the parameter"}
    return xr.Dataset(
        {
            "derivative": ("parameter", moved / here, {"long_name": f"derivative of {label} by the parameter"}),
            "elasticity": ("parameter", elasticity, text),
            "relative_error": ("parameter", error, {"units": "1", "long_name": "estimated error of the derivative"}),
            "method": ("parameter", np.where(differenced, "differences", "exact"), {"long_name": "way in which the derivative was taken"}),
            "growth": ("parameter", growth, {"units": "1", "long_name": "change of the state at the end per relative change of the parameter"}),
            "unit": ("parameter", [lookup(name).quantity.unit for name in names], {"long_name": "unit of the parameter"}),
            "nominal_value": ("parameter", here, {"long_name": "value of the parameter"}),
        },
        {"parameter": names},
        {
            "title": "gradient", "quantity": label, "value": value, "units": units, "system_hash": system.hash,
            "snapbeam_system": canonical_json(system.to_mapping()), "diagnostics": to_json(diagnostics),
        },
    )  # fmt: skip
