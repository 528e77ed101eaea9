"""Contacts of a motion: impacts, approaches without one, and the phase that is farthest from all of them."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.dynamics.flow import Flow
from snapbeam.dynamics.stroboscope import Stroboscope
from snapbeam.simulation.advance import advance
from snapbeam.simulation.run import Run
from snapbeam.simulation.simulate import simulate
from snapbeam.util.status_codes import RunStatus

_Array = NDArray[np.float64]
_NEAR_CONTACT = 0.25
"""Distance of a contact from the instant of observation that is small, over that of the instant farthest from contacts."""
_SAMPLES = 400
"""Number of samples a period."""


class Passage(NamedTuple):
    """Some periods of a run."""

    impacts: int
    clearance: float
    """Minimum gap, over the length scale b, at which the beam turns back from a tip without touching; NaN: never."""
    min_penetration: float
    """Maximum penetration of the lightest impact, over b; NaN: none."""
    min_impulse: float
    """Minimum impulse of an impact, N s; NaN: none."""
    peak_displacement: float
    """Maximum distance of the contact point from the straight beam, over b."""
    crossings: int


def passage_of(flow: Stroboscope, coordinates: _Array, periods: int) -> Passage:
    """Follow one state for some periods and look at every approach."""
    run, depths, impacts = _followed(flow, coordinates, periods)
    time = run.dataset["time"].values
    # a turning point within a contact, or as near to one as a sample, is part of it
    turns, spacing = (turning_points(flow, coordinates, periods, periodic=False), 1.000001 * (time[1] - time[0]))
    free = np.isfinite(turns.depth)
    deepest = []
    for onset, duration, contact in impacts:
        within_contact = (turns.time >= onset - spacing) & (turns.time <= onset + duration + spacing)
        free &= ~(within_contact & (turns.contact == contact))
        inside = depths[(time >= onset) & (time <= onset + duration), contact]
        deepest.append(float(inside.max(initial=0.0)))
    return Passage(
        impacts=len(impacts),
        # beyond the tip by less than a contact that a step sees: as far off
        clearance=float(np.abs(turns.depth[free]).min()) if free.any() else np.nan,
        min_penetration=min(deepest, default=np.nan),
        min_impulse=float(run.impacts["impulse"].values.min()) if impacts else np.nan,
        peak_displacement=float(np.abs(run.dataset["displacement_at_striker"].values).max()),
        crossings=int(run.summary.zero_crossings),
    )


class TurningPoints(NamedTuple):
    """Maxima of the penetrations of a motion."""

    time: _Array
    """s."""
    depth: _Array
    """Penetration over b; negative for a gap."""
    contact: NDArray[np.intp]


def _followed(
    flow: Stroboscope, coordinates: _Array, periods: int, times: _Array | None = None
) -> tuple[Run, _Array, list[tuple[float, float, int]]]:
    """A run, its penetrations over b, shape (times, contacts), and onset (s), duration (s) and contact of its impacts."""
    if times is None:
        times = np.linspace(0.0, periods * flow.period, _SAMPLES * periods + 1)
    run = simulate(flow.starting(coordinates), flow.during(periods), sample_times=times)
    several = len(run.system.contacts) > 1
    depths = run.dataset["striker_penetrations" if several else "penetration_normalised"].values
    table = run.impacts
    contacts = table["striker"].values.astype(int) - 1 if several else [0] * table.sizes["impact"]
    impacts = zip(table["onset"].values.tolist(), table["duration"].values.tolist(), contacts, strict=True)
    return run, depths.reshape(times.size, -1), list(impacts)


def penetrations(flow: Stroboscope, coordinates: _Array, periods: int, times: _Array) -> _Array:
    """Penetrations over b at instants of a motion (s, increasing), shape (times, contacts); gaps are negative."""
    return _followed(flow, coordinates, periods, times)[1]


def turning_points(flow: Stroboscope, coordinates: _Array, periods: int, *, periodic: bool = True) -> TurningPoints:
    """Turning points of the gaps of a motion, *periodic* or not, by quartics through five samples, sampled again."""
    end, count = periods * flow.period, _SAMPLES * periods
    _, depth, impacts = _followed(flow, coordinates, periods)
    depth, spacing = depth[:-1] if periodic else depth, end / count
    turns = (depth >= np.roll(depth, 1, axis=0)) & (depth > np.roll(depth, -1, axis=0))
    if not periodic:
        turns[[0, -1]] = False
    at, contact = np.nonzero(turns)
    for onset, duration, touched in impacts:
        if duration == 0.0:  # the velocity jumps: no turning point
            apart = np.abs((spacing * at - onset + 0.5 * end) % end - 0.5 * end)
            at, contact = (each[(contact != touched) | (apart > 2.0 * spacing)] for each in (at, contact))
    if not at.size:
        return TurningPoints(np.empty(0), np.empty(0), contact)
    nearest = np.arange(-2, 3)
    middle = at if periodic else np.clip(at, 2, len(depth) - 3)
    place, _ = _maximum(depth[(middle[:, None] + nearest) % len(depth), contact[:, None]])
    finer = spacing / _SAMPLES
    time = spacing * (middle + place)
    times, back = np.unique((time[:, None] + finer * nearest) % end, return_inverse=True)
    depth = penetrations(flow, coordinates, periods, times)
    place, top = _maximum(depth[back.reshape(at.size, 5), contact[:, None]])
    return TurningPoints((time + finer * place) % end, top, contact)


def _maximum(values: _Array) -> tuple[_Array, _Array]:
    """Place, in units of the spacing, and height of the maximum of the quartics through rows of five samples."""
    place, top = np.zeros(len(values)), values[:, 2].copy()
    for i, row in enumerate(values):
        curve = np.polynomial.Polynomial.fit(np.arange(-2.0, 3.0), row - row[2], 4).convert()
        roots = curve.deriv().roots()
        inner = roots.real[(np.abs(roots.imag) < 1e-9) & (np.abs(roots.real) <= 2.0)]
        if inner.size:
            place[i] = inner[np.argmax(curve(inner))]
            top[i] += curve(place[i])
    return place, top


def carried(flow: Stroboscope, coordinates: _Array, phase: float) -> _Array:
    """A state that a map takes, at the next instant at which the primary excitation has *phase*, rad."""
    part = (phase - flow.clock.striker_phase) % (2.0 * np.pi) / (2.0 * np.pi)
    if part == 0.0:
        return coordinates
    if flow.dimension > 2 * flow.space.modes:  # to a tick of the clock
        moved = advance(flow.system, flow.state(coordinates), part, integration=flow.integration)
        return np.asarray(flow.space.of(moved.flat)[0])
    integration = flow.integration.replace(cycles=1, early_termination=False)
    times = [0.0, part * flow.clock.cycle]
    last = simulate(flow.starting(coordinates), integration, sample_times=times).dataset.isel(time=-1)
    return np.concatenate([last["modal_amplitude"].values, last["modal_velocity"].values]) / flow.space.scales


def between_contacts(flow: Flow, coordinates: _Array, periods: int) -> Stroboscope | None:
    """The map at the phase farthest from the contacts of a periodic motion; None if smooth or no contact is near."""
    if not isinstance(flow, Stroboscope) or not flow.jumps or flow.system.striker is None:
        return None
    end, cycle, begin = periods * flow.period, flow.clock.cycle, flow.clock.striker_phase
    run = simulate(flow.starting(coordinates), flow.during(periods), sample_times=[0.0, end])
    onset = run.impacts["onset"].values
    if run.summary.status != int(RunStatus.OK) or not onset.size:
        return None
    order = np.argsort(onset)
    release = np.maximum.accumulate((onset + run.impacts["duration"].values)[order])
    free = np.append(onset[order][1:], onset[order][0] + end) - release
    middle = (release + 0.5 * free) % end
    # several motions share one clock: their map takes states within the first cycle of the common period
    free[middle % flow.period > cycle] = 0.0
    best = int(np.argmax(free))
    distance = min(float(onset.min()), end - float(release[-1]))
    if distance > _NEAR_CONTACT * 0.5 * free[best]:
        return None
    return replace(flow, phase=(begin + 2.0 * np.pi * float(middle[best]) / cycle) % (2.0 * np.pi))
