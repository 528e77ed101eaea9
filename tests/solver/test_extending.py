"""What somebody adds in files of their own: a statistic, a law of contact, a parameter to sweep.

Two files for a statistic (its row and its scalar function), one for a law, none more for its parameter; and the
package is not touched.
"""

from __future__ import annotations

import hashlib
import math
import sys
from importlib import import_module, invalidate_caches
from pathlib import Path

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.model.contact.base import LAWS
from snapbeam.model.parameters import lookup, parameters
from snapbeam.solver.statistics import STATISTICS, unregister
from snapbeam.util.validation import InputError

FUNCTION = '''"""The deepest that the tip ever is, at the end of a step, m."""


def deepest(held, step):
    return max(held, step.penetration[1])
'''
ROW = '''"""One row of the table of outcomes."""

from own_function import deepest
from snapbeam.solver.statistics import Statistic, register

ROW = Statistic(
    "max_penetration", "float64", "m", "greatest penetration at the end of a step",
    lambda reading, held: held, update=deepest,
)
register(ROW)
'''
LAW = '''"""A spring between tip and beam: a linear force, nothing lost."""

from dataclasses import dataclass

from snapbeam.model.contact.base import ContactLaw
from snapbeam.model.quantity import RUN, quantity


@dataclass(frozen=True)
class LinearContact(ContactLaw):
    linear_stiffness: float = quantity("N/m", "stiffness of the contact", low=0.0, scope=RUN, symbol="k")

    name = "linear"

    @staticmethod
    def force(law, penetration):
        return law.linear_stiffness * penetration

    @staticmethod
    def energy(law, penetration):
        return 0.5 * law.linear_stiffness * penetration * penetration

    @staticmethod
    def slope(law, penetration):
        return law.linear_stiffness

    def impact_duration(self, mass, velocity):
        return 3.141592653589793 * (mass / self.linear_stiffness) ** 0.5
'''
MASS, SPEED = 2e-3, 0.05


def package_hash() -> str:
    digest = hashlib.sha256()
    for path in sorted(Path(sb.__file__).parent.rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


@pytest.fixture(scope="module")
def own(tmp_path_factory):
    """The three files, imported; taken back again afterwards."""
    before = package_hash()
    statistic, law = tmp_path_factory.mktemp("statistic"), tmp_path_factory.mktemp("law")
    (statistic / "own_function.py").write_text(FUNCTION, encoding="utf-8")
    (statistic / "own_row.py").write_text(ROW, encoding="utf-8")
    (law / "own_law.py").write_text(LAW, encoding="utf-8")
    sys.path[:0] = [str(statistic), str(law)]
    invalidate_caches()
    try:
        import_module("own_row")
        yield import_module("own_law").LinearContact, statistic, law
    finally:
        sys.path[:] = [path for path in sys.path if path not in (str(statistic), str(law))]
        unregister("max_penetration")
        del LAWS["linear"]
        assert package_hash() == before


def thrown(law: type[sb.ContactLaw], spring: float) -> sb.System:
    """A free mass that meets the tip of a shaker at rest."""
    model = sb.ReducedModel.from_matrices(
        [[MASS]], [0.0], contact_shape=[1.0], length_scale=0.335e-3, reference_frequency=80.0
    )
    return sb.System(
        model, law(spring), sb.Shaker(frequency_ratio=1.0, velocity_amplitude=0.0),
        sb.State(amplitude=[0.0], velocity=[-SPEED]),
    )  # fmt: skip


def test_files_touched(own) -> None:
    law, statistic_folder, law_folder = own
    assert len(list(statistic_folder.glob("*.py"))) == 2
    assert len(list(law_folder.glob("*.py"))) == 1
    assert LAWS["linear"] is law
    assert "max_penetration" in STATISTICS
    # the parameter of the law is in the table without a file more, next to another law's of the same name
    assert lookup("contact.linear_stiffness").quantity.unit == "N/m"
    assert "linear" in parameters()["contact.linear_stiffness"].kinds


@pytest.mark.slow
def test_impact_of_a_free_mass_on_a_spring(own) -> None:
    """Half a period: duration pi sqrt(m/k), greatest force v sqrt(k m), depth v sqrt(m/k), and nothing lost."""
    law, *_ = own
    springs = np.geomspace(1e5, 1e7, 5)
    ds = sb.sweep(thrown(law, 1e6), {"contact.linear_stiffness": springs}, sb.Integration(cycles=1))
    assert (ds.status == sb.RunStatus.OK).all() and (ds.impacts == 1).all()
    assert ds.linear_stiffness.attrs == {
        "units": "N/m", "long_name": "stiffness of the contact", "parameter": "contact.linear_stiffness",
    }  # fmt: skip
    root = np.sqrt(MASS / springs)
    np.testing.assert_allclose(ds.contact_time_fraction * (1.0 / 80.0), math.pi * root, rtol=1e-3)
    np.testing.assert_allclose(ds.peak_force, SPEED * np.sqrt(springs * MASS), rtol=1e-3)
    np.testing.assert_allclose(ds.max_penetration, SPEED * root, rtol=2e-2)
    np.testing.assert_allclose(ds.impulse, 2.0 * MASS * SPEED, rtol=2e-3)
    np.testing.assert_allclose(ds.rms_velocity * 0.335e-3 * 2.0 * math.pi * 80.0, SPEED, rtol=2e-2)


@pytest.mark.slow
def test_a_beam_struck_by_a_spring(own, tmp_path) -> None:
    """The ledger closes, classes are decided early, and a system with the law is saved and read back."""
    law, *_ = own
    system = sb.System(
        sb.ReducedModel.from_beam(default_values.BEAM, modes=4, damping_ratio=0.0), law(2e6),
        sb.Shaker(frequency_ratio=1.4, velocity_amplitude=0.05),
    )  # fmt: skip
    axes = {"contact.linear_stiffness": [5e5, 2e6], "velocity_amplitude": [0.02, 0.3, 0.5]}
    ds = sb.sweep(system, axes, sb.Integration(cycles=8))
    assert (ds.status == sb.RunStatus.OK).all()
    # without damping nothing is dissipated, and the spring gives back what it takes
    assert (abs(ds.energy_dissipated) < 2e-3 * ds.gross_work).all()
    assert (ds.max_penetration > 0.0).all()
    early = sb.sweep(system, axes, sb.Integration(cycles=8, early_termination=True))
    np.testing.assert_array_equal(early.response_class, ds.response_class)
    system.save(tmp_path / "own.toml")
    assert sb.System.load(tmp_path / "own.toml") == system


def test_a_parameter_that_the_law_does_not_have_is_refused(own) -> None:
    law, *_ = own
    with pytest.raises(InputError, match=r"contact\.stiffness: is not a parameter of this system"):
        sb.sweep(thrown(law, 1e6), {"contact.stiffness": [1e8, 2e8]}, sb.Integration(cycles=1))
    with pytest.raises(InputError, match="linear_stiffness = 0: must be a finite number greater than 0 N/m"):
        law(0)
