"""The benchmarks begin: every module is imported, and the shortest parts are run."""

from __future__ import annotations

import pkgutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))
NEEDS = {
    "boost_peer",
    "fixed_steps",
    "rhs",
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
    assert len(names) > 15 and "benchmarks.systems" in names
    done = subprocess.run(
        [sys.executable, "-c", _IMPORT, *names], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert set(done.stdout.split()) <= NEEDS, done.stdout


@pytest.mark.slow
@pytest.mark.parametrize("part", ["scaling", "systems", "ensemble"])
def test_a_part_runs(part, tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks", part, "--quick", "-o", str(tmp_path)],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert (tmp_path / f"{part}.json").stat().st_size > 500 and "| " in (tmp_path / f"{part}.inc").read_text("utf-8")


@pytest.mark.slow
@pytest.mark.parametrize("modes", [1, 3, 32])
def test_the_compiled_right_hand_side_is_that_of_the_equations(modes):
    pytest.importorskip("benchmarks.peers.rhs", reason="no C++ compiler", exc_type=ImportError)
    from benchmarks.cases import Case
    from benchmarks.peers.equations import equations_of
    from benchmarks.peers.rhs import compiled_system

    case = Case(modes, 1.21, 0.3)
    e, system = equations_of(case), compiled_system(case, 10.0)
    rng, t = np.random.default_rng(modes), 0.3 * case.period
    u, du = rng.normal(size=2 * modes), np.empty(2 * modes)
    system.function(t, u.ctypes, du.ctypes, system.memory.ctypes)
    q, unit = system.coordinates(u) / system.scale, 10.0 * e.omega[0]
    p = system.coordinates(u[modes:]) / system.scale * unit
    bend, along = e.tension @ q, e.g @ q
    depth = e.amplitude * np.sin(e.drive * t) - e.contact @ q
    force = e.stiffness * max(depth, 0.0) ** 1.5
    slope = -(e.omega**2) * q - 2.0 * e.damping_ratio * e.omega * p + e.push * force
    slope -= e.gamma * ((q @ bend) * e.g + (2.0 * along + q @ bend) * bend)
    np.testing.assert_allclose(system.coordinates(du) / system.scale, p, rtol=1e-14)
    found = system.coordinates(du[modes:]) / system.scale * unit
    np.testing.assert_allclose(found, slope, atol=1e-12 * np.abs(slope).max())
