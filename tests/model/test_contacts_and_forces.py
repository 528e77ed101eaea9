"""Any number of contacts and forces: names by number and by label, files, and what a run refuses."""

from __future__ import annotations

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.cli.parameter_options import configured
from snapbeam.model import default_values
from snapbeam.model.parameter_file import config_from_mapping, config_text, load_config
from snapbeam.solver.restrictions import check_integrable
from snapbeam.util.validation import InputError, InputTypeError

MODEL = sb.ReducedModel.from_beam(default_values.BEAM, modes=2)
HERTZ = default_values.CONTACT
SHAKER = sb.Shaker(frequency_ratio=1.21, velocity_amplitude=0.1)
STOP = sb.Striker(drive=sb.FixedStop(), location=0.3, side="above", gap=5e-5)
SYSTEM = sb.System(
    MODEL,
    contacts=[
        sb.Contact(HERTZ, SHAKER),
        sb.Contact(sb.PowerLaw.from_stiffness(4e11, 2.0), STOP, label="stop"),
        sb.Contact(HERTZ, STOP),
    ],
    forces=[
        sb.LocalSpring(stiffness=20.0, location=0.4),
        sb.MagneticForce(strength=1e-9, gap=1e-3, location=0.5, label="magnet"),
        sb.ExternalForce(history=sb.ConstantForce(force=1e-3), location=0.6),
    ],
)


def test_names_by_number_and_by_label():
    changed = SYSTEM.replace(**{
        "contact.stop.gap": 6e-5, "contact.3.gap": 7e-5, "contact.1.location": 0.45, "drive.1.phase": 0.2,
        "force.stiffness": 30.0, "force.magnet.strength": 2e-9, "force.3.force": 2e-3,
    })  # fmt: skip
    assert [each.striker.gap for each in changed.contacts] == [None, 6e-5, 7e-5]
    assert (changed.striker.location, changed.striker.drive.phase) == (0.45, 0.2)
    assert (changed.forces[0].stiffness, changed.forces[1].strength) == (30.0, 2e-9)
    assert changed.forces[2].history.force == 2e-3
    for names in (
        ("contact.stop.gap", "contact.2.gap"),
        ("force.magnet.gap", "force.2.gap"),
        ("contact.1.side", "contact.side"),
    ):
        assert changed.get(names[0]) == changed.get(names[1])
    assert changed.contacts[1].label == "stop" and changed.contacts[0].law is SYSTEM.contacts[0].law
    named = SYSTEM.replace(**{"contact.2.label": "gap"})  # a label that is the name of a field, too
    assert named.replace(**{"contact.gap": 1e-5}).contacts[0].striker.gap == 1e-5
    assert named.get("contact.gap.side") == "above"
    wall = SYSTEM.replace(
        **{"contact.stop.law": HERTZ, "drive.3": SHAKER.striker().drive, "force.magnet": SYSTEM.forces[0]}
    )
    assert wall.contacts[1].law == HERTZ and wall.contacts[1].striker == STOP
    assert wall.contacts[2].striker.drive == SHAKER.striker().drive
    assert wall.forces[1] == SYSTEM.forces[0]
    assert SYSTEM.replace(contacts=SYSTEM.contacts[:1], forces=[]).surroundings == ()


def test_files(tmp_path):
    """Arrays of tables, the drive of a contact in its table; what is written is read again."""
    SYSTEM.save(tmp_path / "system.toml")
    text = (tmp_path / "system.toml").read_text()
    assert text.count("[[contact]]") == 3 and text.count("[[force]]") == 3 and "[striker" not in text
    assert sb.System.load(tmp_path / "system.toml") == SYSTEM
    assert sb.System.from_mapping(SYSTEM.to_mapping()) == SYSTEM
    mine = """
extends = "paper"
[[contact]]
location = 0.4
[contact.drive]
frequency_hz = 100
velocity_amplitude = 0.1
[[contact]]
label = "stop"
gap = "50 um"
side = "above"
[[force]]
type = "local_spring"
stiffness = "2 mN/um"
location = 0.5
[[force]]
type = "constant_force"
label = "weight"
force = 1e-3
location = 0.5
"""
    (tmp_path / "mine.toml").write_text(mine)
    config = load_config(tmp_path / "mine.toml")
    system = config.system
    assert [each.label for each in system.contacts] == ["", "stop"]
    assert system.contacts[1].law == system.contacts[0].law and system.get("contact.stop.gap") == pytest.approx(5e-5)
    assert system.get("force.stiffness") == 2000.0 and system.get("force.weight.force") == 1e-3
    for written in (config_text(config), config_text(config.whole())):
        (tmp_path / "again.toml").write_text(written)
        assert load_config(tmp_path / "again.toml").system == system
    given = {"config": tmp_path / "mine.toml", "set_": ["contact.stop.gap=60um", "force.weight.force=2e-3"]}
    changed = configured(given).system
    assert changed.get("contact.2.gap") == pytest.approx(6e-5) and changed.get("force.2.force") == 2e-3
    with pytest.raises(
        InputError, match=r"contact\.wall\.gap: this system has no contact 'wall'; must be one of 1, 2, stop"
    ):
        configured(given | {"set_": ["contact.wall.gap=1um"]})
    (tmp_path / "swept.toml").write_text(mine + '[sweep]\n"contact.stop.gap" = "20um:60um:3"\n')
    axes = load_config(tmp_path / "swept.toml").axes()
    np.testing.assert_allclose(axes["contact.2.gap"], [2e-5, 4e-5, 6e-5])
    twice = {"extends": "paper", "contact": {"drive": {"type": "fixed"}}, "drive": {"type": "fixed"}}
    with pytest.raises(InputError, match=r"\[contact\] drive: is also given in \[drive\]; leave one out"):
        config_from_mapping(twice)
    with pytest.raises(InputError, match=r"\[contact\.3\]: there is none before it; number them 1, 2, 3"):
        sb.System.from_mapping(sb.System(MODEL).to_mapping() | {"contact": {}, "contact.3": {}})
    for section in ("contact", "force"):
        with pytest.raises(InputError, match=rf"{section} = \[\]: must be a table, or an array of at least one"):
            config_from_mapping({"extends": "paper", section: []})


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        (
            {"contacts": [sb.Contact(HERTZ, STOP, "a"), sb.Contact(HERTZ, STOP, "a")]},
            "contacts: two have the label 'a'",
        ),
        ({"forces": [SYSTEM.forces[1]] * 2}, "forces: two have the label 'magnet'"),
        ({"forces": SYSTEM.forces[0]}, r"forces = LocalSpring\(.*: must be a list or tuple"),
        ({"forces": [HERTZ]}, r"forces\[0\] = HertzContact\(.*: must be an ExternalForce"),
        ({"forces": [sb.LocalSpring(stiffness=1.0)]}, "force.location = None: a force on a beam acts at a location"),
        ({"harvesters": [None]}, r"harvesters\[0\] = None: must be a PiezoelectricHarvester"),
        ({"base_excitation": 1.0}, "base_excitation = 1.0: must be a BaseExcitation"),
    ],
)
def test_refused_parts(parts, message):
    with pytest.raises((InputError, InputTypeError), match=message):
        sb.System(MODEL, **parts)


@pytest.mark.parametrize("label", ["left stop", "50 %", "stop.gap", "Anschlag Nr. 2", "=", "ü"])
def test_a_part_is_named_by_a_label_of_any_characters(label, tmp_path):
    """Also beside a label that is the beginning of it, and with a dot before a field's name."""
    stops = [sb.Contact(HERTZ, STOP, "stop"), sb.Contact(HERTZ, STOP, label)]
    system = sb.System(MODEL, contacts=stops)
    moved = system.replace(**{f"contact.{label}.gap": 1e-4})
    assert moved.get(f"contact.{label}.gap") == moved.get("contact.2.gap") == 1e-4
    assert moved.get("contact.stop.gap") == system.get("contact.1.gap")
    moved.save(tmp_path / "labelled.toml")
    assert sb.System.load(tmp_path / "labelled.toml") == moved


@pytest.mark.parametrize("label", ["2", " a", "a\n", 3])
def test_refused_labels(label):
    for make in (
        lambda: sb.Contact(HERTZ, STOP, label),
        lambda: sb.LocalSpring(stiffness=1.0, location=0.5, label=label),
    ):
        with pytest.raises(InputError, match=r"label = .*: must be printable text"):
            make()


def test_questions_and_runs_of_many_parts():
    """Two external forces beside two harvesters and six contacts: equilibria, and nothing to refuse."""
    coil = sb.ElectromagneticHarvester(force_factor=1.0, resistance=10.0)
    weight = sb.ExternalForce(history=sb.ConstantForce(force=-2e-3), location=0.5)
    system = sb.System(MODEL, contacts=[sb.Contact(HERTZ, STOP)] * 6, forces=[weight, weight], harvesters=[coil, coil])
    one = sb.System(MODEL, forces=[sb.ExternalForce(history=sb.ConstantForce(force=-4e-3), location=0.5)])
    for each, same in zip(system.potential.equilibria, one.potential.equilibria, strict=True):
        np.testing.assert_allclose(each.amplitude, same.amplitude, rtol=1e-9, atol=1e-12)
    check_integrable(system)
    single = sb.ReducedModel.from_beam(default_values.BEAM, modes=1)
    newton = sb.System(single, contacts=[sb.Contact(sb.Restitution(0.5), SHAKER), sb.Contact(HERTZ, STOP)])
    assert sb.simulate(newton, sb.Integration(cycles=2)).summary.status == sb.RunStatus.OK


@pytest.mark.slow
def test_two_equal_coils_are_one():
    """Two coils of force factor K beside each other damp as one of sqrt(2) K, and so do two layers."""
    how = sb.Integration(cycles=3)
    for kind, factor, rest in (
        (sb.ElectromagneticHarvester, "force_factor", {"resistance": 10.0, "location": 0.4}),
        (sb.PiezoelectricHarvester, "moment_per_volt", {"resistance": 2e4, "capacitance": 6e-8, "patch_end": 0.25}),
    ):
        ends = []
        for strength, count in ((1e-4, 2), (1e-4 * 2.0**0.5, 1)):
            parts = [kind(**{factor: strength * (1e4 if factor == "force_factor" else 1.0)}, **rest)] * count
            system = sb.System(MODEL, contacts=[sb.Contact(HERTZ, SHAKER)], harvesters=parts)
            ends.append(sb.simulate(system, how))
        for name in ("energy_harvested", "max_displacement", "peak_force"):
            assert getattr(ends[0].summary, name) == pytest.approx(getattr(ends[1].summary, name), rel=1e-7)
        voltages = ends[0].dataset.voltages.values
        assert np.array_equal(voltages[:, 0], voltages[:, 1])


@pytest.mark.slow
def test_springs_at_one_place_are_one_spring():
    """Two springs side by side are one of the summed stiffness: potential, and a run to rounding."""
    start = sb.State(amplitude=0.9 * MODEL.well_amplitude)
    one, other = sb.LocalSpring(stiffness=12.0, location=0.4), sb.LocalSpring(stiffness=8.0, location=0.4)
    two = sb.System(MODEL, forces=[one, other], initial_state=start)
    whole = two.replace(forces=[sb.LocalSpring(stiffness=20.0, location=0.4)])
    assert [each.energy for each in two.potential.wells] == pytest.approx(
        [each.energy for each in whole.potential.wells], rel=1e-12
    )
    how = sb.Integration(cycles=3, step=2e-5)
    ends = [sb.simulate(each, how).final_state for each in (two, whole)]
    np.testing.assert_allclose(ends[0].amplitude, ends[1].amplitude, rtol=1e-9)


@pytest.mark.slow
def test_a_sweep_over_labels():
    system = sb.System(MODEL, contacts=[sb.Contact(HERTZ, SHAKER), sb.Contact(HERTZ, STOP, label="stop")])
    how = sb.Integration(cycles=2)
    found = sb.sweep(system, {"contact.stop.gap": [2e-5, 5e-5]}, how)
    same = sb.sweep(system, {"contact.2.gap": [2e-5, 5e-5]}, how)
    np.testing.assert_array_equal(found.peak_force, same.peak_force)
    assert found.peak_force.dims == ("striker_gap_contact_2",)
