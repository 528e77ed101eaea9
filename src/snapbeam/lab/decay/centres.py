"""Which modes of a decay are to be identified, and which others are in it."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from snapbeam.core.findings import Diagnostic
from snapbeam.core.validate import InputError
from snapbeam.lab.decay.cycles import noise_level
from snapbeam.lab.decay.poles import Pole, Stabilisation, find_poles
from snapbeam.lab.decay.window import Decay, dominant
from snapbeam.lab.plausibility.decay import KINDS
from snapbeam.lab.signals.signal import SignalSamples

__all__ = ["CLOSE", "ENERGY", "Centres", "find_centres", "unexplained"]

ENERGY = 40.0  # of a pole over the noise, from which it is a mode
CLOSE = 0.25  # share within which modes are fitted together
_ASKED = 0.1  # share by which a mode may be off the frequency asked for


class Centres(NamedTuple):
    """Modes to identify: frequencies [Hz]; the poles they are, and those near and far that are not asked for.

    Poles are empty where one mode was asked for and none had to be sought.
    """

    wanted: list[float]
    own: list[Pole]
    near: list[Pole]
    far: list[Pole]
    diagram: Stabilisation | None
    told: list[Diagnostic]


def find_centres(decay: Decay, count: int, asked: list[float] | None) -> Centres:
    """The modes wanted, and the others that the record holds."""
    samples = decay.samples
    span = samples.values.size / samples.sampling_frequency
    sigma = noise_level(samples)
    if asked is None and count == 1:
        center = dominant(samples)
        if center * span < 8.0:
            raise InputError(
                f"signal spans {center * span:.1f} cycles of {center:g} Hz: must span at least 8"
            )
        _stands_out(samples, center, sigma)
        return Centres([center], [], [], [], None, [])
    poles, diagram = find_poles(samples, sigma)
    modes = [pole for pole in poles if _is_mode(pole, span)]
    told: list[Diagnostic] = []
    wanted: list[float] = []
    own: list[Pole] = []
    if asked is None:
        if len(modes) < count:
            names = ", ".join(f"{pole.frequency:.4g} Hz" for pole in modes) or "none"
            raise InputError(f"signal: no further mode stands out of the noise (found: {names})")
        own = modes[:count]
        wanted = [pole.frequency for pole in own]
    for frequency in asked or ():
        near = [pole for pole in modes if abs(pole.frequency / frequency - 1.0) < _ASKED]
        if near:
            own.append(max(near, key=lambda pole: pole.energy))
            wanted.append(own[-1].frequency)
            continue
        hum = [line for line in decay.lines if abs(line.frequency / frequency - 1.0) < 2.5 * _ASKED]
        if hum:
            raise InputError(
                "signal: " + KINDS["hum_asked"].found(asked=frequency, frequency=hum[0].frequency).message
            )
        center = dominant(samples, 0.8 * frequency, 1.2 * frequency)
        _stands_out(samples, center, sigma)
        wanted.append(center)
        told.append(KINDS["off_asked"].found(asked=frequency, found=center))
    others = [pole for pole in modes if pole not in own]
    close = [pole for pole in others if any(abs(pole.frequency / f - 1.0) < CLOSE for f in wanted)]
    near = [pole for pole in close if pole.energy > 0.003 * max(one.energy for one in own or close)]
    far = [pole for pole in others if pole not in close]
    return Centres(wanted, own, near, far, diagram, told)


def unexplained(residual: NDArray[np.float64], sampling_frequency: float) -> bool:
    """Whether what a fit leaves still holds an oscillation that noise would not make."""
    n = residual.size
    window = np.cos(0.5 * math.pi * np.arange(n) / n) ** 2
    power = np.abs(np.fft.rfft(residual * window)) ** 2
    freq = np.fft.rfftfreq(n, 1.0 / sampling_frequency)
    power[freq * n < 6.0 * sampling_frequency] = 0.0
    # noise may be of any colour: each line against its surroundings
    width = max(min(power.size // 8, 101), 9) | 1
    around = median_filter(power, width, mode="nearest") / math.log(2.0)
    return bool((power > 25.0 * np.maximum(around, 1e-300)).any())


def _is_mode(pole: Pole, span: float) -> bool:
    """Whether a pole is a mode: above the noise, decaying, and seen for eight cycles."""
    return pole.energy > ENERGY and pole.damping_ratio > -1e-3 and pole.frequency * span >= 8.0


def _stands_out(samples: SignalSamples, frequency: float, sigma: float) -> None:
    """Refuse a peak of the spectrum that noise alone could make."""
    n = samples.values.size
    span = n / samples.sampling_frequency
    window = np.cos(0.5 * math.pi * np.arange(n) / n) ** 2
    values = samples.values - float((samples.values * window).sum() / window.sum())
    spectrum = np.abs(np.fft.rfft(values * window, 4 * n)) ** 2
    freq = np.fft.rfftfreq(4 * n, 1.0 / samples.sampling_frequency)
    floor = sigma**2 * float(np.sum(window**2))
    if spectrum[np.abs(freq - frequency) <= 1.0 / span].max() < 20.0 * floor:
        raise InputError("signal: no further mode stands out of the noise (found: none)")
