"""Commands and functions without the packages of their extra: a sentence that names the extra, never a traceback."""

from __future__ import annotations

import re
import subprocess
import sys
from importlib.metadata import requires

import numpy as np
import pytest
from commands import run_commands

from snapbeam.parts import installed_parts
from snapbeam.util.packages import _EXTRAS, extra_of

LAB = pytest.mark.skipif("lab" not in installed_parts(), reason="a part that is not installed")
EXPLORER = pytest.mark.skipif("explorer" not in installed_parts(), reason="a part that is not installed")
BLOCKED = sorted(module for modules in _EXTRAS.values() for module in modules if module != "PIL")
"""Pillow is there: Matplotlib needs it."""
WITHOUT = f"import sys; sys.modules.update(dict.fromkeys({BLOCKED!r}))\n"
RUN = ["simulate", "--modes", "1", "--cycles", "1"]
MAP = ["map", "--modes", "1", "--frequency-ratio", "1", "--velocity-amplitude", "0.1:0.2:2", "--checkpoint", "store"]


def without_extras(folder, program, *words):
    """Run a program in a process that has no package of any extra."""
    command = [sys.executable, "-c", program, *words]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300)


@pytest.fixture
def refused(tmp_path_factory):
    """Run commands in a folder; each must name its extra."""

    def run(folder, lines, extra):
        for done in run_commands(
            folder, tmp_path_factory.mktemp("answers"), lines, WITHOUT, ("snapbeam.cli.app", "pint")
        ):
            said = " ".join(done.stderr.decode("utf-8").replace("│", " ").split())
            assert done.returncode == 2 and "Traceback" not in said, said
            assert re.search(rf'needs \w+; .*pip install "\.\[{extra}\b', said), said

    return run


@pytest.fixture
def files(tmp_path):
    """Recordings and signals of every kind whose reader is an extra's; their content is not reached."""
    for name in ("a.avi", "a.mp4", "a.tif", "a.png", "a.tdms", "a.uff"):
        (tmp_path / name).write_bytes(b"\x89PNG" * 300)
    (tmp_path / "series").mkdir()
    (tmp_path / "series" / "a_0001.png").write_bytes(b"\x89PNG" * 300)
    (tmp_path / "map.nc").write_bytes(b"\x89HDF" * 300)
    time = np.arange(4000) / 1e4
    decay = np.exp(-3.0 * time) * np.sin(2.0 * np.pi * 120.0 * time)
    np.savetxt(tmp_path / "a.csv", np.column_stack((time, decay)), delimiter=",", header="time,x", comments="")
    return tmp_path


@EXPLORER
def test_the_explorer(tmp_path, refused):
    refused(tmp_path, [["explore"], ["explore", "map.nc"], ["explore", "--port", "0"]], "explorer")


@EXPLORER
@pytest.mark.slow
def test_the_page_over_a_recording(tmp_path, refused):
    np.save(tmp_path / "a.npy", np.zeros((3, 32, 32), dtype=np.uint8))
    refused(tmp_path, [["look", "a.npy"]], "explorer")


@EXPLORER
def test_the_explorer_in_python(tmp_path):
    done = without_extras(tmp_path, WITHOUT + "import snapbeam; snapbeam.explorer.serve")
    assert 'pip install ".[explorer]"' in done.stderr.splitlines()[-1]


TRACK = ["--frame-rate", "10e3", "--pixel-size", "12e-6", "--buckling-level", "0.33e-3"]


LABORATORY = [
    ["track", "a.png", *TRACK, "--video", "b.avi"],
    ["vibrometer", "a.uff", "--frequency", "100"],
    ["fit-decay", "a.csv", "--units", "m"],
]


@LAB
@pytest.mark.slow
def test_commands_of_the_laboratory(files, refused):
    refused(files, LABORATORY, "lab")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "extra"),
    [([*RUN, "--animate", "a.mp4"], "video"), ([*MAP, "--cluster", "local:2", "-o", "a.nc"], "cluster")],
    ids=["video", "cluster"],
)
def test_options_of_other_commands(tmp_path, refused, words, extra):
    refused(tmp_path, [words], extra)
    assert not (tmp_path / "a.mp4").exists() and not (tmp_path / "a.nc").exists()


WRITE = """
import numpy as np
from snapbeam import InputError, lab
signal = lab.make_signal(np.sin(np.arange(900.0)), "m", 1e3)
frames = np.zeros((3, 20, 20), np.uint8)
calls = [
    lambda: lab.write_signal("b.tdms", signal),
    lambda: lab.write_signal("b.uff", signal),
    lambda: lab.write_video("b.avi", frames),
    lambda: lab.open_recording("a.avi", frame_rate=1e4, pixel_size=1e-5),
]
for call in calls:
    try:
        call()
    except InputError as error:
        print(error)
"""


@LAB
def test_functions_of_the_laboratory(files):
    before = sorted(path.name for path in files.iterdir())
    done = without_extras(files, WITHOUT + WRITE)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count('pip install ".[lab]"') == 4, done.stdout
    assert sorted(path.name for path in files.iterdir()) == before


def test_every_package_of_an_extra_is_known():
    """The table of modules names as many extras as the distribution has."""
    stated = {each.partition("extra ==")[2].strip(" '\"") for each in requires("snapbeam") if "extra ==" in each}
    assert stated == set(_EXTRAS)
    assert extra_of("cv2.gapi") == "lab" and extra_of("numpy") is None and extra_of(None) is None
