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
from snapbeam.model.drive.base import DRIVES, Drive, Timed
from snapbeam.model.drive.force import FORCES, ForceHistory
from snapbeam.model.harvester import HARVESTERS, Harvester
from snapbeam.model.local_force import LOCAL_FORCES
from snapbeam.model.parameters import lookup, parameters
from snapbeam.solver.statistics import STATISTICS, Statistic, register_statistic, unregister_statistic
from snapbeam.util.validation import InputError

PAGE = Path(__file__).parents[2] / "docs" / "extending.md"
BLOCKS = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
"""The code of the page: a contact law, the function of a statistic, its row, a drive, a local force, scripts that use them."""
MASS, SPEED = 2e-3, 0.05
REGISTERED = (
    (LAWS, "linear"), (LAWS, "rubber"), (DRIVES, "smooth_pulse"), (FORCES, "fading_force"), (LOCAL_FORCES, "dry_friction"),
    (HARVESTERS, "plate"),
)  # fmt: skip
"""Tables and names of the parts on the page."""


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
    folders = {"deepest": statistic, "my_statistics": statistic, "own_law": law, "own_loss": law, "own_memory": law}
    for text in BLOCKS:
        name = text.split()[1]
        (folders.get(name.removesuffix(".py"), drive) / name).write_text(text, encoding="utf-8")
    sys.path[:0] = [str(statistic), str(law), str(drive)]
    invalidate_caches()
    try:
        import_module("my_statistics")
        yield import_module("own_law").LinearContact, statistic, law
    finally:
        sys.path[:] = [path for path in sys.path if path not in map(str, (statistic, law, drive))]
        unregister_statistic("max_penetration")
        for table, name in REGISTERED:
            table.pop(name, None)
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
    assert len(list(law_folder.glob("*.py"))) == 3
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


def test_impact_on_a_surface_that_yields(own) -> None:
    """What is given back is the elastic energy at the yield force, f_y^2/(2 k); the rest is in the indentation."""
    law = import_module("own_memory").YieldingContact(1e6, 0.5)
    try:
        run = sb.simulate(thrown(lambda _: law, 0.0), sb.Integration(cycles=1, accuracy="reference", engine="native"))
        rebound = 0.5 / math.sqrt(1e6 * MASS)
        assert run.dataset.modal_velocity.values[-1, 0] == pytest.approx(rebound, rel=1e-7)
        lost = 0.5 * MASS * (SPEED**2 - rebound**2)
        assert run.summary.energy_lost_contact == pytest.approx(lost, rel=1e-7)
        assert float(run.final_state.indentation) == pytest.approx(lost / 0.5, rel=1e-7)
        assert run.summary.peak_force == pytest.approx(0.5, rel=1e-9)
    finally:
        del LAWS["yielding"]


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


def test_the_script_of_the_page(own, capsys) -> None:
    """It runs with the drive, the law and the statistic, and prints the output of the page."""
    import_module("run_own")
    printed = re.search(r"run_own\.py.*?```\n\n```\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert capsys.readouterr().out == printed[1]


# Every hook by its documentation: it has an effect, and another name is refused when the class is defined.


def free_mass(**parts) -> sb.System:
    """A mass without a spring."""
    model = sb.ReducedModel.from_matrices(
        [[MASS]],
        [0.0],
        contact_shape=[1.0],
        midspan_shape=[1.0],
        base_shape=[1.0],
        length_scale=0.335e-3,
        reference_frequency=80.0,
    )
    return sb.System(model, **parts)


def test_a_law_that_loses_energy_stops_a_mass(own) -> None:
    """The rebound is that of m d'' = -k d - c d d'; more loss, less of it, and the difference is what was lost."""
    from scipy.integrate import solve_ivp

    law = import_module("own_loss").RubberContact
    for loss in (0.0, 2e5, 2e6):
        run = sb.simulate(
            thrown(lambda spring, loss=loss: law(spring, loss), 1e6), sb.Integration(cycles=1, accuracy="reference")
        )
        released = lambda t, y: 1e6 * y[0] + loss * y[0] * y[1]  # noqa: B023, E731
        released.terminal, released.direction = True, -1.0
        exact = solve_ivp(
            lambda t, y: (y[1], -max(1e6 * y[0] + loss * y[0] * y[1], 0.0) / MASS),  # noqa: B023
            (0.0, 1.0), (1e-15, SPEED), events=released, rtol=1e-12, atol=1e-18, max_step=1e-6,
        )  # fmt: skip
        rebound = -exact.y[1, -1]
        assert run.dataset.modal_velocity.values[-1, 0] == pytest.approx(rebound, rel=1e-6)
        lost = 0.5 * MASS * (SPEED**2 - rebound**2)
        assert run.summary.energy_lost_contact == pytest.approx(lost, rel=1e-5, abs=1e-12)


def test_a_force_of_time_pushes_a_mass(own) -> None:
    """m v = F T (1 - exp(-t/T)); the work is m v^2/2."""
    history = import_module("own_history").FadingForce(first_force=1e-3, fading_periods=0.5)
    run = sb.simulate(
        free_mass(forces=[sb.ExternalForce(history=history)], initial_state=sb.State(amplitude=[0.0])),
        sb.Integration(cycles=2, accuracy="reference"),
    )
    lasting = 0.5 / 80.0
    speed = 1e-3 * lasting / MASS * (1.0 - math.exp(-2.0 / 80.0 / lasting))
    assert run.dataset.modal_velocity.values[-1, 0] == pytest.approx(speed, rel=1e-8)
    assert run.summary["force_work"] == pytest.approx(0.5 * MASS * speed**2, rel=1e-8)


def test_a_circuit_brakes_a_mass(own) -> None:
    """m v' = theta z and C z' = -theta v - z/R: what the mass loses is in the circuit and in the load."""
    import scipy.linalg

    theta, capacitance, resistance = 0.3, 1e-3, 4.0
    plate = import_module("own_harvester").PlateHarvester(
        force_per_volt=theta, capacitance=capacitance, resistance=resistance
    )
    system = free_mass(
        harvesters=[plate],
        base_excitation=sb.BaseExcitation(motion=sb.Sine(frequency_ratio=1.0, velocity_amplitude=0.0)),
        initial_state=sb.State(amplitude=[0.0], velocity=[SPEED]),
    )
    run = sb.simulate(system, sb.Integration(cycles=2, accuracy="reference"))
    rates = np.array([[0.0, theta / MASS], [-theta / capacitance, -1.0 / (resistance * capacitance)]])
    speed, volts = scipy.linalg.expm(rates * 2.0 / 80.0) @ (SPEED, 0.0)
    assert run.dataset.modal_velocity.values[-1, 0] == pytest.approx(speed, rel=1e-7, abs=1e-9 * SPEED)
    given = 0.5 * MASS * (SPEED**2 - speed**2) - 0.5 * capacitance * volts**2
    assert run.summary["energy_harvested"] == pytest.approx(given, rel=1e-6)


def test_a_motion_of_ones_own_moves_a_base(own) -> None:
    """Of a free mass in the frame of the base: minus the displacement of the base."""
    pulse = import_module("own_drive").SmoothPulse(displacement_amplitude=0.7, pulse_periods=3.0)
    system = free_mass(base_excitation=sb.BaseExcitation(motion=pulse), initial_state=sb.State(amplitude=[0.0]))
    run = sb.simulate(system, sb.Integration(cycles=2, accuracy="reference"))
    moved = 0.5 * 0.7 * (1.0 - math.cos(2.0 * math.pi * 2.0 / 3.0)) * 0.335e-3
    assert abs(run.dataset.modal_amplitude.values[-1, 0]) == pytest.approx(moved, rel=1e-7)


def test_forces_of_the_velocity_act_together(own) -> None:
    """Two frictions, a contact that loses energy and a circuit, as the page says; each takes energy."""
    friction = import_module("own_force").DryFriction
    found = []
    for forces in (1, 2):
        system = sb.System(
            sb.ReducedModel.from_beam(default_values.BEAM, modes=2, damping_ratio=0.01),
            contacts=[
                sb.Contact(
                    import_module("own_loss").RubberContact(1e6, 1e6),
                    sb.Shaker(frequency_ratio=1.21, velocity_amplitude=0.18),
                )
            ],
            forces=[
                friction(friction_force=2e-3, smoothing_velocity=0.02, location=place) for place in (0.5, 0.4)[:forces]
            ],
            harvesters=[
                sb.PiezoelectricHarvester(moment_per_volt=1e-5, capacitance=60e-9, resistance=1e5)
            ],
        )  # fmt: skip
        summary = sb.simulate(system, sb.Integration(cycles=3)).summary
        assert summary["energy_lost_contact"] > 0.0 and summary["energy_harvested"] > 0.0
        found.append(summary["local_force_work"])
    assert found[1] < found[0] < 0.0


def test_the_script_of_friction(own, capsys) -> None:
    import_module("run_friction")
    printed = re.search(r"run_friction\.py.*?```\n\n```\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert capsys.readouterr().out == printed[1]


def of_two(law, a):
    return 0.0


def of_three(law, a, b):
    return 0.0


SPRING = {"force": staticmethod(of_two), "energy": staticmethod(of_two), "slope": staticmethod(of_two)}
POTENTIAL = {"force": staticmethod(of_two), "energy": staticmethod(of_two)}
MOVING = {"motion": staticmethod(of_two)}
TIMED = {name: (lambda self, columns, scale: None) for name in ("cycle", "shape_numbers", "bounds")} | MOVING
CIRCUIT = {name: (lambda self, given: given) for name in ("row", "loss", "share", "volts")} | {"inertia": 1.0}


@pytest.mark.parametrize(
    ("base", "body", "words"),
    [
        (sb.ContactLaw, SPRING | {"damping": staticmethod(of_two)}, r"damping: is no hook.*'damping_coefficient'"),
        (sb.ContactLaw, SPRING | {"stiffness": staticmethod(of_two)}, r"stiffness: is no hook.*the hooks are name, force"),
        (sb.ContactLaw, SPRING | {"rate_dependant": True}, r"'rate_dependent'"),
        (sb.ContactLaw, SPRING | {"impact_durations": lambda self, mass, velocity: 1.0}, r"'impact_duration'"),
        (sb.ContactLaw, SPRING | {"damping_coefficient": staticmethod(of_two)}, r"is read only with rate_dependent"),
        (sb.ContactLaw, SPRING | {"rate_dependent": True}, r"needs damping_coefficient"),
        (sb.ContactLaw, SPRING | {"memory_after": staticmethod(of_two)}, r"is read only with memory"),
        (sb.ContactLaw, {"energy": staticmethod(of_two)}, r"has no force"),
        (sb.LocalForce, POTENTIAL | {"damping": staticmethod(of_three)}, r"did you mean 'damping_"),
        (sb.LocalForce, POTENTIAL | {"range": (0.0, 1.0)}, r"range: is no hook"),
        (sb.LocalForce, POTENTIAL | {"damping_force": staticmethod(of_three)}, r"is read only with dissipative"),
        (sb.LocalForce, {"dissipative": True, "damping_force": staticmethod(of_three)}, r"needs damping_coefficient"),
        (sb.LocalForce, {"energy": staticmethod(of_two)}, r"has no force"),
        (sb.LocalForce, {}, r"has no force"),
        (Timed, TIMED | {"bound": lambda self, columns, scale: None}, r"did you mean 'bounds'"),
        (Timed, TIMED | {"discontinuity": ("duration",)}, r"discontinuity: is no hook"),
        (Timed, TIMED | {"number_names": ("omega",)}, r"number_names: is no hook"),
        (Timed, TIMED | {"components": TIMED["cycle"]}, r"has components and motion; .* define one"),
        (Timed, {k: v for k, v in TIMED.items() if k != "bounds"}, r"has no bounds"),
        (Timed, {k: v for k, v in TIMED.items() if k != "motion"}, r"has no components and no motion; .* define one"),
        (Drive, TIMED | {"numbers": TIMED["cycle"], "harmonic": True, "shape_numbers": TIMED["cycle"]}, r"set harmonic"),
        (ForceHistory, {"cycle": TIMED["cycle"]} | MOVING, r"has no bounds"),
        (ForceHistory, TIMED | {"max_acceleration": TIMED["cycle"]}, r"max_acceleration: .* did you mean 'peak_acceleration'"),
        (Harvester, CIRCUIT | {"voltage": 1.0}, r"voltage: is no hook"),
        (Harvester, {k: v for k, v in CIRCUIT.items() if k != "share"}, r"has no share"),
    ],
)  # fmt: skip
def test_a_hook_by_another_name_is_refused(base, body, words) -> None:
    name = "part_of_a_test"
    with pytest.raises(InputError, match=words):
        type("PartOfATest", (base,), {"name": name, "__module__": __name__} | body)
    assert not any(name in table for table in (LAWS, DRIVES, FORCES, LOCAL_FORCES, HARVESTERS))


def test_names_of_ones_own_are_taken() -> None:
    """A constant, a method, a constructor, and what begins with an underscore."""
    body = {
        "_table": (1.0, 2.0),
        "steepest": lambda self: 1.0,
        "from_steel": classmethod(lambda cls: cls()),
        "__module__": __name__,
    }
    assert type("Own", (sb.ContactLaw,), SPRING | body).hooks == sb.ContactLaw.hooks


@pytest.mark.parametrize(
    ("hooks", "words"),
    [
        ({"value": lambda: 0.0}, r"value must be a function of \(reading\)"),
        ({"value": lambda reading: 0.0, "update": lambda held, step: held}, r"value .* \(reading, held\)"),
        ({"value": lambda reading, held: held, "update": lambda step: 0.0}, r"update .* \(held, step\)"),
    ],
)
def test_a_statistic_that_cannot_be_called_is_refused(hooks, words) -> None:
    with pytest.raises(InputError, match=words):
        register_statistic(Statistic("own_of_a_test", "float64", "m", "statistic of a test", **hooks))
    assert "own_of_a_test" not in STATISTICS


@pytest.mark.parametrize("base", [sb.ContactLaw, sb.LocalForce, Timed, ForceHistory, Harvester])
def test_documented_hooks_are_those_that_are_read(base) -> None:
    """Every function that a docstring names is a hook, and every hook stands in a docstring or on the page."""
    written = " ".join(kind.__doc__ or "" for kind in base.__mro__[:-1])
    for name in re.findall(r"``(\w+)\((?:law|drive)", written):
        assert name in base.hooks
    page = PAGE.read_text(encoding="utf-8")
    described = {"frequencies", "mirrored_bounds", "diagnostics", "unit", "file_keys", "file_gives", "numbers"}
    for name in set(base.hooks) - described:
        assert re.search(rf"\b{name}\b", written + page), name
    for name in described & set(base.hooks) - {"file_keys", "file_gives"}:
        assert getattr(base, name).__doc__ or getattr(base, name).fget.__doc__, name
