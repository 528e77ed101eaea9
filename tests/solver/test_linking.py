"""Kernels that are loaded from disk side by side do not run each other's code."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

from snapbeam.model.contact.base import LAWS, ContactLaw
from snapbeam.model.drive.base import DRIVES
from snapbeam.solver.registered_statistics import extras_of_table
from snapbeam.solver.statistics import Statistic, register_statistic, unregister_statistic

PROGRAM = """
import json, sys
import snapbeam as sb
from snapbeam.model import default_values

model = sb.ReducedModel.from_beam(default_values.BEAM, modes=1, damping_ratio=0.001)
shaker = sb.Shaker(frequency_ratio=1.21, velocity_amplitude=0.3)
laws = {"hertz": default_values.CONTACT, "plastic": sb.Restitution(0.0), "elastic": sb.Restitution(0.9)}
found = {}
for name in sys.argv[1:]:
    system, asked = sb.System(model, contacts=[sb.Contact(laws[name], shaker)]), sb.Integration(cycles=3)
    run = sb.simulate(system, asked, sample_times=[0.0])
    ds = sb.sweep(system, {"velocity_amplitude": [0.3]}, asked)
    found[name] = [repr(dict(run.summary)), repr({str(k): v.item() for k, v in ds.data_vars.items()})]
print(json.dumps(found))
"""


def told(*laws: str) -> dict[str, list[str]]:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, *laws], capture_output=True, text=True, check=True, timeout=500
    )
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.slow
def test_a_law_gives_what_it_gives_alone() -> None:
    """Each law in a process of its own, then together, their code loaded from disk."""
    alone = told("hertz") | told("plastic", "elastic")
    together = told("hertz", "plastic", "elastic")
    for name, said in alone.items():
        assert together[name] == said, name


def test_types_of_numbers_are_named_apart() -> None:
    """Compiled code is linked by names: those of every law and drive differ, and of a law that was read anew."""
    kinds = [kind.numbers_type() for kind in (*LAWS.values(), *DRIVES.values())]
    before = type(extras_of_table())
    register_statistic(
        Statistic("own", "float64", "s", "time of the run", lambda r, h: h, update=lambda held, step: held)
    )
    try:
        kinds += [before, type(extras_of_table())]
    finally:
        unregister_statistic("own")

    def law() -> type[ContactLaw]:
        class Somebodys(ContactLaw):
            pass

        return Somebodys

    from snapbeam.model.quantity import numbers_type

    kinds += [numbers_type(law(), ("stiffness",)) for _ in range(2)]
    assert len({kind.__name__ for kind in kinds}) == len(kinds)
