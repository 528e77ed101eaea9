"""Small grids of response classes that stand in for an engine, so that thresholds are known point by point."""

from __future__ import annotations

import numpy as np

import snapbeam as sb
from snapbeam.model.default_values import BEAM, CONTACT
from snapbeam.sweeps.setup import SweepSetup
from snapbeam.util.status_codes import ResponseClass, RunStatus

SYSTEM = sb.System(
    sb.ReducedModel.from_beam(BEAM, modes=1, damping_ratio=0.005),
    contacts=[sb.Contact(CONTACT, sb.Shaker(frequency_ratio=1.0, velocity_amplitude=0.2))],
)
AMPLITUDE = np.array([0.1, 0.2, 0.3, 0.4, 0.5])

_SIGNS = {"i": ResponseClass.INTRAWELL, "X": ResponseClass.TRANSIENT_2, "?": ResponseClass.UNKNOWN}


def stand_in(monkeypatch, columns: str) -> np.ndarray:
    """Let every run return its class from *columns*, one word for each frequency ratio; return the ratios.

    ``i`` is intrawell, ``X`` interwell, ``?`` a failed run.
    """
    table = np.array([[_SIGNS[sign] for sign in word] for word in columns.split()], dtype=np.int8)
    ratio = np.linspace(1.0, 2.0, len(table))
    true = SweepSetup.integrate

    def integrate(self, points, threads=None, progress=None, **more):
        found = true(self, points, threads, progress, **more)
        at = np.rint((points["drive.frequency_ratio"] - 1.0) * (len(table) - 1)).astype(int)
        row = np.rint(points["drive.velocity_amplitude"] * 10.0).astype(int) - 1
        found["response_class"] = table[at, row]
        failed = found["response_class"] == ResponseClass.UNKNOWN
        found["status"] = np.where(failed, RunStatus.DIVERGED, RunStatus.OK).astype(found["status"].dtype)
        return found

    monkeypatch.setattr(SweepSetup, "integrate", integrate)
    return ratio


def thresholds_of(monkeypatch, columns: str):
    """The threshold dataset of such columns."""
    ratio = stand_in(monkeypatch, columns)
    return sb.threshold(SYSTEM, "velocity_amplitude", AMPLITUDE, {"frequency_ratio": ratio}, sb.Integration(cycles=1))
