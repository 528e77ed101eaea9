"""Signals while the main thread is in a call of a library that does not end: the program ends all the same."""

from __future__ import annotations

import signal
import subprocess
import sys
import time

import pytest

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="interrupts are POSIX signals here")

# the kernel continues sem_wait after each signal (siginterrupt), so that it never comes back to Python
BLOCKED = """
import ctypes, signal
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
        incomplete.add(interrupts.Path("half"))
        open("half", "w").close()
        blocked()""",
}


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("body", BODIES)
def test_a_call_that_does_not_end(tmp_path, body, number):
    process = subprocess.Popen(
        [sys.executable, "-c", BLOCKED + BODIES[body]],
        cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        assert process.stdout is not None and process.stdout.readline() == "blocked\n"
        time.sleep(2.0)  # a signal before the call is a plain interrupt
        process.send_signal(number)
        _, told = process.communicate(timeout=60)
    finally:
        process.kill()
    assert process.returncode == 128 + number
    assert told == "interrupted; no file was left half written\n" and not (tmp_path / "half").exists()
