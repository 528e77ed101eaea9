"""The model's beam from measured frequencies, decays and collisions, with uncertainties and in plain words.

The paper adjusts the thickness to the straight beam's frequencies and the buckling level to those about the
wells (section 3.3).  Here both are fitted at once by least squares, and what the data cannot tell is said.
"""

from __future__ import annotations

import dataclasses
import math
import os
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.lab.diagnostics import KINDS_CALIBRATION, holding
from snapbeam.lab.least_squares import weighted_line
from snapbeam.model.beam import Beam
from snapbeam.model.boundary_conditions import BoundaryConditions
from snapbeam.model.default_values import BEAM, MODES
from snapbeam.model.imperfection import Imperfection
from snapbeam.model.imperfection_identification import identify_imperfection
from snapbeam.model.parameter_file import config_from_mapping, dump_config
from snapbeam.model.reduced_model import ReducedModel
from snapbeam.uncertainty.measurements import HERTZ_TIME, Measurements
from snapbeam.util.diagnostics import Diagnostic
from snapbeam.util.singular_values import svd
from snapbeam.util.validation import InputError, choice, instance, integer, positive, shown

if TYPE_CHECKING:
    import xarray as xr


_PARITY = {"": 0, "symmetric": 1, "antisymmetric": -1}
_UNITS = {"midspan_amplitude": "m", "point_load": "N", "uniform_load": "N/m"}
_Array = NDArray[np.float64]
STARTS = (1.0, 0.75, 1.33, 0.55, 1.8)
"""Buckling levels to start from, over the given one."""
HIGHER = (1.05, 1.15, 1.3)
"""Buckling levels that are tried beyond the one found, over it."""
UNDETERMINED = 1e-5
"""Minimum singular value of the relative sensitivities that counts as a response, over the maximum."""
_CROSSING = 0.05  # share within which the first two frequencies may be in the other order
ASSUMED = 0.005
"""Standard error of a frequency for which none is given, as a share of it."""
_LINKED = 0.95  # correlation from which two parameters are said to be linked
_VAGUE = 0.05  # relative standard error from which a parameter is said to be hardly known
_SHOWN = {
    "thickness": (1e3, "mm"),
    "buckling_level": (1e3, "mm"),
    "length": (1e3, "mm"),
    "young_modulus": (1e-9, "GPa"),
    "density": (1.0, "kg/m^3"),
}
FITTED = ("thickness", "young_modulus", "density", "length", "buckling_level")
_HERTZ_POWER = -0.2
_LEAST_SPAN = 2.0  # factor by which speeds must differ for the power to be told
_COARSE = 6.0  # frames


def _symmetric(measured: Measurements, well: str) -> list[float]:
    """Frequencies [Hz] about a well that belong to symmetric modes, or all if their shapes are not given."""
    values, shapes = getattr(measured, f"{well}_well_frequencies"), getattr(measured, f"{well}_well_shape")
    kinds = shapes or ["symmetric"] * len(values)
    return [f for f, shape in zip(values, kinds, strict=True) if shape == "symmetric"]


def imperfection_section(imperfection: Imperfection | None) -> dict[str, Any]:
    """Nonzero parameters of an imperfection, as the section of a parameter file."""
    if imperfection is None:
        return {}
    perfect = vars(Imperfection())
    return {name: value for name, value in vars(imperfection).items() if not np.array_equal(value, perfect[name])}


def sensitivity(frequencies: Callable[[_Array], _Array], logs: _Array, errors: _Array) -> _Array:
    """Change of the frequencies, in standard errors, with the logarithms of the parameters."""
    step = 1e-5
    steps = step * np.eye(logs.size)
    columns = [(frequencies(logs + e) - frequencies(logs - e)) / (2.0 * step) for e in steps]
    return np.column_stack(columns) / errors[:, None]


def search(residual: Callable[[_Array], _Array], begin: _Array, keep: _Array, level: _Array, freedom: int) -> _Array:
    """The least squares minimum; other buckling levels are tried where the first start meets the data badly.

    Frequencies are told apart by their order only, and at b/r = 6.2 the first two change places: from the
    wrong side of it the fit can end in a minimum that is none of the data's.  *level* is 1 for the buckling level.
    """
    from scipy.optimize import least_squares

    enough = freedom + 3.0 * math.sqrt(2.0 * freedom) + 1e-6
    best, found = math.inf, begin
    for factor in STARTS if level.any() else STARTS[:1]:
        start = begin + math.log(factor) * level
        result = least_squares(
            lambda z, start=start: residual(start + keep @ z), np.zeros(keep.shape[1]), x_scale=0.1,
            xtol=1e-10, ftol=1e-10, gtol=1e-10,
        )  # fmt: skip
        if 2.0 * result.cost < best:
            best, found = 2.0 * result.cost, start + keep @ result.x
        if best <= enough:
            break
    return found


def directions(jacobian: _Array) -> _Array:
    """Orthonormal combinations of parameters that the data respond to, one a column."""
    _, singular, rows = svd(jacobian, full_matrices=False)
    return np.asarray(rows[singular > UNDETERMINED * singular[0]].T)


def shape_diagnostics(beam: Beam, measured: Measurements, modes: int) -> list[Diagnostic]:
    """Diagnostics for an uncertain order of the modes about a well, if only the frequencies identify them."""
    told = [measured.lower_well_shape, measured.upper_well_shape]
    given = [freq for freq in (measured.lower_well_frequencies, measured.upper_well_frequencies) if freq]
    if modes < 2 or any(told) or not given:
        return []
    model = ReducedModel.from_beam(beam, modes)
    if not (model.parity > 0).any():  # unequal ends: no mode is either
        return []
    symmetric = float(model.natural_frequencies[model.parity > 0][0])
    other = model.natural_frequencies[model.parity < 0]
    if not other.size:
        return []
    antisymmetric = float(other[0])
    if antisymmetric < symmetric:
        return [KINDS_CALIBRATION["antisymmetric"].found(frequency=antisymmetric)]
    if symmetric > (1.0 - _CROSSING) * antisymmetric:
        return [KINDS_CALIBRATION["crossing"].found(symmetric=symmetric, antisymmetric=antisymmetric)]
    return []


def either_well(beam: Beam, measured: Measurements, modes: int) -> tuple[float, ...]:
    """Buckling level [m] that the first symmetric frequency of each well alone asks for; empty if they agree."""
    from scipy.optimize import newton

    goals = [*_symmetric(measured, "lower")[:1], *_symmetric(measured, "upper")[:1]]
    if len(goals) < 2 or goals[0] == goals[1]:
        return ()
    level, levels = beam.buckling_level, []

    def symmetric(at: float) -> float:
        model = ReducedModel.from_beam(beam.replace(buckling_level=abs(at) * level), modes)
        even = model.parity > 0
        return float(model.natural_frequencies[even if even.any() else slice(None)][0])

    here = symmetric(1.0)
    for goal in goals:
        options = {"x1": goal / here + 1e-6, "tol": 1e-7, "maxiter": 12}
        try:
            levels.append(level * float(newton(lambda at, goal=goal: symmetric(at) / goal - 1.0, 1.0, **options)))
        except RuntimeError:  # no level gives that frequency
            return ()
    return tuple(levels)


def _listed(names: tuple[str, ...]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def with_error(result: Calibration, name: str) -> str:
    """A fitted parameter with its standard error, in the unit people read."""
    scale, unit = _SHOWN[name]
    value = result.values[name] * scale
    if name not in result.standard_errors:
        return f"{value:.5g} {unit}, not determined by the data"
    return f"{value:.5g} +- {result.standard_errors[name] * scale:.2g} {unit}"


def links(names: list[str], covariance: NDArray[np.float64], hidden: tuple[str, ...]) -> list[Diagnostic]:
    """Diagnostics for parameters that the data do not determine or determine only in combination."""
    told = []
    if hidden:
        words = f"no measured frequency depends on {hidden[0]}: it keeps its start"
        if len(hidden) > 1:
            words = (
                f"the measured frequencies cannot tell {_listed(hidden)} apart: they depend on a combination of "
                "them only; fix one of them by another measurement (the values given keep nearest to the start)"
            )
        told.append(KINDS_CALIBRATION["undetermined"].found(told=words))
    spread = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    for i in (i for i, name in enumerate(names) if name not in hidden):
        if spread[i] > _VAGUE:
            told.append(KINDS_CALIBRATION["vague"].found(told=names[i], share=spread[i]))
        for j in (j for j, other in enumerate(names[:i]) if other not in hidden):
            linked = covariance[i, j] / (spread[i] * spread[j])
            if abs(linked) > _LINKED:
                words = (
                    f"{names[j]} and {names[i]} can hardly be told apart (correlation {linked:+.3f}): where one rises "
                )
                words += f"the other {'rises' if linked > 0.0 else 'falls'}"
                told.append(KINDS_CALIBRATION["linked"].found(told=words, correlation=linked))
    return told


def remarks(result: Calibration, measured: Measurements) -> list[str]:
    """Remarks on the result: frequencies about the wells, and measured against fitted geometry."""
    told = []
    wells = (measured.lower_well_frequencies, measured.upper_well_frequencies)
    first = [values[0] for values in wells if values]
    if first and result.well_frequency is not None:
        mean = float(np.mean(first))
        told.append(
            f"the model's first frequency about either well is {result.well_frequency:.2f} Hz; measured mean "
            f"{mean:.2f} Hz"
        )
        other = result.start_well_frequency
        if other is not None and abs(other / mean - 1.0) > 0.002:
            told.append(
                f"the buckling level the fit started from, {result.start.buckling_level * 1e3:.4g} mm "
                f"(thickness {result.start.thickness * 1e3:.4g} mm), reproduces {other:.2f} Hz, "
                f"{other - mean:+.2f} Hz from the measured mean"
            )
    for name in ("thickness", "buckling_level"):
        gauge, value = getattr(measured, name), getattr(result.beam, name)
        if gauge is not None:
            told.append(
                f"{name}: {value * 1e3:.4g} mm in the model, {gauge * 1e3:.4g} mm measured ({value / gauge - 1.0:+.1%})"
            )
    if result.gauge_well_frequency is not None:
        told.append(
            f"with the measured geometry the model's first frequency about a well would be "
            f"{result.gauge_well_frequency:.1f} Hz: the fitted numbers stand for all that the ideal clamped beam "
            "leaves out, and are no gauge readings"
        )
    return told


def doubts(result: Calibration, measured: Measurements) -> list[Diagnostic]:
    """Diagnostics of a calibration: unequal wells, assumed standard errors, data that the model does not fit."""
    told = []
    pairs = zip(measured.lower_well_frequencies, measured.upper_well_frequencies, strict=False)
    for i, (one, two) in enumerate(pairs):
        if one != two:
            text = (
                f"mode {i + 1}: wells at {one:g} and {two:g} Hz, {2.0 * abs(one - two) / (one + two):.1%} "
                "apart: unequal wells lie outside the symmetric model, which has one frequency for both and "
                "is fitted to their mean"
            )
            if i == 0 and len(result.either_well) == 2:
                levels = " and ".join(f"{level * 1e3:.4g}" for level in result.either_well)
                text += f"; either alone would ask for a buckling level of {levels} mm"
            told.append(KINDS_CALIBRATION["unequal_wells"].found(told=text, first=one, second=two))
    states = ("straight_frequencies", "lower_well_frequencies", "upper_well_frequencies")
    assumed = [name for name in states if getattr(measured, name) and getattr(measured, f"{name}_se") is None]
    if assumed:
        told.append(KINDS_CALIBRATION["assumed_errors"].found(told=f"{_listed(tuple(assumed))}: {ASSUMED:.1%}"))
    for item in (one for one in result.residuals if abs(one.deviation) > 3.0):
        numbers = {"model": item.model, "measured": item.measured, "apart": abs(item.deviation)}
        told.append(KINDS_CALIBRATION["outlier"].found(None, item.name, **numbers))
    low, high = (of(measured.damping_ratio, default=0.0) for of in (min, max))
    return told + holding(
        KINDS_CALIBRATION,
        ("scatter", result.scatter > 1.1, {"scatter": result.scatter}),
        ("damping_differs", high > 1.3 * low, {"low": low, "high": high}),
    )


@dataclass(frozen=True)
class Residual:
    """One measured frequency [Hz] and that of the model, and their difference in standard errors."""

    name: str
    measured: float
    standard_error: float
    model: float

    @property
    def deviation(self) -> float:
        """(model - measured)/standard error."""
        return (self.model - self.measured) / self.standard_error


@dataclass(frozen=True)
class Calibration:
    """A calibrated beam.

    ``beam`` is the result; ``values`` and ``standard_errors`` are by name (SI), in the order of ``correlation``. A
    parameter that the data do not determine is in ``undetermined`` instead of ``standard_errors``. ``scatter`` is the
    root of chi-square per degree of freedom that raised the errors, or 1. ``well_frequency``, ``start_well_frequency``,
    ``gauge_well_frequency`` [Hz] are the first about a well of the result, of the start, and of the result with the
    gauge's geometry; ``either_well`` is the buckling level [m] from each well alone. ``imperfection``, if requested,
    gives each well its own frequency. ``remarks`` describe the result, ``diagnostics`` list doubtful results.

    Examples
    --------
    >>> from snapbeam import lab
    >>> measured = lab.Measurements(lower_well_frequencies=[84.0], lower_well_frequencies_se=[0.2])  # Hz
    >>> found = lab.calibrate(measured, fit=("buckling_level",), modes=4)
    >>> f"{1e3 * found.beam.buckling_level:.3f} mm"
    '0.342 mm'
    """

    beam: Beam
    start: Beam
    values: dict[str, float]
    standard_errors: dict[str, float]
    correlation: _Array = field(repr=False)
    undetermined: tuple[str, ...]
    residuals: tuple[Residual, ...]
    scatter: float
    degrees_of_freedom: int
    modes: int
    damping_ratio: float | None
    damping_ratio_se: float | None
    contact_stiffness: float | None
    contact_stiffness_se: float | None
    well_frequency: float | None
    start_well_frequency: float | None
    gauge_well_frequency: float | None
    either_well: tuple[float, ...]
    remarks: tuple[str, ...]
    diagnostics: tuple[Diagnostic, ...]
    imperfection: Imperfection | None = None

    @property
    def warnings(self) -> tuple[str, ...]:
        """The diagnostics in words."""
        return tuple(one.message for one in self.diagnostics)

    def sections(self) -> dict[str, dict[str, Any]]:
        """The result as the sections of a parameter file."""
        last = "buckling_level" if self.beam.is_buckled else "axial_load"
        names = ("length", "thickness", "width", "density", "young_modulus", last)
        beam = {name: float(getattr(self.beam, name)) for name in names}
        sections: dict[str, dict[str, Any]] = {"beam": beam, "model": {"modes": self.modes}}
        if self.beam.boundary != BoundaryConditions():
            ends = vars(self.beam.boundary).items()
            sections["boundary"] = {name: float(value) for name, value in ends if value is not None}
        if self.imperfection:
            sections["imperfection"] = imperfection_section(self.imperfection)
        if self.damping_ratio is not None:
            sections["model"]["damping_ratio"] = self.damping_ratio
        if self.contact_stiffness is not None:
            sections["contact"] = {"stiffness": self.contact_stiffness}
        return sections

    def summary(self) -> dict[str, Any]:
        """The figures as plain numbers and words, in SI, for a JSON file."""
        plain = {name: value for name, value in vars(self).items() if name not in ("beam", "start", "modes")}
        plain |= {name: list(value) for name, value in plain.items() if isinstance(value, tuple)}
        return plain | {
            "correlation": self.correlation.tolist(),
            "residuals": [{**dataclasses.asdict(r), "deviation": r.deviation} for r in self.residuals],
            "imperfection": imperfection_section(self.imperfection),
            "diagnostics": [one.plain() for one in self.diagnostics],
        }

    def write_config(self, path: str | os.PathLike[str]) -> None:
        """Write the parameter file that ``snapbeam map --config`` reads, with the diagnostics as comments."""
        told = [f"{name} = {with_error(self, name)}" for name in self.values]
        comment = ["Calibrated from measurements.", *told, *self.remarks]
        comment += [f"Warning: {text}" for text in self.warnings]
        dump_config(config_from_mapping(self.sections() | {"extends": "paper"}), path, "\n".join(comment))


def calibrate(
    measured: Measurements,
    beam: Beam = BEAM,
    *,
    fit: tuple[str, ...] | None = None,
    modes: int = MODES,
    imperfection: str | None = None,
) -> Calibration:
    """Fit the parameters of a beam to measurements.

    Parameters
    ----------
    measured : Measurements
    beam : Beam
        Nominal beam, the start of the fit; its frequencies are compared with the measured ones.
    fit : tuple of str, optional
        Names among thickness, young_modulus, density, length and buckling_level. By default the thickness, if there are
        frequencies of the straight beam, and the buckling level, if there are any about a well.
    modes : int
        Number of buckling modes.
    imperfection : {"midspan_amplitude", "point_load", "uniform_load"}, optional
        Imperfection, fitted last to the first frequencies about both wells; none by default.

    Returns
    -------
    Calibration

    Notes
    -----
    Weighted least squares in the logarithms of the parameters (``scipy.optimize.least_squares``), with the covariance of the
    linearised fit, raised by chi-square per degree of freedom above 1.  Parameters of a combination to which no frequency
    responds (singular values of the sensitivities) stay near the start and get no standard error.

    Examples
    --------
    >>> from snapbeam import lab
    >>> measured = lab.Measurements(lower_well_frequencies=[84.0], lower_well_frequencies_se=[0.2])  # Hz
    >>> found = lab.calibrate(measured, fit=("buckling_level",), modes=4)
    >>> list(found.values)
    ['buckling_level']
    """
    instance("measured", measured, Measurements, "Measurements")
    instance("beam", beam, Beam, "a Beam")
    count = integer("modes", modes, 1, 256)
    data = _data(measured, count)
    names = _fitted(measured, fit)
    if not data and names:
        raise InputError(f"measured: no frequency to fit {', '.join(names)} to")
    wells = bool(measured.lower_well_frequencies or measured.upper_well_frequencies)
    if wells and not beam.is_buckled:
        raise InputError(
            "beam: is straight, but frequencies about wells were measured; give a buckling_level (in the file of "
            "--config)"
        )
    ends = beam.boundary
    unequal = ends.left_rotational_stiffness != ends.right_rotational_stiffness
    if unequal and any(item.parity for item in data):
        raise InputError(
            "lower_well_shape, upper_well_shape: between unequal ends no mode is symmetric; give frequencies by order"
        )
    first = [_symmetric(measured, well)[:1] for well in ("lower", "upper")]
    if imperfection is not None and not all(first):
        raise InputError(
            f"imperfection = {imperfection!r}: needs the first frequency about both wells; the "
            f"{'upper' if first[0] else 'lower'} one's is not given"
        )
    fitted = _fit(beam, data, names, count)
    result, diagnostics = fitted["beam"], fitted.pop("diagnostics")
    damping, damping_se = _mean(measured.damping_ratio, measured.damping_ratio_se, 0.1)
    tests = [test.stiffness() for test in measured.contact]
    contact, contact_se = _mean(tuple(k for k, _ in tests), tuple(se for _, se in tests) or None, 0.1)
    names_by_gauge = ("thickness", "buckling_level")
    gauges = {name: value for name in names_by_gauge if (value := getattr(measured, name)) is not None}
    answer = Calibration(
        start=beam,
        modes=count,
        damping_ratio=damping,
        damping_ratio_se=damping_se,
        contact_stiffness=contact,
        contact_stiffness_se=contact_se,
        well_frequency=_first_frequency(result, count) if wells else None,
        start_well_frequency=_first_frequency(beam, count) if wells else None,
        gauge_well_frequency=_first_frequency(result.replace(**gauges), count) if wells and gauges else None,
        either_well=either_well(result, measured, count),
        remarks=(),
        diagnostics=(),
        **fitted,
    )
    diagnostics += shape_diagnostics(result, measured, count) if wells else []
    diagnostics += doubts(answer, measured)
    told = remarks(answer, measured)
    if imperfection is not None:
        # of the beam, the buckling level alone changes: two numbers from two frequencies
        uneven = identify_imperfection(result, float(first[0][0]), float(first[1][0]), imperfection, count)
        assert uneven.beam is not None
        value, level = getattr(uneven.imperfection, imperfection), uneven.beam.buckling_level * 1e3
        told.append(
            f"{imperfection} = {value:.4g} {_UNITS[imperfection]} with a buckling level of {level:.4g} mm gives each "
            "well its own first frequency; which kind of imperfection it is, two frequencies do not say"
        )
        answer = dataclasses.replace(answer, beam=uneven.beam, imperfection=uneven.imperfection)
    return dataclasses.replace(answer, remarks=tuple(told), diagnostics=tuple(diagnostics))


def _fit(beam: Beam, data: list[_Datum], names: list[str], modes: int) -> dict[str, Any]:
    """Least squares in the logarithms of the parameters, along what the data respond to: fields of the result."""
    begin = np.array([math.log(getattr(beam, name)) for name in names])
    target = np.array([item.measured for item in data])
    errors = np.array([item.standard_error for item in data])

    def changed(logs: _Array) -> Beam:
        changes = {name: math.exp(log) for name, log in zip(names, logs, strict=True)}
        return beam.replace(**changes) if changes else beam

    def frequencies(logs: _Array) -> _Array:
        return _model(changed(logs), data, modes)

    def residual(logs: _Array) -> _Array:
        return (frequencies(logs) - target) / errors

    logs, covariance, scatter, freedom = begin, np.zeros((0, 0)), 1.0, len(data)
    undetermined: tuple[str, ...] = ()
    diagnostics: list[Diagnostic] = []
    level = np.array([float(name == "buckling_level") for name in names])
    if names:
        keep = directions(sensitivity(frequencies, begin, errors))
        logs = search(residual, begin, keep, level, len(data) - keep.shape[1])
        jacobian = sensitivity(frequencies, logs, errors)
        # where the fit ends the data may respond to less than where it began
        keep = min(keep, directions(jacobian), key=lambda one: one.shape[1])
        freedom = len(data) - keep.shape[1]
        chi = float(np.sum(residual(logs) ** 2))
        scatter = max(1.0, math.sqrt(chi / freedom)) if freedom > 0 else 1.0
        inner = np.linalg.inv((jacobian @ keep).T @ (jacobian @ keep))
        covariance = keep @ inner @ keep.T * scatter**2
        undetermined = tuple(name for i, name in enumerate(names) if (keep @ keep.T)[i, i] < 1.0 - 1e-4)
        diagnostics += links(names, covariance, undetermined)
        higher = [float(np.sum(residual(logs + math.log(by) * level) ** 2)) for by in HIGHER if level.any()]
        # as where the only frequency about a well is that of the antisymmetric mode, whose level is open upwards
        if higher and "buckling_level" not in undetermined and max(higher) < chi + 4.0:
            undetermined += ("buckling_level",)
            least = math.exp(logs[names.index("buckling_level")])
            words = (
                f"any buckling_level above {least * 1e3:.4g} mm meets the measured frequencies as well: the first one "
                "about a well may be that of the antisymmetric mode, which does not depend on the level; measure the "
                "symmetric one"
            )
            diagnostics.append(KINDS_CALIBRATION["undetermined"].found(told=words, least=least))
        if freedom <= 0:
            diagnostics.append(KINDS_CALIBRATION["no_check"].found())
    values = {name: math.exp(log) for name, log in zip(names, logs, strict=True)}
    spread = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    known = names and (spread > 0.0).all()
    pairs = zip(data, frequencies(logs).tolist(), strict=True)
    return {
        "beam": changed(logs),
        "values": values,
        "standard_errors": {
            name: values[name] * float(s) for name, s in zip(names, spread, strict=True) if name not in undetermined
        },
        "correlation": covariance / np.outer(spread, spread) if known else np.eye(len(names)),
        "undetermined": undetermined,
        "residuals": tuple(Residual(one.name, one.measured, one.standard_error, model) for one, model in pairs),
        "scatter": scatter,
        "degrees_of_freedom": freedom,
        "diagnostics": diagnostics,
    }


class _Datum(NamedTuple):
    name: str
    state: str
    mode: int
    parity: int  # of the mode, 0 where modes are told by their order only
    measured: float
    standard_error: float


def _data(measured: Measurements, modes: int) -> list[_Datum]:
    data = []
    for state, word in (("straight", "straight"), ("lower_well", "lower well"), ("upper_well", "upper well")):
        values = getattr(measured, f"{state}_frequencies")
        errors = getattr(measured, f"{state}_frequencies_se") or [ASSUMED * value for value in values]
        if len(values) > modes:
            raise InputError(f"{state}_frequencies: {len(values)} frequencies for a model of {modes} modes")
        shapes = getattr(measured, f"{state}_shape", ()) or [""] * len(values)
        seen: Counter[str] = Counter()
        for shape, value, error in zip(shapes, values, errors, strict=True):
            name = f"{word}, {shape} mode" if shape else f"{word}, mode"
            data.append(_Datum(f"{name} {seen[shape] + 1}", state, seen[shape], _PARITY[shape], value, error))
            seen[shape] += 1
    return data


def _fitted(measured: Measurements, fit: tuple[str, ...] | None) -> list[str]:
    wells = bool(measured.lower_well_frequencies or measured.upper_well_frequencies)
    if fit is None:
        return ["thickness"] * bool(measured.straight_frequencies) + ["buckling_level"] * wells
    if isinstance(fit, str) or len(set(fit)) < len(fit):
        raise InputError(f"fit = {shown(fit)}: must be a tuple of different names among {', '.join(FITTED)}")
    for name in fit:
        choice("fit", name, FITTED)
    if "buckling_level" in fit and not wells:
        raise InputError("fit: the buckling_level needs a frequency measured about a well")
    return list(fit)


def _model(beam: Beam, data: list[_Datum], modes: int) -> _Array:
    models = {
        straight: ReducedModel.from_beam(beam.replace(axial_load=0.0) if straight else beam, modes)
        for straight in {item.state == "straight" for item in data}
    }

    def frequency(model: ReducedModel, item: _Datum) -> float:
        of_kind = model.parity == item.parity if item.parity else slice(None)
        return float(model.natural_frequencies[of_kind][item.mode])

    return np.array([frequency(models[item.state == "straight"], item) for item in data])


def _first_frequency(beam: Beam, modes: int) -> float:
    return float(ReducedModel.from_beam(beam, modes).natural_frequencies[0])


def _mean(
    values: tuple[float, ...] | Any, errors: tuple[float, ...] | Any, assumed: float
) -> tuple[float | None, float | None]:
    """Weighted mean and its standard error, raised by the scatter of the values where that is larger."""
    if not len(values):
        return None, None
    x = np.asarray(values, dtype=np.float64)
    s = np.asarray(errors, dtype=np.float64) if errors is not None else assumed * x
    weight = 1.0 / s**2
    mean = float(np.sum(weight * x) / weight.sum())
    spread = float(np.sqrt(np.sum(weight * (x - mean) ** 2) / max(x.size - 1, 1)))
    return mean, float(1.0 / np.sqrt(weight.sum())) * max(1.0, spread)


# For a force k d^1.5 between two bodies of effective mass m that close at v (Hertz), the contact lasts
#
#     T = 2.943 (5 m/(4 k))^0.4 v^-0.2 .
#
# The power of v checks that the impacts are such collisions; on a limp beam, which bends while it is in touch,
# they are not, and then there is no stiffness to tell.


@dataclass(frozen=True)
class ContactStiffness:
    """Contact stiffness [N/m^1.5] from impacts, with its standard error; ``exponent`` is the power of the speed.

    ``impacts`` were used.
    """

    stiffness: float
    stiffness_se: float
    exponent: float
    exponent_se: float
    impacts: int
    diagnostics: tuple[Diagnostic, ...]


def stiffness_from_impacts(impacts: xr.Dataset, effective_mass: float) -> ContactStiffness:
    """Fit the contact stiffness to the durations of tracked impacts.

    Parameters
    ----------
    impacts : xarray.Dataset
        From :func:`snapbeam.lab.contact_onsets`; those of which both ends were seen count.
    effective_mass : float
        1/(1/m_1 + 1/m_2) of the two bodies [kg].

    Raises
    ------
    InputError
        If fewer than three impacts can be used.

    Examples
    --------
    >>> import xarray as xr
    >>> from snapbeam import lab
    >>> impacts = xr.Dataset(
    ...     {
    ...         "duration": ("impact", [1.06e-3, 0.93e-3, 0.80e-3, 0.70e-3]),  # s
    ...         "duration_stderr": ("impact", [1e-5] * 4),
    ...         "closing_speed": ("impact", [0.025, 0.05, 0.1, 0.2]),  # m/s
    ...         "frames": ("impact", [20, 18, 16, 14]),
    ...         "bounded": ("impact", [1, 1, 1, 1]),
    ...     }
    ... )
    >>> contact = lab.stiffness_from_impacts(impacts, effective_mass=0.02)  # kg
    >>> f"{contact.stiffness:.1e} N/m^1.5"
    '6.4e+07 N/m^1.5'
    """
    from snapbeam.util.datasets import xr

    mass = positive("effective_mass", effective_mass, "kg")
    instance("impacts", impacts, xr.Dataset, "an xarray.Dataset")
    needed = ("duration", "duration_stderr", "closing_speed", "frames")
    missing = [name for name in needed if name not in impacts]
    if missing:
        raise InputError(f"impacts without {', '.join(missing)}: must come from contact_onsets()")
    speed, duration = impacts["closing_speed"].values, impacts["duration"].values
    good = np.isfinite(speed) & (speed > 0.0) & (duration > 0.0) & (impacts["bounded"].values == 1)
    if good.sum() < 3:
        raise InputError(f"impacts: {int(good.sum())} of {speed.size} seen from end to end: must be at least 3")
    log_v, log_t = np.log(speed[good]), np.log(duration[good])
    spread = np.maximum(impacts["duration_stderr"].values[good] / duration[good], 1e-3)
    weight = 1.0 / spread**2
    middle, level, exponent, lever = weighted_line(log_v, log_t, weight)
    rest = log_t - level - (log_v - middle) * (exponent if math.isfinite(exponent) else 0.0)
    scatter = max(1.0, float(np.sqrt((weight * rest**2).sum() / max(good.sum() - 2, 1))))
    exponent_se = scatter / math.sqrt(lever) if lever > 0.0 else math.inf
    # the constant of the law, with its power held
    constant, constant_se = _mean(log_t - _HERTZ_POWER * log_v, spread, 1.0)
    assert constant is not None and constant_se is not None
    stiffness = 1.25 * mass * (HERTZ_TIME / math.exp(constant)) ** 2.5
    span, frames = float(np.exp(np.ptp(log_v))), float(np.median(impacts["frames"].values[good]))
    off = abs(exponent - _HERTZ_POWER) > max(4.0 * exponent_se, 0.1)
    told = holding(
        KINDS_CALIBRATION,
        ("exponent", off, {"exponent": exponent, "error": exponent_se}),
        ("few", not off and (span < _LEAST_SPAN or good.sum() < 5), {"count": int(good.sum()), "span": span}),
        ("coarse", frames < _COARSE, {"frames": frames}),
    )
    error = 2.5 * constant_se * stiffness
    return ContactStiffness(stiffness, error, exponent, exponent_se, int(good.sum()), tuple(told))
