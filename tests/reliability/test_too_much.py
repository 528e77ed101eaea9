"""What would take for ever, or more memory than there is, is refused with the figure before it begins."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.solver.step_size import most_steps, seconds_of
from snapbeam.sweeps.points import points_of
from snapbeam.util.validation import InputError

MODEL = sb.ReducedModel.from_beam(default_values.BEAM, modes=2)


def system(frequency_ratio=1.0, modes=2):
    model = MODEL if modes == 2 else sb.ReducedModel.from_beam(default_values.BEAM, modes=modes)
    return sb.System(
        model,
        contacts=[
            sb.Contact(default_values.CONTACT, sb.Shaker(frequency_ratio=frequency_ratio, velocity_amplitude=0.3))
        ],
    )


def quick(function, *arguments, **options):
    """What a call raises, which must take neither long nor much memory."""
    start, before = time.process_time(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(InputError) as refused:
        function(*arguments, **options)
    assert time.process_time() - start < 10.0
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 300_000  # kB
    return str(refused.value)


@pytest.mark.parametrize(
    ("how", "ratio", "words"),
    [
        ({"step": 1e-10}, 1.0, r"a run of 2.*e\+10 steps of 1e-10 s, some .* hours on one core: must be at most"),
        ({"cycles": 10**6}, 1e-3, r"steps of .* s, some .* on one core: must be at most"),
        ({"cycles": 200, "max_steps": 1000}, 1.0, r"must be at most 1e\+03 steps \(max_steps\)"),
        ({"step": 1e3}, 1.0, "does not resolve a cycle of excitation"),
        ({"cycles": 10**7}, 1.0, "too long to record|steps of"),
        ({}, 1e-9, "steps"),
    ],
)
def test_runs_that_would_take_too_long(how, ratio, words, tried):
    tried("inputs of much time or memory")
    said = quick(sb.simulate, system(ratio), sb.Integration(**how))
    import re

    assert re.search(words, said), said


def test_sweeps_that_would_take_too_long(tried):
    """One run too many is enough, and it is found before any is computed."""
    axes = {"drive.frequency_ratio": [1e-9, 1.0]}
    assert "steps" in quick(sb.sweep, system(), axes)
    tried("inputs of much time or memory")
    axes, allowed = {"drive.velocity_amplitude": [0.1, 0.2]}, sb.Integration(cycles=10**6, max_steps=10**13)
    assert "steps, must be at most 8.6e+09" in quick(sb.sweep, system(1e-3), axes, allowed)
    tried("inputs of much time or memory")


def test_the_limit_is_the_users():
    """Given, it holds; by default it is an hour's for any number of modes."""
    assert most_steps(sb.Integration(max_steps=10**12), 1) == 10**12
    for modes in (1, 8, 64, 256):
        assert seconds_of(most_steps(sb.Integration(), modes), modes) == pytest.approx(3600.0, rel=1e-6)
    run = sb.simulate(system(), sb.Integration(cycles=1, max_steps=10**12))
    assert run.summary.status == sb.RunStatus.OK


@pytest.mark.filterwarnings("ignore:drive.frequency_ratio = 1e.12")
def test_fast_drives_take_no_memory():
    """What is asked for is a few cycles, however short they are."""
    run = sb.simulate(system(1e12), sb.Integration(cycles=2))
    assert run.dataset.sizes["time"] < 10_000


def test_too_many_sample_times_are_refused():
    said = quick(
        sb.simulate, system(modes=64), sb.Integration(cycles=10), sample_times=np.linspace(0.0, 1e-2, 3_000_000)
    )
    assert "GiB" in said


def test_axes_of_too_many_points():
    said = quick(points_of, {"drive.frequency_ratio": "0.1:2:1000000000"})
    assert "frequency_ratio" in said
    many = {
        "drive.frequency_ratio": np.linspace(0.5, 2, 10_000),
        "drive.velocity_amplitude": np.linspace(0.1, 1, 10_000),
        "contact.location": np.linspace(0.1, 0.5, 1000),
    }
    assert "points" in quick(sb.sweep, system(), many)


@pytest.mark.slow
@pytest.mark.parametrize(
    "command",
    [
        ["simulate", "--modes", "2", "--step", "1e-9", "--max-steps", "1000000000000"],
        ["map", "--modes", "64", "--frequency-ratio", "1e-3", "--velocity-amplitude", "0.1:0.2:2", "--max-steps",
         "1000000000000", "--cycles", "10000"],
    ],
)  # fmt: skip
def test_an_interrupt_ends_a_long_run(command, tmp_path, tried):
    """Ctrl-C in the middle of steps that would take hours: an end, with words."""
    process = subprocess.Popen(
        [sys.executable, "-m", "snapbeam", *command, "-o", "x.nc"], cwd=tmp_path, stderr=subprocess.PIPE, text=True
    )
    time.sleep(60)
    assert process.poll() is None, process.stderr.read()
    process.send_signal(signal.SIGINT)
    process.wait()
    with process.stderr:
        said = process.stderr.read()
    assert process.returncode == 130 and "Traceback" not in said
    assert os.listdir(tmp_path) == []
    tried("interrupts of long runs")
