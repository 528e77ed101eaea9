"""Commands with few descriptors, little memory, a folder of the user that cannot be written, a clock that jumps, and forks.

Each is forked from a process that has imported them.  It succeeds with the right numbers, or ends with a line and without
an incomplete file; a second start without limits goes on from the checkpoint.

    python limits.py COMMANDS SEED
"""

from __future__ import annotations

import collections
import json
import os
import random
import resource
import shutil
import sys
import tempfile
import threading
import time
import traceback
from importlib import import_module
from pathlib import Path

import xarray as xr

from snapbeam.__main__ import main
from snapbeam.util.memory_limit import _used

GRID = ["--frequency-ratio", "0.9:1.3:3", "--velocity-amplitude", "0.1:0.3:3", "--threads", "1"]
COMMANDS = {
    "simulate": ["simulate", "--modes", "1", "--cycles", "9", "--plot", "a.png", "-o", "a.nc"],
    "stream": ["simulate", "--modes", "1", "--cycles", "9", "--stream", "-o", "a.nc"],
    "map": ["map", "--modes", "1", "--cycles", "9", *GRID, "--points-per-task", "2", "--checkpoint", "s", "-o", "a.nc"],
    "threshold": ["threshold", "--modes", "1", "--cycles", "9", *GRID, "-o", "a.nc"],
    "equilibria": ["equilibria", "--modes", "2"],
}
KINDS = ("descriptors", "memory", "home", "clock", "forks")


def _limit(kind: str, draw: random.Random) -> None:
    if kind == "descriptors":
        used = len(os.listdir("/proc/self/fd"))
        resource.setrlimit(resource.RLIMIT_NOFILE, (used + draw.randrange(20), 4096))
    elif kind == "memory":
        most = _used() + draw.randrange(200_000_000)
        resource.setrlimit(resource.RLIMIT_AS, (most, resource.RLIM_INFINITY))
    elif kind == "home":
        place = draw.choice(("/proc/sys", "/dev/null/none", "/nowhere", "", "\udcff"))
        os.environ.update(HOME=place, XDG_CACHE_HOME=place, XDG_CONFIG_HOME=place)
    elif kind == "clock":
        true, most = time.time, draw.choice((1.0, 1e5, 1e9))
        time.time = lambda: true() + draw.uniform(-most, most)
    else:
        threading.Thread(target=_forks, args=(draw.uniform(0.0, 0.05),), daemon=True).start()


def _forks(pause: float) -> None:
    """Children that end at once, from a thread beside the command."""
    while True:
        time.sleep(pause)
        if not (child := os.fork()):
            os._exit(0)
        os.waitpid(child, 0)


def run(words: list[str], folder: Path, kind: str = "", draw: random.Random | None = None) -> tuple[int, str]:
    """Run a command in *folder*; its status and what it wrote to the standard error."""
    if not (child := os.fork()):
        os.chdir(folder)
        for stream in (1, 2):
            os.dup2(os.open(f"{folder}.{stream}", os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), stream)
        if kind:
            _limit(kind, draw)
        sys.argv[:] = ["snapbeam", *words]
        code: object = 0
        try:
            main()
        except SystemExit as ended:
            code = ended.code or 0
        except BaseException:
            code = traceback.format_exc()
        if isinstance(code, str):
            os.write(2, code.encode() + b"\n")
        sys.stdout.flush()
        os._exit(code if isinstance(code, int) else 1)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    return code, Path(f"{folder}.2").read_text(encoding="utf-8", errors="replace")


def same(one: Path, other: Path) -> bool:
    """Equal numbers of two files."""
    with xr.open_dataset(one, engine="h5netcdf") as first, xr.open_dataset(other, engine="h5netcdf") as second:
        return first.drop_vars("run_time", errors="ignore").equals(second.drop_vars("run_time", errors="ignore"))


def tried(commands: int, seed: int) -> dict[str, object]:
    """Counts by kind and status, and what went wrong."""
    draw, seen, wrong = random.Random(seed), collections.Counter(), []
    for name in ("simulate", "map", "threshold", "equilibria"):
        import_module(f"snapbeam.cli.{name}")
    with tempfile.TemporaryDirectory() as place:
        for name, words in COMMANDS.items():
            (folder := Path(place) / name).mkdir()
            assert run(words, folder)[0] == 0
        for number in range(commands):
            kind, name = KINDS[number % len(KINDS)], draw.choice(list(COMMANDS))
            (folder := Path(place) / str(number)).mkdir()
            state = draw.getstate()
            code, said = run(COMMANDS[name], folder, kind, draw)
            draw.setstate(state)
            draw.random()
            left = {each.name for each in folder.iterdir()} - {"s"}
            seen[f"{kind}: status {code}"] += 1
            good = "Traceback" not in said and code in (0, 1) and (code == 0) == (not said.startswith("error"))
            good &= left <= {"a.nc", "a.png"} and (code == 0 or bool(said.strip()))
            if name == "map" and code:
                good &= run(COMMANDS[name], folder)[0] == 0
            if name != "equilibria" and (code == 0 or name == "map"):
                good &= same(folder / "a.nc", Path(place) / name / "a.nc")
            if not good:
                wrong.append([number, kind, name, code, sorted(left), said[-1500:]])
            shutil.rmtree(folder)
    return {"seen": dict(sorted(seen.items())), "wrong": wrong}


if __name__ == "__main__":
    print(json.dumps(tried(int(sys.argv[1]), int(sys.argv[2]))))
