"""Has three processes write one store at the same time, again and again, and looks at what came of it.

Run as a program: a process that has everything loaded forks three children that are let go within a few milliseconds
of each other; each says how it ended.

    python race_driver.py FOLDER RACES SEED
"""

from __future__ import annotations

import json
import os
import random
import re
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

WRITERS = 3
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


def write(store, gate, answer, pause):
    """Wait for the gate to be shut, then for *pause* seconds; compute the map and say how it ended."""
    os.read(gate, 1)
    time.sleep(pause)
    try:
        swept(**ASKED, path=store, points_per_task=3, threads=1)
        said = {"ended": "written"}
    except sb.CheckpointError as error:
        said = {"ended": "refused", "text": str(error)}
    except BaseException as error:
        said = {"ended": "died", "text": f"{type(error).__name__}: {error}"}
    os.write(answer, (json.dumps(said | {"process": os.getpid()}) + "\n").encode())


def race(store, pauses):
    """Let so many writers go at one store; returns what each said."""
    gate, shut = os.pipe()
    heard, answer = os.pipe()
    children = []
    for pause in pauses:
        child = os.fork()
        if child == 0:
            os.close(shut)
            try:
                write(store, gate, answer, pause)
            finally:
                os._exit(0)
        children.append(child)
    for end in (gate, shut, answer):
        os.close(end)
    for child in children:
        os.waitpid(child, 0)
    with os.fdopen(heard) as stream:
        return children, [json.loads(line) for line in stream]


def main(folder, races, seed):
    """Run *races* races and print what was seen as JSON."""
    work = PointWork(setup_of(**ASKED))
    grid = work.setup.points
    wanted = MemoryRunner(work, 1).complete(Stage("base", grid, grid.size)).read(0, grid.size).content_hash()
    stage, draw = Stage("base", grid, 3), random.Random(seed)
    seen = dict.fromkeys(("races", "written", "refused", "died", "silent", "nobody", "unnamed", "wrong"), 0)
    seen["texts"] = []
    for number in range(races):
        store = folder / f"store-{number}"
        children, said = race(store, [draw.uniform(0.0, 0.03) for _ in range(WRITERS)])
        seen["races"] += 1
        seen["silent"] += WRITERS - len(said)
        for each in said:
            seen[each["ended"]] += 1
            if each["ended"] == "refused":
                holder = re.search(r"another process is writing it \(process (\d+)\)", each["text"])
                seen["unnamed"] += holder is None or int(holder[1]) not in children
            elif each["ended"] == "died":
                seen["texts"].append(each["text"])
        seen["nobody"] += not any(each["ended"] == "written" for each in said)
        with Checkpoint(store, work) as held:
            held.open_stage(stage)
            whole = not held.pending(stage) and not held.damaged
            seen["wrong"] += not whole or held.reader(stage).read(0, grid.size).content_hash() != wanted
    print(json.dumps(seen))


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))
