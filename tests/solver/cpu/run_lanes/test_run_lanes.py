"""Eight runs in a register give what eight modes in one give, to the bit, whatever a run is marched with."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline
from scipy.linalg import expm

import snapbeam as sb
from snapbeam.model.default_values import BEAM, CONTACT
from snapbeam.solver.assemble import make_ensemble
from snapbeam.solver.cpu import driver
from snapbeam.solver.cpu.memory import pack
from snapbeam.solver.cpu.run_lanes import layout as at
from snapbeam.solver.cpu.run_lanes.memory import suits
from snapbeam.solver.cpu.run_lanes.step import TEXTS, Modes
from snapbeam.solver.statistics import Statistic, register_statistic, statistics_of, unregister_statistic
from snapbeam.util.status_codes import RunStatus


def ensemble(modes, runs=40, cycles=12, seed=0, contact=CONTACT, drive=None, striker=None, **how):
    """Runs over the plane of Fig. 6, at three locations."""
    generator = np.random.default_rng(seed)
    system = sb.System(
        sb.ReducedModel.from_beam(BEAM, modes=modes, damping_ratio=0.005),
        contacts=[
            sb.Contact(
                contact,
                sb.Striker(
                    drive=drive or sb.Sine(frequency_ratio=1.0, velocity_amplitude=0.2), **(striker or {})
                ),
            )
        ],
    )
    points = {}
    if drive is None:
        points = {
            "drive.frequency_ratio": generator.uniform(0.1, 4.0, runs),
            "drive.velocity_amplitude": generator.uniform(0.02, 1.0, runs),
            "contact.location": generator.choice([0.3, 0.42, 1.0 / 2.1], runs),
        }
    else:
        points = {"contact.location": np.full(runs, 0.4)}
    return make_ensemble(system, sb.Integration(cycles=cycles, **how), points)


def marched(monkeypatch, few, made, threads=1):
    monkeypatch.setattr(driver, "FEWEST_STEPS", 0.0)
    monkeypatch.setattr(driver, "FEW_MODES", 16 if few else 0)
    return driver.run_ensemble(made, threads)


def assert_same(monkeypatch, made):
    expected, found = marched(monkeypatch, False, made), marched(monkeypatch, True, made)
    assert_equal(found, expected)
    return found


def assert_equal(found, expected):
    for name in expected.dtype.names:
        np.testing.assert_array_equal(found[name], expected[name], err_msg=name)


def test_one_mode_is_the_same_to_the_bit(monkeypatch):
    accumulators_of_runs = assert_same(monkeypatch, ensemble(1, cycles=40))
    assert accumulators_of_runs["impacts"].min() > 0
    assert np.unique(accumulators_of_runs["zero_crossings"]).size > 5
    assert (accumulators_of_runs["status"] == RunStatus.OK).all()


def test_decided_and_given_up_runs_are_the_same(monkeypatch):
    accumulators_of_runs = assert_same(monkeypatch, ensemble(1, cycles=120, early_termination=True))
    assert 3 < (accumulators_of_runs["status"] == RunStatus.EARLY_STOP).sum() < 40
    # a limit that is met on the way; one that cannot but be met is refused before
    accumulators_of_runs = assert_same(
        monkeypatch, dataclasses.replace(ensemble(1, cycles=20), max_steps=2000)
    )
    limited = accumulators_of_runs["status"] == RunStatus.STEP_LIMIT
    assert limited.any()
    assert (accumulators_of_runs["steps"][limited] == 2000).all()


def test_a_gap_and_a_striker_above(monkeypatch):
    assert_same(monkeypatch, ensemble(1, striker={"side": "above", "gap": 2e-5}))


@pytest.mark.slow
def test_a_striker_with_mass(monkeypatch):
    """Extremes and the share of high modes are those of the beam in both layouts, as recorded runs have them."""
    body = {"mass": 0.02, "suspension_stiffness": 700.0, "suspension_damping": 0.1}
    made = ensemble(2, runs=16, cycles=8, striker=body, high_frequency_ratio=1.2)
    found = statistics_of(made, assert_same(monkeypatch, made))
    assert (found["impacts"] > 0).all() and (found["high_frequency_energy_fraction"] > 0.0).any()
    model = made.structure.model
    for i in range(3):
        numbers = dict(zip(made.drive.number_names, made.drive_numbers[i], strict=True))
        first = 2.0 * np.pi * model.reference_frequency
        drive = sb.Sine(
            frequency_ratio=float(numbers["omega"] / first),
            velocity_amplitude=float(numbers["amplitude"] * numbers["omega"] / (model.length_scale * first)),
        )
        striker = sb.Striker(drive=drive, location=float(made.location[i]), **body)
        how = sb.Integration(cycles=8)
        times = np.linspace(0.0, 8 * 2.0 * np.pi / numbers["omega"] * (1.0 - 1e-12), 20001)
        w = sb.simulate(
            sb.System(model, contacts=[sb.Contact(CONTACT, striker)]), how, sample_times=times
        ).dataset.displacement_at_striker
        assert found["min_displacement"][i] == pytest.approx(float(w.min()), abs=1e-3)
        assert found["max_displacement"][i] == pytest.approx(float(w.max()), abs=1e-3)


@pytest.mark.slow
def test_a_striker_whose_suspension_is_nearly_critically_damped(monkeypatch):
    mass, stiffness = 0.02, 700.0
    critical = 2.0 * np.sqrt(stiffness * mass)
    body = {"mass": mass, "suspension_stiffness": stiffness, "suspension_damping": 0.95 * critical}
    found = assert_same(monkeypatch, ensemble(1, striker=body))
    assert found["impacts"].sum() > 0


@pytest.mark.parametrize(
    "damping_ratio", [0.02, *(pytest.param(each, marks=pytest.mark.slow) for each in (0.0, 0.3, 0.7, 0.95))]
)
def test_cubics_through_the_ends_of_a_step_are_as_near_as_their_bound(damping_ratio):
    """Of an oscillator under an acceleration that changes linearly, for steps from a hundredth of a period to half of one."""
    generator, written = np.random.default_rng(7), {
        "vabs": abs, "fma": lambda a, b, c: a * b + c, "load": lambda m, i: m[i], "broadcast_load": lambda m, i: m[i],
    }  # fmt: skip
    modes = Modes((1,), 6)
    exec("\n".join(TEXTS["cubic_errors"](modes)), written)
    for _ in range(200):
        omega, length = generator.uniform(50.0, 500.0), generator.uniform(0.05, 3.0)
        length /= omega
        q, p = generator.normal(), omega * generator.normal()
        k = omega**2 * generator.normal(size=2) * generator.choice([0.0, 0.1, 1.0])
        rates = np.zeros((4, 4))  # of q, p, the acceleration and its constant rate
        rates[0, 1] = rates[1, 2] = rates[2, 3] = 1.0
        rates[1, :2] = -(omega**2), -2.0 * damping_ratio * omega
        parts = np.linspace(0.0, 1.0, 41)
        state = np.array([expm(rates * s * length) @ [q, p, k[0], (k[1] - k[0]) / length] for s in parts])
        cubic = CubicHermiteSpline([0.0, length], state[[0, -1], 0], state[[0, -1], 1])(parts * length)
        memory = np.zeros(modes.place(0, at.MODE_ROWS))
        for field, value in (
            (at.OMEGA_I, omega), (at.OMEGA_SQUARED, omega**2), (at.DAMPING, damping_ratio * omega), (at.CENTER, -0.5),
            (at.CONTACT, 2.0), (at.Q, q), (at.P, p), (at.K, k[0]), (at.K1, k[1]),
        ):  # fmt: skip
            memory[modes.place(0, field)] = value
        contact, center = written["cubic_errors"](memory, None, length)
        away = np.abs(cubic - state[:, 0]).max()
        assert away <= 1.0001 * 0.5 * contact + 1e-14
        assert center == pytest.approx(0.25 * contact)


def test_neighbours_order_and_threads_do_not_matter(monkeypatch):
    made = ensemble(1, runs=37, cycles=20, seed=3)
    whole = marched(monkeypatch, True, made)
    again = marched(monkeypatch, True, made, threads=2)
    assert_equal(again, whole)
    for which in (np.arange(37)[::-1], np.array([5, 3, 30, 7, 7, 7, 7, 7, 12])):
        part = dataclasses.replace(
            made,
            runs=made.runs[which],
            law_numbers=made.law_numbers[which],
            drive_numbers=made.drive_numbers[which],
            location=made.location[which],
            highest=made.highest[which],
        )
        assert_equal(marched(monkeypatch, True, part), whole[which])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("modes", "how"),
    [
        (2, {}),
        (3, {}),
        (4, {"early_termination": True}),
        (8, {}),
        (13, {}),
        (16, {"cycles": 5}),
        (1, {"accuracy": "reference"}),
        (5, {"accuracy": "reference", "cycles": 4}),
        (4, {"high_frequency_ratio": 3.0}),
    ],
)
def test_more_modes_and_finer_steps_are_the_same_to_the_bit(monkeypatch, modes, how):
    assert_same(monkeypatch, ensemble(modes, seed=modes, **how))


def test_what_it_does_not_serve_goes_to_the_other_layout():
    def serves(made, most=driver.FEW_MODES):
        return suits(made, pack(made.structure, made.high_omega), most)

    assert serves(ensemble(2, cycles=2))
    assert serves(ensemble(12, cycles=2))
    assert not serves(ensemble(13, cycles=2))
    assert not serves(ensemble(1, runs=1, cycles=2))
    assert not serves(ensemble(1, cycles=2, contact=sb.Restitution(coefficient=0.6)))
    assert not serves(ensemble(1, cycles=2, contact=sb.HuntCrossley(stiffness=2e8, damping_factor=0.5)))
    assert not serves(ensemble(1, cycles=2, contact=sb.PowerLaw(force_at_1um=1.0, exponent=1.4)))
    drive = sb.HalfSine(displacement_amplitude=0.5, duration=0.5)
    assert not serves(ensemble(1, cycles=2, drive=drive))
    register_statistic(
        Statistic("twice", "float64", "1", "a number", lambda reading, held: held, lambda held, step: held)
    )
    try:
        assert not serves(ensemble(1, cycles=2))
    finally:
        unregister_statistic("twice")


@pytest.mark.slow
def test_small_work_is_not_worth_another_kernel(monkeypatch):
    made = ensemble(2, cycles=2)
    packed = pack(made.structure, made.high_omega)
    monkeypatch.setattr(driver, "_WORK", {})
    monkeypatch.setattr(driver, "FEWEST_STEPS", 2.5 * made.work.sum())
    assert [driver._few_modes_pay(made, packed) for _ in range(4)] == [False, False, True, True]
    monkeypatch.setattr(driver, "_KEPT", {})
    kernel = driver._kernel(driver.integrate_run_lanes, made)
    driver.run_ensemble(made, 1)
    assert driver._few_modes_kept(made, packed), "what is compiled serves from the first run on"
    monkeypatch.setattr(kernel, "overloads", {})
    monkeypatch.setattr(driver, "_KEPT", {})
    assert driver._few_modes_kept(made, packed), "so does what is on the disk"
