"""Kills a map that is being computed, again and again, and looks at what its store holds after each time.

Run as a program: a process that has everything loaded forks a child that computes the map, kills it with
SIGKILL at a random instant, and forks another that opens the store and says what it finds.

    python kill_driver.py FOLDER KILLS SEED
"""

from __future__ import annotations

import json
import os
import random
import signal
import sys
import time
from pathlib import Path

import numpy as np
import zarr.storage  # noqa: F401  (loaded before the first fork, so that a child starts at once)

import snapbeam as sb
from snapbeam.sweeps.checkpoint.store import Checkpoint
from snapbeam.sweeps.tasks import MemoryRunner, PointWork, Stage

sys.path.insert(0, str(Path(__file__).parents[1]))
from small_map import setup_of, swept

CHUNK = 3
BEAM = sb.Beam(
    length=0.161, thickness=0.4e-3, width=15e-3, density=7800.0, young_modulus=200e9, buckling_level=0.335e-3
)
ASKED = {
    "model": sb.ReducedModel.from_beam(BEAM, modes=1),
    "contact": sb.HertzContact(stiffness=4e8),
    "cycles": 2,
    "frequency_ratio": np.linspace(0.5, 2.0, 6),
    "velocity_amplitude": np.linspace(0.05, 0.6, 8),
}


def in_child(work, *arguments):
    """Fork, do *work* in the child and end it at once; return the child's number."""
    child = os.fork()
    if child == 0:
        status = 1
        try:
            work(*arguments)
            status = 0
        finally:
            os._exit(status)
    return child


def compute(store, trace):
    """Compute the map, leaving a byte in *trace* for each task begun."""
    begin = PointWork.compute

    def counted(self, *arguments):
        os.write(trace, b".")
        return begin(self, *arguments)

    PointWork.compute = counted
    swept(**ASKED, path=store, points_per_task=CHUNK, threads=1)


def look(store, work, stage, answer):
    """Say which tasks are done, with the hashes of their data as read back, and which are damaged."""
    with Checkpoint(store, work) as held:
        held.open_stage(stage)
        pending = set(held.pending(stage))
        done = {
            task: held.reader(stage).read(*stage.bounds(task)).content_hash()
            for task in range(stage.tasks)
            if task not in pending
        }
        found = {"done": done, "damaged": held.damaged_in(stage), "torn": held.task_log.torn}
    os.write(answer, json.dumps(found).encode())


def main(folder, kills, seed):
    """Kill *kills* times and print what was seen as JSON."""
    work = PointWork(setup_of(**ASKED))
    grid = work.setup.points
    stage = Stage("base", grid, CHUNK)
    whole = MemoryRunner(work, 1).complete(Stage("base", grid, grid.size))
    wanted = {task: whole.read(*stage.bounds(task)).content_hash() for task in range(stage.tasks)}
    draw = random.Random(seed)
    seen = {"kills": 0, "maps": 0, "lost": 0, "changed": 0, "wrong": 0, "damaged": 0, "begun": 0, "needed": 0}
    seen |= {"torn": 0, "surplus": 0}
    longest = 0.5
    while seen["kills"] < kills:
        store, before, killed = folder / f"store-{seen['maps']}", {}, 0
        trace_read, trace = os.pipe()
        while len(before) < stage.tasks:
            start = time.monotonic()
            child = in_child(compute, store, trace)
            time.sleep(draw.uniform(0.0, longest))
            ended, status = os.waitpid(child, os.WNOHANG)
            if ended == 0:
                os.kill(child, signal.SIGKILL)
                os.waitpid(child, 0)
                killed += 1
            else:
                assert status == 0, "the map failed"
                longest = max(0.05, 0.9 * (time.monotonic() - start))
            if not (store / "map.json").exists():
                continue
            answer_read, answer = os.pipe()
            _, status = os.waitpid(in_child(look, store, work, stage, answer), 0)
            assert status == 0, "the store could not be opened"
            found = json.loads(os.read(answer_read, 1 << 20))
            for end in (answer_read, answer):
                os.close(end)
            now = {int(task): content for task, content in found["done"].items()}
            seen["lost"] += len(before.keys() - now.keys())
            seen["changed"] += sum(now[task] != before[task] for task in before.keys() & now.keys())
            seen["wrong"] += sum(content != wanted[task] for task, content in now.items())
            seen["damaged"] += len(found["damaged"])
            seen["torn"] += found["torn"] > 0
            before = now
        os.close(trace)
        begun = len(os.read(trace_read, 1 << 16))
        os.close(trace_read)
        seen["surplus"] += max(0, begun - stage.tasks - killed)
        seen["begun"] += begun
        seen["needed"] += stage.tasks
        seen["kills"] += killed
        seen["maps"] += 1
    print(json.dumps(seen))


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))
