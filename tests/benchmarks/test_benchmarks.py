"""The benchmarks begin: every module is imported, and the GPU's is run small in the simulator."""

from __future__ import annotations

import json
import os
import pkgutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
NEEDS = {
    "boost_peer",
    "fixed_steps",
    "diffrax",
    "equinox",
    "heyoka",
    "holoviews",
    "jax",
    "numbalsoda",
    "panel",
    "playwright",
    "pyidi",
    "trackpy",
}
"""Packages that single benchmarks need, and a C++ compiler with Boost; without them that one is left out."""
_IMPORT = """
import importlib, sys
for name in sys.argv[1:]:
    try:
        importlib.import_module(name)
    except ImportError as error:
        print((error.name or name).partition(".")[0])
"""


@pytest.mark.slow
def test_every_benchmark_can_be_imported():
    names = [
        name
        for _, name, _ in pkgutil.walk_packages([str(ROOT / "benchmarks")], "benchmarks.")
        if not name.endswith("__main__")
    ]
    assert len(names) > 15 and "benchmarks.gpu" in names
    done = subprocess.run(
        [sys.executable, "-c", _IMPORT, *names], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert set(done.stdout.split()) <= NEEDS, done.stdout


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="Windows has no access bits")
def test_boost_is_not_loaded_from_a_folder_that_others_can_write(tmp_path):
    folder = tmp_path / f"snapbeam-{os.getuid()}"
    folder.mkdir()
    folder.chmod(0o777)
    done = subprocess.run(
        [sys.executable, "-c", "import benchmarks.peers.boost_peer"],
        cwd=ROOT, env=dict(os.environ, TMPDIR=str(tmp_path), CXX="true"), capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert f"{folder} is not this user's alone" in done.stderr
    assert list(folder.iterdir()) == []


@pytest.mark.slow
def test_the_gpus_benchmark_runs_in_the_simulator(tmp_path):
    pytest.importorskip("numba_cuda")
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.gpu", "--smoke", "-o", str(tmp_path / "gpu.json")],
        cwd=ROOT, env=dict(os.environ, NUMBA_ENABLE_CUDASIM="1"), capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    found = json.loads((tmp_path / "gpu.json").read_text(encoding="utf-8"))
    assert {"facts", "conformance", "throughput", "host", "scaling", "fig_7b"} <= found.keys()
    assert found["conformance"]["first_cycle"][0]["error"] < 1e-6
    assert {row["engine"].split()[-1] for row in found["throughput"]["rows"]} == {"cores", "warps"}
