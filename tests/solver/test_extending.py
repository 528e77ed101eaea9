"""What somebody adds in files of their own: a statistic, a law of contact, a parameter to sweep.

Two files for a statistic (its row and its scalar function), one for a law, none more for its parameter; and the
package is not touched.
"""

from __future__ import annotations

import hashlib
import math
import re
import sys
from importlib import import_module, invalidate_caches
from pathlib import Path

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.model.contact.base import LAWS
from snapbeam.model.drive.base import DRIVES
from snapbeam.model.parameters import lookup, parameters
from snapbeam.solver.statistics import STATISTICS, unregister_statistic
from snapbeam.util.validation import InputError

PAGE = Path(__file__).parents[2] / "docs" / "extending.md"
BLOCKS = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
"""The code of the page: a contact law, the function of a statistic, its row, a drive, a local force, scripts that use them."""
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
    drive = tmp_path_factory.mktemp("drive")
    for path, text in zip(
        (
            law / "own_law.py", law / "own_memory.py", statistic / "deepest.py", statistic / "my_statistics.py", drive / "own_drive.py",
            drive / "own_force.py", drive / "run_friction.py", drive / "run_own.py",
        ),
        BLOCKS, strict=True,
    ):  # fmt: skip
        path.write_text(text, encoding="utf-8")
    sys.path[:0] = [str(statistic), str(law), str(drive)]
    invalidate_caches()
    try:
        import_module("my_statistics")
        yield import_module("own_law").LinearContact, statistic, law
    finally:
        sys.path[:] = [path for path in sys.path if path not in map(str, (statistic, law, drive))]
        unregister_statistic("max_penetration")
        del LAWS["linear"]
        DRIVES.pop("smooth_pulse", None)
        assert package_hash() == before


def thrown(law: type[sb.ContactLaw], spring: float) -> sb.System:
    """A free mass that meets the tip of a shaker at rest."""
    model = sb.ReducedModel.from_matrices(
        [[MASS]], [0.0], contact_shape=[1.0], length_scale=0.335e-3, reference_frequency=80.0
    )
    return sb.System(
        model,
        contacts=[sb.Contact(law(spring), sb.Shaker(frequency_ratio=1.0, velocity_amplitude=0.0))],
        initial_state=sb.State(amplitude=[0.0], velocity=[-SPEED]),
    )  # fmt: skip


def test_files_touched(own) -> None:
    law, statistic_folder, law_folder = own
    assert len(list(statistic_folder.glob("*.py"))) == 2
    assert len(list(law_folder.glob("*.py"))) == 2
    assert LAWS["linear"] is law
    assert "max_penetration" in STATISTICS
    # the parameter of the law is in the table without a file more, next to another law's of the same name
    assert lookup("contact.linear_stiffness").quantity.unit == "N/m"
    assert "linear" in parameters()["contact.linear_stiffness"].kinds


def test_contact_steps_follow_from_the_energy_of_a_law(own) -> None:
    """pi sqrt(m/k) of a spring; Hertz's closed form, (4/5) B(2/5, 1/2) d_max/v; 0 if nothing stops the mass."""
    law, *_ = own
    assert law(1e6).impact_duration(MASS, SPEED) == pytest.approx(math.pi * math.sqrt(MASS / 1e6), rel=1e-9)
    assert law(1e6).time_scale(MASS, SPEED) == pytest.approx(math.pi * math.sqrt(MASS / 1e6), rel=1e-9)
    hertz = default_values.CONTACT
    general = sb.ContactLaw.impact_duration(hertz, MASS, SPEED)
    assert general == pytest.approx(hertz.impact_duration(MASS, SPEED), rel=1e-6)
    assert law(1e-9).impact_duration(MASS, SPEED) == 0.0


@pytest.mark.slow
def test_impact_on_a_surface_that_yields(own) -> None:
    """What is given back is the elastic energy at the yield force, f_y^2/(2 k); the rest is in the indentation."""
    law = import_module("own_memory").YieldingContact(1e6, 0.5)
    try:
        run = sb.simulate(thrown(lambda _: law, 0.0), sb.Integration(cycles=1, accuracy="reference"))
        rebound = 0.5 / math.sqrt(1e6 * MASS)
        assert run.dataset.modal_velocity.values[-1, 0] == pytest.approx(rebound, rel=1e-7)
        lost = 0.5 * MASS * (SPEED**2 - rebound**2)
        assert run.summary.energy_lost_contact == pytest.approx(lost, rel=1e-7)
        assert float(run.final_state.indentation) == pytest.approx(lost / 0.5, rel=1e-7)
        assert run.summary.peak_force == pytest.approx(0.5, rel=1e-9)
    finally:
        del LAWS["yielding"]


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
    """The energy balance closes, runs end early with the same class, and a system with the law is saved and read back."""
    law, *_ = own
    system = sb.System(
        sb.ReducedModel.from_beam(default_values.BEAM, modes=4, damping_ratio=0.0),
        contacts=[sb.Contact(law(2e6), sb.Shaker(frequency_ratio=1.4, velocity_amplitude=0.05))],
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


@pytest.mark.slow
def test_the_script_of_the_page(own, capsys) -> None:
    """It runs with the drive, the law and the statistic, and prints the output of the page."""
    import_module("run_own")
    printed = re.search(r"run_own\.py.*?```\n\n```\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert capsys.readouterr().out == printed[1]
