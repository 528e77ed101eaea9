"""What a calibration says in words: remarks on what was found, diagnostics on what to beware of."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.findings import Diagnostic
from snapbeam.lab.plausibility.calibration import KINDS

if TYPE_CHECKING:
    from snapbeam.lab.calibration.calibrate import Calibration
    from snapbeam.lab.calibration.measurements import Measurements

__all__ = ["ASSUMED", "at_least", "doubts", "links", "remarks", "with_error"]

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


def links(names: list[str], covariance: NDArray[np.float64], hidden: tuple[str, ...]) -> list[Diagnostic]:
    """What to say of parameters that the data do not determine, link, or hardly tell."""
    told = []
    if len(hidden) == 1:
        words = f"no measured frequency depends on {hidden[0]}: it keeps its start"
        told.append(KINDS["undetermined"].found(told=words))
    elif hidden:
        words = (
            f"the measured frequencies cannot tell {_listed(hidden)} apart: they depend on a combination of "
            "them only; fix one of them by another measurement (the values given keep nearest to the start)"
        )
        told.append(KINDS["undetermined"].found(told=words))
    spread = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    for i, name in enumerate(names):
        if name in hidden:
            continue
        if spread[i] > _VAGUE:
            told.append(
                KINDS["vague"].found(told=f"{name} is known to {spread[i]:.0%} only", share=spread[i])
            )
        for j, other in enumerate(names[:i]):
            linked = 0.0 if other in hidden else covariance[i, j] / (spread[i] * spread[j])
            if abs(linked) > _LINKED:
                sense = "rises" if linked > 0.0 else "falls"
                words = (
                    f"{other} and {name} can hardly be told apart (correlation {linked:+.3f}): where one "
                    f"rises the other {sense}"
                )
                told.append(KINDS["linked"].found(told=words, correlation=linked))
    return told


def at_least(level: float) -> Diagnostic:
    """What to say where any buckling level [m] above the one found meets the data as well."""
    text = (
        f"any buckling_level above {level * 1e3:.4g} mm meets the measured frequencies as well: the first one about "
        "a well may be that of the antisymmetric mode, which does not depend on the level; measure the symmetric one"
    )
    return KINDS["undetermined"].found(told=text, least=level)


def remarks(result: Calibration, measured: Measurements) -> list[str]:
    """What was found: the frequencies about the wells, and the measured geometry beside the model's."""
    told = []
    first = [
        values[0] for values in (measured.lower_well_frequencies, measured.upper_well_frequencies) if values
    ]
    if first and result.well_frequencies is not None:
        mean = float(np.mean(first))
        told.append(
            f"the model's first frequency about either well is {result.well_frequencies:.2f} Hz; measured mean "
            f"{mean:.2f} Hz"
        )
        other = result.start_well_frequencies
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
    if result.gauge_well_frequencies is not None:
        told.append(
            f"with the measured geometry the model's first frequency about a well would be "
            f"{result.gauge_well_frequencies:.1f} Hz: the fitted numbers stand for all that the ideal clamped beam "
            "leaves out, and are no gauge readings"
        )
    return told


def doubts(result: Calibration, measured: Measurements) -> list[Diagnostic]:
    """What to beware of: unequal wells, assumed errors, data the model does not meet."""
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
            told.append(KINDS["unequal_wells"].found(told=text, first=one, second=two))
    assumed = [
        state
        for state in ("straight_frequencies", "lower_well_frequencies", "upper_well_frequencies")
        if getattr(measured, state) and getattr(measured, f"{state}_se") is None
    ]
    if assumed:
        words = (
            f"no standard errors given for {_listed(tuple(assumed))}: {ASSUMED:.1%} assumed, on which the "
            "uncertainties rest"
        )
        told.append(KINDS["assumed_errors"].found(told=words))
    for item in result.residuals:
        if abs(item.deviation) > 3.0:
            told.append(
                KINDS["outlier"].found(
                    told=item.name, model=item.model, measured=item.measured, apart=abs(item.deviation)
                )
            )
    if result.scatter > 1.1:
        told.append(KINDS["scatter"].found(scatter=result.scatter))
    ratios = measured.damping_ratio
    if len(ratios) > 1 and max(ratios) > 1.3 * min(ratios):
        told.append(KINDS["damping_differs"].found(low=min(ratios), high=max(ratios)))
    return told
