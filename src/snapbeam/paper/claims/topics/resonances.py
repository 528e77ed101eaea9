"""Appendix B: maxima of the displacement over frequency, and the notches that are linked to them."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from snapbeam.paper.claims.claim_result import ClaimResult, Quantity, above, below, found, near
from snapbeam.paper.claims.topics.thresholds import notch_of
from snapbeam.paper.claims.uncertainty import combined
from snapbeam.paper.recipes.figB10 import maxima
from snapbeam.paper.recipes.resonance import ridge
from snapbeam.paper.system import paper_model
from snapbeam.sweeps.threshold import interwell_threshold

if TYPE_CHECKING:
    from snapbeam.paper.recipe import Results

_BANDS = ((0.5, 2.3), (2.3, 4.1))
"""Omega between which the first and the second maximum are looked for."""
_LOW, _MODERATE = 0, 1


def _two(results: Results, which: int, level: int) -> tuple[Quantity, Quantity]:
    """Omega of the highest maximum in either band; its uncertainty is the step of the grid, at the half."""
    ds = list(results["figB10"].values())[which]
    half = 0.5 * float(np.diff(ds.frequency_ratio.values).max())
    peaks = maxima(ds, level)
    at = [next((ratio for ratio, _ in peaks if low <= ratio < high), math.nan) for low, high in _BANDS]
    return Quantity(at[0], half), Quantity(at[1], half)


def _drives(results: Results) -> tuple[float, float]:
    low, moderate = next(iter(results["figB10"].values())).velocity_amplitude.values
    return float(low), float(moderate)


def low_drive(results: Results) -> ClaimResult:
    """9a: one mode, low drive."""
    first, second = _two(results, 0, _LOW)
    close = near(first, 1.8, 0.05 + first.uncertainty) & near(second, 3.6, 0.05 + second.uncertainty)
    return found(
        close, near(first, 1.8, 0.15) & near(second, 3.6, 0.15), first=first, second=second, drive=_drives(results)[0]
    )


def _shift(before: Quantity, after: Quantity) -> Quantity:
    return Quantity(before.value - after.value, combined(before.uncertainty, after.uncertainty))


def shifts_left(results: Results) -> ClaimResult:
    """9b: one mode, moderate drive."""
    low, moderate = _two(results, 0, _LOW), _two(results, 0, _MODERATE)
    first, second = (_shift(before, after) for before, after in zip(low, moderate, strict=True))
    return found(above(first, 0.0), first=first, second=second, at=moderate[0].value, drive=_drives(results)[1])


def another_maximum(results: Results) -> ClaimResult:
    """9e: one mode, moderate drive, near Omega = 3.5."""
    _, second = _two(results, 0, _MODERATE)
    return found(near(second, 3.5, 0.05 + second.uncertainty), near(second, 3.5, 0.15), second=second)


def lower_with_many(results: Results) -> ClaimResult:
    """9c: many modes have their maxima at lower frequencies."""
    shifts, beyond = [], []
    for level in (_LOW, _MODERATE):
        one, many = _two(results, 0, level), _two(results, 1, level)
        shifts += [_shift(before, after) for before, after in zip(one, many, strict=True)]
        peaks = maxima(list(results["figB10"].values())[1], level)
        beyond += [ratio for ratio, _ in peaks if ratio >= one[1].value - one[1].uncertainty]
    every = above(shifts[0], 0.0)
    for shift in shifts[1:]:
        every &= above(shift, 0.0)
    named = {"many": _two(results, 1, _LOW)[0], "many_second": _two(results, 1, _LOW)[1]}
    moderate = _two(results, 1, _MODERATE)
    return found(
        every & below(len(beyond), 0), every, first_shift=shifts[0], second_shift=shifts[1], **named,
        moderate=moderate[0].value, moderate_second=moderate[1].value, beyond=tuple(sorted(beyond)),
    )  # fmt: skip


def one_mode_is_adequate(results: Results) -> ClaimResult:
    """9d: how far one mode is off with the frequencies of low-amplitude resonances, in Hz."""
    maps = list(results["figB10"].values())
    own, other = (float(ds.attrs["reference_frequency"]) for ds in maps)
    offs = []
    for one, many in zip(_two(results, 0, _LOW), _two(results, 1, _LOW), strict=True):
        value = one.value * own / (many.value * other) - 1.0
        errors = one.uncertainty / one.value, many.uncertainty / many.value
        offs.append(Quantity(value, (1.0 + value) * combined(*errors)))
    first, second = offs
    return found(
        below(first, 0.05) & below(second, 0.05), below(first, 0.1) & below(second, 0.1), first=first, second=second,
        natural=own / other - 1.0,
    )  # fmt: skip


def softening(results: Results) -> ClaimResult:
    """9f: the free vibration of one mode about a well is the slower the larger."""
    model = paper_model(1)
    kappa, gamma, mass = float(model.stiffness[0]), model.nonlinear_stiffness, float(model.mass[0, 0])
    rest = abs(float(model.well_amplitude[0]))
    swing = 0.5

    def energy(a: float) -> float:
        return 0.5 * kappa * a**2 + 0.25 * gamma * a**4

    def period(points: int) -> float:
        # a = middle - half cos theta takes the square roots out of the ends
        inner = (1.0 - swing) * rest
        # the outer turning point has the same energy: a^2 is symmetric about rest^2
        outer = math.sqrt(2.0 * rest**2 - inner**2)
        middle, half = 0.5 * (inner + outer), 0.5 * (outer - inner)
        angle = math.pi * (np.arange(points) + 0.5) / points
        a = middle - half * np.cos(angle)
        speed = np.sqrt(np.maximum(2.0 / mass * (energy(inner) - np.array([energy(v) for v in a])), 1e-300))
        return 2.0 * float(np.sum(half * np.sin(angle) / speed)) * math.pi / points

    values = [1.0 / (period(points) * float(model.natural_frequencies[0])) for points in (400, 800)]
    freq = Quantity(values[1], abs(values[1] - values[0]) + 1e-9)
    return found(below(freq, 0.99), freq=freq, swing=swing)


def _linked(results: Results, which: int) -> ClaimResult:
    """Frequency of the maximum just below the threshold, compared with the notch of Fig. 6."""
    study = list(results["resonance"].values())[which]
    drives, ratios = ridge(study)
    grid = float(np.diff(study.frequency_ratio.values).max())
    if not ratios.size:
        nothing = Quantity(math.nan, math.nan)
        return found(above(0.0, 0.0), apart=nothing, end=nothing, start=math.nan, drive=math.nan, notch=math.nan)
    ds = list(results["fig6"].values())[which]
    notch = notch_of(ds)
    spread = 0.5 * (notch.high - notch.low) + 0.5 * float(np.diff(ds.frequency_ratio.values).max())
    end = Quantity(float(ratios[-1]), 0.5 * grid)
    there = float(np.interp(end.value, ds.frequency_ratio.values, interwell_threshold(ds)))
    apart = Quantity(abs(end.value - notch.position), combined(end.uncertainty, spread))
    closing = abs(float(ratios[0]) - notch.position) - apart.value
    towards = above(Quantity(closing, apart.uncertainty), 0.5 * abs(float(ratios[0]) - notch.position))
    return found(
        below(apart.value, 0.05 + apart.uncertainty), towards, apart=apart, end=end, start=float(ratios[0]),
        drive=float(drives[-1]), notch=notch.position, depth=notch.height, there=there,
    )  # fmt: skip


ROWS = {
    "9a": low_drive,
    "9b": shifts_left,
    "9c": lower_with_many,
    "9d": one_mode_is_adequate,
    "9e": another_maximum,
    "9f": softening,
    "31a": partial(_linked, which=0),
    "31b": partial(_linked, which=1),
}
