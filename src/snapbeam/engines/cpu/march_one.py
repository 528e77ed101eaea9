"""The CPU engine's march of one run that is recorded: in slices, so that it can be watched, stopped and drained."""

from __future__ import annotations

from snapbeam.core.codes import RunStatus
from snapbeam.engines.cpu.march import choose
from snapbeam.engines.cpu.recording import has_room, lay_aside, take_up
from snapbeam.engines.cpu.settling.after import after_step
from snapbeam.engines.cpu.state import Place, begin, finish, run_of
from snapbeam.engines.cpu.step import take_step
from snapbeam.engines.cpu.strikers.meet import close_others
from snapbeam.engines.scalar.compile import compiled
from snapbeam.engines.scalar.tip import seen_from

__all__ = ["march_one"]

_RUNNING = int(RunStatus.RUNNING)


@compiled
def march_one(memory, blocks, layout, stages, asked, room, book, outputs, aside, budget):
    """March the first run until it ends, *outputs* are full or *budget* steps are taken.

    *aside* is a pair of arrays in which the run is laid aside; the first integer there, if negative, says that
    it has not begun.
    """
    place, (marks, reals) = Place(layout, stages), aside
    if marks[0] < 0:
        run, now = begin(memory, blocks, place, asked, 0, book)
    else:
        now = take_up(marks, reals)
        run = run_of(memory, layout, stages, asked, 0)
    left = budget
    while now.status == _RUNNING and left > 0 and has_room(now, book, outputs):
        left -= 1
        now, step = choose(memory, blocks, place, run, now, book)
        tip = seen_from(run.struck, now.home, run.rest_contact)
        done = take_step(memory, blocks, layout, stages, tip, step, True)
        now, _ = after_step(memory, blocks, place, run, now, step, done, room, book, asked, outputs)
    if now.status != _RUNNING:
        close_others(memory, layout.others, book, outputs, now.t, run.clock.tick)
        finish(memory, blocks, layout, run, now, book, outputs.impacts, outputs.marks[1], False)
    book.time, book.status, book.samples = now.t, now.status, now.sample
    lay_aside(now, marks, reals)
