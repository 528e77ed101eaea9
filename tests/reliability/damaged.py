"""Damaged files of every format that a reader takes: refused by name, or read; never another error.

python damaged.py FILES SEED REPORT [SECONDS]
"""

from __future__ import annotations

import collections
import json
import random
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import fuzz
import numpy as np

import snapbeam as sb
from snapbeam.model.parameter_file import load_config
from snapbeam.util.netcdf import read_netcdf


def whole_files(folder: Path) -> dict[str, tuple[bytes, Any]]:
    """Content of a file of each format, and the function that reads it."""
    lab = sb.lab
    run = sb.simulate(fuzz.SYSTEM, fuzz.SHORT)
    run.save(folder / "run.nc")
    signal = lab.make_signal(np.sin(0.3 * np.arange(400.0)), sampling_frequency=1e3, units="m/s")
    found: dict[str, Any] = {"run.nc": sb.load, "result.nc": read_netcdf}
    sb.write_netcdf(fuzz._results()[3], folder / "result.nc")
    np.savetxt(folder / "signal.csv", np.column_stack([signal.time, signal.values]), delimiter=",")
    np.save(folder / "signal.npy", np.asarray(signal.values))
    np.savez(folder / "signal.npz", time=signal.time, velocity=signal.values)
    # MATLAB files are left out: SciPy's reader ends the process with a segmentation fault on some of them
    for name in ("signal.csv", "signal.npy", "signal.npz"):
        found[name] = lambda path: lab.read_signal(path, sampling_frequency=1e3, units="m/s")
    lab.write_video(
        folder / "video.avi", np.random.default_rng(1).integers(0, 255, (3, 32, 32)).astype(np.uint8)
    )
    found["video.avi"] = lambda path: lab.open_recording(path, frame_rate=1e4, pixel_size=1e-5)
    (folder / "system.toml").write_text(
        'extends = "paper"\n[beam]\nlength = "161 mm"\n[drive]\nfrequency_ratio = 1.2\n'
    )
    found["system.toml"] = load_config
    return {name: ((folder / name).read_bytes(), reader) for name, reader in found.items()}


def damaged(whole: bytes, draw: random.Random) -> bytes:
    """Content with some bytes changed, removed, doubled, or cut."""
    content = bytearray(whole)
    for _ in range(draw.choice((1, 3, 10, 40))):
        at, kind = draw.randrange(len(content) or 1), draw.randrange(5)
        if kind == 0:
            content[at : at + 1] = bytes([draw.randrange(256)])
        elif kind == 1:
            content[at : at + 8] = draw.choice((b"\xff" * 8, b"\0" * 8, b"9" * 8, b"-1e308,\n"))
        elif kind == 2:
            del content[at : at + draw.choice((1, 8, 200))]
        elif kind == 3:
            content[at:at] = content[at : at + draw.choice((1, 8, 200))]
        elif len(content) > 20 and draw.random() < 0.2:
            del content[at:]
    return bytes(content)


def fuzz_files(
    files: int, seed: int, seconds: float = float("inf")
) -> tuple[dict[str, int], dict[str, list[str]]]:
    """Read so many damaged files; returns their numbers by format, and what went wrong."""
    draw, start = random.Random(seed), time.monotonic()
    made: dict[str, int] = collections.Counter()
    wrong: dict[str, list[str]] = collections.defaultdict(list)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        whole = whole_files(folder)
        while sum(made.values()) < files and time.monotonic() - start < seconds:
            each = draw.choice(list(whole))
            path = folder / f"damaged{Path(each).suffix}"
            path.write_bytes(content := damaged(whole[each][0], draw))
            made[each] += 1
            if said := fuzz.judged(whole[each][1], [path], {}):
                wrong[f"{each}: {said}"].append(content[:4000].hex())
    return dict(made), dict(wrong)


if __name__ == "__main__":
    fuzz._limit_memory(4.0)
    report = Path(sys.argv[3]).absolute()
    made, wrong = fuzz_files(int(sys.argv[1]), int(sys.argv[2]), *map(float, sys.argv[4:]))
    report.write_text(
        json.dumps({"files": made, "wrong": {name: len(each) for name, each in wrong.items()}}, indent=1)
    )
