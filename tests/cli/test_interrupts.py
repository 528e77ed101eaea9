"""Ctrl-C, termination and a closed terminal while the program starts and computes: a sentence and a status."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time

import pytest

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="interrupts are POSIX signals here")

SENTENCE = "interrupted; no file was left half written"
LATER = ("snapbeam.cli.map", "numpy", "xarray")
HANGUP = getattr(signal, "SIGHUP", signal.SIGTERM)
ALL = pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, HANGUP])
AT_IMPORT = """
import os, signal, sys
from snapbeam.__main__ import main

class Interrupter:
    def find_spec(self, name, path=None, target=None):
        if name == {name!r}:
            os.kill(os.getpid(), {number})

sys.meta_path.insert(0, Interrupter())
sys.argv = ["snapbeam", "map", "--modes", "1", "--cycles", "2", "-o", "map.nc"]
main()
"""


@pytest.mark.slow
@ALL
@pytest.mark.parametrize("name", ["typer", *LATER])
def test_while_modules_are_imported(tmp_path, number, name):
    code = AT_IMPORT.format(name=name, number=int(number))
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 128 + number, done.stderr
    assert done.stderr.splitlines()[-1] == SENTENCE
    assert "Traceback" not in done.stderr
    assert os.listdir(tmp_path) == []


@pytest.mark.slow
@ALL
def test_while_points_are_computed(tmp_path, number):
    command = ["map", "--modes", "1", "--cycles", "30000", "--frequency-ratio", "0.5:4:20"]
    process = subprocess.Popen(
        [sys.executable, "-m", "snapbeam", *command], cwd=tmp_path, stderr=subprocess.PIPE, text=True
    )
    while " of " not in process.stderr.readline():
        assert process.poll() is None
    process.send_signal(number)
    _, messages = process.communicate(timeout=600)
    assert process.returncode == 128 + number
    assert messages.splitlines()[-1] == SENTENCE and "Traceback" not in messages
    assert os.listdir(tmp_path) == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("run", "number", "delay"),
    [
        (("--stream", "--modes", "8", "--cycles", "100000"), signal.SIGINT, 0.0),
        (("--stream", "--modes", "8", "--cycles", "100000"), signal.SIGTERM, 0.5),
        (("--stream", "--modes", "32", "--cycles", "4000000"), signal.SIGINT, 0.1),
        (("--stream", "--modes", "32", "--cycles", "4000000"), signal.SIGTERM, 2.0),
        (("--modes", "1", "--cycles", "15000"), signal.SIGINT, 0.0),
        (("--modes", "1", "--cycles", "15000"), signal.SIGTERM, 0.1),
    ],
)
def test_while_a_file_is_written(tmp_path, run, number, delay):
    """HDF5 calls back into Python, where an exception is lost or ends the process; also in one long call of NumPy."""
    command = [sys.executable, "-m", "snapbeam", "simulate", *run, "-o", "st.nc"]
    out = subprocess.DEVNULL
    process = subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE, stdout=out, text=True)
    while not os.listdir(tmp_path):
        assert process.poll() is None
        time.sleep(0.005)
    time.sleep(delay)
    if process.poll() is None:
        process.send_signal(number)
    _, messages = process.communicate(timeout=60)
    if os.listdir(tmp_path) == ["st.nc"]:  # it was written before the signal was heard
        assert delay > 0.0
        return
    assert process.returncode == 128 + number
    assert messages.splitlines()[-1] == SENTENCE and "Traceback" not in messages
    assert os.listdir(tmp_path) == []


@pytest.mark.slow
def test_a_terminal_that_is_closed(tmp_path):
    """Messages cannot be written any more; the program ends, and no incomplete file is left."""
    import fcntl
    import pty
    import termios

    command = ["map", "--modes", "1", "--cycles", "30000", "--frequency-ratio", "0.5:4:20", "--checkpoint", "store"]
    here, there = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, "-m", "snapbeam", *command, "--points-per-task", "1"], cwd=tmp_path, stdin=there, stdout=there,
        stderr=there, start_new_session=True, preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0),
    )  # fmt: skip
    os.close(there)
    shown = b""
    while b"points" not in shown:
        shown += os.read(here, 1024)
    os.close(here)
    assert process.wait(timeout=600) != 0
    assert not [file for file in tmp_path.rglob("*.partial")]
    assert sorted(os.listdir(tmp_path)) in ([], ["store"])


@pytest.mark.slow
def test_a_background_job_ignores_what_its_shell_says(tmp_path):
    """A shell starts background jobs with SIGINT ignored; the program leaves it so."""
    code = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)\n" + AT_IMPORT.format(
        name="typer", number=int(signal.SIGINT)
    ).replace('"map", "--modes", "1", "--cycles", "2", "-o", "map.nc"', '"frequencies"')
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
def test_the_library_leaves_the_signals_alone():
    code = "import signal, snapbeam as sb; sb.simulate; print(signal.getsignal(signal.SIGTERM) is signal.SIG_DFL)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "True\n"
