"""Kills a computation at each of its writes to a checkpoint, in turn, and resumes it: ``python write_killer.py FOLDER KIND``.

Run as a program, since forks go before threads.  Prints as JSON how often it was killed, and what was not as it should be.
"""

from __future__ import annotations

import json
import os
import pickle
import signal
import sys
from contextlib import suppress
from pathlib import Path

import numpy as np
import xarray as xr
import zarr.storage  # noqa: F401  (loaded before the first fork, so that a child starts at once)

import snapbeam as sb
from snapbeam.model import default_values

SYSTEM = sb.System(
    sb.ReducedModel.from_beam(default_values.BEAM, modes=1),
    contacts=[sb.Contact(default_values.CONTACT, sb.Shaker(frequency_ratio=1.0, velocity_amplitude=0.2))],
)  # fmt: skip
HOW = sb.Integration(cycles=3, threads=1)
RATIOS, VELOCITIES = np.linspace(0.4, 2.0, 4), np.linspace(0.05, 0.6, 3)
AXES = {"drive.frequency_ratio": RATIOS, "drive.velocity_amplitude": VELOCITIES}
LIST = xr.Dataset({name: ("point", np.resize(values, 8)) for name, values in AXES.items()})
MORE = AXES | {"drive.frequency_ratio": np.linspace(0.4, 2.0, 7)}


def kept(store):
    return None if store is None else sb.CheckpointOptions(store, points_per_task=4)


def extended(store):
    """A map, and the same with more values of an axis."""
    with suppress(sb.InputError):  # a checkpoint that is extended already
        sb.sweep(SYSTEM, AXES, HOW, checkpoint=kept(store))
    return sb.sweep(SYSTEM, MORE, HOW, checkpoint=kept(store))


KINDS = {
    "map": lambda store: sb.sweep(SYSTEM, AXES, HOW, checkpoint=kept(store)),
    "list": lambda store: sb.sweep(SYSTEM, LIST, HOW, checkpoint=kept(store)),
    "refined": lambda store: sb.sweep(SYSTEM, AXES, HOW, checkpoint=kept(store), refine_levels=1),
    "repeats": lambda store: sb.sweep(SYSTEM, AXES, HOW, checkpoint=kept(store), replicates=2),
    "extended": extended,
}


def in_child(work, answer=None):
    """Fork and do *work* there; what it gives is pickled.  Returns the status as ``waitpid`` has it."""
    child = os.fork()
    if child == 0:
        status = 1
        try:
            found = work()
            if answer is not None:
                answer.write_bytes(pickle.dumps(found))
            status = 0
        finally:
            os._exit(status)
    return os.waitpid(child, 0)[1]


def doomed(make, store, number):
    """Compute until the write of a number is on the disk; then SIGKILL."""
    sync, made = os.fsync, [0]

    def counted(handle):
        sync(handle)
        made[0] += 1
        if made[0] == number:
            os.kill(os.getpid(), signal.SIGKILL)

    os.fsync = counted
    make(store)


def main(folder, kind):
    make, wrong, kills = KINDS[kind], [], 0
    whole = make(None)
    while True:
        store = folder / f"{kills + 1}"
        status = in_child(lambda at=store, number=kills + 1: doomed(make, at, number))
        if status == 0:
            break
        if not (os.WIFSIGNALED(status) and os.WTERMSIG(status) == signal.SIGKILL):
            wrong.append(f"write {kills + 1}: status {status}")
            break
        kills += 1
        answer = folder / f"{kills}.answer"
        if in_child(lambda at=store: make(at).load(), answer) != 0:
            wrong.append(f"write {kills}: was not resumed")
        elif not pickle.loads(answer.read_bytes()).equals(whole):
            wrong.append(f"write {kills}: other results")
        elif list(store.rglob("*.partial")):
            wrong.append(f"write {kills}: a partial file was left")
    print(json.dumps({"kills": kills, "wrong": wrong}))


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2])
