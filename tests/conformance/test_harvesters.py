"""Harvesters: an independent solution with the circuit as its own equation, the ledger, the limits, what is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest
from around_oracle import Surroundings, live, slopes
from oracle import LENGTH, LEVEL, PaperBeam
from test_moving_base import ledger, model

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.solver.assemble import make_ensemble
from snapbeam.util.validation import InputError

DRIVE = sb.Sine(frequency_ratio=0.9, velocity_amplitude=0.3)
THETA, CAPACITANCE = 4e-3, 60e-9
PIEZO = sb.PiezoelectricHarvester(
    moment_per_volt=THETA, capacitance=CAPACITANCE, resistance=2e4, patch_start=0.0, patch_end=0.25
)


def add_base_acceleration(
    modes: int,
    harvester: sb.PiezoelectricHarvester | sb.ElectromagneticHarvester,
    ratio: float = 0.9,
    strength: float = 0.25,
) -> sb.System:
    motion = sb.AccelerationSine(frequency_ratio=ratio, acceleration_amplitude=strength)
    return sb.System(model(modes), harvesters=[harvester], base_excitation=sb.BaseExcitation(motion=motion))


def compare(
    modes: int,
    cycles: int,
    harvester: sb.PiezoelectricHarvester | sb.ElectromagneticHarvester,
    row,
    inertia: float,
    loss: float,
    volts: float,
) -> None:
    beam, ratio, strength = PaperBeam(modes), 0.9, 0.25
    omega, hardest = ratio * float(beam.omega[0]), strength * LEVEL * float(beam.omega[0]) ** 2

    def base(t: float) -> tuple[float, float, float]:
        return 0.0, 0.0, -hardest * math.sin(omega * t)

    times = np.linspace(0.0, cycles * 2.0 * math.pi / omega, 801) * (1.0 - 1e-13)
    around = Surroundings(base, coupling=row(beam), inertia=inertia, loss=loss)
    truth = live(beam, around, times)
    free = live(beam, Surroundings(base), times)
    # the circuit matters: what is met is not the beam without it
    assert np.abs(truth.midspan_displacement - free.midspan_displacement).max() > 3e-3
    for accuracy, bound, slack in (("standard", 1e-3, 1e-2), ("reference", 1e-7, 1e-5)):
        run = sb.simulate(
            add_base_acceleration(modes, harvester),
            sb.Integration(cycles=cycles, accuracy=accuracy),
            sample_times=times,
        )
        data = run.dataset
        np.testing.assert_allclose(data.midspan_displacement, truth.midspan_displacement, rtol=0.0, atol=bound)
        size = float(np.abs(truth.z).max())
        np.testing.assert_allclose(data.voltage, volts * truth.z, rtol=0.0, atol=10 * bound * abs(volts) * size)
        share = float(harvester.share(np.array([harvester.resistance]))[0])
        given = share * truth.circuit
        np.testing.assert_allclose(data.energy_harvested, given, rtol=0.0, atol=slack * given[-1])
        assert run.summary.energy_harvested == pytest.approx(given[-1], rel=slack)
        assert run.summary.harvested_power == pytest.approx(given[-1] / times[-1], rel=slack)
        assert run.summary.harvested_per_cycle == pytest.approx(given[-1] / cycles, rel=slack)
        assert ledger(run) < 1e-4


def deviation(system: sb.System, finer: float) -> float:
    """Error of a run at level reference by one with steps *finer* times as long, over b."""
    coarse = sb.Integration(cycles=2, accuracy="reference")
    fine = sb.Integration(cycles=2, accuracy="reference", step=finer * flight_step(system))
    times = np.linspace(0.0, 2.0 * 2.0 * math.pi / (0.9 * system.scale.omega), 121)[1:-1]
    found = [sb.simulate(system, each, sample_times=times).dataset.modal_amplitude.values for each in (coarse, fine)]
    return float(np.abs(found[0] - found[1]).max()) / system.scale.length


def flight_step(system: sb.System) -> float:
    return float(make_ensemble(system, sb.Integration(cycles=2, accuracy="reference")).step_times[0])


@pytest.mark.parametrize("decay", [9.0, 20.0, 60.0])
@pytest.mark.parametrize("strikers", [1, 2])
def test_a_circuit_faster_than_the_step(strikers, decay) -> None:
    """It follows the beam; with steps in which it is resolved the motion is the same, beside other losses too."""
    sides = [
        sb.Contact(sb.HuntCrossley(stiffness=4e8, damping_factor=3.0), sb.Striker(drive=DRIVE)),
        sb.Contact(
            sb.KelvinVoigt(linear_stiffness=1e6, linear_damping=2.0), sb.Striker(drive=DRIVE, side="below", gap=1e-4)
        ),
    ]
    parts = {"contacts": sides[:strikers], "forces": [sb.QuadraticDamping(coefficient=0.1, location=0.3)]}
    step = flight_step(sb.System(model(3), **parts))
    coil = sb.ElectromagneticHarvester(force_factor=1.5, resistance=40.0, inductance=40.0 * step / decay, location=0.4)
    assert deviation(sb.System(model(3), harvesters=[coil], **parts), 1.0 / decay) < 3e-8


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:contact. the mass that an impulse")
@pytest.mark.parametrize(("ratio", "velocity"), [(0.05, 0.02), (0.3, 0.2)])
def test_a_circuit_faster_than_the_step_beside_a_tip_that_holds_the_beam(ratio, velocity) -> None:
    """Newton's law: the beam stays on the tip for a third of the time; what holds it moves the circuit too."""
    drive = sb.Sine(frequency_ratio=ratio, velocity_amplitude=velocity)
    contacts = [sb.Contact(sb.Restitution(coefficient=0.5), sb.Striker(drive=drive))]
    step = flight_step(sb.System(model(3), contacts=contacts))
    coil = sb.ElectromagneticHarvester(force_factor=1.5, resistance=40.0, inductance=40.0 * step / 60.0, location=0.4)
    system = sb.System(model(3), contacts=contacts, harvesters=[coil])
    held = sb.simulate(system, sb.Integration(cycles=2, accuracy="reference")).summary.contact_time_fraction
    assert held > 0.25
    assert deviation(system, 1.0 / 60.0) < 2e-7


@pytest.mark.slow
@pytest.mark.parametrize("modes", [1, 3, 8])
def test_piezo(modes) -> None:
    def row(beam):
        return THETA * (slopes(beam, 0.25 * LENGTH) - slopes(beam, 0.0))

    compare(modes, 4 if modes == 1 else 2, PIEZO, row, CAPACITANCE, 1.0 / 2e4, 1.0)


@pytest.mark.slow
@pytest.mark.parametrize("modes", [1, 3, 8])
@pytest.mark.parametrize("inductance", [0.0, 0.01])
def test_coil(modes, inductance) -> None:
    coil = sb.ElectromagneticHarvester(
        force_factor=1.5, resistance=30.0, coil_resistance=10.0, inductance=inductance, location=0.4
    )

    def row(beam):
        return 1.5 * beam.shape(0.4 * LENGTH)

    compare(modes, 4 if modes == 1 else 2, coil, row, inductance, 40.0, -30.0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("modes", "ratio", "velocity", "resistance", "cycles"),
    [(3, 2.782, 0.333, 9.06e5, 3), (1, 0.4038, 0.473, 3.27e5, 1), (3, 1.3, 0.4, 3e5, 2), (8, 2.0, 0.3, 5e5, 1)],
)
def test_struck_with_a_nearly_open_circuit(modes, ratio, velocity, resistance, cycles) -> None:
    """The layers stiffen the beam, so that it comes back to the tip sooner than without: no contact is missed."""
    beam, gap = PaperBeam(modes), 1e-6
    omega = ratio * float(beam.omega[0])
    amplitude = velocity * LEVEL * float(beam.omega[0]) / omega

    def away(t: float) -> tuple[float, float, float]:
        return -amplitude * math.sin(omega * t), 0.0, 0.0

    around = Surroundings(
        away, coupling=THETA * (slopes(beam, 0.25 * LENGTH) - slopes(beam, 0.0)), inertia=CAPACITANCE,
        loss=1.0 / resistance, gap=gap, striker_on_base=False,
    )  # fmt: skip
    times = np.linspace(0.0, cycles * 2.0 * math.pi / omega, 801) * (1.0 - 1e-13)
    truth = live(beam, around, times)
    drive = sb.Sine(frequency_ratio=ratio, velocity_amplitude=velocity)
    layers = sb.PiezoelectricHarvester(
        moment_per_volt=THETA, capacitance=CAPACITANCE, resistance=resistance, patch_start=0.0, patch_end=0.25
    )
    system = sb.System(
        model(modes),
        contacts=[sb.Contact(default_values.CONTACT, sb.Striker(drive=drive, gap=gap))],
        harvesters=[layers],
    )
    for accuracy, bound in (("standard", 1e-3), ("reference", 1e-7)):
        run = sb.simulate(system, sb.Integration(cycles=cycles, accuracy=accuracy), sample_times=times)
        assert run.summary.impacts > 2
        np.testing.assert_allclose(run.dataset.displacement_at_striker, truth.displacement, rtol=0.0, atol=bound)
        assert ledger(run) < 1e-4


@pytest.mark.slow
def test_a_layer_that_does_not_couple_changes_nothing() -> None:
    """theta to 0: the struck beam without a harvester, to the error of the level."""
    shaker = sb.Shaker(frequency_ratio=1.21, velocity_amplitude=0.1)
    steps = sb.Integration(cycles=1, accuracy="reference")
    bare = sb.simulate(
        sb.System(model(3), contacts=[sb.Contact(default_values.CONTACT, shaker)]), steps
    ).final_state.amplitude
    errors = []
    for coupling in (1e-4, 1e-5, 0.0):
        system = sb.System(
            model(3),
            contacts=[sb.Contact(default_values.CONTACT, shaker)],
            harvesters=[PIEZO.__class__(
            moment_per_volt=coupling, capacitance=CAPACITANCE, resistance=2e4)],
        )  # fmt: skip
        errors.append(np.abs(sb.simulate(system, steps).final_state.amplitude - bare).max() / abs(bare[0]))
    assert errors[0] > 30.0 * errors[1]
    assert errors[2] < 1e-9


@pytest.mark.slow
def test_sweep_of_the_load() -> None:
    """Under a gentle shake the power over the resistance is that of linear theory.

    The start rings down within the run, which is long against 1/(zeta omega).
    """
    ratio, strength = 0.6, 1e-3
    system = add_base_acceleration(1, PIEZO, ratio, strength)
    beam = system.model
    loads = np.geomspace(2e3, 2e6, 7)
    found = sb.sweep(system, {"harvester.resistance": loads}, sb.Integration(cycles=150))
    from snapbeam.model.base_excitation import rigid_mass

    theta = float((beam.linear_modes.T @ PIEZO.row(beam))[0])
    pull = float((beam.linear_modes.T @ rigid_mass(beam))[0])
    omega, zeta = float(beam.omega[0]), float(beam.damping_ratio[0])
    at = ratio * omega
    hardest = strength * default_values.BEAM.buckling_level * omega**2
    voltage = []
    for load in loads:
        circuit = -1j * at * theta / (1j * at * CAPACITANCE + 1.0 / load)
        q = pull * hardest / (omega**2 - at**2 + 2j * zeta * omega * at - theta * circuit)
        voltage.append(abs(circuit * q))
    expected = np.array(voltage) ** 2 / (2.0 * loads)
    np.testing.assert_allclose(found.harvested_power.values, expected, rtol=0.15)
    assert int(found.harvested_power.values.argmax()) == int(expected.argmax())


def test_refusals() -> None:
    with pytest.raises(InputError, match=r"patch_start = 0.5: must be less than patch_end"):
        sb.PiezoelectricHarvester(
            moment_per_volt=1e-3, capacitance=1e-9, resistance=1e4, patch_start=0.5, patch_end=0.4
        )
    shaker = sb.Shaker(frequency_ratio=1.21, velocity_amplitude=0.1)
    system = sb.System(model(1), contacts=[sb.Contact(default_values.CONTACT, shaker)], harvesters=[PIEZO])
    assert sb.System.from_mapping(system.to_mapping()) == system
    assert system.replace(**{"harvester.resistance": 5e3}).get("harvester.resistance") == 5e3


def test_layers_by_their_material() -> None:
    """Two faces in series have the moment of one and half its capacitance, in parallel twice both."""
    parts = {
        "stress_constant": -16.6, "permittivity": 25.55e-9, "layer_thickness": 0.2e-3, "layer_width": 15e-3,
        "beam": default_values.BEAM, "resistance": 1e4,
    }  # fmt: skip
    series, parallel = (
        sb.PiezoelectricHarvester.from_material(wiring=wiring, **parts) for wiring in ("series", "parallel")
    )
    assert series.moment_per_volt == pytest.approx(-16.6 * 15e-3 * 0.3e-3)
    assert series.capacitance == pytest.approx(0.5 * 25.55e-9 * 15e-3 * 0.25 * 0.161 / 0.2e-3)
    assert parallel.moment_per_volt == 2.0 * series.moment_per_volt and parallel.capacitance == 4.0 * series.capacitance
