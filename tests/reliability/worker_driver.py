"""Computes maps on a cluster whose workers are killed at random instants, and looks at what came of each.

python worker_driver.py FOLDER MAPS KILLS SEED
"""

from __future__ import annotations

import faulthandler
import json
import os
import random
import signal
import sys
import threading
import time
from pathlib import Path

import numpy as np

import snapbeam as sb
from snapbeam.sweeps.checkpoint.store import Checkpoint
from snapbeam.sweeps.compute import CheckpointOptions, CheckpointRunner, SweepReport
from snapbeam.sweeps.distributed import ClusterWorkers, open_client, parse_cluster
from snapbeam.sweeps.tasks import MemoryRunner, PointWork, Stage

sys.path.insert(0, str(Path(__file__).parents[1]))
from small_map import setup_of

CHUNK = 4
LONGEST = 180.0
"""Seconds after which a map counts as one that hangs."""
BEAM = sb.Beam(
    length=0.161, thickness=0.4e-3, width=15e-3, density=7800.0, young_modulus=200e9, buckling_level=0.335e-3
)
ASKED = {
    "model": sb.ReducedModel.from_beam(BEAM, modes=1),
    "contact": sb.HertzContact(stiffness=4e8),
    "cycles": 3,
    "frequency_ratio": np.linspace(0.5, 2.0, 8),
    "velocity_amplitude": np.linspace(0.05, 0.6, 12),
}


def compute(store, work, stage, client, said):
    """One map, and again what was given up, as somebody would; leaves the rows or the error in *said*."""
    try:
        for _ in range(4):
            report = SweepReport()
            with Checkpoint(store, work, CHUNK) as held:
                options = CheckpointOptions(store, note=lambda _: None, report=report)
                rows = CheckpointRunner(held, ClusterWorkers(client, lambda _: None), options).complete(stage)
                found = rows.read(0, stage.size).content_hash()
            said["given up"] = said.get("given up", 0) + len(report.failed)
            if not report.failed:
                said["hash"] = found
                return
    except BaseException as error:
        said["raised"] = f"{type(error).__name__}: {error}"


def main(folder, maps, kills, seed):
    """Compute *maps* maps under *kills* kills and print what was seen as JSON."""
    faulthandler.register(signal.SIGUSR1, all_threads=True)
    work = PointWork(setup_of(**ASKED))
    grid = work.setup.points
    stage = Stage("base", grid, CHUNK)
    wanted = MemoryRunner(work, 1).complete(Stage("base", grid, grid.size)).read(0, grid.size).content_hash()
    draw = random.Random(seed)
    seen = {"maps": 0, "kills": 0, "hung": 0, "differ": 0, "raised": 0, "given up": 0, "texts": []}
    with open_client(parse_cluster("local:2")) as client:
        processes = client.run(os.getpid)
        for number in range(maps):
            share = -(-kills * (number + 1) // maps) - seen["kills"]
            said = {}
            thread = threading.Thread(
                target=compute, args=(folder / f"store-{number}", work, stage, client, said), daemon=True
            )
            thread.start()
            start = time.monotonic()
            while thread.is_alive() and time.monotonic() - start < LONGEST:
                thread.join(draw.uniform(0.0, 0.6))
                if not share or not thread.is_alive():
                    continue
                living = [nanny.process for nanny in client.cluster.workers.values() if nanny.process]
                living = [each.process.pid for each in living if each.process and each.process.is_alive()]
                if living:
                    os.kill(draw.choice(living), signal.SIGKILL)
                    seen["kills"] += 1
                    share -= 1
            seen["maps"] += 1
            seen["given up"] += said.get("given up", 0)
            if thread.is_alive():
                seen["hung"] += 1
            elif "raised" in said:
                seen["raised"] += 1
                seen["texts"].append(said["raised"])
            else:
                seen["differ"] += said.get("hash") != wanted
            print(json.dumps(seen), flush=True)
    del processes


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]), int(sys.argv[4]))
