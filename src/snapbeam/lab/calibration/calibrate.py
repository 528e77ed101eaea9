"""The model's beam from measured frequencies, decays and collisions, with uncertainties and in plain words.

The paper adjusts the thickness to the straight beam's frequencies and the buckling level to those about the
wells (section 3.3).  Here both are fitted at once by least squares, and what the data cannot tell is said.
"""

from __future__ import annotations

import dataclasses
import math
import os
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.config import config_from_mapping, dump_config
from snapbeam.core.findings import Diagnostic
from snapbeam.core.validate import InputError, InputTypeError, choice, integer, shown
from snapbeam.lab.calibration import wording as words
from snapbeam.lab.calibration.asymmetry import (
    ends_section,
    imperfection_section,
    uneven_beam,
    uneven_words,
)
from snapbeam.lab.calibration.fit import directions, open_upwards, search, sensitivity
from snapbeam.lab.calibration.measurements import ContactTest, Measurements, load_measurements
from snapbeam.lab.calibration.parity import either_well, shape_findings
from snapbeam.lab.plausibility.calibration import KINDS
from snapbeam.model.beam import Beam
from snapbeam.model.ends import BoundaryConditions
from snapbeam.model.galerkin.reduction import ReducedModel
from snapbeam.model.imperfection import Imperfection
from snapbeam.model.paper_values import BEAM, MODES

__all__ = ["Calibration", "ContactTest", "Measurements", "Residual", "calibrate", "load_measurements"]

_Array = NDArray[np.float64]
FITTED = ("thickness", "young_modulus", "density", "length", "buckling_level")


@dataclass(frozen=True)
class Residual:
    """One measured frequency [Hz] beside the model's, and their difference in standard errors."""

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

    ``beam`` is the result; ``values`` and ``standard_errors`` hold the fitted parameters by name (SI), in the
    order of ``correlation``; a parameter that the data do not determine has no entry in ``standard_errors``
    and is named in ``undetermined``.  ``scatter`` is the root of chi-square per degree of freedom by which
    standard errors were raised, 1 if the data agree.  ``well_frequencies``, ``start_well_frequencies``, ``gauge_well_frequencies``
    [Hz] are the first frequency about a well of the result, of the beam the fit started from, and of the
    result with the gauge's geometry; ``either_well`` holds the buckling level [m] that each well alone would
    ask for.  ``imperfection``, if one was asked for, gives each well its own first frequency; ``beam`` then has
    the buckling level that goes with it.  ``remarks`` say in words what was found, ``diagnostics`` what to beware of.
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
    well_frequencies: float | None
    start_well_frequencies: float | None
    gauge_well_frequencies: float | None
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
        beam: dict[str, Any] = {
            name: float(getattr(self.beam, name))
            for name in ("length", "thickness", "width", "density", "young_modulus")
        }
        if self.beam.is_buckled:
            beam["buckling_level"] = float(self.beam.buckling_level)
        else:
            beam["axial_load"] = float(self.beam.axial_load)
        sections: dict[str, dict[str, Any]] = {"beam": beam, "model": {"modes": self.modes}}
        sections |= {"ends": ends_section(self.beam)} if self.beam.boundary != BoundaryConditions() else {}
        sections |= {"imperfection": imperfection_section(self.imperfection)} if self.imperfection else {}
        if self.damping_ratio is not None:
            sections["model"]["damping_ratio"] = self.damping_ratio
        if self.contact_stiffness is not None:
            sections["contact"] = {"stiffness": self.contact_stiffness}
        return sections

    def summary(self) -> dict[str, Any]:
        """The figures as plain numbers and words, in SI, for a JSON file."""
        return {
            "values": dict(self.values),
            "standard_errors": dict(self.standard_errors),
            "undetermined": list(self.undetermined),
            "correlation": self.correlation.tolist(),
            "residuals": [{**dataclasses.asdict(r), "deviation": r.deviation} for r in self.residuals],
            "scatter": self.scatter,
            "degrees_of_freedom": self.degrees_of_freedom,
            "damping_ratio": self.damping_ratio,
            "damping_ratio_se": self.damping_ratio_se,
            "contact_stiffness": self.contact_stiffness,
            "contact_stiffness_se": self.contact_stiffness_se,
            "well_frequencies": self.well_frequencies,
            "start_well_frequencies": self.start_well_frequencies,
            "gauge_well_frequencies": self.gauge_well_frequencies,
            "either_well": list(self.either_well),
            "imperfection": imperfection_section(self.imperfection),
            "remarks": list(self.remarks),
            "diagnostics": [one.plain() for one in self.diagnostics],
        }

    def write_config(self, path: str | os.PathLike[str]) -> None:
        """Write the parameter file that ``snapbeam map --config`` reads, with the diagnostics as comments."""
        told = [f"{name} = {words.with_error(self, name)}" for name in self.values]
        comment = ["Calibrated from measurements.", *told, *self.remarks]
        comment += [f"Warning: {text}" for text in self.warnings]
        dump_config(config_from_mapping(self.sections()), path, "\n".join(comment))


def calibrate(
    measured: Measurements,
    beam: Beam = BEAM,
    *,
    fit: tuple[str, ...] | None = None,
    modes: int = MODES,
    imperfection: str | None = None,
) -> Calibration:
    """Fit a beam to what was measured of it.

    Parameters
    ----------
    measured : Measurements
    beam : Beam
        What is known of the beam, and where the fit starts; parameters that are not fitted are kept.  Its own
        frequencies are compared with the measured ones in the diagnostics.
    fit : tuple of str, optional
        Which of thickness, young_modulus, density, length and buckling_level to fit.  By default the
        thickness if there are frequencies of the straight beam, and the buckling level if there are any
        about a well.
    modes : int
        Number of buckling modes of the model, which is that used for maps.
    imperfection : {"rise", "point_load", "uniform_load"}, optional
        What makes the wells unequal, fitted last to the first frequencies about both; the parameter file then has
        a section ``[imperfection]``.  Equal wells by default.

    Returns
    -------
    Calibration

    Raises
    ------
    InputError
        If nothing was measured that the parameters could be fitted to, or an argument is unusable.

    Notes
    -----
    Weighted least squares in the logarithms of the parameters (``scipy.optimize.least_squares``).  The
    covariance is that of the linearised fit, raised by chi-square per degree of freedom where that exceeds 1.
    A combination of parameters to which no measured frequency responds is found from the singular values of
    the sensitivities; its parameters stay as near to the start as they can and get no standard error.
    """
    if not isinstance(measured, Measurements):
        raise InputTypeError(f"measured: must be Measurements, not {type(measured).__name__}")
    if not isinstance(beam, Beam):
        raise InputTypeError(f"beam: must be a Beam, not {type(beam).__name__}")
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
    if beam.boundary.left_rotational_stiffness != beam.boundary.right_rotational_stiffness and any(
        item.parity for item in data
    ):
        raise InputError(
            "lower_well_shape, upper_well_shape: between unequal ends no mode is symmetric; give frequencies by order"
        )
    fitted_to = _fit(beam, data, names, count)
    diagnostics = list(fitted_to.diagnostics)
    result = _changed(beam, names, fitted_to.logs)
    fitted = _model(result, data, count)
    residuals = tuple(
        Residual(item.name, item.measured, item.standard_error, float(f))
        for item, f in zip(data, fitted, strict=True)
    )
    values, standard, correlation = fitted_to.values(names)
    uneven = None if imperfection is None else uneven_beam(result, measured, imperfection, count)
    damping, damping_se = _mean(measured.damping_ratio, measured.damping_ratio_se, 0.1)
    tests = [test.stiffness() for test in measured.contact]
    contact, contact_se = _mean(tuple(k for k, _ in tests), tuple(se for _, se in tests) or None, 0.1)
    gauges = {name: getattr(measured, name) for name in ("thickness", "buckling_level")}
    gauges = {name: value for name, value in gauges.items() if value is not None}
    answer = Calibration(
        beam=result,
        start=beam,
        values=values,
        standard_errors=standard,
        correlation=correlation,
        undetermined=fitted_to.undetermined,
        residuals=residuals,
        scatter=fitted_to.scatter,
        degrees_of_freedom=fitted_to.freedom,
        modes=count,
        damping_ratio=damping,
        damping_ratio_se=damping_se,
        contact_stiffness=contact,
        contact_stiffness_se=contact_se,
        well_frequencies=_first_frequency(result, count) if wells else None,
        start_well_frequencies=_first_frequency(beam, count) if wells else None,
        gauge_well_frequencies=_first_frequency(result.replace(**gauges), count)
        if wells and gauges
        else None,
        either_well=either_well(result, measured, count),
        remarks=(),
        diagnostics=(),
    )
    diagnostics += shape_findings(result, measured, count) if wells else []
    diagnostics += words.doubts(answer, measured)
    told = words.remarks(answer, measured)
    if uneven is not None and imperfection is not None:
        assert uneven.beam is not None
        told.append(uneven_words(imperfection, uneven))
        answer = dataclasses.replace(answer, beam=uneven.beam, imperfection=uneven.imperfection)
    return dataclasses.replace(answer, remarks=tuple(told), diagnostics=tuple(diagnostics))


@dataclass(frozen=True)
class _Fitted:
    """What the measured frequencies say of the parameters that are fitted."""

    logs: _Array
    covariance: _Array
    undetermined: tuple[str, ...]
    scatter: float
    freedom: int
    diagnostics: tuple[Diagnostic, ...]

    def values(self, names: list[str]) -> tuple[dict[str, float], dict[str, float], _Array]:
        """Values and standard errors by name, and the correlations."""
        values = {name: math.exp(log) for name, log in zip(names, self.logs, strict=True)}
        spread = np.sqrt(np.maximum(np.diag(self.covariance), 0.0))
        standard = {
            name: values[name] * float(s)
            for name, s in zip(names, spread, strict=True)
            if name not in self.undetermined
        }
        if names and (spread > 0.0).all():
            return values, standard, self.covariance / np.outer(spread, spread)
        return values, standard, np.eye(len(names))


def _fit(beam: Beam, data: list[_Datum], names: list[str], modes: int) -> _Fitted:
    """Least squares in the logarithms of the parameters, along what the data respond to."""
    begin = np.array([math.log(getattr(beam, name)) for name in names])
    target = np.array([item.measured for item in data])
    errors = np.array([item.standard_error for item in data])

    def frequencies(logs: _Array) -> _Array:
        return _model(_changed(beam, names, logs), data, modes)

    def residual(logs: _Array) -> _Array:
        return (frequencies(logs) - target) / errors

    if not names:
        return _Fitted(begin, np.zeros((0, 0)), (), 1.0, len(data), ())
    keep = directions(sensitivity(frequencies, begin, errors))
    freedom = len(data) - keep.shape[1]
    logs = search(residual, begin, keep, names, freedom)
    jacobian = sensitivity(frequencies, logs, errors)
    # where the fit ends the data may respond to less than where it began
    here = directions(jacobian)
    if here.shape[1] < keep.shape[1]:
        keep, freedom = here, len(data) - here.shape[1]
    chi = float(np.sum(residual(logs) ** 2))
    scatter = max(1.0, math.sqrt(chi / freedom)) if freedom > 0 else 1.0
    inner = np.linalg.inv((jacobian @ keep).T @ (jacobian @ keep))
    covariance = keep @ inner @ keep.T * scatter**2
    undetermined = tuple(name for i, name in enumerate(names) if (keep @ keep.T)[i, i] < 1.0 - 1e-4)
    diagnostics = list(words.links(names, covariance, undetermined))
    if "buckling_level" not in undetermined and open_upwards(residual, logs, names):
        undetermined += ("buckling_level",)
        diagnostics.append(words.at_least(math.exp(logs[names.index("buckling_level")])))
    if freedom <= 0:
        diagnostics.append(KINDS["no_check"].found())
    return _Fitted(logs, covariance, undetermined, scatter, freedom, tuple(diagnostics))


@dataclass(frozen=True)
class _Datum:
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
        errors = getattr(measured, f"{state}_frequencies_se") or [words.ASSUMED * value for value in values]
        if len(values) > modes:
            raise InputError(f"{state}_frequencies: {len(values)} frequencies for a model of {modes} modes")
        shapes = getattr(measured, f"{state}_shape", ())
        seen = {1: 0, -1: 0}
        for i, (value, error) in enumerate(zip(values, errors, strict=True)):
            if not shapes:
                data.append(_Datum(f"{word}, mode {i + 1}", state, i, 0, value, error))
                continue
            parity = 1 if shapes[i] == "symmetric" else -1
            name = f"{word}, {shapes[i]} mode {seen[parity] + 1}"
            data.append(_Datum(name, state, seen[parity], parity, value, error))
            seen[parity] += 1
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


def _changed(beam: Beam, names: list[str], logs: _Array) -> Beam:
    changes = {name: math.exp(log) for name, log in zip(names, logs, strict=True)}
    return beam.replace(**changes) if changes else beam


def _model(beam: Beam, data: list[_Datum], modes: int) -> _Array:
    models = {
        straight: ReducedModel.from_beam(beam.replace(axial_load=0.0) if straight else beam, modes)
        for straight in {item.state == "straight" for item in data}
    }
    out = []
    for item in data:
        model = models[item.state == "straight"]
        freq = model.natural_frequencies
        if item.parity:
            freq = freq[model.parity == item.parity]
        out.append(freq[item.mode])
    return np.array(out)


def _first_frequency(beam: Beam, modes: int) -> float:
    return float(ReducedModel.from_beam(beam, modes).natural_frequencies[0])


def _mean(
    values: tuple[float, ...] | Any, errors: tuple[float, ...] | Any, assumed: float
) -> tuple[float | None, float | None]:
    """Weighted mean and its standard error, raised by the scatter of the values where that is larger."""
    if not values:
        return None, None
    x = np.asarray(values, dtype=np.float64)
    s = np.asarray(errors, dtype=np.float64) if errors is not None else assumed * x
    weight = 1.0 / s**2
    mean = float(np.sum(weight * x) / weight.sum())
    spread = float(np.sqrt(np.sum(weight * (x - mean) ** 2) / max(x.size - 1, 1)))
    return mean, float(1.0 / np.sqrt(weight.sum())) * max(1.0, spread)
