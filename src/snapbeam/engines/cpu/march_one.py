"""The CPU engine's march of one run that is recorded: in slices, so that it can be watched, stopped and drained."""

from __future__ import annotations

from snapbeam.core.codes import RunStatus
from snapbeam.engines.cpu.march import propose_step
from snapbeam.engines.cpu.recording import has_room, save_state, restore_state
from snapbeam.engines.cpu.settling.after import accept_any_step
from snapbeam.engines.cpu.state import Workspace, begin, finish, run_of
from snapbeam.engines.cpu.step import take_step
from snapbeam.engines.cpu.strikers.meet import close_further_contacts
from snapbeam.engines.scalar.compile import compiled
from snapbeam.engines.scalar.tip import seen_from

__all__ = ["integrate_recorded"]

_RUNNING = int(RunStatus.INTERRUPTED)


@compiled
def integrate_recorded(
    memory, blocks, layout, stages, kernel_input, scratch, accumulators, outputs, aside, budget
):
    """March the first run until it ends, *outputs* are full or *budget* steps are taken.

    *aside* is a pair of arrays in which the run is laid aside; the first integer there, if negative, says that
    it has not begun.
    """
    workspace, (marks, reals) = Workspace(layout, stages), aside
    if marks[0] < 0:
        run, now = begin(memory, blocks, workspace, kernel_input, 0, accumulators)
    else:
        now = restore_state(marks, reals)
        run = run_of(memory, layout, stages, kernel_input, 0)
    left = budget
    while now.status == _RUNNING and left > 0 and has_room(now, accumulators, outputs):
        left -= 1
        now, step = propose_step(memory, blocks, workspace, run, now, accumulators)
        tip = seen_from(run.struck, now.well_sign, run.rest_contact)
        done = take_step(memory, blocks, layout, stages, tip, step, True)
        now, _ = accept_any_step(
            memory, blocks, workspace, run, now, step, done, scratch, accumulators, kernel_input, outputs
        )
    if now.status != _RUNNING:
        close_further_contacts(memory, layout.others, accumulators, outputs, now.t, run.clock.tick)
        finish(memory, blocks, layout, run, now, accumulators, outputs.impacts, outputs.marks[1], False)
    accumulators.time, accumulators.status, accumulators.samples = now.t, now.status, now.sample
    save_state(now, marks, reals)
