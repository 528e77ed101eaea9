"""A system: one value that describes itself, hashes, saves and reads back equal, and changes by dotted name."""

from __future__ import annotations

import dataclasses
import pickle

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.util.validation import InputError, InputTypeError

MODEL = sb.ReducedModel.from_beam(default_values.BEAM, modes=3)
SHAKER = sb.Shaker(frequency_ratio=1.21, velocity_amplitude=0.18)
PLAIN = sb.System(MODEL, contacts=[sb.Contact(default_values.CONTACT, SHAKER)])


def record(samples: int = 400, last: float = 0.0) -> sb.Striker:
    """A sine of 600 rad/s, its last sample shifted a little."""
    t = np.arange(samples) / 20_000.0
    displacement = 1e-4 * np.sin(600.0 * t)
    displacement[-1] += last
    return sb.Striker(
        drive=sb.RecordedMotion(
            displacement=displacement, velocity=0.06 * np.cos(600.0 * t), sampling_frequency=20_000.0, frequency=95.0
        )
    )


def start(**changes) -> sb.State:
    given = {"amplitude": 0.9 * MODEL.well_amplitude, "velocity": np.array([1e-3, 0.0, 0.1])}
    return sb.State(**(given | changes))


BY_MATRICES = sb.ReducedModel.from_matrices(
    [[1.0, 0.1], [0.1, 2.0]],
    [-4.0, 3.0],
    contact_shape=[1.0, 1.0],
    nonlinear_stiffness=4.0,
    well_amplitude=[-1.0, 0.0],
    damping_ratio=[0.01, 0.02],
)
SYSTEMS = {
    "plain": PLAIN,
    "recorded": PLAIN.replace(**{"contact.striker": record()}),
    "start": PLAIN.replace(initial_state=start(striker_position=1e-4, phase=0.3, contact_time=1e-5)),
    "free": sb.System(MODEL, initial_state=start()),
    "matrices": sb.System(
        BY_MATRICES,
        contacts=[
            sb.Contact(sb.HertzContact(1e3), sb.Shaker(frequency_ratio=1.0, velocity_amplitude=0.1, side="above"))
        ],
    ),
    "gap": PLAIN.replace(**{"contact.gap": -1e-4, "drive.phase": 1.0}),
    "load": PLAIN.replace(**{"beam.axial_load": 36.0}),
    "damping by mode": sb.System(
        sb.ReducedModel.from_beam(default_values.BEAM, modes=2, damping_ratio=[0.01, 0.02], reference_frequency=80.0),
        contacts=[sb.Contact(default_values.CONTACT, SHAKER)],
    ),
    "restitution": sb.System(
        sb.ReducedModel.from_beam(default_values.BEAM, modes=1), contacts=[sb.Contact(sb.Restitution(0.6), SHAKER)]
    ),
}


# ---------------------------------------------------------------------- files


@pytest.mark.parametrize("name", SYSTEMS)
def test_saved_and_read_back_equal(name: str, tmp_path) -> None:
    system = SYSTEMS[name]
    system.save(tmp_path / "system.toml")
    assert [file.name for file in tmp_path.iterdir()] == ["system.toml"]
    again = sb.System.load(tmp_path / "system.toml")
    assert again == system
    assert again.hash == system.hash
    assert hash(again) == hash(system)
    np.testing.assert_equal(again.to_mapping(), system.to_mapping())
    np.testing.assert_array_equal(again.model.linear_modes, system.model.linear_modes)
    assert sb.System.from_mapping(system.to_mapping()) == system
    assert pickle.loads(pickle.dumps(system)) == system


@pytest.mark.slow
def test_what_is_read_back_runs_alike(tmp_path) -> None:
    for name in ("start", "recorded", "restitution"):
        SYSTEMS[name].save(tmp_path / "system.toml")
        runs = [
            sb.simulate(system, sb.Integration(cycles=1, accuracy="reference"), sample_times=[0.0])
            for system in (SYSTEMS[name], sb.System.load(tmp_path / "system.toml"))
        ]
        np.testing.assert_equal(dict(runs[0].summary), dict(runs[1].summary))
        np.testing.assert_array_equal(runs[0].final_state.amplitude, runs[1].final_state.amplitude)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[bam]\n", r"\[bam\]: unknown section; did you mean 'beam'"),
        ("beam = 3\n", r"beam = 3: must be a section \[beam\]"),
        ("[beam]\n", r"\[beam\] length, thickness, width, density, young_modulus: missing"),
        ("[model]\nmodes = 3\n", r"\[model\] modes: unknown key; must be one of mass"),
        ("[model]\nmass = [[1.0]]\n", r"\[model\] stiffness is missing: give it, or a section \[beam\]"),
        ("[initial_state]\nphase = 1.0\n", r"\[model\] mass is missing"),
        ("[model\n", "is no TOML"),
    ],
)
def test_files_that_are_no_system(tmp_path, text: str, message: str) -> None:
    path = tmp_path / "system.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=message):
        sb.System.load(path)


def test_files_that_cannot_be_used(tmp_path) -> None:
    with pytest.raises(InputError, match="cannot be read, No such file"):
        sb.System.load(tmp_path / "none.toml")
    with pytest.raises(InputError, match=r"must end in \.toml"):
        PLAIN.save(tmp_path / "system.json")
    sections = PLAIN.to_mapping() | {"initial_state": {"phase": 1.0}}
    with pytest.raises(InputError, match=r"\[initial_state\] amplitude: missing"):
        sb.System.from_mapping(sections)
    with pytest.raises(InputError, match=r"\[drive\] type = None: must be one of 'burst', 'chirp'"):
        sb.System.from_mapping(PLAIN.to_mapping() | {"drive": {}})


# ---------------------------------------------------------------------- identity


CHANGES = {
    "beam.length": 0.17,
    "beam.thickness": 5e-4,
    "beam.width": 0.02,
    "beam.density": 7700.0,
    "beam.young_modulus": 1.9e11,
    "beam.buckling_level": 3e-4,
    "beam.axial_load": 36.0,
    "model.modes": 5,
    "model.damping_ratio": 0.01,
    "model.reference_frequency": 80.0,
    "boundary.left_rotational_stiffness": 10.0,
    "boundary.right_rotational_stiffness": 10.0,
    "boundary.axial_support_stiffness": 1e8,
    "imperfection.midspan_amplitude": 1e-5,
    "imperfection.antisymmetric_amplitude": 1e-6,
    "imperfection.point_load": 0.01,
    "imperfection.uniform_load": 0.05,
    "imperfection.gravity": 0.1,
    "contact.stiffness": 2e8,
    "contact.location": 0.3,
    "contact.side": "above",
    "contact.gap": 1e-5,
    "contact.mass": 0.02,
    "drive.frequency_ratio": 1.3,
    "drive.velocity_amplitude": 0.2,
    "drive.phase": 0.5,
    "initial_state.amplitude[1]": -0.9,
    "initial_state.velocity[2]": 0.1,
    "initial_state.striker_position": 1e-4,
    "initial_state.phase": 0.1,
}


@pytest.mark.parametrize("name", CHANGES)
def test_any_change_is_another_system(name: str) -> None:
    changed = PLAIN.replace(**{name: CHANGES[name]})
    assert changed != PLAIN
    assert changed.hash != PLAIN.hash
    if not name.startswith("initial_state."):
        assert changed.get(name) == CHANGES[name]
    assert len({PLAIN, changed, PLAIN.replace()}) == 2


def test_every_parameter_of_scope_run_can_be_changed() -> None:
    from snapbeam.model.parameters import parameters

    own = {"contact": "hertz", "drive": "sine"}
    names = {
        name
        for name, row in parameters().items()
        if row.section
        not in (
            "integration",
            "base_excitation",
            "axial_load",
            "force",
            "harvester",
        )  # which the paper's system has none of
        and (not row.kinds or own[row.section] in row.kinds)
    }
    # of a body alone, or of a rise or a force that is there; a profile is no number
    others = {"contact.suspension_stiffness", "contact.suspension_damping"}
    others |= {"initial_state.initial_well"}  # see test_initial_well.py
    others |= {f"imperfection.{name}" for name in ("shape", "point_location", "profile")}
    assert names - set(CHANGES) == others


OF_OTHERS = {
    "hunt_crossley": (sb.HuntCrossley(4e8, 2.0), {"damping_factor": 1.0, "stiffness": 3e8}),
    "kelvin_voigt": (sb.KelvinVoigt(1e6, 2.0), {"linear_stiffness": 2e6, "linear_damping": 1.0}),
    "power": (sb.PowerLaw(1.0, 2.0), {"force_at_1um": 2.0, "exponent": 1.7}),
    "layer": (sb.LayeredHertz(4e8, 1e13), {"stiffness": 3e8, "layer_stiffness": 2e13}),
    "elastic_plastic": (
        sb.ElasticPlasticContact(1e5, 2e5),
        {"loading_stiffness": 9e4, "unloading_stiffness": 3e5},
    ),
    "restitution": (None, {}),
    "recorded_motion": (None, {}),
    "recorded_acceleration": (None, {}),
    "burst": (
        sb.Burst(frequency_ratio=1.0, velocity_amplitude=0.1, duration_cycles=5.0),
        {
            "frequency_ratio": 1.1, "velocity_amplitude": 0.2, "duration_cycles": 6.0, "ramp_up_cycles": 2.0,
            "ramp_down_cycles": 0.5, "retraction": 0.1,
        },
    ),
    "chirp": (
        sb.Chirp(start_ratio=0.5, stop_ratio=2.0, velocity_amplitude=0.1, sweep_cycles=20.0),
        {"start_ratio": 0.6, "stop_ratio": 3.0, "velocity_amplitude": 0.2, "sweep_cycles": 30.0, "sweep_type": "log"},
    ),
    "half_sine": (
        sb.HalfSine(displacement_amplitude=0.1, duration=0.5), {"displacement_amplitude": 0.2, "duration": 0.6}
    ),
    "shock": (
        sb.Shock(acceleration_g=10.0, duration_ms=11.0),
        {"acceleration_g": 20.0, "duration_ms": 6.0, "shape": "trapezoid", "rise_fraction": 0.2},
    ),
    "band_limited_noise": (
        sb.BandLimitedNoise(low_ratio=0.5, high_ratio=2.0, velocity_rms=0.1),
        {"low_ratio": 0.6, "high_ratio": 3.0, "velocity_rms": 0.2, "seed": 5, "ramp_up_cycles": 2.0},
    ),
    "random_vibration": (
        sb.RecordedAcceleration.from_psd([(20.0, 0.04), (200.0, 0.04)], duration_s=0.5),
        {"psd": ((20.0, 0.04), (200.0, 0.02)), "duration_s": 0.4, "rms_g": 1.0, "seed": 2, "ramp_up_s": 0.1},
    ),
    "constant_velocity": (sb.ConstantVelocity(speed=0.4), {"speed": 0.5}),
    "fixed": (sb.FixedStop(), {}),
    "acceleration_chirp": (
        sb.model.AccelerationChirp(start_ratio=0.5, stop_ratio=2.0, acceleration_amplitude=0.1, sweep_cycles=9.0),
        {"start_ratio": 0.6, "stop_ratio": 1.5, "acceleration_amplitude": 0.2, "sweep_cycles": 8.0, "sweep_type": "log"},
    ),
    "displacement_sine": (
        sb.DisplacementSine(frequency_ratio=1.0, displacement_amplitude=0.1),
        {"frequency_ratio": 1.1, "displacement_amplitude": 0.2, "phase": 0.1},
    ),
    "acceleration_sine": (
        sb.AccelerationSine(frequency_ratio=1.0, acceleration_amplitude=0.1),
        {"frequency_ratio": 1.1, "acceleration_amplitude": 0.2, "phase": 0.1},
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", OF_OTHERS)
def test_other_laws_and_drives_too(kind) -> None:
    """Every parameter of theirs makes another system, and every system comes back from its mapping."""
    from snapbeam.model.parameters import parameters

    part, changes = OF_OTHERS[kind]
    if part is None:
        return
    section = "contact" if isinstance(part, sb.ContactLaw) else "drive"
    system = PLAIN.replace(**{"contact.law" if section == "contact" else section: part})
    assert sb.System.from_mapping(system.to_mapping()) == system
    held = {name for name, row in parameters().items() if kind in row.kinds and row.section == section}
    assert held == {f"{section}.{name}" for name in changes}
    for name, value in changes.items():
        changed = system.replace(**{f"{section}.{name}": value})
        assert changed.hash != system.hash
        assert changed.get(f"{section}.{name}") == value


def test_every_law_and_drive_is_asked() -> None:
    from snapbeam.model.contact.base import LAWS
    from snapbeam.model.drive.base import DRIVES

    assert {*LAWS, *DRIVES} - {"hertz", "sine"} == set(OF_OTHERS)


@pytest.mark.slow
def test_every_sample_and_the_start_are_hashed() -> None:
    """Two runs with different records or starts do not carry the same parameter hash."""
    one, other = (PLAIN.replace(**{"contact.striker": record(last=shift)}) for shift in (0.0, 1e-12))
    assert one.hash != other.hash
    begun, elsewhere = (PLAIN.replace(initial_state=start(velocity=[0.0, 0.0, v])) for v in (0.1, 0.1 + 1e-15))
    assert begun.hash != elsewhere.hash
    asked = sb.Integration(cycles=1)
    attrs = [sb.simulate(system, asked, sample_times=[0.0]).dataset.attrs for system in (one, other, begun, elsewhere)]
    assert len({each["parameter_hash"] for each in attrs}) == 4
    assert [each["system_hash"] for each in attrs] == [s.hash for s in (one, other, begun, elsewhere)]


def test_what_a_state_met_on_its_way_is_no_part_of_a_system(tmp_path) -> None:
    """A system that begins in a state from a run is the one that is read back from its file."""
    state = sb.advance(PLAIN, periods=1, tangent=np.zeros((1, 2, 3)))
    system = PLAIN.replace(initial_state=state)
    assert (
        system.initial_state.modal is None
        and system.initial_state.statistics is None
        and system.initial_state.tangent is None
    )
    system.save(tmp_path / "system.toml")
    again = sb.System.load(tmp_path / "system.toml")
    asked = sb.Integration(cycles=3)
    runs = [sb.simulate(each, asked, sample_times=[0.0]) for each in (system, again)]
    np.testing.assert_equal(dict(runs[0].summary), dict(runs[1].summary))


def test_hash_is_the_same_tomorrow() -> None:
    """Over versions, else no result can be traced to its parameters."""
    assert PLAIN.hash == "6ab7a1d29d48" + PLAIN.hash[12:]


# ---------------------------------------------------------------------- neighbours


def test_replace_keeps_everything_else() -> None:
    changed = PLAIN.replace(**{"beam.thickness": 5e-4, "contact.location": 0.3})
    assert changed.model.beam == dataclasses.replace(default_values.BEAM, thickness=5e-4)
    assert changed.model.beam.buckling_level == default_values.BEAM.buckling_level
    assert changed.model.beam.axial_load > default_values.BEAM.axial_load
    assert changed.striker == dataclasses.replace(PLAIN.striker, location=0.3)
    assert changed.contact_law is PLAIN.contact_law
    assert changed.model.modes == 3
    assert PLAIN.get("contact.location") == pytest.approx(1.0 / 2.1), "the first one is as it was"
    assert PLAIN.replace() == PLAIN


def test_whole_parts() -> None:
    assert PLAIN.replace(beam=default_values.BEAM.replace(width=0.02)).get("beam.width") == 0.02
    assert PLAIN.replace(drive=sb.Sine(frequency_ratio=2.0, velocity_amplitude=0.1)).get("drive.frequency_ratio") == 2.0
    assert PLAIN.replace(contacts=[], initial_state=start()).striker is None
    shaken = PLAIN.replace(**{"contact.striker": sb.Shaker(frequency_ratio=3.0, velocity_amplitude=0.1, location=0.2)})
    assert (shaken.get("drive.frequency_ratio"), shaken.get("contact.location")) == (3.0, 0.2)
    both = PLAIN.replace(model=sb.ReducedModel.from_beam(default_values.BEAM, 2), **{"beam.width": 0.02})
    assert (both.model.modes, both.get("beam.width")) == (2, 0.02)


def test_damping_and_reference_of_a_structure_given_by_matrices() -> None:
    system = SYSTEMS["matrices"].replace(**{"model.damping_ratio": 0.05, "model.reference_frequency": 1.0})
    assert system.model.damping_ratio.tolist() == [0.05, 0.05]
    assert system.model.reference_frequency == 1.0
    np.testing.assert_array_equal(system.model.mass, BY_MATRICES.mass)
    np.testing.assert_allclose(system.model.natural_frequencies, BY_MATRICES.natural_frequencies, rtol=1e-15)


def test_another_number_of_modes_keeps_the_start() -> None:
    system = PLAIN.replace(initial_state=start())
    more = system.replace(**{"model.modes": 5})
    np.testing.assert_array_equal(more.initial_state.amplitude, [*system.initial_state.amplitude, 0.0, 0.0])
    np.testing.assert_array_equal(more.initial_state.velocity, [1e-3, 0.0, 0.1, 0.0, 0.0])
    with pytest.raises(InputError, match=r"modes = 2: a state of 3 modes cannot be cut to fewer without loss"):
        system.replace(**{"model.modes": 2})
    assert system.replace(**{"model.modes": 5}).replace(**{"model.modes": 3}) == system


def test_names_are_those_of_the_axes_of_maps() -> None:
    changed = PLAIN.replace(modes=4, velocity_amplitude=0.31)
    assert changed.model.modes == 4 and changed.parameters["drive.velocity_amplitude"] == 0.31
    assert changed.to_mapping() == PLAIN.replace(**{"model.modes": 4, "drive.velocity_amplitude": 0.31}).to_mapping()
    with pytest.raises(InputError, match="velocity_amp: is not a parameter; did you mean"):
        PLAIN.replace(velocity_amp=0.3)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"beam.thicknes": 1.0}, r"beam\.thicknes: is not a parameter of a beam; must be one of length, thickness"),
        (
            {"nothing.x": 1.0},
            r"nothing\.x: is not a parameter of a system; its sections are beam, model, boundary, imperfection, contact",
        ),
        ({"mode": 3}, "mode: is not a parameter; did you mean"),
        (
            {"contact.coefficient": 0.5},
            r"contact\.coefficient: is not a parameter of this system; must be one of stiffness",
        ),
        (
            {"model.mass": 1.0},
            r"model\.mass: cannot be changed; must be one of modes, damping_ratio, reference_frequency",
        ),
        ({"contact.frequency_ratio": 1.0}, "must be one of stiffness, location, side, gap"),
        ({"drive.displacement": [1.0]}, "must be one of frequency_ratio, velocity_amplitude, phase"),
        ({"initial_state.amplitude": 1.0}, r"must be amplitude\[i\], velocity\[i\], phase or striker_position"),
        (
            {"initial_state.amplitude[9]": 1.0},
            r"initial_state\.amplitude\[9\]: mode = 9: must be an integer in \[1, 3\]",
        ),
        ({"beam": default_values.STRAIGHT_BEAM}, "a run needs a buckled beam: axial_load = 0 N must exceed"),
        ({"beam.buckling_level": 1e-3, "beam.axial_load": 30.0}, "give exactly one of the two"),
        ({"model.modes": 0}, r"modes = 0: must be an integer in \[1, 256\]"),
        ({"contact.location": 1.0}, r"location = 1.0: must be a number in \(0, 1\)"),
        ({"contact": None}, r"contacts\[0\] = None: must be a Contact\(law, striker\)"),
        ({"contact.2.gap": 1e-5}, r"contact\.2: this system has 1 contact"),
        ({"contact.stop.gap": 1e-5}, r"contact\.stop\.gap: this system has no contact 'stop'; must be one of 1"),
        ({"force": 1.0}, "force: this system has no force"),
        ({"contacts": 1.0}, "contacts = 1.0: must be a list or tuple"),
        ({"contact.law": 3.0}, r"law = 3.0: must be a law of contact, such as HertzContact\(stiffness\)"),
        ({"model": 3}, "model = 3: must be a ReducedModel"),
        ({"drive": 3}, "drive = 3: must be a drive"),
        ({"contact.striker": 3}, "striker = 3: must be a Striker or a Shaker"),
        ({"initial_state": 3}, "initial_state = 3: must be a State"),
        (
            {"initial_state": sb.State(amplitude=np.zeros(2))},
            "initial_state of 2 modes: must have the 3 modes of the model",
        ),
        (
            {"initial_state": sb.State(amplitude=np.zeros((4, 3)))},
            r"initial_state: a batch of shape \(4,\): must be one state",
        ),
    ],
)
def test_refusals(changes, message: str) -> None:
    with pytest.raises(InputError, match=message):
        PLAIN.replace(**changes)


def test_refusals_name_what_is_not_there() -> None:
    with pytest.raises(InputError, match=r"beam\.thicknes: is not a parameter of this system; it has beam\.length"):
        PLAIN.get("beam.thicknes")
    with pytest.raises(InputError, match="drive: this system has no contacts"):
        SYSTEMS["free"].replace(**{"drive.frequency_ratio": 1.0})
    with pytest.raises(InputError, match="beam: this model was given by matrices, it has no beam"):
        SYSTEMS["matrices"].replace(**{"beam.length": 0.2})
    with pytest.raises(InputTypeError):
        sb.System(MODEL, contacts=[sb.Contact(default_values.CONTACT, "shaker")])  # type: ignore[arg-type]
    with pytest.raises(dataclasses.FrozenInstanceError):
        PLAIN.contacts = sb.HertzContact(1.0)  # type: ignore[misc]


def test_described() -> None:
    text = PLAIN.describe()
    assert "contact   type = hertz, stiffness = 4e+08" in text
    assert "drive     type = sine, frequency_ratio = 1.21, velocity_amplitude = 0.18" in text
    assert "array of shape (400,)" in SYSTEMS["recorded"].describe()
    assert repr(PLAIN).startswith("<System modes=3, contact=HertzContact(stiffness=400000000.0)")
    assert PLAIN.hash[:12] in repr(PLAIN)
    assert len(repr(SYSTEMS["recorded"])) < 200


def test_scale() -> None:
    assert PLAIN.scale.length == default_values.BEAM.buckling_level
    assert PLAIN.scale.omega == pytest.approx(2.0 * np.pi * MODEL.reference_frequency)
