"""What the memory held before changes no bit of a run, alone or beside others."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

RUNS = """
import sys, warnings
warnings.simplefilter("ignore")
sys.path.insert(0, sys.argv[1])
import hashlib
import numpy as np
from snapbeam.dynamics.stroboscope import Stroboscope
from test_random_tools import system_of
for seed in map(int, sys.argv[2:]):
    flow = Stroboscope(system_of(seed))
    states = np.random.default_rng(seed).normal(0.0, 0.3, (3, flow.dimension))
    print(seed, hashlib.sha256(np.ascontiguousarray(flow.advance(states, 3).states).tobytes()).hexdigest())
"""


@pytest.mark.skipif(sys.platform != "linux", reason="the C library of Linux fills memory on request")
@pytest.mark.slow
def test_memory_changes_no_bit():
    """A system with circuits that follow the beam beside lossy contacts: it failed."""
    found = []
    for fill in ("0", "165"):
        done = subprocess.run(
            [sys.executable, "-c", RUNS, str(Path(__file__).parent), "13"],
            env=os.environ | {"MALLOC_PERTURB_": fill}, capture_output=True, text=True, check=True,
        )  # fmt: skip
        found.append(done.stdout)
    assert found[0] and found[0] == found[1]
