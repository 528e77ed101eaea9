"""What spoils a record of a periodic motion: dropouts, spikes, and tops cut off."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.lab.signals.signal import SignalSamples
from snapbeam.lab.signals.sine_fit import SineFit

__all__ = ["Clipping", "Flaw", "find_clipping", "find_flaws", "sound_samples", "stuck_runs"]

_Array = NDArray[np.float64]
_FLAT = 0.105  # share of a cycle within 3 % of its extreme from which a top is flat; 0.078 for a sine
_NEAR = 0.03


class Flaw(NamedTuple):
    """Samples *first* to *last* (one past) that are no part of the motion."""

    first: int
    last: int


class Clipping(NamedTuple):
    """Levels at which tops are cut off, infinite where they are not, and the share of the cycle cut.

    Samples nearer than ``reach`` to a level may be cut.
    """

    low: float
    high: float
    share: float
    reach: float

    @property
    def found(self) -> bool:
        """Whether any top is cut off."""
        return math.isfinite(self.low) or math.isfinite(self.high)

    def touches(self, values: _Array) -> NDArray[np.bool_]:
        """Which of *values* may have been cut."""
        cut: NDArray[np.bool_] = (values > self.high - self.reach) | (values < self.low + self.reach)
        return cut


def find_flaws(samples: SignalSamples, fit: SineFit, measured: NDArray[np.bool_] | None = None) -> list[Flaw]:
    """Stretches in which a record leaves its steady sine by far more than its noise does.

    More than eight robust standard deviations and a twentieth of the amplitude; samples less than half a cycle
    apart belong to one flaw, and a flaw reaches as far as three standard deviations do.  Where not all samples
    were *measured*, the noise is that of those that were.
    """
    rest = samples.values - fit.waveform(samples.time)
    known = rest if measured is None else rest[measured]
    sigma = 1.4826 * float(np.median(np.abs(known - np.median(known))))
    far = np.abs(rest) > max(8.0 * sigma, 0.05 * fit.amplitude)
    # one sample in thousands strays by chance where the noise is not normal; a flaw is more, or farther out
    single = (
        far & ~np.roll(far, 1) & ~np.roll(far, -1) & (np.abs(rest) < max(12.0 * sigma, 0.1 * fit.amplitude))
    )
    at = np.flatnonzero(far & ~single)
    if not at.size:
        return []
    half = 0.5 * samples.sampling_frequency / fit.frequency
    groups = np.split(at, np.flatnonzero(np.diff(at) > half) + 1)
    near = np.abs(rest) > 3.0 * sigma
    found = []
    for group in groups:
        first, last = int(group[0]), int(group[-1]) + 1
        while first > 0 and near[first - 1]:
            first -= 1
        while last < rest.size and near[last]:
            last += 1
        found.append(Flaw(max(first - 1, 0), min(last + 1, rest.size)))
    return found


def sound_samples(size: int, flaws: list[Flaw]) -> NDArray[np.bool_]:
    """Which samples lie in no flaw."""
    sound = np.ones(size, dtype=bool)
    for flaw in flaws:
        sound[flaw.first : flaw.last] = False
    return sound


def find_clipping(samples: SignalSamples, fit: SineFit) -> Clipping:
    """Tops that are flatter than those of a sine, in the mean cycle of a record; or levels hit exactly, again
    and again."""
    none = Clipping(-math.inf, math.inf, 0.0, 0.0)
    turn = np.mod(fit.frequency * samples.time + fit.phase / (2.0 * math.pi), 1.0)
    bins = int(np.clip(samples.values.size // 20, 16, 128))
    index = np.minimum((turn * bins).astype(int), bins - 1)
    count = np.bincount(index, minlength=bins)
    if count.min() < 4:
        return _exact(samples.values, none)
    mean = np.bincount(index, samples.values, minlength=bins) / count
    low, high = (float(level) for level in np.quantile(mean, (0.01, 0.99)))
    half = 0.5 * (high - low)
    noise = fit.noise_rms / math.sqrt(float(count.min()))
    if noise > 0.01 * half:
        return _exact(samples.values, none)
    near = _NEAR * half + 1.5 * noise
    variance = np.bincount(index, samples.values**2, minlength=bins) / count - mean**2
    single = math.sqrt(max(float(np.median(variance)), 0.0))  # noise of a sample, behind the cut or before it
    share = [float((mean > high - near).mean()), float((mean < low + near).mean())]
    flat = _FLAT + 0.02 * min(noise / (0.01 * half), 1.0)
    cut = Clipping(
        low if share[1] > flat else -math.inf,
        high if share[0] > flat else math.inf,
        sum(one for one in share if one > flat),
        0.04 * half + 3.0 * single,
    )
    return cut if cut.found else _exact(samples.values, none)


def _exact(values: _Array, none: Clipping) -> Clipping:
    """Levels that many neighbouring samples share to the last digit with the extreme."""
    levels = []
    shares = []
    for extreme in (float(values.min()), float(values.max())):
        hit = values == extreme
        run = hit[1:] & hit[:-1]
        told = run.mean() > 0.01 and np.ptp(values) > 0.0
        levels.append(extreme if told else None)
        shares.append(float(hit.mean()) if told else 0.0)
    if levels[0] is None and levels[1] is None:
        return none
    return Clipping(
        -math.inf if levels[0] is None else levels[0],
        math.inf if levels[1] is None else levels[1],
        sum(shares),
        0.02 * float(np.ptp(values)),
    )


def stuck_runs(values: _Array, least: int) -> list[Flaw]:
    """Runs of at least so many samples that are equal to the last digit."""
    same = np.concatenate([[False], np.diff(values) == 0.0, [False]])
    edges = np.flatnonzero(np.diff(same.astype(np.int8)))
    return [
        Flaw(int(first), int(last) + 1)
        for first, last in zip(edges[::2], edges[1::2], strict=True)
        if last - first + 1 >= least
    ]
