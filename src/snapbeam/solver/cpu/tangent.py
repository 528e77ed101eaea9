"""The tangent flow: small changes of the state, carried along by the very steps that a run takes.

A step is a composition of kicks and exact linear flows; its derivative, at the lengths of step that were taken, is the
composition of theirs.  A kick by the tension's acceleration k(q) and the contact's force f(d) changes by

    delta k = -2 gamma (r.dq) g - 2 gamma (g.dq + r.dq) r - gamma (2 g.q + q.r) G dq,    r = G q,
    delta f = -f'(d) c.dq   of every striker that touches,

so each kick is a shear and each flow contracts by what damping takes: the sum of all exponents is exact.  The laws of
contact that are let in here have a force without a jump, so that nothing else happens where contact begins and ends.
"""

from __future__ import annotations

from snapbeam.solver.compilation import compiled
from snapbeam.solver.contact_force import contact_force, contact_slope
from snapbeam.solver.cpu.contact_dispatch import accept_step_by_law
from snapbeam.solver.cpu.indentation import tip_at
from snapbeam.solver.cpu.integrate import propose_step, store_state
from snapbeam.solver.cpu.mode_lanes import acceleration_rows, flow_rows, kick_rows, tension_rows
from snapbeam.solver.cpu.state import Workspace, begin, finish, variable_slot
from snapbeam.solver.cpu.step import prepare, take_step
from snapbeam.solver.cpu.terms.further_contacts import (
    kick_tangent_by_further_contacts,
    linearise_further_contacts,
    note_touching,
)
from snapbeam.solver.excitation import tip_motion
from snapbeam.solver.physics import tension_factors
from snapbeam.solver.simd import WIDTH, dot, fma, load, store
from snapbeam.solver.terms.interface import add_to_tension, update_forces
from snapbeam.util.status_codes import RunStatus

_RUNNING = int(RunStatus.INTERRUPTED)
TANGENT_ROWS = 8
"""Rows beside the tangents themselves: the state of the step that is gone through again, and room."""


@compiled
def _kick_tangent(memory, layout, weight, along_r, slope, r, dq, dp, dr, gdq, rdq):
    """Change a tangent's velocity by a kick."""
    gamma, size = layout.gamma, layout.size
    push = -slope * dot(memory, size, layout.contact, dq)
    kick_tangent_by_further_contacts(memory, size, layout.others, weight, dq, dp)
    of_g, of_r = -2.0 * gamma * rdq, -2.0 * gamma * (gdq + rdq)
    for row in range(0, size, WIDTH):
        change = fma(of_g, load(memory, layout.g + row), of_r * load(memory, r + row))
        change = fma(along_r, load(memory, dr + row), change)
        change = fma(push, load(memory, layout.contact + row), change)
        store(memory, dp + row, fma(weight, change, load(memory, dp + row)))


@compiled
def carry_tangents(memory, blocks, workspace, run, tip, step, first, count):
    """Go through a step again, with the *count* tangents that stand from row *first* on."""
    layout, stages, size = workspace.layout, workspace.stages, workspace.layout.size
    if step.at == variable_slot(run):
        prepare(memory, layout, stages, run.tip.drive, step.length, step.at)
    q, p, k, r = first - 4 * size, first - 3 * size, first - 2 * size, first - size
    dr = first - 5 * size
    for row in range(size):
        memory[q + row], memory[p + row] = memory[step.q + row], memory[step.p + row]
    for stage in range(stages.flows + 1):
        weight = memory[stages.kick + stage] * step.length
        gq, qr = tension_rows(memory, blocks, layout, q, r)
        along_g, along_r = tension_factors(layout.gamma, gq, qr)
        at = step.phase + memory[stages.elapsed + stage] * step.length * tip.drive.omega
        update_forces(memory, size, layout.terms, tip.drive, at, q)
        along_g, along_r = add_to_tension(memory, layout.terms, along_g, along_r)
        force, slope = 0.0, 0.0
        if step.touching:
            now = step.phase + memory[stages.elapsed + stage] * step.length * tip.drive.omega
            motion, _ = tip_motion(tip.drive, memory, now)
            penetration = tip.offset + motion - dot(memory, size, layout.contact, q)
            force, slope = contact_force(tip.law, penetration), contact_slope(tip.law, penetration)
        linearise_further_contacts(memory, size, layout.others, tip.drive, at, q)
        for i in range(count):
            dq, dp = first + 2 * i * size, first + (2 * i + 1) * size
            gdq, _ = tension_rows(memory, blocks, layout, dq, dr)
            rdq = dot(memory, size, r, dq)
            _kick_tangent(memory, layout, weight, along_r, slope, r, dq, dp, dr, gdq, rdq)
        acceleration_rows(memory, layout, along_g, along_r, r, k)
        kick_rows(memory, layout, weight, k, force, p, p)
        if stage == stages.flows:
            break
        flow = step.at + min(stage, stages.flows - 1 - stage) * 4 * size
        flow_rows(memory, size, flow, q, p, q, p)
        for i in range(count):
            dq, dp = first + 2 * i * size, first + (2 * i + 1) * size
            flow_rows(memory, size, flow, dq, dp, dq, dp)


@compiled
def integrate_tangent(
    memory, blocks, layout, stages, kernel_input, which, scratch, kernel_output, tangents, first
):
    """Integrate the runs *which* one after the other, with their tangents, shape (runs, k, 2 rows), from row *first* on.

    Tangents are handed out as they are at the end of a run.
    """
    workspace, size, count = Workspace(layout, stages), layout.size, tangents.shape[1]
    for i in which:
        accumulators = kernel_output.accumulators_of_runs[i]
        run, now = begin(memory, blocks, workspace, kernel_input, i, accumulators)
        for j in range(count):
            for row in range(2 * size):
                memory[first + 2 * j * size + row] = tangents[i, j, row]
        while now.status == _RUNNING:
            if kernel_output.stop_flag[0] != 0:
                accumulators.time, accumulators.status = now.t, _RUNNING
                return
            before = now.t
            now, step = propose_step(memory, blocks, workspace, run, now, accumulators)
            note_touching(memory, layout.others)
            well_sign = now.well_sign
            tip = tip_at(memory, layout, run, well_sign, now.rows.q)
            done = take_step(memory, blocks, layout, stages, tip, step, None)
            now, step = accept_step_by_law(
                memory, blocks, workspace, run, now, step, done, scratch, accumulators, kernel_input, None
            )
            if now.t > before:
                carry_tangents(memory, blocks, workspace, run, tip, step, first, count)
            now = store_state(memory, blocks, layout, run, now, accumulators, i, kernel_output)
        finish(memory, blocks, layout, run, now, accumulators, None, 0, True)
        for j in range(count):
            for row in range(2 * size):
                tangents[i, j, row] = memory[first + 2 * j * size + row]
