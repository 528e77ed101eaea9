"""Response class of a measured run, by the rules used for simulations, or why it cannot be told.

A measured displacement is noisy and may be short or have dropouts.  A crossing of zero counts only when the
displacement has gone beyond a hysteresis on the other side, several times the noise; what dropouts could hide
and what a record too short cannot show leave the class unknown, with the reason.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.codes import ResponseClass, classify
from snapbeam.core.validate import InputError, choice, integer, nonnegative, positive
from snapbeam.runs.schema import check_trajectory

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["MeasuredResponse", "measure_response"]

_Array = NDArray[np.float64]
_HYSTERESIS = 5.0  # in standard deviations of the noise
LEAST_CYCLES = 20  # the rule of more than n/5 crossings in n cycles means nothing below n = 5
_WHOLE = 0.98  # share of the wanted cycles that counts as all of them


@dataclass(frozen=True)
class MeasuredResponse:
    """Class and counts of a measured run.

    ``response_class`` is UNKNOWN where ``reasons`` say why.  ``zero_crossings`` is at least what happened: more may
    hide in dropouts.  ``noise`` and ``hysteresis`` are in units of b; ``final_well`` is -1 or 1, the sign
    at the end.
    """

    response_class: ResponseClass
    zero_crossings: int
    zero_crossings_last_quarter: int
    last_zero_crossing: float
    final_well: int
    cycles: float
    noise: float
    hysteresis: float
    longest_dropout: float
    reasons: tuple[str, ...]

    @property
    def description(self) -> str:
        """The result in words."""
        counts = f"{self.zero_crossings} crossing(s) in {self.cycles:.1f} cycles"
        if self.response_class is ResponseClass.UNKNOWN:
            return f"class not told: {'; '.join(self.reasons)} ({counts})"
        return (
            f"{self.response_class.label} ({counts}, {self.zero_crossings_last_quarter} in the last quarter)"
        )


def measure_response(
    run: xr.Dataset,
    frequency: float | None = None,
    *,
    cycles: int = 200,
    at: str = "displacement_at_striker",
    noise: float | None = None,
    start: float | None = None,
) -> MeasuredResponse:
    """Class a measured run by the zero crossings of its displacement.

    Parameters
    ----------
    run : xarray.Dataset
        A run (see :mod:`snapbeam.runs.schema`): displacements in units of b over time [s], zero midway between
        the wells, and ``valid`` = 0 where nothing was found.
    frequency : float, optional
        Excitation frequency [Hz]; not needed if the run has the coordinate ``cycle``.
    cycles : int
        Cycles of excitation the class is asked for; the paper's experiments have 200.
    at : {"displacement_at_striker", "midspan_displacement"}
        Where to count: at the shaker, which for a shaker near the centre serves as well, or at the centre.
    noise : float, optional
        Standard deviation of the displacement's noise, in units of b; estimated from its third differences if
        left out.
    start : float, optional
        Start of the excitation [s]; the first sample if left out.

    Raises
    ------
    InputError
        If the dataset is no run, or neither *frequency* nor ``cycle`` says how long a cycle is.
    """
    choice("at", at, ("displacement_at_striker", "midspan_displacement"))
    check_trajectory(run, require=(at,))
    wanted = integer("cycles", cycles, 1)
    time = np.asarray(run["time"].values, dtype=np.float64)
    values = np.array(run[at].values, dtype=np.float64)
    good = np.isfinite(values)
    if "valid" in run:
        good &= run["valid"].values.astype(bool)
    if start is not None:
        good &= time >= start
    if good.sum() < 16:
        raise InputError(f"run: {int(good.sum())} valid sample(s) of {at}: must be at least 16")
    if "cycle" in run.coords:
        count = np.asarray(run["cycle"].values, dtype=np.float64)
    else:
        if frequency is None:
            raise InputError("frequency: must be given, the run has no coordinate cycle")
        begin = float(time[0]) if start is None else start
        count = (time - begin) * positive("frequency", frequency, "Hz")
    sigma = _noise(values, good) if noise is None else nonnegative("noise", noise, "b")
    hysteresis = max(_HYSTERESIS * sigma, 1e-9)
    shown, when, covered = values[good], time[good], count[good]

    side, crossed = _crossings(shown, hysteresis)
    total = min(float(covered[-1]), float(wanted))
    inside = covered[crossed] <= wanted
    crossed = crossed[inside]
    late = int(np.count_nonzero(covered[crossed] > 0.75 * wanted))
    last_index = int(np.flatnonzero(covered <= wanted)[-1])
    final = int(side[last_index])
    first = int(side[np.flatnonzero(side)[0]]) if side.any() else 0

    gaps = np.diff(covered)
    longest = float(gaps.max()) if gaps.size else 0.0
    reasons = []
    if hysteresis > 0.25:
        reasons.append(f"the noise, {sigma:.2g} b, hides crossings (hysteresis {hysteresis:.2g} b)")
    if first == 0 or final == 0:
        reasons.append("the displacement never leaves the hysteresis about zero")
    if wanted < LEAST_CYCLES:
        reasons.append(f"too short to tell: {wanted} cycles, the rule needs {LEAST_CYCLES}")
    certain_continuous = late > wanted / 20.0
    if total < _WHOLE * wanted and not certain_continuous:
        reasons.append(f"too short to tell: {total:.1f} of {wanted} cycles recorded")
    typical = float(np.median(gaps)) if gaps.size else 0.0
    if longest > max(0.25, 4.0 * typical) and not certain_continuous:
        reasons.append(f"a dropout of {longest:.2f} cycles could hide crossings")
    response = ResponseClass.UNKNOWN
    if not reasons:
        response = ResponseClass(int(classify(crossed.size, late, wanted, -first * final)))
    return MeasuredResponse(
        response_class=response,
        zero_crossings=int(crossed.size),
        zero_crossings_last_quarter=late,
        last_zero_crossing=float(when[crossed[-1]]) if crossed.size else math.nan,
        final_well=final,
        cycles=total,
        noise=sigma,
        hysteresis=hysteresis,
        longest_dropout=longest,
        reasons=tuple(reasons),
    )


def _noise(values: _Array, good: NDArray[np.bool_]) -> float:
    """Standard deviation of white noise from third differences of neighbouring valid samples."""
    whole = good[:-3] & good[1:-2] & good[2:-1] & good[3:]
    thirds = (values[3:] - 3.0 * values[2:-1] + 3.0 * values[1:-2] - values[:-3])[whole]
    if thirds.size < 8:
        raise InputError(
            "run: too few neighbouring valid samples to estimate the noise; state noise, in units of b"
        )
    return float(np.median(np.abs(thirds)) / 0.6745 / math.sqrt(20.0))


def _crossings(values: _Array, hysteresis: float) -> tuple[NDArray[np.int8], NDArray[np.intp]]:
    """Side of each sample (0 until it first leaves the hysteresis) and where that changes."""
    beyond = np.where(values > hysteresis, 1, np.where(values < -hysteresis, -1, 0)).astype(np.int8)
    index = np.where(beyond != 0, np.arange(values.size), -1)
    held = np.maximum.accumulate(index)
    side = np.where(held >= 0, beyond[np.maximum(held, 0)], 0).astype(np.int8)
    changes = np.flatnonzero((side[1:] != side[:-1]) & (side[:-1] != 0)) + 1
    return side, changes
