"""The Python engine against the native core, and laws that it alone integrates."""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.model.quantity import RUN, quantity
from snapbeam.util import diagnostics
from snapbeam.util.validation import InputError

sys.path.insert(0, str(Path(__file__).parents[1] / "composition"))
from generator import Features
from test_composition import checked

pytestmark = pytest.mark.filterwarnings("ignore:engine = 'python'")


def beam(modes):
    return sb.ReducedModel.from_beam(default_values.BEAM, modes=modes)


def striking(law=default_values.CONTACT, **changes):
    drive = sb.Sine(frequency_ratio=1.2, velocity_amplitude=0.18)
    return sb.Contact(law, sb.Striker(**{"drive": drive, "location": 0.45} | changes))


def how(engine="python", cycles=1):
    return sb.Integration(cycles=cycles, engine=engine, accuracy="reference")


@pytest.mark.sampled(2)
@pytest.mark.parametrize("modes", [1, 4])
def test_the_papers_system(modes):
    system = sb.System(beam(modes), contacts=[striking()])
    run = sb.simulate(system, how(cycles=2))
    times = np.linspace(0.0, float(run.dataset["time"][-1]), 60)[:-1]
    runs = [sb.simulate(system, how(engine, 2), sample_times=times) for engine in ("python", "native")]
    for name in ("midspan_displacement", "displacement_at_striker", "striker_displacement"):
        one, other = (each.dataset[name].values for each in runs)
        assert np.abs(one - other).max() < 1e-7, name
    own, core = (each.summary for each in runs)
    assert own.impacts == core.impacts > 1
    exact = ("impulse", "striker_work", "contact_time_fraction", "rms_midspan_displacement", "energy_dissipated")
    for name in (*exact, "high_frequency_energy_fraction"):
        assert own[name] == pytest.approx(core[name], rel=1e-6), name
    for name in ("peak_force", "max_midspan_displacement", "peak_midspan_velocity"):
        assert own[name] == pytest.approx(core[name], rel=1e-3), name
    assert abs(run.dataset.attrs["energy_error"]) < 1e-8
    assert run.dataset.attrs["engine"] == "python"
    assert run.impacts["onset"].values == pytest.approx(runs[1].impacts["onset"].values, abs=1e-9)


@pytest.mark.sampled(3)
@pytest.mark.parametrize(
    ("seed", "features"),
    [
        (1, Features(1, (("hertz", "sine", False),), base="acceleration_sine", uneven=True)),
        (2, Features(2, (("power", "displacement_sine", True),), load="harmonic_force", circuits=("piezo", "coil"))),
        (3, Features(3, external=("harmonic_force",), local=("quadratic_damping", "magnetic_force"), started=True)),
    ],
)
def test_systems_of_many_parts_against_the_reference(seed, features):
    report = checked(seed, features, engine="python")
    assert report.failures == [] and not report.refused


@pytest.mark.sampled(2)
@pytest.mark.parametrize("midspan_amplitude", [0.0, 4e-6])
def test_energy_of_high_modes_across_the_wells(midspan_amplitude):
    """Counted from the well on whose side mid-span is, equal or not."""
    imperfection = sb.Imperfection(midspan_amplitude=midspan_amplitude) if midspan_amplitude else None
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=3, damping_ratio=0.01, imperfection=imperfection)
    drive = sb.Sine(frequency_ratio=1.2, velocity_amplitude=0.6)
    system = sb.System(model, contacts=[striking(drive=drive, location=0.4)])
    own, core = (sb.simulate(system, how(engine, 3)).summary for engine in ("python", "native"))
    assert own.zero_crossings == core.zero_crossings > 1
    assert own.last_zero_crossing == pytest.approx(core.last_zero_crossing, rel=1e-6)
    assert own.high_frequency_energy_fraction == pytest.approx(core.high_frequency_energy_fraction, rel=5e-6)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12))
def test_random_systems(seed):
    assert checked(seed, engine="python").failures == []


def several():
    """Three strikers, of which the second loses energy and is released by its force."""
    stops = [(sb.KelvinVoigt(2e5, 1.0), 0.4, 5e-5), (default_values.CONTACT, 0.6, 1e-5)]
    further = [striking(law, drive=sb.FixedStop(), side="above", location=at, gap=gap) for law, at, gap in stops]
    return sb.System(beam(2), contacts=[striking(), *further])


@pytest.mark.slow
def test_several_contacts_of_which_one_loses_energy():
    times = np.linspace(0.0, 0.009, 80)
    own, core = (sb.simulate(several(), how(engine), sample_times=times) for engine in ("python", "native"))
    for name in ("striker_penetrations", "striker_displacements", "modal_amplitude"):
        assert np.abs(own.dataset[name].values - core.dataset[name].values).max() < 1e-7, name
    for name in ("impacts", "impulse", "striker_work", "peak_force"):
        for number in (1, 2, 3):
            one, other = (each.summary[f"{name}_contact_{number}"] for each in (own, core))
            assert one == pytest.approx(other, rel=1e-3), (name, number)
    assert own.summary.energy_lost_contact == pytest.approx(core.summary.energy_lost_contact, rel=1e-8) != 0.0
    assert abs(own.dataset.attrs["energy_error"]) < 1e-8


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["python", "native"])
def test_energies_of_several_contacts_are_balanced_at_every_sample(engine):
    """Beam, all contacts and losses together change by the work of the striker alone; a contact counts once."""
    data = sb.simulate(several(), how(engine), sample_times=np.linspace(0.0, 0.009, 2000)).dataset
    force = data.striker_forces.values
    assert (force[:, 1] > 0.0).any() and (force[:, 2] > 0.0).any()
    gained = data.energy_beam + data.energy_contact + data.energy_dissipated - data.striker_work
    assert float(abs(gained - gained[0]).max()) < 1e-7 * data.attrs["gross_work"]


def test_a_statistic_that_needs_every_step_is_refused_by_name():
    row = sb.Statistic("deepest", "float64", "m", "penetration", lambda r, held: held, update=lambda held, step: held)
    sb.register_statistic(row)
    try:
        system = sb.System(beam(1), contacts=[striking()])
        for call in (sb.simulate, lambda *given: sb.sweep(given[0], {"drive.velocity_amplitude": [0.1]}, given[1])):
            with pytest.raises(InputError, match=r"statistic 'deepest'.*'python'.*engine = 'native'"):
                call(system, how("python"))
        assert sb.simulate(system, how("native")).summary.deepest == 0.0
    finally:
        sb.unregister_statistic("deepest")
    assert sb.simulate(system, how("python")).summary.impacts > 0


def test_gross_work_is_that_of_the_core():
    """Of strikers, base, load and external forces; a local force does none."""
    damper = sb.QuadraticDamping(coefficient=0.05, location=0.3)
    system = sb.System(beam(2), contacts=[striking()], forces=[damper])
    own, core = (sb.simulate(system, how(engine)).summary for engine in ("python", "native"))
    assert own.gross_work == pytest.approx(core.gross_work, rel=1e-4)


def test_energy_of_everything_at_once_is_balanced():
    system = sb.System(
        beam(2),
        contacts=[striking(sb.HuntCrossley(3e8, 2.0), mass=2e-3, suspension_stiffness=50.0, suspension_damping=0.02)],
        base_excitation=sb.BaseExcitation(motion=sb.AccelerationSine(frequency_ratio=0.9, acceleration_amplitude=0.3)),
        axial_load=sb.AxialLoadModulation(motion=sb.HarmonicForce(frequency_ratio=2.0, amplitude=2.0)),
        forces=[
            sb.ExternalForce(history=sb.HarmonicForce(frequency_ratio=0.7, amplitude=0.02), location=0.4),
            sb.QuadraticDamping(coefficient=0.2, location=0.55),
            sb.LocalSpring(stiffness=20.0, location=0.35),
        ],
        harvesters=[sb.ElectromagneticHarvester(force_factor=1.5, resistance=30.0, coil_resistance=10.0)],
    )  # fmt: skip
    run = sb.simulate(system, how())
    works = ("striker_work", "base_work", "load_work", "force_work", "local_force_work", "energy_lost_contact")
    assert all(run.summary[name] != 0.0 for name in (*works, "energy_harvested"))
    assert abs(run.dataset.attrs["energy_error"]) < 1e-8


@dataclass(frozen=True)
class Stiffening(sb.ContactLaw):
    """A law in plain Python, f = k_1 d + k_3 d^3 by a list and a loop, without energy and slope."""

    linear: float = quantity("N/m", "linear stiffness", low=0.0, scope=RUN)
    cubic: float = quantity("N/m^3", "cubic stiffness", low=0.0, scope=RUN)

    @staticmethod
    def force(law, penetration):
        return sum({1: law.linear, 3: law.cubic}[power] * penetration**power for power in [1, 3])


def test_a_law_with_a_force_alone():
    system = sb.System(beam(1), contacts=[striking(Stiffening(2e5, 1e15))])
    run = sb.simulate(system, how(cycles=2))
    assert run.summary.impacts > 1 and abs(run.dataset.attrs["energy_error"]) < 1e-8
    law, d = system.contact_law.numbers(), 3e-6
    assert Stiffening.energy(law, d) == pytest.approx(0.5 * 2e5 * d**2 + 0.25 * 1e15 * d**4, rel=1e-12)
    assert Stiffening.slope(law, d) == pytest.approx(2e5 + 3e15 * d**2, rel=1e-8)
    with pytest.warns(sb.DiagnosticWarning, match="Numba cannot compile force"):  # its functions are beyond Numba
        native = sb.simulate(system, how("native", cycles=2))
    ends = [each.dataset.modal_amplitude.values[-1] for each in (native, run)]
    assert ends[0] == pytest.approx(ends[1], rel=1e-9)


def test_an_impact_that_leaves_a_residual_indentation():
    law = sb.ElasticPlasticContact(loading_stiffness=1e5, unloading_stiffness=2.5e5)
    model = sb.ReducedModel.from_matrices(
        [[2e-3]], [0.0], contact_shape=[1.0], length_scale=1e-3, reference_frequency=100.0
    )
    stop = sb.Striker(drive=sb.FixedStop(), side="above", gap=1e-5, location=0.5)
    system = sb.System(model, contacts=[sb.Contact(law, stop)])
    start = sb.State(amplitude=np.zeros(1), velocity=np.array([0.05]))
    end = sb.advance(system.replace(initial_state=start), periods=0.2, integration=how())
    deepest = 0.05 * math.sqrt(2e-3 / 1e5)
    assert float(end.velocity[0]) == pytest.approx(-law.restitution * 0.05, rel=1e-7)
    assert float(end.indentation) == pytest.approx(deepest * (1.0 - 1e5 / 2.5e5), rel=1e-7)


def test_advanced_in_pieces():
    system = sb.System(beam(2), contacts=[striking(mass=3e-3, suspension_stiffness=200.0)])
    whole = sb.advance(system, periods=2, integration=how())
    every = sb.advance(system, periods=2, integration=how(), save_every_period=True)[-1]
    state = None
    for _ in range(2):
        state = sb.advance(system, state, integration=how())
    scale = float(np.abs(whole.amplitude).max())
    for other in (every, state):
        assert np.abs(whole.amplitude - other.amplitude).max() < 1e-8 * scale
        assert float(other.striker_shift) == pytest.approx(float(whole.striker_shift), rel=1e-6)


def test_a_sweep():
    system = sb.System(beam(1), contacts=[striking()])
    points = {"drive.velocity_amplitude": [0.05, 0.2]}
    own, core = (sb.sweep(system, points, how(engine)) for engine in ("python", "native"))
    for name in ("impulse", "max_midspan_displacement", "striker_work"):
        assert own[name].values == pytest.approx(core[name].values, rel=1e-5), name
    assert own["impulse"].values[0] != own["impulse"].values[1]


def test_it_says_how_slow_it_is(monkeypatch):
    monkeypatch.setattr(diagnostics, "_told", set())
    system = sb.System(beam(1), contacts=[striking(location=0.437)])
    with pytest.warns(sb.DiagnosticWarning, match=r"times slower than engine = 'native', some .* s a run"):
        sb.simulate(system, how(cycles=3))


@pytest.mark.parametrize("given", [{"step": 1e-5}, {"tolerance": 1e-3}, {"early_termination": True}])
def test_settings_that_it_does_not_have_are_refused_by_name(given):
    with pytest.raises(InputError, match=f"{next(iter(given))} = .*engine = 'python'"):
        sb.Integration(engine="python", **given)


def test_impacts_without_a_duration_and_perturbed_drives_are_refused():
    with pytest.raises(InputError, match=r"contact.law = Restitution.*engine = 'python'; use engine = 'native'"):
        sb.simulate(sb.System(beam(1), contacts=[striking(sb.Restitution(0.6))]), how())
    with pytest.raises(InputError, match=r"engine = 'python': does not change a drive.*use engine = 'native'"):
        sb.perturbation_growth(sb.System(beam(1), contacts=[striking()]), how())


def test_an_impact_that_has_not_ended_counts_in_every_engine():
    """A run that ends while a stop presses."""
    model = sb.ReducedModel.from_beam(default_values.BEAM, 2, damping_ratio=0.02)
    stop = striking(sb.HertzContact(1e6), drive=sb.FixedStop(), gap=-2e-5)
    system = sb.System(model, contacts=[stop], initial_state=sb.State(amplitude=model.well_amplitude))
    own, core = (sb.simulate(system, how(engine)) for engine in ("python", "native"))
    assert own.summary.impacts == core.summary.impacts > 0
    assert float(core.final_state.contact_time[0]) > 0.0
    assert own.impacts.sizes == core.impacts.sizes
    assert own.impacts["impulse"].values == pytest.approx(core.impacts["impulse"].values, rel=1e-5)
    assert own.summary.contact_time_fraction == pytest.approx(core.summary.contact_time_fraction, rel=1e-6)
    state = sb.advance(system, periods=1, integration=how("python"))
    assert int(state.statistics["impacts"]) == core.summary.impacts - 1


def test_gross_work_of_forces_against_each_other():
    """Each by itself, as in the core."""
    forces = [
        sb.ExternalForce(history=sb.HarmonicForce(frequency_ratio=0.8, amplitude=amplitude, phase=phase), location=0.4)
        for amplitude, phase in ((0.02, 0.0), (0.015, math.pi))
    ]
    own, core = (sb.simulate(sb.System(beam(2), forces=forces), how(engine)).summary for engine in ("python", "native"))
    assert own.gross_work == pytest.approx(core.gross_work, rel=1e-3)
