"""Lines in a shaker's record beside its own: mains hum, which is there at rest too, and a second motion."""

from __future__ import annotations

import dataclasses
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.lab.decay.drift import Line, without_lines
from snapbeam.lab.signals.flaws import find_flaws, sound_samples
from snapbeam.lab.signals.signal import SignalSamples
from snapbeam.lab.signals.sine_fit import SineFit

__all__ = ["DriveLines", "beside_lines", "find_drive_lines", "without_hum"]

_Array = NDArray[np.float64]
_MOST = 4
_HARMONICS = 10
_ABOVE = 16.0  # times the power about it by which a line stands out
_LEAST = 0.005  # of the drive's amplitude
_HUM_ALIKE = 0.35  # of a hum's amplitude by which it may differ at rest
_SURE = 0.25  # of its amplitude to which a line must be known at rest


class DriveLines(NamedTuple):
    """Lines that are there at rest as well (``hum``), and those ``beside`` the drive that are not, or may not be."""

    hum: tuple[Line, ...]
    beside: tuple[Line, ...]


def find_drive_lines(samples: SignalSamples, first: int, last: int, rough: SineFit) -> DriveLines:
    """Lines beside a drive and its harmonics, of more than half a percent of its amplitude.

    They are sought in what the sine leaves of the steady motion, and their frequencies fitted together with its own.
    Hum goes on with the same amplitude and phase through the rest before the start; a record without such a rest
    cannot tell it from a motion.

    Parameters
    ----------
    samples
        The record.
    first, last
        Samples of the moving part.
    rough
        The sine of its last two thirds.
    """
    begin = first + (last - first) // 3
    part = SignalSamples(samples.values[begin:last], samples.time[begin:last], samples.sampling_frequency)
    sound = sound_samples(part.values.size, find_flaws(part, rough))
    rest = slice(0, max(first - 3 * round(samples.sampling_frequency / rough.frequency), 0))
    base = rough.frequency
    found: list[float] = []
    for _ in range(_MOST):
        left = _left(part, [base, *found], sound)[0]
        peak = _peak(left, part.sampling_frequency, rough)
        if peak is None:
            break
        base, *found = _refined(part, [base, *found, peak], sound)
        if (
            min(abs(found[-1] - f) for f in (base, *found[:-1])) * part.values.size
            < 0.5 * part.sampling_frequency
        ):
            return DriveLines((), ())  # two that cannot be parted are a motion that wanders
    if not found:
        return DriveLines((), ())
    moving = _phasors(part, [base, *found], sound)[1:]
    still, error = _at_rest(samples, rest, found)
    hum: list[Line] = []
    beside: list[Line] = []
    for frequency, here, there, unsure in zip(found, moving, still, error, strict=True):
        line = Line(frequency, abs(here), float(np.angle(here)))
        alike = abs(here - there) < max(_HUM_ALIKE * abs(here), 4.0 * unsure)
        (hum if unsure < _SURE * abs(here) and alike else beside).append(line)
    return DriveLines(
        tuple(hum), tuple(line for line in beside if line.amplitude > 2.0 * _LEAST * rough.amplitude)
    )


def without_hum(samples: SignalSamples, lines: DriveLines) -> SignalSamples:
    """A record less its hum."""
    return without_lines(samples, list(lines.hum)) if lines.hum else samples


def beside_lines(steady: SineFit, lines: DriveLines) -> SineFit:
    """A sine whose standard errors hold what *lines* beside it may pull: a share 1/(pi df T) of their amplitude."""
    span = steady.stop - steady.start
    pull = math.hypot(
        0.0,
        *(
            line.amplitude / max(1.0, math.pi * abs(line.frequency - steady.frequency) * span)
            for line in lines.beside
        ),
    )
    if pull == 0.0:
        return steady
    share = pull / steady.amplitude
    return dataclasses.replace(
        steady,
        amplitude_se=math.hypot(steady.amplitude_se, pull),
        phase_se=math.hypot(steady.phase_se, share),
        frequency_se=math.hypot(steady.frequency_se, share / span),
    )


def _design(time: _Array, frequencies: list[float]) -> _Array:
    """Offset, cosine and sine of each frequency, then the harmonics of the first."""
    turns = [2.0 * math.pi * f * time for f in frequencies]
    turns += [2.0 * math.pi * k * frequencies[0] * time for k in range(2, _HARMONICS + 1)]
    columns = [np.ones_like(time)]
    for turn in turns:
        columns += [np.cos(turn), np.sin(turn)]
    return np.column_stack(columns)


def _left(part: SignalSamples, frequencies: list[float], sound: NDArray[np.bool_]) -> tuple[_Array, _Array]:
    """What lines leave of a record, 0 where it is not sound, and their cosine and sine amplitudes."""
    design = _design(part.time, frequencies)
    used = design[sound]
    gram = used.T @ used
    solution: _Array = np.asarray(
        np.linalg.lstsq(gram, used.T @ part.values[sound], rcond=1e-12)[0], dtype=np.float64
    )
    left: _Array = np.asarray(part.values - design @ solution, dtype=np.float64)
    left[~sound] = 0.0
    return left, solution


def _phasors(
    part: SignalSamples, frequencies: list[float], sound: NDArray[np.bool_]
) -> NDArray[np.complex128]:
    """Complex amplitudes c of lines Re(c exp(i 2 pi f t))."""
    solution = _left(part, frequencies, sound)[1]
    count = len(frequencies)
    return np.asarray(solution[1 : 2 * count + 1 : 2] - 1j * solution[2 : 2 * count + 2 : 2])


def _peak(left: _Array, rate: float, rough: SineFit) -> float | None:
    """Frequency of the highest line of a spectrum that stands out, or None."""
    n = left.size
    window = np.hanning(n)
    spectrum = np.abs(np.fft.rfft(left * window)) * 2.0 / window.sum()
    freq = np.fft.rfftfreq(n, 1.0 / rate)
    step = rate / n
    spectrum[freq < 4.0 * step] = 0.0
    at = int(np.argmax(spectrum))
    near = (np.abs(freq - freq[at]) < 40.0 * step) & (np.abs(freq - freq[at]) > 4.0 * step)
    near &= freq > 4.0 * step
    if spectrum[at] < _LEAST * rough.amplitude or near.sum() < 16:
        return None
    about = float(np.median(spectrum[near] ** 2)) / math.log(2.0)
    return float(freq[at]) if spectrum[at] ** 2 > _ABOVE * about else None


def _refined(part: SignalSamples, frequencies: list[float], sound: NDArray[np.bool_]) -> list[float]:
    """Frequencies of lines by least squares, amplitudes eliminated."""
    from scipy.optimize import least_squares

    step = part.sampling_frequency / part.values.size
    start = np.array(frequencies)

    def left(off: _Array) -> _Array:
        return _left(part, (start + step * off).tolist(), sound)[0]

    solved = least_squares(
        left, np.zeros(start.size), bounds=(-1.5, 1.5), x_scale=0.1, diff_step=1e-3, max_nfev=15
    )
    return [float(f) for f in start + step * solved.x]


def _at_rest(
    samples: SignalSamples, rest: slice, frequencies: list[float]
) -> tuple[NDArray[np.complex128], _Array]:
    """Complex amplitudes of lines before the motion, and their standard errors; infinite without such a rest."""
    time, values = samples.time[rest], samples.values[rest]
    count = len(frequencies)
    if time.size < 8 * (2 * count + 1) or (time[-1] - time[0]) * min(frequencies) < 1.0:
        return np.zeros(count, dtype=np.complex128), np.full(count, math.inf)
    turns = 2.0 * math.pi * np.outer(time, frequencies)
    design = np.column_stack([np.ones(time.size), np.cos(turns), np.sin(turns)])
    solution, *_ = np.linalg.lstsq(design, values, rcond=1e-12)
    noise = float(np.std(values - design @ solution))
    spread = noise * np.sqrt(np.diag(np.linalg.pinv(design.T @ design, rcond=1e-12)))
    error = np.hypot(spread[1 : count + 1], spread[count + 1 :])
    return solution[1 : count + 1] - 1j * solution[count + 1 :], error
