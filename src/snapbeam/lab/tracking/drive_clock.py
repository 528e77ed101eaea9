"""Spacing of frames by the drive: the steady sine of the striker is a clock inside the picture.

Time that jumps (frames lost, recordings joined) leaves a step along the slope of the motion from there on, a camera
that was knocked a step along the rows.  A step is named where it explains more than chance and more than the other.
Frames exchanged or shown again are found without a sine, by :mod:`~snapbeam.lab.tracking.frame_order`.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.stats import chi2, f

from snapbeam.lab.least_squares import sines
from snapbeam.lab.signals import SignalSamples
from snapbeam.lab.sine_fit import SineFit, fit_sine, spectral_peak
from snapbeam.lab.tracking.edges import Floats
from snapbeam.lab.vibrometer import moving_part
from snapbeam.util.singular_values import lstsq
from snapbeam.util.validation import InputError

_RATE = 1e-4  # of false alarms of a pattern over a recording with normal noise
_CYCLES = 4.0  # of steady motion, at least
_MOST = 3000  # frames of a recording that are looked at
_LEAST_NOISE = 0.01  # px
_SURER = 10.0  # chi-square by which one kind of step must explain more than the other
_FRAMES, _PIXELS = 0.3, 0.2  # that a step is at least
_JITTER = 0.05  # frames
_MEDIAN = 2.7  # times as many squares a median needs for the error of a mean
_FADING = (0.05, 0.2)  # time constants of a start that is not over, over the length
_WINDOW, _LEAST_WINDOW = 1.6, 16  # cycles and frames in which the frequency of the drive is found
_PURE = 0.02  # of its square that a sine leaves in them
_SAME = 0.08  # by which their frequencies may differ
_BLOCK = 8  # frames, for noise that is alike in neighbours


def _filled(shaker: Floats) -> tuple[SignalSamples, float] | None:
    """The striker's rows over the numbers of frames, gaps by straight lines, and their frequency; None if not told."""
    known = np.flatnonzero(np.isfinite(shaker))
    if known.size < 64 or known.size < 0.8 * shaker.size:
        return None
    frames = np.arange(shaker.size, dtype=np.float64)
    samples = SignalSamples(np.interp(frames, frames[known], shaker[known]), frames, 1.0)
    try:
        return samples, spectral_peak(samples)
    except InputError:
        return None


def steady_striker(shaker: Floats) -> tuple[SignalSamples, SineFit] | None:
    """The steady part of the striker's rows [px], over the numbers of frames, and its sine; None if it is too short."""
    filled = _filled(shaker)
    if filled is None:
        return None
    samples, guess = filled
    try:
        first, last = moving_part(samples, guess)
        first = min(first + round(2.0 / guess), last)
        last = min(last, first + _MOST)
        if (last - first) * guess < _CYCLES:
            return None
        part = samples.part(slice(first, last))
        return part, fit_sine(part, guess, 5, keep=np.isfinite(shaker[first:last]))
    except InputError:
        return None


def drive_clock(shaker: Floats) -> list[tuple[str, dict[str, float]]]:
    """Kinds and numbers of what is wrong with the times of the frames, from the rows [px] of the striker."""
    changed = _rate_change(shaker)
    steady = steady_striker(shaker)
    if steady is None or changed:
        return changed
    part, fit = steady
    first, last = int(part.time[0]), int(part.time[-1]) + 1
    wave = fit.waveform(np.arange(first - 1, last + 1, dtype=np.float64))
    off = np.where(np.isfinite(shaker[first:last]), part.values - wave[1:-1], 0.0)
    told = _jitter(off, 0.5 * (wave[2:] - wave[:-2]))
    if told:
        return told
    noise = max(1.4826 * float(np.median(np.abs(np.diff(off, 2)))) / math.sqrt(6.0), _LEAST_NOISE)
    return _steps(part, off, noise, fit.frequency)


def _rate_change(shaker: Floats) -> list[tuple[str, dict[str, float]]]:
    """A frequency of the drive, counted in frames, that is another multiple from some frame on: the frame rate changed."""
    filled = _filled(shaker)
    if filled is None:
        return []
    (values, frames, _), guess = filled
    width = max(round(_WINDOW / guess), _LEAST_WINDOW)
    if values.size < 4 * width:
        return []
    windows = np.lib.stride_tricks.sliding_window_view(values, width)[:: max(width // 16, 1)]
    grid = guess * np.geomspace(0.4, 2.5, 93)
    left = []
    for frequency in grid:
        base = np.linalg.qr(np.column_stack([np.ones(width), sines(frames[:width], [frequency])]))[0]
        left.append((windows**2).sum(1) - ((windows @ base) ** 2).sum(1))
    rest = windows.var(1) * width
    sound = (np.min(left, axis=0) < _PURE * rest) & (np.ptp(windows, axis=1) > 0.4 * np.ptp(windows))
    found = grid[np.argmin(left, axis=0)][sound]
    at = frames[: values.size - width + 1 : max(width // 16, 1)][sound] + 0.5 * width
    if found.size < 24:
        return []
    before, after = float(np.median(found[: found.size // 6])), float(np.median(found[-found.size // 6 :]))
    ratio = after / before
    whole = max(ratio, 1.0 / ratio)
    if round(whole) < 2 or abs(whole - round(whole)) > 0.1 * whole:
        return []
    alike = [np.abs(np.log(found / one)) < _SAME for one in (before, after)]
    fits = np.cumsum(np.append(0, alike[0])) + np.cumsum(np.append(0, alike[1])[::-1])[::-1]
    k = int(np.argmax(fits))
    # windows about the change are of both rates
    if fits[k] < found.size - 16 or min(k, found.size - k) < 4:
        return []
    return [("rate_changes", {"ratio": ratio, "first": round(0.5 * float(at[k - 1] + at[k]))})]


def _steps(part: SignalSamples, off: Floats, noise: float, frequency: float) -> list[tuple[str, dict[str, float]]]:
    """A step of the time, or of the rows, from some frame on."""
    turn = 2.0 * np.pi * frequency * part.time
    wave = np.column_stack([np.cos(turn), np.sin(turn)])
    since = part.time - part.time.mean()
    slope = np.gradient(wave @ lstsq(wave, part.values - part.values.mean()))
    begun = part.time - part.time[0]
    fading = [np.exp(-begun / (share * begun[-1]))[:, None] * wave for share in _FADING]
    base = np.linalg.qr(np.column_stack([np.ones_like(turn), wave, since * slope, *fading]))[0]
    left = off - base @ (base.T @ off)
    places = np.arange(_BLOCK, off.size - _BLOCK)
    after = (np.arange(off.size)[:, None] >= places).astype(np.float64)
    best: dict[str, tuple[float, float, int, float]] = {}
    alike = math.inf
    for kind, column, least in (("time_jump", slope, _FRAMES), ("knocked", np.ones_like(slope), _PIXELS)):
        steps = after * column[:, None]
        steps -= base @ (base.T @ steps)
        power = np.maximum((steps**2).sum(0), 1e-12)
        size = steps.T @ left / power
        gain = size**2 * power / noise**2
        at = int(np.argmax(gain))
        best[kind] = (float(gain[at]), float(size[at]), int(part.time[0]) + int(places[at]), least)
        blocks = (left - size[at] * steps[:, at])[: left.size // _BLOCK * _BLOCK].reshape(-1, _BLOCK).mean(1)
        alike = min(alike, max(float(np.mean(blocks**2)) * _BLOCK / noise**2, 1.0))
    kind = max(best, key=lambda one: best[one][0])
    gain, size, at, least = best[kind]
    gain /= alike
    if gain < float(chi2.isf(_RATE / off.size, 1)) or abs(size) < least:
        return []
    other = min(one[0] for one in best.values()) / alike
    named = kind if gain - other > max(_SURER, 0.2 * gain) else "off_its_drive"
    return [(named, {"size": abs(size), "first": at})]


def _jitter(off: Floats, slope: Floats) -> list[tuple[str, dict[str, float]]]:
    """Scatter that grows with the speed, as of frames taken at uneven times."""
    off, slope = np.diff(off, 4) / math.sqrt(70.0), slope[2:-2]  # what moves slowly is no scatter
    order = np.argsort(np.abs(slope))
    third = off.size // 3
    # medians, which a few frames in the wrong order do not move; of the square of normal noise it is 0.455
    slow, fast = (float(np.median(off[part] ** 2)) / 0.455 for part in (order[:third], order[-third:]))
    if fast < slow * float(f.isf(_RATE, third / _MEDIAN, third / _MEDIAN)):
        return []
    frames = math.sqrt((fast - slow) / float(np.mean(slope[order[-third:]] ** 2) - np.mean(slope[order[:third]] ** 2)))
    return [("scattered", {"size": frames})] if frames > _JITTER else []
