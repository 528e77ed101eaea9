"""What a run does within its periods: impacts, how near it passes the tip without touching, how far it goes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.dynamics.flow import Stroboscope
from snapbeam.runs.simulate import simulate

__all__ = ["Passage", "passage_of"]

_Array = NDArray[np.float64]
_SAMPLES = 400
"""A period."""


class Passage(NamedTuple):
    """Some periods of a run."""

    impacts: int
    clearance: float
    """Least gap, over the length scale b, at which the beam turns back from the tip without touching; NaN: never."""
    least_penetration: float
    """Greatest penetration of the lightest impact, over b; NaN: none."""
    least_impulse: float
    """Of an impact, N s; NaN: none."""
    peak_displacement: float
    """Greatest distance of the contact point from the straight beam, over b."""
    crossings: int


def passage_of(flow: Stroboscope, coordinates: _Array, periods: int) -> Passage:
    """Follow one state for some periods and look at every approach."""
    system = flow.starting(flow.state(coordinates))
    integration = flow.integration.replace(cycles=periods, early_termination=False)
    run = simulate(
        system, integration, sample_times=np.linspace(0.0, periods * flow.period, _SAMPLES * periods + 1)
    )
    data = run.dataset
    time = data["time"].values
    depth = data["penetration_normalised"].values
    held, spacing = np.zeros(time.size, dtype=bool), 1.000001 * (time[1] - time[0])
    onset, duration = run.impacts["onset"].values, run.impacts["duration"].values
    for begun, lasted in zip(onset, duration, strict=True):
        held |= (time >= begun - spacing) & (time <= begun + lasted + spacing)
    lightest = least = np.nan
    deepest = []
    for begun, lasted in zip(onset, duration, strict=True):
        inside = depth[(time >= begun) & (time <= begun + lasted)]
        deepest.append(float(inside.max(initial=0.0)))
    if onset.size:
        lightest = min(deepest)
        least = float(run.impacts["impulse"].values.min())
    return Passage(
        int(onset.size), _turn_back(time, depth, held), lightest, least,
        float(np.abs(data["displacement_at_striker"].values).max()),
        int(run.summary.zero_crossings),
    )  # fmt: skip


def _turn_back(time: _Array, depth: _Array, held: NDArray[np.bool_]) -> float:
    """Least gap at a turning point of the gap apart from contact, by the parabola through three samples."""
    best = np.nan
    inner = np.arange(1, time.size - 1)
    free = ~(held[inner - 1] | held[inner] | held[inner + 1])
    turns = inner[free & (depth[inner] >= depth[inner - 1]) & (depth[inner] > depth[inner + 1])]
    for i in turns:
        before, here, after = depth[i - 1], depth[i], depth[i + 1]
        bend = before - 2.0 * here + after
        top = here if bend == 0.0 else here - (after - before) ** 2 / (8.0 * bend)
        best = np.nanmin([best, max(-top, 0.0)])
    return float(best)
