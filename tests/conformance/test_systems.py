"""What is asked of every extended system: its mirror image, sweeps of all of its parameters, early decisions."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from killed_systems import NOT_SWEPT
from systems import SYSTEMS, mirror_image

import snapbeam as sb
from snapbeam.model.contact.base import LAWS
from snapbeam.model.drive.base import DRIVES
from snapbeam.model.drive.force import FORCES
from snapbeam.model.drive.random_vibration import RandomVibration
from snapbeam.model.harvester import HARVESTERS
from snapbeam.model.parameters import parameters
from snapbeam.model.quantity import quantities
from snapbeam.util.status_codes import RunStatus

HERE = Path(__file__).parent
MIRRORED = {
    "min_displacement": "max_displacement",
    "max_displacement": "min_displacement",
    "min_midspan_displacement": "max_midspan_displacement",
    "max_midspan_displacement": "min_midspan_displacement",
}
EVERY = list(SYSTEMS)


def swept(name: str, count: int, seed: int, *, mirrored: bool = False, modes: int | None = None, **how):
    extended = SYSTEMS[name]
    system = extended.system(modes)
    columns = {key: ("point", values) for key, values in extended.points(count, seed).items()}
    system = mirror_image(system) if mirrored else system
    return sb.sweep(system, xr.Dataset(columns), sb.Integration(**how))


def test_none_is_missing() -> None:
    """Every kind of law, drive, motion of a base and harvester, and every parameter but those of runs.

    The composition test compares every force as an external force and as an axial load.
    Laws with a memory are in ``test_elastic_plastic.py``.  ``test_external_force.py``, ``test_local_force.py``, ``test_shock.py``,
    ``test_random_vibration.py``, ``test_recorded_acceleration.py`` and ``model/test_wired_patches.py`` compare those with independent solutions.
    """
    others = sb.Shock, sb.RecordedAcceleration, RandomVibration
    elsewhere = {
        f"{section}.{name}" for section in ("drive", "base_excitation") for kind in others for name in quantities(kind)
    }
    elsewhere |= {f"axial_load.{name}" for kind in FORCES.values() for name in quantities(kind)}
    elsewhere |= {f"contact.{name}" for law in LAWS.values() if law.memory for name in quantities(law)}
    wired = {"patches", "patch_imbalance"}
    elsewhere |= {f"harvester.{name}" for kind in wired for name in quantities(HARVESTERS[kind])}
    systems = [extended.system() for extended in SYSTEMS.values()]
    there = {(section, type(drive).name) for each in systems for section, drive in each.moving}
    there |= {("contact", type(contact.law).name) for each in systems for contact in each.contacts}
    there |= {("harvester", type(each.harvester).name) for each in systems if each.harvester is not None}
    there |= {("drive", type(each.striker.drive).name) for each in systems}
    shaking = [name for name, kind in DRIVES.items() if kind.can_excite_base() and name != "still"]
    known = {
        "contact": [name for name, law in LAWS.items() if not law.memory],
        "drive": DRIVES,
        "base_excitation": shaking,
        "harvester": HARVESTERS,
    }
    for section, names in known.items():
        missing = {name for name in names if (section, name) not in there} - {kind.name for kind in others} - wired
        assert not missing, f"{section}: no extended system has {missing}"
    own = set().union(*(each.parameters for each in systems))
    missing = {
        name for name, row in parameters().items() if row.section not in ("integration", "initial_state", "force")
    } - own
    assert missing <= elsewhere


@pytest.mark.parametrize("name", EVERY)
def test_mirror_image(name) -> None:
    """The mirrored system's runs are the runs, to the last bit: every statistic of every one of them."""
    below = swept(name, 16, 1, cycles=8)
    above = swept(name, 16, 1, cycles=8, mirrored=True)
    assert set(below.data_vars) == set(above.data_vars)
    for key in below.data_vars:
        other = below[MIRRORED.get(key, key)].values
        wanted = -other if key in MIRRORED or key == "final_well" else other
        np.testing.assert_array_equal(above[key].values, wanted, err_msg=key)
    assert (below.status == RunStatus.OK).all()
    assert float(np.ptp(below.max_midspan_displacement.values)) > 0.0


@pytest.mark.slow
@pytest.mark.parametrize("name", EVERY)
def test_every_parameter_swept_killed_and_resumed(name) -> None:
    """SIGKILL at the second task, resumed: the file of an undisturbed sweep, bit for bit."""
    assert set(NOT_SWEPT) <= set(parameters())
    command = [sys.executable, str(HERE / "killed_systems.py"), name]
    done = subprocess.run(command, capture_output=True, text=True, timeout=3600)
    assert done.returncode == 0, done.stderr[-3000:]
    seen = json.loads(done.stdout.splitlines()[-1])
    assert seen["failures"] == []
    assert seen["swept"] > 0


@pytest.mark.slow
@pytest.mark.parametrize("modes", [1, 8])
@pytest.mark.parametrize("name", [name for name, extended in SYSTEMS.items() if extended.decides])
def test_never_ended_early_wrongly(name, modes) -> None:
    """1,000 random runs with and without early decision."""
    extended = SYSTEMS[name]
    if modes > 1 and extended.modes == 1:
        pytest.skip("an entry of one mode")
    decided, wrong = early_decisions(name, modes, 1000)
    print(f"{name}, N = {modes}: {decided} of 1000 decided early, {wrong} wrongly")
    assert wrong == 0
    if not extended.system(extended.fewest).surroundings:
        assert decided > 10


def early_decisions(name: str, modes: int, count: int) -> tuple[int, int]:
    """How many of *count* random runs were decided early, and how many of those have another class than whole."""
    modes = 1 if SYSTEMS[name].modes == 1 else max(modes, SYSTEMS[name].fewest)
    early, whole = (
        swept(name, count, 7, modes=modes, cycles=SYSTEMS[name].cycles, early_termination=flag)
        for flag in (True, False)
    )
    decided = early.status.values == RunStatus.EARLY_STOP
    wrong = early.response_class.values != whole.response_class.values
    # what is said to be final is where the whole run ends
    wrong |= early.final_well_proven.values & (early.final_well.values != whole.final_well.values)
    return int(decided.sum()), int(wrong.sum())
