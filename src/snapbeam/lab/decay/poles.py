"""Modes of a free decay by the matrix pencil, with a stabilisation diagram.

A sum of decaying sines obeys a linear recurrence.  The leading vectors of the matrix of its shifted windows
span the same space whether they begin at the first row or the second, so the matrix that turns one into the
other has the poles exp((-delta + i omega)/f_s) as eigenvalues (Y. Hua and T. K. Sarkar, IEEE Trans. Acoust.
38, 1990, 814; the subspace form of R. Roy and T. Kailath, IEEE Trans. Acoust. 37, 1989, 984).  How many poles
there are is not known: a mode is what stays where it is while more and more are asked for.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.signal import fftconvolve

from snapbeam.lab.least_squares import solve
from snapbeam.lab.signals import SignalSamples
from snapbeam.lab.sine_fit import fit_sine
from snapbeam.util.singular_values import lstsq
from snapbeam.util.validation import InputError

_Array = NDArray[np.float64]
_WINDOW = 240  # samples of a window
_WINDOWS = 6000  # of them used
_MOST = 40  # poles asked for at most, two a mode
# shares of frequency and damping ratio, and damping ratio, within which a pole stays
_SAME = (0.01, 0.3, 0.004)
_STABLE = 4  # orders in a row at which a pole must stay
_LARGEST_DAMPING = 0.25
_BANDS = (0.02, 0.42)  # of the sampling rate, in which poles of one stage count
_MAINS = (50.0, 60.0)
_MOST_LINES = 6
_PEAKS = 10  # of the spectrum that are looked at for a line
_HIGHEST_DEGREE = 6
_MATTERS = 0.03  # of the amplitude; a drift below that is let be


class Pole(NamedTuple):
    """A mode of a decay: frequency [Hz] undamped, damping ratio, amplitude at the start, and how it compares.

    ``energy`` is the sum of its squares over the record over that of the noise in its band, ``orders`` at how
    many orders it stayed.
    """

    frequency: float
    damping_ratio: float
    amplitude: float
    energy: float
    orders: int


class Stabilisation(NamedTuple):
    """Every pole at every order: ``order``, ``frequency`` [Hz], ``damping_ratio``, and whether it is stable."""

    order: NDArray[np.int64]
    frequency: _Array
    damping_ratio: _Array
    stable: NDArray[np.bool_]


def thinned(samples: SignalSamples, factor: int) -> SignalSamples:
    """Every *factor*-th sample after a low-pass without phase shift; the filter's ends are left out."""
    from scipy.signal import firwin, oaconvolve

    if factor <= 1:
        return samples
    half = 10 * factor
    taps = firwin(2 * half + 1, 0.8 / factor, window="hamming")
    smooth = oaconvolve(samples.values, taps, mode="valid")
    time = samples.time[half : samples.time.size - half]
    return SignalSamples(smooth[::factor], time[::factor], samples.sampling_frequency / factor)


def find_poles(samples: SignalSamples, noise: float) -> tuple[list[Pole], Stabilisation]:
    """The modes of a decay, strongest first, and the diagram from which they were read.

    The record is looked at in stages, each thinned to a quarter of the one before, so that low frequencies are
    seen in long windows.  *noise* is the standard deviation of white noise in it.
    """
    found: list[Pole] = []
    rows: list[tuple[int, float, float, bool]] = []
    factor = 1
    while samples.values.size // factor >= 96:
        stage = thinned(samples, factor)
        if stage.values.size < 96:
            break
        low = _BANDS[0] if samples.values.size // (4 * factor) < 160 else 0.25 * _BANDS[1]
        poles, table = _stage(stage, low * stage.sampling_frequency, _BANDS[1] * stage.sampling_frequency)
        rows += table
        found += poles
        factor *= 4
    lowest = 4.0 * samples.sampling_frequency / samples.values.size
    merged: list[Pole] = []  # each mode once: the pole that stayed longest
    for pole in sorted((one for one in found if one.frequency > lowest), key=lambda one: -one.orders):
        if all(abs(pole.frequency / other.frequency - 1.0) > 0.015 for other in merged):
            merged.append(pole)
    floor = max(noise, 1e-9 * float(np.abs(samples.values).max()))
    weighed = [
        pole._replace(amplitude=amplitude, energy=float(part @ part) / floor**2)
        for pole, amplitude, part in zip(merged, *_parts(samples, merged), strict=True)
    ]
    kinds = (np.int64, np.float64, np.float64, bool)
    diagram = Stabilisation(*(np.array([row[k] for row in rows], dtype=kind) for k, kind in enumerate(kinds)))
    return sorted(weighed, key=lambda pole: -pole.energy), diagram


def _stage(samples: SignalSamples, low: float, high: float) -> tuple[list[Pole], list[tuple[int, float, float, bool]]]:
    """Stable poles of one stage between two frequencies [Hz], and its part of the diagram."""
    values = samples.values - samples.values.mean()
    n = values.size
    length = min(n // 2, _WINDOW)
    count = n - length + 1
    every = max(1, count // _WINDOWS)
    windows = np.lib.stride_tricks.sliding_window_view(values, length)[::every]
    gram = np.zeros((length, length))
    for first in range(0, windows.shape[0], 2000):
        part = np.ascontiguousarray(windows[first : first + 2000])
        gram += part.T @ part
    most = min(_MOST, length // 3)
    most -= most % 2
    _, vectors = eigh(gram, subset_by_index=(length - most, length - 1), driver="evr")
    vectors = vectors[:, ::-1]
    # the columns are orthonormal, so the least squares solution of every order follows from one product
    shifted = vectors[:-1].T @ vectors[1:]
    ends = vectors[-1]
    last: list[tuple[float, float]] = []
    tracks: list[list[tuple[float, float]]] = []
    owner: dict[int, int] = {}
    rows: list[tuple[int, float, float, bool]] = []
    for order in range(2, most + 1, 2):
        end = ends[:order]
        part = shifted[:order, :order]
        turn = part + np.outer(end, end @ part) / max(1.0 - float(end @ end), 1e-12)
        roots = np.linalg.eigvals(turn)
        s = np.log(roots.astype(np.complex128)) * samples.sampling_frequency
        poles = [(abs(one) / (2.0 * math.pi), -one.real / abs(one)) for one in s if one.imag > 0.0]
        poles = [one for one in poles if low <= one[0] <= high and -0.02 < one[1] < _LARGEST_DAMPING]
        fresh: dict[int, int] = {}
        for k, pole in enumerate(poles):
            match = _nearest(pole, last)
            known = owner.get(match) if match is not None else None
            if known is None:
                tracks.append([pole])
                known = len(tracks) - 1
            else:
                tracks[known].append(pole)
            fresh[k] = known
            rows.append((order, pole[0], pole[1], len(tracks[known]) >= _STABLE))
        last, owner = poles, fresh
    out = []
    for track in tracks:
        if len(track) >= _STABLE:
            middle = np.median(np.array(track), axis=0)
            out.append(Pole(float(middle[0]), float(middle[1]), math.nan, math.nan, len(track)))
    return out, rows


def _nearest(pole: tuple[float, float], others: list[tuple[float, float]]) -> int | None:
    """Which of *others* is the same pole, if any."""
    damped = max(_SAME[1] * abs(pole[1]), _SAME[2])
    apart = [(abs(other[0] / pole[0] - 1.0), k) for k, other in enumerate(others) if abs(other[1] - pole[1]) < damped]
    best, where = min(apart, default=(math.inf, 0))
    return where if best < _SAME[0] else None


def without_poles(samples: SignalSamples, poles: list[Pole], others: list[Pole]) -> SignalSamples:
    """A record less the sines of *poles*, their amplitudes fitted together with those of *others*."""
    if not poles:
        return samples
    _, parts = _parts(samples, [*poles, *others])
    return samples._replace(values=samples.values - sum(parts[: len(poles)]))


def _parts(samples: SignalSamples, poles: list[Pole]) -> tuple[list[float], list[_Array]]:
    """Amplitude of each pole at the start, and its part of the record."""
    if not poles:
        return [], []
    t = samples.time - samples.time[0]
    design = damped_waves(t, [(pole.frequency, min(max(pole.damping_ratio, 0.0), 0.99)) for pole in poles])
    solution = solve(design, samples.values, 1e-10)
    amplitudes, parts = [], []
    for k in range(1, 2 * len(poles), 2):
        amplitudes.append(math.hypot(solution[k], solution[k + 1]))
        parts.append(np.asarray(solution[k] * design[:, k] + solution[k + 1] * design[:, k + 1]))
    return amplitudes, parts


def damped_waves(t: _Array, modes: list[tuple[float, float]]) -> _Array:
    """Columns of an offset, and of cosine and sine of each mode, by its undamped frequency [Hz] and damping ratio."""
    columns = [np.ones_like(t)]
    for frequency, zeta in modes:
        omega = 2.0 * math.pi * frequency
        wave = np.exp((-zeta * omega + 1j * omega * math.sqrt(1.0 - zeta * zeta)) * t)
        columns += [wave.real, wave.imag]
    return np.column_stack(columns)


class Line(NamedTuple):
    """A sine that does not decay: frequency [Hz], amplitude, phase at time 0 of the record."""

    frequency: float
    amplitude: float
    phase: float

    def waveform(self, time: _Array) -> _Array:
        """The line at times [s]."""
        out: _Array = self.amplitude * np.cos(2.0 * math.pi * self.frequency * time + self.phase)
        return out


def find_drift(samples: SignalSamples, frequency: float, decay_rate: float) -> tuple[_Array, int]:
    """A polynomial that the mean motion follows, at every sample, and its degree; 0 if none is needed.

    The mean is that under a bell of two periods of the mode's *frequency* [Hz].  A softening mode shifts it in
    proportion to the square of its amplitude; what falls so, at twice *decay_rate* [1/s], is no drift.
    """
    n = samples.values.size
    nothing: _Array = np.zeros(n)
    width = round(samples.sampling_frequency / frequency)
    if n < 10 * width:
        return nothing, 0
    bell = np.hanning(2 * width + 1)
    mean = fftconvolve(samples.values, bell / bell.sum(), mode="valid")[::width]
    at = np.arange(mean.size) * width + width
    fall = np.column_stack([np.ones(mean.size), np.exp(-2.0 * decay_rate * at / samples.sampling_frequency)])
    rest = mean - fall @ lstsq(fall, mean)
    x = 2.0 * (at + 0.5) / n - 1.0
    largest = float(np.percentile(np.abs(samples.values - np.median(samples.values)), 99))
    best, chosen, solution = math.inf, 0, np.zeros(1)
    for degree in range(0, min(_HIGHEST_DEGREE, mean.size // 5) + 1):
        basis = np.polynomial.legendre.legvander(x, degree)
        found = lstsq(basis, rest)
        left = float(np.mean((rest - basis @ found) ** 2)) + (1e-4 * largest) ** 2
        score = mean.size * math.log(left) + 2.0 * (degree + 1) * math.log(mean.size)
        if score < best - 6.0:
            best, chosen, solution = score, degree, found
    whole = 2.0 * (np.arange(n) + 0.5) / n - 1.0
    drift = np.asarray(np.polynomial.legendre.legval(whole, solution), dtype=np.float64)
    return (drift - drift.mean(), chosen) if chosen and np.ptp(drift) >= _MATTERS * largest else (nothing, 0)


def find_lines(samples: SignalSamples, decay_rate: float) -> list[Line]:
    """Sines that do not decay, in the last third of a record, where the decay has died away most.

    A line must stand twelve decibels above its surroundings there, keep its amplitude over the two halves of
    that third, and, unless it is a multiple of mains frequency, do so where a mode of *decay_rate* [1/s] could not.
    """
    n = samples.values.size
    first = 2 * n // 3
    rest = SignalSamples(samples.values[first:].copy(), samples.time[first:], samples.sampling_frequency)
    found: list[Line] = []
    for _ in range(_MOST_LINES):
        line = _strongest(rest, decay_rate)
        if line is None:
            break
        found.append(line)
        rest = rest._replace(values=rest.values - line.waveform(rest.time))
    return found


def _strongest(part: SignalSamples, decay_rate: float) -> Line | None:
    n = part.values.size
    values = part.values - part.values.mean()
    spectrum = np.abs(np.fft.rfft(values * np.hanning(n))) ** 2
    freq = np.fft.rfftfreq(n, 1.0 / part.sampling_frequency)
    span = n / part.sampling_frequency
    left = np.where(freq * span < 4.0, 0.0, spectrum)
    for _ in range(_PEAKS):
        at = int(np.argmax(left))
        left = np.where(np.abs(freq - freq[at]) < 4.0 / span, 0.0, left)
        near = (np.abs(freq - freq[at]) < 30.0 / span) & (np.abs(freq - freq[at]) > 4.0 / span)
        if near.sum() < 8 or spectrum[at] < 16.0 * float(np.median(spectrum[near])) / math.log(2.0):
            continue
        try:
            whole = fit_sine(part, float(freq[at]), 1)
            parts = [part.part(cut) for cut in (slice(0, n // 2), slice(n // 2, n))]
            halves = [fit_sine(one, whole.frequency, 1, fixed=True) for one in parts]
        except InputError:
            continue
        ratio = halves[1].amplitude / halves[0].amplitude
        error = ratio * math.hypot(*(half.amplitude_se / half.amplitude for half in halves))
        mains = min(abs(whole.frequency / base - round(whole.frequency / base)) * base for base in _MAINS)
        multiple = mains < max(0.004 * whole.frequency, 3.0 * whole.frequency_se) and mains < 0.6
        decayed = math.exp(-decay_rate * 0.5 * span)
        level = abs(ratio - 1.0) < max(3.0 * error, 0.04) and error < 0.1
        if level and (multiple or ratio - decayed > max(6.0 * error, 0.15)):
            return Line(whole.frequency, whole.amplitude, whole.phase)
    return None


def without_lines(samples: SignalSamples, lines: Sequence[Line]) -> SignalSamples:
    """A record less its lines."""
    values = samples.values
    for line in lines:
        values = values - line.waveform(samples.time)
    return samples._replace(values=values)
