"""What a calibration says in words."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from snapbeam.lab.calibration.calibrate import Calibration
    from snapbeam.lab.calibration.measurements import Measurements

__all__ = ["ASSUMED", "findings", "link_warnings", "warnings", "with_error"]

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


def _listed(names: tuple[str, ...]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def with_error(result: Calibration, name: str) -> str:
    """A fitted parameter with its standard error, in the unit people read."""
    scale, unit = _SHOWN[name]
    value = result.values[name] * scale
    if name not in result.standard_errors:
        return f"{value:.5g} {unit}, not determined by the data"
    return f"{value:.5g} +- {result.standard_errors[name] * scale:.2g} {unit}"


def link_warnings(names: list[str], covariance: NDArray[np.float64], hidden: tuple[str, ...]) -> list[str]:
    """What to say of parameters that the data do not determine, link, or hardly tell."""
    told = []
    if len(hidden) == 1:
        told.append(f"no measured frequency depends on {hidden[0]}: it keeps its start")
    elif hidden:
        told.append(
            f"the measured frequencies cannot tell {_listed(hidden)} apart: they depend on a combination of "
            "them only; fix one of them by another measurement (the values given keep nearest to the start)"
        )
    spread = np.sqrt(np.diag(covariance))
    for i, name in enumerate(names):
        if name in hidden:
            continue
        if spread[i] > _VAGUE:
            told.append(f"{name} is known to {spread[i]:.0%} only")
        for j, other in enumerate(names[:i]):
            linked = 0.0 if other in hidden else covariance[i, j] / (spread[i] * spread[j])
            if abs(linked) > _LINKED:
                sense = "rises" if linked > 0.0 else "falls"
                told.append(
                    f"{other} and {name} can hardly be told apart (correlation {linked:+.3f}): where one "
                    f"rises the other {sense}"
                )
    return told


def findings(result: Calibration, measured: Measurements) -> list[str]:
    """What was found: the frequencies about the wells, and the measured geometry beside the model's."""
    told = []
    first = [values[0] for values in (measured.lower_well_freq, measured.upper_well_freq) if values]
    if first and result.well_freq is not None:
        mean = float(np.mean(first))
        told.append(
            f"the model's first frequency about either well is {result.well_freq:.2f} Hz; measured mean "
            f"{mean:.2f} Hz"
        )
        other = result.start_well_freq
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
                f"{name}: {value * 1e3:.4g} mm in the model, {gauge * 1e3:.4g} mm measured "
                f"({value / gauge - 1.0:+.1%})"
            )
    if result.gauge_well_freq is not None:
        told.append(
            f"with the measured geometry the model's first frequency about a well would be "
            f"{result.gauge_well_freq:.1f} Hz: the fitted numbers stand for all that the ideal clamped beam "
            "leaves out, and are no gauge readings"
        )
    return told


def warnings(result: Calibration, measured: Measurements) -> list[str]:
    """What to beware of: unequal wells, assumed errors, data the model does not meet."""
    told = []
    pairs = zip(measured.lower_well_freq, measured.upper_well_freq, strict=False)
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
            told.append(text)
    assumed = [
        state
        for state in ("straight_freq", "lower_well_freq", "upper_well_freq")
        if getattr(measured, state) and getattr(measured, f"{state}_se") is None
    ]
    if assumed:
        told.append(
            f"no standard errors given for {_listed(tuple(assumed))}: {ASSUMED:.1%} assumed, on which the "
            "uncertainties rest"
        )
    for item in result.residuals:
        if abs(item.deviation) > 3.0:
            told.append(
                f"{item.name}: model {item.model:.4g} Hz, measured {item.measured:.4g} Hz, "
                f"{abs(item.deviation):.1f} standard errors apart"
            )
    if result.scatter > 1.1:
        told.append(
            f"the data scatter {result.scatter:.2f} times as much as their standard errors allow; the "
            "uncertainties are raised by it"
        )
    ratios = measured.damping_ratio
    if len(ratios) > 1 and max(ratios) > 1.3 * min(ratios):
        told.append(
            f"damping ratios from {min(ratios):.4g} to {max(ratios):.4g}: the model takes one for every mode"
        )
    return told
