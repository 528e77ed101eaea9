"""Signals while the main thread is in a call of a library that does not end: the program ends all the same."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from itertools import product

import pytest

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="interrupts are POSIX signals here")

# the kernel continues sem_wait after each signal (siginterrupt), so that it never comes back to Python
BLOCKED = """
import ctypes, signal
from pathlib import Path
from snapbeam.util import interrupts
interrupts.install()
libc, semaphore = ctypes.CDLL(None), ctypes.create_string_buffer(64)
libc.sem_init(semaphore, 0, 0)
def blocked():
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.siginterrupt(number, False)
    print("blocked", flush=True)
    libc.sem_wait(semaphore)
with interrupts.during_command():
"""
BODIES = {
    "at work": "    blocked()",
    "closing": """
    try:
        signal.raise_signal(signal.SIGINT)
    finally:
        blocked()""",
    "held": """
    with interrupts.held_back() as incomplete:
        incomplete.add(Path("half"))
        open("half", "w").close()
        blocked()""",
}


@pytest.mark.slow
def test_calls_that_do_not_end(tmp_path):
    """All at once, since the program waits for some seconds before it gives a call up."""
    begun = []
    try:
        for body, number in product(BODIES, (signal.SIGINT, signal.SIGTERM)):
            folder = tmp_path / f"{body}, {number}"
            folder.mkdir()
            process = subprocess.Popen(
                [sys.executable, "-c", BLOCKED + BODIES[body]],
                cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            )  # fmt: skip
            begun.append((process, folder, number))
        for process, _, _ in begun:
            assert process.stdout is not None and process.stdout.readline() == "blocked\n"
        time.sleep(2.0)  # a signal before the call is a plain interrupt
        for process, _, number in begun:
            process.send_signal(number)
        for process, folder, number in begun:
            _, told = process.communicate(timeout=60)
            assert process.returncode == 128 + number, folder.name
            assert told == "interrupted; no file was left half written\n", folder.name
            assert not (folder / "half").exists()
    finally:
        for process, _, _ in begun:
            process.kill()
