"""The one table of parameters: everything that can be set is in it once, with its unit, its limits and its words."""

from __future__ import annotations

import dataclasses
import inspect

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.model.contact.base import LAWS
from snapbeam.model.drive.base import DRIVES
from snapbeam.model.drive.force import FORCES
from snapbeam.model.harvester import HARVESTERS
from snapbeam.model.local_force import LOCAL_FORCES
from snapbeam.model.parameters import Parameter, lookup, parameters, short_names
from snapbeam.model.quantity import RUN, STRUCTURE, quantities
from snapbeam.model.reduced_model import MODEL_QUANTITIES
from snapbeam.util.validation import InputError

TABLE = parameters()
CLASSES = {
    "beam": [sb.Beam],
    "boundary": [sb.BoundaryConditions],
    "imperfection": [sb.Imperfection],
    "integration": [sb.Integration],
    "contact": [sb.Striker, *LAWS.values()],
    "drive": list(DRIVES.values()),
    "base_excitation": [sb.BaseExcitation, *(kind for kind in DRIVES.values() if kind.can_excite_base())],
    "axial_load": list(FORCES.values()),
    "force": [sb.ExternalForce, *FORCES.values(), *LOCAL_FORCES.values()],
    "harvester": list(HARVESTERS.values()),
}


OF = {"base_excitation": "base", "axial_load": "axial load", "force": "force"}


@pytest.mark.parametrize("section", CLASSES)
def test_every_quantity_of_every_class_is_in_it(section: str) -> None:
    found = {name for name in TABLE if name.startswith(f"{section}.")}
    assert found == {f"{section}.{name}" for kind in CLASSES[section] for name in quantities(kind)}
    for kind in CLASSES[section]:
        for name, item in quantities(kind).items():
            own = TABLE[f"{section}.{name}"].quantity
            if section in OF and issubclass(kind, sb.Drive):
                comma = "," if " over " in item.long_name else ""
                assert own.long_name == f"{item.long_name}{comma} of the {OF[section]}"
                own = dataclasses.replace(own, long_name=item.long_name)
            if name == "location" and section == "force":
                own = dataclasses.replace(own, closed=item.closed)
            assert own == item
            if section in ("contact", "drive", "axial_load", "force", "harvester") and hasattr(kind, "name"):
                assert kind.name in TABLE[f"{section}.{name}"].kinds


@pytest.mark.parametrize("section", CLASSES)
def test_every_field_of_every_class_is_a_quantity(section: str) -> None:
    """What a person can give to a class is in the table; but for the one of two that the other follows from."""
    for kind in CLASSES[section]:
        fields = {item.name for item in dataclasses.fields(kind) if item.init}
        parts = {sb.Striker: {"drive"}, sb.Beam: {"boundary"}, sb.BaseExcitation: {"motion"}}.get(kind, set())
        parts |= {"history", "label"} if section == "force" else set()
        assert fields - parts == set(quantities(kind)), kind


def test_every_argument_of_a_model_of_a_beam_is_in_it() -> None:
    asked = set(inspect.signature(sb.ReducedModel.from_beam).parameters) - {"beam", "imperfection"}
    assert {f"model.{name}" for name in asked} == {name for name in TABLE if name.startswith("model.")}
    assert {f"model.{name}" for name in MODEL_QUANTITIES} == {f"model.{name}" for name in asked}


def test_a_system_has_no_parameter_beside_it() -> None:
    system = sb.System(
        sb.ReducedModel.from_beam(default_values.BEAM, modes=2),
        contacts=[
            sb.Contact(
                default_values.CONTACT, sb.Striker(drive=sb.Sine(frequency_ratio=1.2, velocity_amplitude=0.1), gap=1e-4)
            )
        ],
    )
    words = {"contact.type", "drive.type"}
    assert set(system.parameters) - words <= set(TABLE)


def test_names_are_unique() -> None:
    shorts = [row.short for row in TABLE.values()]
    assert len(set(shorts)) == len(shorts) == len(TABLE)
    assert short_names() == {row.short: name for name, row in TABLE.items()}
    for name, row in TABLE.items():
        assert row.name == name
        assert row.short.isidentifier()
        assert row.section == name.split(".")[0]


def test_every_row_is_said_in_words() -> None:
    for name, row in TABLE.items():
        assert len(row.quantity.long_name) > 5, name
        assert row.quantity.long_name[0].islower() or row.quantity.long_name.startswith("Young"), name
        assert not row.quantity.long_name.endswith("."), name
        assert row.quantity.unit, name
        assert row.label.startswith(row.quantity.long_name[0].upper()), name
        assert row.quantity.scope in (RUN, STRUCTURE)
        assert row.limits or row.quantity.kind is object, name
        if row.default is not None:
            assert row.quantity.check(name, row.default) == row.default, name


@pytest.mark.parametrize(
    ("name", "label", "limits"),
    [
        ("beam.thickness", "Thickness in the direction of bending $h$ (m)", "(0, inf)"),
        ("drive.velocity_amplitude", r"Velocity amplitude over b omega_1 $V$", "[0, inf)"),
        ("contact.location", r"Location of the striker over the length $x_\mathrm{s}$", "(0, 1)"),
        ("contact.side", "Side that the striker pushes from", "below or above"),
        ("model.modes", "Number of buckling modes $N$", "[1, 256]"),
        ("model.damping_ratio", r"Damping ratio of every linear mode $\zeta$", "[0, 1)"),
        ("contact.stiffness", "Contact stiffness $k_c$ (N/m$^{1.5}$)", "(0, inf)"),
        ("beam.density", r"Mass density $\rho$ (kg/m$^{3}$)", "(0, inf)"),
        ("contact.coefficient", "Coefficient of restitution $e$", "[0, 1]"),
        ("integration.early_termination", "Whether a run ends once its response class is certain", "true or false"),
    ],
)
def test_label_and_limits(name: str, label: str, limits: str) -> None:
    assert (TABLE[name].label, TABLE[name].limits) == (label, limits)


@pytest.mark.parametrize(
    ("asked", "name"),
    [
        ("beam.thickness", "beam.thickness"),
        ("beam_thickness", "beam.thickness"),
        ("thickness", "beam.thickness"),
        ("frequency_ratio", "drive.frequency_ratio"),
        ("modes", "model.modes"),
        ("contact_stiffness", "contact.stiffness"),
        ("stiffness", "contact.stiffness"),
        ("restitution_coefficient", "contact.coefficient"),
        ("location", "contact.location"),
        ("step", "integration.step"),
        ("frequency", "drive.frequency"),
        ("initial_state.amplitude[3]", "initial_state.amplitude[3]"),
        ("initial_state.velocity[1]", "initial_state.velocity[1]"),
        ("initial_state_striker_position", "initial_state.striker_position"),
    ],
)
def test_looked_up_by_any_of_its_names(asked: str, name: str) -> None:
    assert lookup(asked).name == name


@pytest.mark.parametrize("name", [name for name in TABLE if name != "drive.displacement"])
def test_looked_up_by_its_own_and_its_short_name(name: str) -> None:
    assert lookup(name) == TABLE[name]
    assert lookup(TABLE[name].short) == TABLE[name]


def test_starts_are_parameters_of_runs() -> None:
    row = lookup("initial_state.amplitude[2]")
    assert isinstance(row, Parameter)
    assert row.is_run
    assert row.short == "initial_state_amplitude_2"
    assert "mode 2" in row.label
    assert lookup("initial_state.striker_position").quantity.unit == "m"


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("beam.thicknes", "did you mean 'beam.thickness'"),
        ("initial_state.amplitude[0]", "is not a parameter"),
        ("", "is not a parameter"),
        (3, "must be a name, such as 'drive.frequency_ratio'"),
    ],
)
def test_unknown_names(name, message) -> None:
    with pytest.raises(InputError, match=message):
        lookup(name)


def test_scopes_are_what_an_ensemble_shares() -> None:
    """Whatever is of scope run may differ inside one ensemble; the engines take it as a column."""
    from snapbeam.solver.assemble import run_columns

    laws = {
        "restitution": sb.Restitution(0.5),
        "hunt_crossley": sb.HuntCrossley(4e8, 1.0),
        "kelvin_voigt": sb.KelvinVoigt(1e6, 1.0),
        "power": sb.PowerLaw(1.0, 2.0),
        "layer": sb.LayeredHertz(4e8, 1e13),
        "elastic_plastic": sb.ElasticPlasticContact(1e5, 2e5),
    }
    pair = {"frequency_ratio": 1.0, "velocity_amplitude": 0.1}
    drives = {
        "burst": sb.Burst(**pair, duration_cycles=5.0),
        "chirp": sb.Chirp(start_ratio=0.5, stop_ratio=2.0, velocity_amplitude=0.1, sweep_cycles=20.0),
        "acceleration_chirp": sb.model.AccelerationChirp(
            start_ratio=0.5, stop_ratio=2.0, acceleration_amplitude=0.1, sweep_cycles=20.0
        ),
        "half_sine": sb.HalfSine(displacement_amplitude=0.1, duration=0.5),
        "band_limited_noise": sb.BandLimitedNoise(low_ratio=0.5, high_ratio=2.0, velocity_rms=0.1),
        "random_vibration": sb.RecordedAcceleration.from_psd([(20.0, 0.04), (200.0, 0.04)], duration_s=0.5),
        "shock": sb.Shock(acceleration_g=10.0, duration_ms=11.0),
        "constant_velocity": sb.ConstantVelocity(speed=0.4),
        "displacement_sine": sb.DisplacementSine(frequency_ratio=1.0, displacement_amplitude=0.1),
        "acceleration_sine": sb.AccelerationSine(frequency_ratio=1.0, acceleration_amplitude=0.1),
    }
    forces = {
        "ramp_force": sb.RampForce(change=1.0, duration=1.0),
        "burst_force": sb.model.BurstForce(frequency_ratio=2.0, amplitude=1.0, duration_cycles=4.0),
        "chirp_force": sb.model.ChirpForce(start_ratio=0.5, stop_ratio=2.0, amplitude=1.0, sweep_cycles=4.0),
        "noise_force": sb.model.NoiseForce(low_ratio=0.5, high_ratio=2.0, rms=1.0),
        "harmonic_force": sb.HarmonicForce(frequency_ratio=2.0, amplitude=1.0),
        "constant_force": sb.ConstantForce(force=1.0),
        "half_sine_force": sb.model.HalfSineForce(peak=1.0, duration=0.1),
    }
    around = {
        "base_excitation": lambda kind: sb.BaseExcitation(motion=drives.get(kind, sb.Sine(**pair))),
        "axial_load": lambda kind: sb.AxialLoadModulation(motion=forces[kind]),
        "forces": lambda kind: [sb.ExternalForce(history=forces[kind], location=0.5)],
        "harvesters": lambda kind: [sb.PiezoelectricHarvester(moment_per_volt=1e-3, capacitance=1e-8, resistance=1e4)],
    }
    for name, row in TABLE.items():
        if not row.is_run:
            continue
        kind = next((each for each in row.kinds if each in ("hertz", "sine")), row.kinds[0] if row.kinds else "")
        system = sb.System(
            sb.ReducedModel.from_beam(default_values.BEAM, modes=1),
            contacts=[
                sb.Contact(laws.get(kind, default_values.CONTACT), sb.Striker(drive=drives.get(kind, sb.Sine(**pair))))
            ],
            **{part: around[part](kind) for part in (row.section, f"{row.section}s") if part in around},
        )
        columns = run_columns(system, {name: np.array([0.1, 0.2, 0.3])})
        assert columns[name].tolist() == [0.1, 0.2, 0.3]
    with pytest.raises(InputError, match=r"beam\.thickness: no parameter that may differ between the runs"):
        run_columns(system, {"beam.thickness": np.array([1e-4, 2e-4])})
