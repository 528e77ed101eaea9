"""A run of the CPU engine: what stays the same in it, where it stands, how it begins and ends."""

from __future__ import annotations

import math
from typing import NamedTuple

from snapbeam.core.codes import RunStatus
from snapbeam.engines.columns import Counts, Numbers, Ticks
from snapbeam.engines.cpu.rows import acceleration_rows, flow_coefficients, modal_energy, tension_rows
from snapbeam.engines.cpu.step import Impactor, observe, prepare
from snapbeam.engines.scalar.compile import compiled, inlined
from snapbeam.engines.scalar.composition import TURNS
from snapbeam.engines.scalar.decisions import PIECES, Clock, change_well, finish_impact, is_quiet, set_up
from snapbeam.engines.scalar.physics import contact_energy, tension_energy, tension_factors
from snapbeam.engines.scalar.signals import sign_of

__all__ = ["Now", "Run", "begin", "cut_slot", "finish", "look_slot"]

_OK, _DECIDED, _RUNNING = int(RunStatus.OK), int(RunStatus.DECIDED), int(RunStatus.RUNNING)
_TWO_PI = 2.0 * math.pi


class Run(NamedTuple):
    """What stays the same in a run."""

    struck: Impactor
    """The shaker as seen from the well the run begins in."""
    clock: Clock
    rest_contact: float
    """Displacement of the contact point in that well, seen from the shaker's side."""
    rest_center: float
    finest_look: float
    """Longest piece that a step is looked into by, s."""
    step_pieces: int
    """Such pieces in a flight step."""
    step_time: float
    """Of the flight step, s."""
    coefficients: int
    """Where the prepared steps begin, one for each level from -1 on."""
    slot: int
    """Length of one."""
    spare: int
    """Rows for a look ahead: q, p, k."""


class Now(NamedTuple):
    """Where a run stands."""

    t: int
    """Ticks."""
    q: int
    p: int
    k: int
    q1: int
    p1: int
    k1: int
    home: float
    """+1 in the well the run began in, -1 in the other: the origin of q."""
    stretch: float
    quiet: bool
    """Whether its energy is so low that longer steps serve."""
    w: float
    """Displacement of the contact point, and its rate."""
    wv: float
    d: float
    """Penetration, and its rate."""
    dv: float
    c: float
    """Displacement of the centre, and its rate."""
    cv: float
    touching: bool
    safe_gap: int
    """Until then the gap cannot close."""
    safe_center: int
    """Until then the centre cannot cross."""
    sample: int
    """Instants recorded so far."""
    status: int


@inlined
def cut_slot(run):
    """Where a step of any other length is prepared."""
    return run.coefficients + (run.clock.finest + 2) * run.slot


@inlined
def look_slot(run):
    """Where the flow over one piece of a flight step stands, and after it that over any other piece."""
    return cut_slot(run) + run.slot


@compiled
def begin(memory, blocks, layout, stages, asked, i, limits, counts, numbers):
    """Put run *i* into its place in memory; returns what stays and where it stands."""
    contact_rows, starts, reals, ticks = asked
    contact_row, start = contact_rows[ticks[i, Ticks.CONTACT_ROW]], starts[ticks[i, Ticks.START_ROW]]
    struck, clock, (rest_contact, rest_center) = set_up(
        memory, layout, contact_row, start, reals[i], ticks[i], *limits
    )
    size = layout.size
    slot = (stages.flows + 1) // 2 * 4 * size + 2 * TURNS
    q, p, k = layout.work, layout.work + size, layout.work + 2 * size
    r, coefficients = layout.work + 9 * size, layout.work + 10 * size
    step_time = clock.step * clock.tick
    for level in range(clock.finest + 2):
        prepare(memory, layout, stages, struck, 2.0 * step_time / (1 << level), coefficients + level * slot)
    fastest = struck.omega
    for row in range(size):
        fastest = max(fastest, memory[layout.omega + row])
    finest_look = _TWO_PI / (PIECES * fastest)
    step_pieces = max(4, math.ceil(step_time / finest_look))
    run = Run(
        struck,
        clock,
        rest_contact,
        rest_center,
        finest_look,
        step_pieces,
        step_time,
        coefficients,
        slot,
        q + 6 * size,
    )
    flow_coefficients(memory, layout, step_time / step_pieces, look_slot(run))

    t = counts[Counts.TIME]
    phase = _TWO_PI * ((t % clock.period) / clock.period)
    gq, qr = tension_rows(memory, blocks, layout, q, r)
    along_g, along_r = tension_factors(layout.gamma, gq, qr)
    acceleration_rows(memory, layout, along_g, along_r, r, k)
    w, wv, d, dv, c, cv = observe(memory, layout, struck, phase, q, p)
    w += rest_contact
    c += rest_center
    touching = d > 0.0 or (d == 0.0 and dv > 0.0)
    counts[Counts.TOUCHING], counts[Counts.ONSET] = touching, t
    counts[Counts.SIDE] = sign_of(c, 0)
    numbers[Numbers.MIN_DISPLACEMENT] = numbers[Numbers.MAX_DISPLACEMENT] = w
    numbers[Numbers.MIN_CENTER] = numbers[Numbers.MAX_CENTER] = c
    numbers[Numbers.DEEPEST] = max(d, 0.0)
    status = _RUNNING if t < clock.end else _OK
    q1, p1, k1, stretch = q + 3 * size, p + 3 * size, k + 3 * size, 2.0 * gq + qr
    energy = modal_energy(memory, layout, q, p) + tension_energy(layout.gamma, gq, qr)
    quiet = is_quiet(energy, layout.gamma, layout.stretch)
    now = Now(t, q, p, k, q1, p1, k1, 1.0, stretch, quiet, w, wv, d, dv, c, cv, touching, t, t, 0, status)
    return run, now


@compiled
def finish(memory, blocks, layout, run, now, counts, numbers, outputs):
    """Close a run's book; the state, about the well it began in, goes to its first two work rows."""
    q, p, size, tick = now.q, now.p, layout.size, run.clock.tick
    r = layout.work + 9 * size
    if now.touching:
        finish_impact(counts, numbers, outputs, run.struck.stiffness, now.t, tick)
    if now.status == _DECIDED:
        numbers[Numbers.DECIDED_AT] = now.t * tick
    gq, qr = tension_rows(memory, blocks, layout, q, r)
    numbers[Numbers.ENERGY] = (
        modal_energy(memory, layout, q, p)
        + tension_energy(layout.gamma, gq, qr)
        + contact_energy(run.struck.stiffness, now.d)
    )
    if now.home < 0.0:
        change_well(memory, blocks, layout, now.home, q, now.k, r)
    for row in range(size):
        q_end, p_end = memory[q + row], memory[p + row]
        memory[layout.work + row], memory[layout.work + size + row] = q_end, p_end
    counts[Counts.TIME], counts[Counts.STATUS], counts[Counts.SAMPLES] = now.t, now.status, now.sample
