"""Exact derivatives of statistics, through impacts, against differences of the core."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model import default_values as paper
from snapbeam.solver import native
from snapbeam.solver.assemble import make_ensemble
from snapbeam.solver.ensemble import Ensemble
from snapbeam.solver.statistics import statistics_of

SMOOTH = (
    "peak_force", "contact_time_fraction", "impulse", "striker_work", "mean_power", "rms_displacement", "rms_midspan_displacement",
    "rms_velocity", "rms_midspan_velocity", "energy_dissipated", "energy_lost_contact", "energy_harvested", "harvested_power",
)  # fmt: skip
"""Statistics that are integrals, or maxima of a contact."""
ROUGHER = {
    "min_displacement": 30.0, "max_displacement": 30.0, "peak_velocity": 30.0, "high_frequency_energy_fraction": 30.0,
    "harvested_power_last_quarter": 20.0,
}  # fmt: skip
"""Factors of the limit for what takes a cubic between the ends of steps, or a share of the step in which the last quarter begins."""
LIMIT = {"reference": 1e-6, "standard": 1e-4}
STEP = {"reference": 0.25, "standard": 1.0}
"""Factor of the steps: of the reference they are shorter, so that what maxima and energies miss in a step is less than the limit."""
CHANGES = (1e-4, 3e-5, 1e-5, 3e-6)
ORDER_SIX = ((1.0, 0.75), (2.0, -0.15), (3.0, 1.0 / 60.0))
ONE, MODEL = (sb.ReducedModel.from_beam(paper.BEAM, modes=modes, damping_ratio=0.012) for modes in (1, 2))


def struck(law: sb.ContactLaw, gap: float | None = None, **parts: Any) -> sb.System:
    drive = sb.Sine(frequency_ratio=1.13, velocity_amplitude=0.14)
    model = ONE if isinstance(law, sb.Restitution) else MODEL  # its impulses belong to a number of modes
    return sb.System(model, [sb.Contact(law, sb.Striker(drive=drive, gap=gap, location=0.44))], **parts)


def pushed() -> sb.System:
    history = sb.HarmonicForce(frequency_ratio=0.83, amplitude=0.02, mean=0.003)
    spring = sb.LocalSpring(location=0.31, stiffness=15.0)
    return sb.System(MODEL, forces=[sb.ExternalForce(history=history, location=0.4), spring])


def two_strikers() -> sb.System:
    drive = sb.Sine(frequency_ratio=1.13, velocity_amplitude=0.14)
    stop = sb.Striker(drive=sb.FixedStop(), location=0.6, side="above", gap=2e-5)
    return sb.System(
        MODEL,
        [
            sb.Contact(paper.CONTACT, sb.Striker(drive=drive, location=0.44)),
            sb.Contact(sb.HuntCrossley(2e7, 0.4), stop),
        ],
    )


def uneven() -> sb.System:
    imperfection = sb.Imperfection(midspan_amplitude=4e-6, antisymmetric_amplitude=3e-6, uniform_load=0.02)
    model = sb.ReducedModel.from_beam(paper.BEAM, modes=3, damping_ratio=0.012, imperfection=imperfection)
    base = sb.BaseExcitation(motion=sb.Sine(frequency_ratio=1.07, velocity_amplitude=0.9))
    striker = sb.Striker(drive=sb.Sine(frequency_ratio=1.07, velocity_amplitude=0.3), location=0.44)
    return sb.System(model, [sb.Contact(paper.CONTACT, striker)], base_excitation=base)


def held() -> sb.System:
    ends = sb.BoundaryConditions(left_rotational_stiffness=0.02, right_rotational_stiffness=0.05)
    model = sb.ReducedModel.from_beam(paper.BEAM.replace(boundary=ends), modes=3, damping_ratio=0.012)
    forces = [sb.LocalSpring(stiffness=15.0, location=0.31), sb.QuadraticDamping(coefficient=0.02, location=0.6)]
    striker = sb.Striker(drive=sb.Sine(frequency_ratio=1.13, velocity_amplitude=0.2), location=0.44, mass=0.05)
    return sb.System(model, [sb.Contact(sb.HuntCrossley(2e8, 0.4), striker)], forces=forces)


HERTZ = paper.CONTACT.stiffness
SYSTEMS: dict[str, tuple[Callable[[], sb.System], tuple[str, ...]]] = {
    "Hertz": (lambda: struck(paper.CONTACT, 1.5e-5), ("contact.gap", "contact.stiffness", "contact.location", "drive.frequency_ratio")),
    "Hunt and Crossley": (lambda: struck(sb.HuntCrossley(HERTZ, 0.7)), ("contact.damping_factor", "drive.frequency_ratio")),
    "Kelvin and Voigt": (lambda: struck(sb.KelvinVoigt(2.3e5, 2.0)), ("contact.linear_damping", "drive.frequency_ratio")),
    "restitution": (lambda: struck(sb.Restitution(0.55)), ("contact.coefficient", "drive.velocity_amplitude")),
    "plastic": (lambda: struck(sb.ElasticPlasticContact(2e5, 5e5)), ("contact.loading_stiffness", "drive.velocity_amplitude")),
    "piezoelectric": (
        lambda: struck(paper.CONTACT, harvesters=[sb.PiezoelectricHarvester(moment_per_volt=1e-5, capacitance=1e-8, resistance=2e5)]),
        ("harvester.resistance", "drive.velocity_amplitude"),
    ),
    "coil": (
        lambda: struck(paper.CONTACT, harvesters=[sb.ElectromagneticHarvester(force_factor=0.4, resistance=30.0, inductance=0.01)]),
        ("harvester.resistance", "drive.frequency_ratio"),
    ),
    "force": (pushed, ("force.amplitude", "force.frequency_ratio")),
    "structure": (
        lambda: struck(paper.CONTACT, 1.5e-5, harvesters=[sb.PiezoelectricHarvester(moment_per_volt=1e-5, capacitance=1e-8, resistance=2e5)]),
        ("beam.young_modulus", "beam.thickness", "beam.density", "model.damping_ratio", "harvester.capacitance"),
    ),
    "unequal wells": (uneven, ("imperfection.midspan_amplitude", "beam.length", "base_excitation.velocity_amplitude")),
    "held and damped": (held, ("boundary.left_rotational_stiffness", "beam.buckling_level", "force.stiffness", "force.location")),
    "two strikers": (two_strikers, ("contact.2.gap", "contact.2.damping_factor", "drive.velocity_amplitude")),
}  # fmt: skip


def slopes_of(
    system: sb.System, name: str, accuracy: str
) -> tuple[dict[str, float], dict[str, float], dict[str, float], dict[str, float]]:
    """Values, exact derivatives per relative change, those by differences, and the errors of these."""
    how = sb.Integration(cycles=3, accuracy=accuracy, early_termination=False, high_frequency_ratio=2.0)
    value = float(system.get(name))

    def ensemble(share: float) -> Ensemble:
        return make_ensemble(system.replace(**{name: value * share}), how, step_factor=STEP[accuracy])

    def run(share: float) -> dict[str, float]:
        one = ensemble(share)
        found = statistics_of(one, native.run_ensemble(one, threads=1))
        return {each: float(values[0]) for each, values in found.items()}

    above, below = ensemble(1.0 + 1e-5), ensemble(1.0 - 1e-5)
    assert native.differentiable(above, below)
    pairs, _, _ = native.changed_accumulators(ensemble(1.0), [(above, below, 2e-5 * value)], threads=1)
    high, low = (statistics_of(near, records) for near, records in zip((above, below), pairs[0], strict=True))
    here = run(1.0)
    exact = {each: (float(high[each][0]) - float(low[each][0])) / 2e-5 for each in here}
    tables: list[dict[str, float]] = []
    for change in CHANGES:
        ends = [(run(1.0 + k * change), run(1.0 - k * change), weight) for k, weight in ORDER_SIX]
        assert {end["impacts"] for pair in ends for end in pair[:2]} == {here["impacts"]}
        tables.append({each: sum(w * (a[each] - b[each]) for a, b, w in ends) / change for each in here})
    found, doubt = {}, {}
    for each in here:
        gaps = np.abs(np.diff([table[each] for table in tables]))
        best = int(np.nan_to_num(gaps, nan=np.inf).argmin())
        found[each], doubt[each] = tables[best + 1][each], float(gaps[best])
    return here, exact, found, doubt


@pytest.mark.sampled(3)
@pytest.mark.parametrize("accuracy", ["standard", pytest.param("reference", marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    "kind",
    [pytest.param(each, marks=pytest.mark.slow) if each in ("force", "held and damped") else each for each in SYSTEMS],
)
def test_derivatives_of_statistics(kind: str, accuracy: str) -> None:
    make, names = SYSTEMS[kind]
    for name in names:
        here, exact, found, doubt = slopes_of(make(), name, accuracy)
        assert kind == "force" or here["impacts"] > 1
        for each in (*SMOOTH, *(ROUGHER if accuracy == "reference" else ())):
            if kind == "restitution" and each == "peak_force":
                assert np.isnan(exact[each])
                continue
            # steps follow the structure, those of the derivative stay as they are
            moved = 4.0 if accuracy == "standard" and name.split(".")[0] in ("beam", "boundary", "model") else 1.0
            allowed = moved * LIMIT[accuracy] * ROUGHER.get(each, 1.0) * max(abs(found[each]), abs(here[each]))
            assert abs(exact[each] - found[each]) <= allowed + 10.0 * doubt[each], (
                name,
                each,
                exact[each],
                found[each],
                here[each],
            )
            assert doubt[each] <= 10.0 * allowed + 1e-300, (name, each)


def test_a_gradient_says_which_way_was_taken() -> None:
    how = sb.Integration(cycles=3, early_termination=False)
    names = ["drive.velocity_amplitude", "contact.stiffness", "beam.young_modulus"]
    system = struck(paper.CONTACT)
    found = sb.uncertainty.gradient(system, "striker_work", names, integration=how)
    assert found["method"].values.tolist() == ["exact", "exact", "exact"]
    assert (found["relative_error"].values < 1e-4).all()
    assert (found["growth"].values > 0.0).all()
    value, step = system.get(names[0]), 1e-4
    ends = [
        sb.simulate(system.replace(**{names[0]: value * (1.0 + side * step)}), how).summary.striker_work
        for side in (1.0, -1.0)
    ]
    assert found["derivative"].values[0] == pytest.approx((ends[0] - ends[1]) / (2.0 * step * value), rel=1e-4)


def test_a_table_of_pieces_whose_jumps_move() -> None:
    """The ramps of a burst last parts of its cycle; so its pieces and the times of their jumps change with its frequency."""
    burst = sb.Burst(
        frequency_ratio=1.1, velocity_amplitude=0.15, duration_cycles=2.4, ramp_up_cycles=0.6, ramp_down_cycles=0.6
    )
    system = sb.System(ONE, [sb.Contact(paper.CONTACT, sb.Striker(drive=burst))])
    how = sb.Integration(cycles=3, early_termination=False, accuracy="reference")
    names = ["drive.frequency_ratio", "drive.duration_cycles", "beam.buckling_level"]
    many = ["impulse", "striker_work", "rms_velocity"]
    found = sb.uncertainty.gradient(system, many, names, integration=how)
    assert (found["method"] == "exact").all()
    for k, name in enumerate(names):
        value, step = system.get(name), 1e-4
        ends = [sb.simulate(system.replace(**{name: value * (1.0 + side * step)}), how).summary for side in (1.0, -1.0)]
        for i, each in enumerate(many):
            slope = (getattr(ends[0], each) - getattr(ends[1], each)) / (2.0 * step)
            scale = max(abs(slope), 1e-2 * abs(float(found["value"][i])))
            assert abs(float(found["derivative"][i, k]) * value - slope) < 1e-5 * scale, (name, each)


def test_chaos_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("snapbeam.util.diagnostics._told", set())  # the same words are said once a process
    model = sb.ReducedModel.from_beam(paper.BEAM, modes=1, damping_ratio=0.005)
    drive = sb.Sine(frequency_ratio=1.2, velocity_amplitude=0.3)
    system = sb.System(model, [sb.Contact(paper.CONTACT, sb.Striker(drive=drive))])
    how = sb.Integration(cycles=60, early_termination=False)
    with pytest.warns(UserWarning, match="the motion is chaotic"):
        found = sb.uncertainty.gradient(system, "striker_work", "drive.velocity_amplitude", integration=how)
    assert found["growth"].values[0] > 1e3 and found["relative_error"].values[0] > 1e-4


@pytest.mark.parametrize("law", [sb.HertzContact(1e6), sb.HuntCrossley(1e6, 0.5), sb.PowerLaw(0.05, 1.5)])
def test_the_force_of_a_stop_that_is_preloaded(law: sb.ContactLaw) -> None:
    """The greatest penetration is that of the start: its derivative was lost."""
    stop = sb.Striker(drive=sb.FixedStop(), location=0.5, gap=-0.02 * MODEL.length_scale)
    system = sb.System(MODEL, [sb.Contact(law, stop)], initial_state=sb.State(amplitude=MODEL.well_amplitude))
    found = sb.uncertainty.gradient(system, "peak_force", ["contact.gap"], integration=sb.Integration(cycles=1))
    gaps = stop.gap + 1e-3 * MODEL.length_scale * np.array([-1.0, 1.0])
    forces = sb.sweep(system, {"contact.gap": gaps}, sb.Integration(cycles=1))["peak_force"].values
    wanted = (forces[1] - forces[0]) / (gaps[1] - gaps[0])
    assert float(found["derivative"].values.ravel()[0]) == pytest.approx(wanted, rel=1e-3)
