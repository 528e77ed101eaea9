"""Damaged files of every format that a reader takes: refused by name, or read; never another error.

python damaged.py FILES SEED REPORT [SECONDS [END_OF_NAMES]]
"""

from __future__ import annotations

import collections
import json
import random
import shutil
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import fuzz
import numpy as np
import tifffile
from PIL import Image
from scipy.io import savemat

sys.path.append(str(Path(__file__).parents[1] / "lab"))
from cine_file import write_cine

import snapbeam as sb
from snapbeam.model.parameter_file import load_config
from snapbeam.util.netcdf import read_netcdf

_WRITTEN = (".csv", ".wav", ".uff", ".tdms", ".h5", ".npz")
"""Kinds of files of signals that the package writes."""


def whole_files(folder: Path) -> dict[str, Any]:
    """Write a file or folder of each format; returns the function that reads it, by name."""
    lab = sb.lab
    draw = np.random.default_rng(1)
    run = sb.simulate(fuzz.SYSTEM, fuzz.SHORT)
    run.save(folder / "run.nc")
    sb.write_netcdf(fuzz._results()[3], folder / "result.nc")
    found: dict[str, Any] = {"run.nc": sb.load, "result.nc": read_netcdf}
    axes = {"drive.frequency_ratio": [0.9, 1.0], "drive.velocity_amplitude": [0.1, 0.2]}
    sb.sweep(fuzz.SYSTEM, axes, fuzz.SHORT, checkpoint=sb.CheckpointOptions(folder / "sweep.checkpoint"))
    found["sweep.checkpoint"] = sb.read_checkpoint

    signal = lab.make_signal(np.sin(0.3 * np.arange(400.0)), sampling_frequency=1e3, units="m/s")
    for suffix in _WRITTEN:
        lab.write_signal(folder / f"signal{suffix}", signal, full_scale=2.0 if suffix == ".wav" else None)
    np.save(folder / "signal.npy", np.asarray(signal.values))
    arrays = {"time": signal.time.values, "velocity": signal.values}
    savemat(folder / "plain.mat", arrays)
    savemat(folder / "nested.mat", {"s": arrays | {"units": "m/s"}, "c": np.array([1, "a"], dtype=object)})
    savemat(folder / "compressed.mat", {"s": arrays}, do_compression=True)
    (folder / "signal.lvm").write_text(
        "LabVIEW Measurement\nSeparator\tTab\nDecimal_Separator\t.\n***End_of_Header***\nChannels\t1\nSamples\t400\n"
        "Y_Unit_Label\tm/s\nDelta_X\t0.001\nX0\t0\n***End_of_Header***\nX_Value\tVelocity\tComment\n"
        + "".join(f"{k * 1e-3:.3f}\t{v:.9f}\n" for k, v in enumerate(signal.values))
    )
    names = [f"signal{suffix}" for suffix in (*_WRITTEN, ".npy", ".lvm")]
    for name in (*names, "plain.mat", "nested.mat", "compressed.mat"):
        found[name] = lambda path: lab.read_channels(path, sampling_frequency=1e3)

    frames = draw.integers(0, 255, (3, 32, 32)).astype(np.uint8)
    lab.write_video(folder / "video.avi", frames)
    tifffile.imwrite(folder / "frames.tif", frames)
    tifffile.imwrite(folder / "deflated.tif", frames, compression="zlib")
    Image.fromarray(frames[0]).save(folder / "picture.png")
    write_cine(folder / "camera.cine", frames.astype(np.uint16), frame_rate=10_000, exposure=2e-5)
    (folder / "photron").mkdir()
    lab.write_photron(folder / "photron" / "test.cihx", frames, frame_rate=1e4, pixel_size=1e-5)

    def read_frames(path: Path) -> None:
        with lab.open_recording(path, frame_rate=1e4, pixel_size=1e-5) as recording:
            for _ in recording:
                pass

    for name in ("video.avi", "frames.tif", "deflated.tif", "picture.png", "camera.cine"):
        found[name] = read_frames
    found["photron"] = lambda path: read_frames(path / "test.cihx")
    (folder / "system.toml").write_text(
        'extends = "paper"\n[beam]\nlength = "161 mm"\n[drive]\nfrequency_ratio = 1.2\n'
    )
    found["system.toml"] = load_config
    return found


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
    files: int, seed: int, seconds: float = float("inf"), only: str = ""
) -> tuple[dict[str, int], dict[str, list[str]]]:
    """Read so many damaged files of the formats whose names end so; returns their numbers by format, and what went wrong."""
    draw, start = random.Random(seed), time.monotonic()
    made: dict[str, int] = collections.Counter()
    wrong: dict[str, list[str]] = collections.defaultdict(list)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        readers = whole_files(folder)
        names = [each for each in readers if not only or each.endswith(only)]
        while sum(made.values()) < files and time.monotonic() - start < seconds:
            each = draw.choice(names)
            path = folder / f"damaged{Path(each).suffix}"
            if (folder / each).is_dir():
                shutil.rmtree(path, ignore_errors=True)
                shutil.copytree(folder / each, path)
                spoiled = draw.choice(sorted(one for one in path.rglob("*") if one.is_file()))
                spoiled.write_bytes(content := damaged(spoiled.read_bytes(), draw))
            else:
                path.write_bytes(content := damaged((folder / each).read_bytes(), draw))
            made[each] += 1
            if said := fuzz.judged(readers[each], [path], {}):
                wrong[f"{each}: {said}"].append(content[:4000].hex())
    return dict(made), dict(wrong)


def peak_memory() -> float:
    """Largest resident memory of this process and of those that it started, bytes; NaN without a record of it (Windows)."""
    try:
        import resource
    except ImportError:
        return float("nan")
    most = max(resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return most * (1.0 if sys.platform == "darwin" else 1024.0)


if __name__ == "__main__":
    fuzz._limit_memory(4.0)
    report = Path(sys.argv[3]).absolute()
    made, wrong = fuzz_files(int(sys.argv[1]), int(sys.argv[2]), *map(float, sys.argv[4:5]), only="".join(sys.argv[5:]))
    found = {"files": made, "peak memory, bytes": peak_memory()}
    found["wrong"] = {name: {"times": len(each), "example": each[0]} for name, each in wrong.items()}
    report.write_text(json.dumps(found, indent=1))
