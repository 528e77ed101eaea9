"""Motions as functions of time: of a striker, a base, an axial load or a force."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.drive.base import Drive, Scale
from snapbeam.model.drive.sum import SumDrive

_Array = NDArray[np.float64]
Motion = Callable[[float], tuple[float, float, float]]
"""Displacement (m), velocity (m/s) and acceleration (m/s^2) at a time, s."""


def motion_of(
    drive: Drive, scale: Scale, phase: float, later: float, sign: float
) -> tuple[Motion, list[float]]:
    """w(t), w'(t) and w''(t) of a drive that began *later* seconds ago at a *phase*, and the times at which it jumps."""
    if isinstance(drive, SumDrive):
        own = [(each, scale, getattr(each, "phase", 0.0)) for each in drive.parts_of_sum]
        terms = [motion_of(*each, later, sign) for each in own]
        begun = sum(motion_of(*each, 0.0, sign)[0](0.0)[0] for each in own if each[0].harmonic)

        def together(t: float) -> tuple[float, float, float]:
            w, v, a = (sum(each) for each in zip(*(term(t) for term, _ in terms), strict=True))
            return w - begun, v, a

        return together, [at for _, jumps in terms for at in jumps]
    columns = {name: np.array([value]) for name, value in drive.values().items()} or {"": np.zeros(1)}
    kind: Any = drive.integrated_as or type(drive)
    found, samples = drive.numbers(columns, scale), sign * drive.samples()
    numbers = kind.numbers_type()(*(float(found[name][0]) for name in kind.number_names))
    omega = numbers.omega

    def harmonic(t: float) -> tuple[float, float, float]:
        angle, size = omega * (t + later) + phase, numbers.amplitude
        w = size * math.sin(angle)
        return w, size * omega * math.cos(angle), -(omega**2) * w

    def general(t: float) -> tuple[float, float, float]:
        at = omega * (t + later) + phase
        return *kind.motion(numbers, samples, at), kind.acceleration(numbers, samples, at)

    jumps = [getattr(numbers, name) - later - phase / omega for name in kind.discontinuities]
    return harmonic if kind.harmonic else general, jumps


def displacements(drive: Drive, columns: Mapping[str, _Array], scale: Scale, arguments: _Array) -> _Array:
    """Displacement, m, of a drive with each run's own parameters at an argument of each run, rad; shape (runs,)."""
    found, kind = drive.numbers(columns, scale), drive.integrated_as or type(drive)
    if kind.harmonic:
        return np.where(arguments == 0.0, 0.0, found["amplitude"] * np.sin(arguments))
    motion: Any = kind
    table = np.stack([*(found[name] for name in kind.number_names), arguments], axis=1)
    rows, which = np.unique(table, axis=0, return_inverse=True)
    numbers, samples = kind.numbers_type(), drive.samples()
    return np.array([motion.motion(numbers(*row), samples, at)[0] for *row, at in rows.tolist()])[
        which.reshape(-1)
    ]
