"""A recorded motion for tests: a start-up over three cycles to a sine and its second harmonic."""

from __future__ import annotations

import numpy as np

import snapbeam as sb


def start_up(model: sb.ReducedModel, ratio: float = 1.3, velocity: float = 0.3, cycles: int = 8) -> sb.RecordedMotion:
    """Return the motion, sampled 60 times a cycle, as an experiment would record it."""
    frequency = ratio * model.reference_frequency
    rate = 60.0 * frequency
    t = np.arange(60 * cycles + 1) / rate
    omega = 2.0 * np.pi * frequency
    amplitude = velocity * model.length_scale * 2.0 * np.pi * model.reference_frequency / omega
    grown = np.minimum(t * frequency / 3.0, 1.0)
    envelope, slope = grown**2 * (3.0 - 2.0 * grown), 6.0 * grown * (1.0 - grown) * frequency / 3.0
    wave = np.sin(omega * t) + 0.1 * np.sin(2.0 * omega * t)
    wave_rate = omega * np.cos(omega * t) + 0.2 * omega * np.cos(2.0 * omega * t)
    return sb.RecordedMotion(
        displacement=amplitude * envelope * wave,
        velocity=amplitude * (envelope * wave_rate + slope * wave),
        sampling_frequency=rate,
        frequency=frequency,
    )
