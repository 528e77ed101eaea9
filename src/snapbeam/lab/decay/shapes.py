"""Whether a mode is symmetric or antisymmetric about the middle of the beam, from two sensors."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from snapbeam.core.validate import InputError
from snapbeam.lab.decay.model import DecayFit
from snapbeam.lab.signals.signal import SignalSamples, check_signal

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["SHAPES", "mode_shapes"]

SHAPES = ("symmetric", "antisymmetric", "unclear")
_IN_PHASE = 0.7  # cosine of the angle between two sensors from which a mode is told
_ALIKE = 0.2  # amplitude of one sensor over the other's below which it is not


def mode_shapes(first: xr.DataArray, second: xr.DataArray, fit: DecayFit) -> tuple[str, ...]:
    """Shape of each mode of *fit*: "symmetric", "antisymmetric" or "unclear".

    Both sensors sense the same decay at places that mirror each other about the middle of the beam, such as a
    quarter and three quarters of its length, and count the same direction as positive.  In a symmetric mode
    they move alike, in an antisymmetric one against each other.

    Parameters
    ----------
    first, second : xarray.DataArray
        The two records, of one length and rate.
    fit : DecayFit
        What :func:`snapbeam.lab.identify_decay` made of the first.

    Raises
    ------
    InputError
        If the records differ in length or rate.
    """
    one, two = check_signal(first, (), "first"), check_signal(second, (), "second")
    if (
        one.values.size != two.values.size
        or abs(one.sampling_frequency / two.sampling_frequency - 1.0) > 1e-9
    ):
        raise InputError(
            f"second: {two.values.size} samples at {two.sampling_frequency:g} Hz, first has {one.values.size} at "
            f"{one.sampling_frequency:g} Hz: must be one recording"
        )
    amplitudes = [_complex_amplitudes(samples, fit) for samples in (one, two)]
    out = []
    for a, b in zip(*amplitudes, strict=True):
        size = min(abs(a), abs(b)) / max(abs(a), abs(b))
        angle = (a.conjugate() * b).real / (abs(a) * abs(b))
        told = size > _ALIKE and abs(angle) > _IN_PHASE
        out.append(SHAPES[2] if not told else SHAPES[0] if angle > 0.0 else SHAPES[1])
    return tuple(out)


def _complex_amplitudes(samples: SignalSamples, fit: DecayFit) -> list[complex]:
    """Amplitude and phase of each mode in a record, by linear least squares."""
    inside = (samples.time >= fit.start - 1e-12) & (samples.time <= fit.stop + 1e-12)
    t, y = samples.time[inside] - fit.start, samples.values[inside]
    columns = [np.ones_like(t)]
    for mode in fit.modes:
        omega = 2.0 * math.pi * mode.natural_frequencies
        turn = omega * math.sqrt(1.0 - mode.damping_ratio**2)
        wave = np.exp((-mode.damping_ratio * omega + 1j * turn) * t)
        columns += [wave.real, wave.imag]
    solution = np.linalg.lstsq(np.column_stack(columns), y, rcond=None)[0]
    return [complex(solution[1 + 2 * k], -solution[2 + 2 * k]) for k in range(len(fit.modes))]
