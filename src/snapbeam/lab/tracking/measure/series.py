"""The rows of all frames together: jumps, distorted frames, rest, and standard errors that lean on each other."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from snapbeam.lab.tracking.edges import Floats

__all__ = [
    "Rest",
    "Touch",
    "distortion",
    "find_rest",
    "jumps",
    "pooled",
    "touching",
    "unexplained_blur",
    "wanderings",
]

_WIDER = 1.6  # times the width that is explained
_FAR = 5.0  # standard deviations of the thickness that are no chance
_STRETCH = 32  # frames that faint light must last to be told
_FAINT = 0.025  # px by which the thickness must then be off on average
_JUMP = 3.0  # px
_LONGEST = 3  # frames of a jump
_STEADY = 0.005  # px; noise less than this is not asked of a rest
_QUIET = 8  # frames that make a rest
_FEW = 5  # frames that may be nearer than those that count as nearest
_OFTEN = 3  # stretches as quiet as the start from which the start is nothing special


class Rest(NamedTuple):
    """Frames at rest: ``indices``; the row there and its standard error; whether it is one.

    ``found`` is False where the recording begins in motion.  ``drift`` is by how much the row moves within the
    frames, in standard errors of a frame.
    """

    indices: NDArray[np.intp]
    row: float
    error: float
    found: bool
    drift: float


class Touch(NamedTuple):
    """Penetration [px] while beam and shaker move together, its standard error, and the frames it rests on."""

    penetration: float
    error: float
    frames: int


def touching(penetration: Floats, error: Floats, beam: Floats) -> Touch:
    """Penetration in the frames in which beam and shaker move together: zero, if both are located rightly.

    They are together where, over four frames, the penetration stays within its errors while the beam moves by
    many, as near to each other as they ever come; of all such stretches those that agree count.
    """
    length = 4
    nothing = Touch(math.nan, math.nan, 0)
    if penetration.size < 2 * length:
        return nothing
    views = np.lib.stride_tricks.sliding_window_view
    together, motion = views(penetration, length), views(beam, length)
    noise = float(np.nanmedian(error)) if np.isfinite(error).any() else math.nan
    if not math.isfinite(noise):
        return nothing
    known = np.isfinite(together).all(1) & np.isfinite(motion).all(1)
    still = np.full(known.shape, False)
    still[known] = (np.ptp(together[known], axis=1) < 4.5 * noise) & (
        np.ptp(motion[known], axis=1) > max(12.0 * noise, 0.3)
    )
    # two bodies also move together where they are farthest apart; touching, they are at their nearest
    seen = penetration[np.isfinite(penetration)]
    deepest = float(np.partition(seen, -_FEW)[-_FEW]) if seen.size > _FEW else 0.0
    means = together.mean(1)
    still &= np.where(known, means, -np.inf) > deepest - max(5.0 * noise, 0.1)
    if np.count_nonzero(still) < 3:
        return nothing
    means = np.sort(means[still])
    counts = np.searchsorted(means, means + max(16.0 * noise, 0.3), side="right") - np.arange(means.size)
    first = int(np.argmax(counts))
    near = means[first : first + int(counts[first])]
    spread = max(float(np.std(near)), noise / math.sqrt(length))
    return Touch(float(np.median(near)), spread / math.sqrt(max(near.size / length, 1.0)), int(near.size))


def jumps(rows: Floats) -> NDArray[np.bool_]:
    """Frames whose row leaves both neighbours, for up to three frames, as no motion does.

    The steps into and out of the jump must be of opposite sign, beyond 3 px and ten times the usual bend of
    the motion, and three times as large as the steps before and after: a beam thrown back moves as fast
    before and after.
    """
    out = np.zeros(rows.shape, dtype=bool)
    known = np.flatnonzero(np.isfinite(rows))
    if known.size < 8:
        return out
    at, values = known, rows[known]
    for length in range(1, _LONGEST + 1):
        n = values.size - length - 1
        if n < 4:
            break
        before, behind = values[:n], values[length + 1 :]
        share = np.arange(1, length + 1)[:, None] / (length + 1.0)
        inside = np.stack([values[j + 1 : j + 1 + n] for j in range(length)])
        bend = inside - (before + share * (behind - before))
        least = np.abs(bend).min(0)
        same = (bend > 0.0).all(0) | (bend < 0.0).all(0)
        usual = 1.4826 * float(np.median(np.abs(bend)))
        own = np.maximum(
            np.abs(np.diff(values, prepend=values[0]))[:n],
            np.abs(np.diff(values, append=values[-1]))[length + 1 :],
        )
        steps = np.minimum(np.abs(inside[0] - before), np.abs(behind - inside[-1]))
        near = at[length + 1 :] - at[:n] <= length + 5
        for k in np.flatnonzero(same & near & (least > max(_JUMP, 10.0 * usual)) & (steps > 3.0 * own + 1.0)):
            out[at[k + 1 : k + 1 + length]] = True
    return out


def wanderings(rows: Floats, lost: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Frames of a row that strays while something it leans on is *lost*.

    Each run of lost frames is held against a straight line between the frames before and after; it may bend
    as much as the motion bends elsewhere.
    """
    out = np.zeros(rows.shape, dtype=bool)
    good = np.isfinite(rows) & ~lost
    where = np.flatnonzero(good)
    if where.size < 8:
        return out | (lost & np.isfinite(rows))
    whole = good[:-2] & good[1:-1] & good[2:]
    bends = np.abs(rows[2:] - 2.0 * rows[1:-1] + rows[:-2])[whole]
    bend = float(np.percentile(bends, 99.5)) if bends.size else 0.0
    suspect = np.flatnonzero(lost & np.isfinite(rows))
    position = np.searchsorted(where, suspect)
    left = where[np.clip(position - 1, 0, where.size - 1)]
    right = where[np.clip(position, 0, where.size - 1)]
    span = np.maximum(right - left, 1)
    line = rows[left] + (rows[right] - rows[left]) * np.clip((suspect - left) / span, 0.0, 1.0)
    beyond = (suspect < where[0]) | (suspect > where[-1])
    allowed = _JUMP + bend * (span / 2.0) ** 2 / 2.0
    strays = np.abs(rows[suspect] - line) > allowed
    out[suspect] = np.where(beyond, np.abs(suspect - left) > _LONGEST, strays)
    return out


def distortion(
    thickness: Floats, residual: Floats, width: Floats, usual_width: float
) -> tuple[Floats, NDArray[np.bool_]]:
    """By how much the beam looks thicker or thinner than usual [px], and which frames are distorted.

    A frame is distorted if that exceeds five robust standard deviations and 0.06 px, if the mean over 32 frames about
    it is as far off (faint light that lasts), or if its edges are no steps: fits that leave three times as much as
    usual without being blurred.
    """
    known = np.isfinite(thickness)
    miss = np.zeros(thickness.shape)
    odd = np.zeros(thickness.shape, dtype=bool)
    if known.sum() >= 8:
        usual = float(np.median(thickness[known]))
        spread = 1.4826 * float(np.median(np.abs(thickness[known] - usual)))
        miss[known] = np.abs(thickness[known] - usual)
        odd = miss > max(_FAR * spread, 0.06)
        faint = _lasting(thickness[known] - usual)
        miss[known] = np.maximum(miss[known], faint)
        odd[known] |= faint > 0.0
    sound = np.isfinite(residual)
    if sound.any():
        with np.errstate(invalid="ignore"):
            rough = residual > 3.0 * float(np.median(residual[sound])) + 0.03
            odd |= rough & ~(width > 1.5 * usual_width + 0.3)
    return miss, odd


def _lasting(miss: Floats) -> Floats:
    """How far off the thickness is on average over any stretch that a frame is in, where that is no chance; else 0.

    What chance does is told by the steps from frame to frame: light that lasts over a good part of the recording
    widens the scatter of all frames together, but not these.
    """
    out = np.zeros(miss.size)
    if miss.size < 4 * _STRETCH:
        return out
    noise = 1.4826 * float(np.median(np.abs(np.diff(miss)))) / math.sqrt(2.0)
    mean = np.convolve(miss, np.full(_STRETCH, 1.0 / _STRETCH), "valid")
    for first in np.flatnonzero(np.abs(mean) > max(_FAR * noise / math.sqrt(_STRETCH), _FAINT)):
        inside = slice(int(first), int(first) + _STRETCH)
        out[inside] = np.maximum(out[inside], abs(mean[first]))
    return out


def pooled(error: Floats) -> Floats:
    """Standard errors of single frames, each from few columns, none less than the usual one.

    A frame whose columns scatter less than usual does so by chance: no frame is better lit or sharper than most.
    """
    known = np.isfinite(error)
    if not known.any():
        return error
    usual = float(np.median(error[known]))
    with np.errstate(invalid="ignore"):
        return np.where(error < usual, usual, error)


def unexplained_blur(row: Floats, width: Floats, usual: float) -> Floats:
    """By how much [px] edges are wider than lens and motion explain, over the frames; 0 where they are not.

    An exposure is no longer than a frame, so motion smears an edge over no more than the step from frame to
    frame, with a standard deviation of that over the root of 12.
    """
    step = np.abs(np.diff(row))
    with np.errstate(invalid="ignore"):
        fastest = np.fmax(np.append(step, np.nan), np.append(np.nan, step))
        explained = np.hypot(usual, fastest / np.sqrt(12.0))
        return np.where(width > _WIDER * explained + 0.2, width - explained, 0.0)


def find_rest(row: Floats, error: Floats, shaker: Floats, given: tuple[int, int] | None) -> Rest:
    """The frames at rest, given or sought at the start.

    Sought: the first half of the frames before the row departs from their mean by three standard errors.  A
    turning point looks like rest for a few frames too, so it must last eight frames, and beam and shaker (NaN
    where it is not followed) must not be as quiet time and again.
    """
    known = np.flatnonzero(np.isfinite(row))
    if given is not None:
        used = known[(known >= given[0]) & (known < given[1])]
        if not used.size:
            return Rest(used, math.nan, math.nan, False, math.nan)
        noise = max(float(np.sqrt(np.mean(error[used] ** 2))), _STEADY)
        drift = float(np.ptp(_thirds(row[used]))) / (noise / math.sqrt(max(used.size / 3.0, 1.0)))
        return Rest(used, float(row[used].mean()), _mean_error(row[used], noise), drift < 8.0, drift)
    if not known.size:
        return Rest(known, math.nan, math.nan, False, math.nan)
    noise = max(float(np.median(error[known])), _STEADY)
    values = row[known]
    before = np.cumsum(values)[:-1] / np.arange(1, known.size)
    gone = np.abs(values[1:] - before) > 3.0 * noise + 1e-6
    # one frame in some hundred strays by chance; two in a row do not
    away = gone & np.append(gone[1:], True)
    quiet = int(away.argmax()) + 1 if away.any() else known.size
    used = known[: (quiet + 1) // 2]
    mean = float(row[used].mean())
    found = quiet >= _QUIET
    if found:
        length = max(4 * quiet // 5, _QUIET)
        still = _still(values[quiet:], length, noise)
        if np.isfinite(shaker[known]).mean() > 0.5:
            still &= _still(shaker[known][quiet:], length, noise)
        found = int(np.count_nonzero(np.diff(np.concatenate([[0], still.astype(np.int8)])) == 1)) < _OFTEN
    return Rest(used, mean, _mean_error(row[used], noise), found, 0.0)


def _still(values: Floats, length: int, noise: float) -> NDArray[np.bool_]:
    """From which frames on the row stays within six standard errors for *length* frames."""
    if values.size < length:
        return np.zeros(0, dtype=bool)
    shift = -(length // 2)
    filled = np.where(np.isfinite(values), values, 1e6 * np.arange(values.size))
    high = maximum_filter1d(filled, length, origin=shift)
    low = minimum_filter1d(filled, length, origin=shift)
    still: NDArray[np.bool_] = ((high - low) < 6.0 * noise)[: values.size - length + 1]
    return still


def _thirds(values: Floats) -> Floats:
    return np.array([part.mean() for part in np.array_split(values, 3) if part.size])


def _mean_error(values: Floats, noise: float) -> float:
    spread = float(np.std(values)) if values.size > 4 else noise
    return max(spread, noise) / math.sqrt(values.size)
