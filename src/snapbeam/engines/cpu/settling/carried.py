"""A step in which the tip carries a single mode along, up to the release."""

from __future__ import annotations

import math

from snapbeam.core.codes import RunStatus
from snapbeam.engines.cpu.recording import record_held
from snapbeam.engines.cpu.settling.elastic import swap_rows, monitor_energy
from snapbeam.engines.cpu.settling.hold import PANELS, held_for, hold, constraint_force
from snapbeam.engines.cpu.state import IntegratorState, StepControl, cut_slot, phase_at
from snapbeam.engines.cpu.step import Step, observe, prepare, take_step
from snapbeam.engines.cpu.uneven import about_level, at_center
from snapbeam.engines.scalar.compile import compiled, inlined
from snapbeam.engines.scalar.decisions import (
    ContactKinematics,
    contact_level,
    count_zero_crossings_in_step,
    close_impact,
    ticks_of,
    accumulate_displacement,
)
from snapbeam.engines.scalar.extras import observe as observe_extras

__all__ = ["carry"]

_OK, _RUNNING = int(RunStatus.OK), int(RunStatus.INTERRUPTED)
_BISECTIONS = 60


@inlined
def _release_between(memory, blocks, layout, run, tip, phase, low, high):
    """Where between *low* (pushing) and *high* (pulling), s after *phase*, the force vanishes."""
    omega = tip.drive.omega
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        if middle <= low or middle >= high:
            break
        if constraint_force(memory, blocks, layout, run, tip, phase + omega * middle) < 0.0:
            high = middle
        else:
            low = middle
    return low


@compiled
def _release(memory, blocks, layout, run, tip, phase, length):
    """When within *length* the force first has to pull, s; negative if it does not.

    The force is looked at in *PANELS* panels; where it dips between them, its least value is followed.
    """
    piece, omega = length / PANELS, tip.drive.omega
    before = force = constraint_force(memory, blocks, layout, run, tip, phase)
    if force < 0.0:
        return 0.0
    for i in range(1, PANELS + 1):
        after = constraint_force(memory, blocks, layout, run, tip, phase + omega * (i * piece))
        if after < 0.0:
            return _release_between(memory, blocks, layout, run, tip, phase, (i - 1) * piece, i * piece)
        if i > 1 and force < before and force <= after:
            # the least of the parabola through the three
            bend = before - 2.0 * force + after
            if bend > 0.0:
                at = (i - 1 + 0.5 * (before - after) / bend) * piece
                if constraint_force(memory, blocks, layout, run, tip, phase + omega * at) < 0.0:
                    return _release_between(memory, blocks, layout, run, tip, phase, (i - 2) * piece, at)
        before, force = force, after
    return -1.0


@inlined
def carry(memory, blocks, workspace, run, tip, now, step, scratch, accumulators, kernel_input, outputs):
    """Where a run stands after a step in which the tip carries the beam, up to the release if there is one.

    Returns that and the step.
    """
    layout, clock, tick = workspace.layout, run.clock, run.clock.tick
    rest_contact, rest_center = now.well_sign * run.rest_contact, now.well_sign * run.rest_center
    t, seen, control = now.t, now.seen, now.control
    # however strongly it is stretched, a beam that is carried moves no faster than the tip
    left = min((now.landed + 1) * clock.landing, clock.end) - t
    ticks = min(ticks_of(clock, contact_level(clock, (t - accumulators.onset) * tick, 0.0, 0.0)), left)
    ticks = max(1, ticks // 4)
    length = ticks * tick
    release = _release(memory, blocks, layout, run, tip, step.phase, length)
    released = release >= 0.0
    if released:
        length = release
        ticks = min(max(1, math.ceil(release / tick)), ticks)
    impulse, work, gross, dissipated, peak = held_for(memory, blocks, layout, run, tip, step.phase, length)
    step = Step(
        ticks, step.at, length, step.phase, True, step.q, step.p, step.k, step.q1, step.p1, step.k1, step.r
    )
    there = step.phase + tip.drive.omega * length
    sample = now.sample
    if outputs is not None:
        sample = record_held(memory, blocks, layout, run, tip, now, step, accumulators, outputs)
    accumulators.impulse += impulse
    accumulators.work += work
    accumulators.gross_work += gross
    accumulators.dissipated += dissipated
    accumulators.deepest = max(accumulators.deepest, peak)
    _, gq, qr = hold(memory, blocks, layout, tip, there, step.q1, step.p1, step.k1)
    about = observe(memory, layout, tip, there, step.q1, step.p1)
    seen1 = ContactKinematics(about.w + rest_contact, about.wv, 0.0, 0.0, about.c + rest_center, about.cv)
    accumulate_displacement(accumulators, seen, seen1, length)
    # a carried centre moves as the tip does, slowly enough for one cubic
    count_zero_crossings_in_step(
        accumulators, clock, t, length, about_level(layout.uneven, seen), about_level(layout.uneven, seen1), scratch.looked,
        at_center(layout.uneven, rest_center), 0, 0.0,
    )  # fmt: skip
    observe_extras(kernel_input.extras, accumulators, t * tick, length, seen, seen1, True)
    t += ticks
    status = _RUNNING if t < clock.end else _OK
    rows, touching = swap_rows(now.rows), True
    if released:
        touching = False
        after = (t - now.t) * tick - length
        rest = Step(
            0, cut_slot(run), after, there, False, step.q1, step.p1, step.k1,
            step.q, step.p, step.k, step.r,
        )  # fmt: skip
        prepare(memory, layout, workspace.stages, run.struck.drive, after, rest.at)
        done = take_step(memory, blocks, layout, workspace.stages, tip, rest, True)
        gq, qr, rows = done.gq, done.qr, now.rows
        accumulators.dissipated += done.dissipated
        if outputs is None:
            close_impact(accumulators, None, 0, tip.law, t, tick)
        else:
            close_impact(accumulators, outputs.impacts, outputs.marks[1], tip.law, t, tick)
        about = observe(memory, layout, tip, phase_at(run, t), rows.q, rows.p)
        d = min(about.d, 0.0)
        seen1 = ContactKinematics(
            about.w + rest_contact, about.wv, d, about.dv, about.c + rest_center, about.cv
        )
    kernel_output = StepControl(touching, control.quiet, t, t, control.monitor_energy, control.beat)
    state = rows.q, rows.p, gq, qr
    kernel_output, status = monitor_energy(
        memory, layout, run, now, t, state, seen1, kernel_output, released, status, accumulators, kernel_input
    )
    return IntegratorState(
        t, now.well_sign, 2.0 * gq + qr, rows, seen1, kernel_output, sample, now.landed, status
    ), step
