"""Root mean squares and the share of the energy in high modes, against dense recordings of random runs."""

from __future__ import annotations

import math
import re
import warnings

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.solver.statistics import Statistic, register_statistic, unregister_statistic
from snapbeam.sweeps.setup import variable_attributes

ROOTS = {
    "displacement": "displacement_at_striker",
    "midspan_displacement": "midspan_displacement",
    "velocity": "velocity_at_striker",
    "midspan_velocity": "midspan_velocity",
}
DISPLACEMENT = {"standard": 2e-5, "reference": 5e-7}
VELOCITY = {"standard": 5e-4, "reference": 3e-6}
SHARE = {"standard": 1e-4, "reference": 2e-5}
SAMPLES = 100_001


def mean(values: np.ndarray) -> float:
    """Of samples at even distances, the first and the last counted half."""
    return float(values.sum() - 0.5 * (values[0] + values[-1])) / (values.size - 1)


def share(run: sb.Run, wells: tuple[np.ndarray, np.ndarray], level: float) -> float:
    """High share of the energy of the linear modes about the well on the side of the centre."""
    model, data = run.system.model, run.dataset
    back = model.mass @ model.linear_modes
    lower, upper = sorted(wells, key=lambda each: float(each @ model.midspan_shape))
    above = data.midspan_displacement.values * model.length_scale > level
    q = (data.modal_amplitude.values - np.where(above[:, None], upper, lower)) @ back
    p = data.modal_velocity.values @ back
    energy = 0.5 * (p**2 + (model.omega * q) ** 2)
    high = model.natural_frequencies > run.integration.high_frequency_ratio * model.reference_frequency
    return mean(energy[:, high].sum(axis=1)) / mean(energy.sum(axis=1))


def assert_integrated(system: sb.System, how: sb.Integration, period: float) -> sb.Run:
    end = how.cycles * period
    run = sb.simulate(system, how, sample_times=np.linspace(0.0, end * (1.0 - 1e-13), SAMPLES))
    for name, variable in ROOTS.items():
        wanted = math.sqrt(mean(run.dataset[variable].values ** 2))
        bound = (VELOCITY if "velocity" in name else DISPLACEMENT)[how.accuracy]
        assert run.summary[f"rms_{name}"] == pytest.approx(wanted, rel=bound), (name, system)
    return run


@pytest.mark.sampled(3)
@pytest.mark.parametrize("accuracy", ["standard", "reference"])
@pytest.mark.parametrize("modes", [1, 3, 8, pytest.param(32, marks=pytest.mark.slow)])
def test_random_runs_with_contact(modes: int, accuracy: str) -> None:
    rng = np.random.default_rng(modes)
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=modes, damping_ratio=0.005)
    for _ in range(4):
        ratio, ratio_of_high = rng.uniform(0.7, 1.8), rng.uniform(2.0, 6.0)
        drive = sb.Sine(frequency_ratio=ratio, velocity_amplitude=rng.uniform(0.05, 0.6))
        system = sb.System(
            model,
            contacts=[sb.Contact(default_values.CONTACT, sb.Striker(drive=drive, location=rng.uniform(0.3, 0.5)))],
        )
        how = sb.Integration(cycles=5, accuracy=accuracy, high_frequency_ratio=ratio_of_high)
        run = assert_integrated(system, how, 1.0 / (ratio * model.reference_frequency))
        assert run.summary.impacts > 1
        if (model.natural_frequencies > ratio_of_high * model.reference_frequency).any():
            wanted = share(run, (model.well_amplitude, -model.well_amplitude), 0.0)
            assert run.summary.high_frequency_energy_fraction == pytest.approx(wanted, rel=SHARE[accuracy])


@pytest.mark.parametrize("ratio", [0.8, 1.05, 1.3])
def test_the_time_of_the_last_crossing(ratio: float) -> None:
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=3, damping_ratio=0.01)
    drive = sb.Sine(frequency_ratio=ratio, velocity_amplitude=0.6)
    system = sb.System(model, contacts=[sb.Contact(default_values.CONTACT, sb.Striker(drive=drive, location=0.4))])
    run = sb.simulate(system, sb.Integration(cycles=6, accuracy="reference", early_termination=False))
    last = run.summary.last_zero_crossing
    times = last + np.linspace(-1e-6, 1e-6, 201)
    near = sb.simulate(system, run.integration, sample_times=times).dataset.midspan_displacement.values
    assert near[0] * near[-1] < 0.0
    assert abs(np.interp(0.0, near * np.sign(near[-1]), times) - last) < 2e-8


@pytest.mark.slow
@pytest.mark.parametrize("accuracy", ["standard", "reference"])
def test_unequal_wells(accuracy: str) -> None:
    model = sb.ReducedModel.from_beam(
        default_values.BEAM, modes=4, imperfection=sb.Imperfection(midspan_amplitude=2e-6)
    )
    assert model.landscape is not None
    wells = model.landscape.lower.amplitude, model.landscape.upper.amplitude
    reached = 0
    for ratio, velocity in ((1.1, 0.5), (1.4, 0.1)):
        drive = sb.Sine(frequency_ratio=ratio, velocity_amplitude=velocity)
        system = sb.System(model, contacts=[sb.Contact(default_values.CONTACT, sb.Striker(drive=drive, location=0.45))])
        how = sb.Integration(cycles=5, accuracy=accuracy, high_frequency_ratio=2.0)
        run = assert_integrated(system, how, 1.0 / (ratio * model.reference_frequency))
        wanted = share(run, wells, model.dividing_height)
        assert run.summary.high_frequency_energy_fraction == pytest.approx(wanted, rel=SHARE[accuracy])
        reached += run.summary.zero_crossings > 0
    assert reached, "a run that passes from one well to the other"


@pytest.mark.slow
def test_a_statistic_that_is_registered_after_a_run() -> None:
    """The results are the same."""
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=2)
    striker = sb.Striker(drive=sb.Sine(frequency_ratio=1.21, velocity_amplitude=0.2))
    system, how = (sb.System(model, contacts=[sb.Contact(default_values.CONTACT, striker)]), sb.Integration(cycles=3))
    before = sb.simulate(system, how).summary
    row = Statistic(
        "steps_counted", "float64", "1", "steps of the run", lambda reading, held: held, update=lambda held, _: held + 1.0
    )  # fmt: skip
    register_statistic(row)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            with_row = sb.simulate(system, how).summary
    finally:
        unregister_statistic("steps_counted")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        after = sb.simulate(system, how).summary
    assert with_row.steps_counted > 100.0 and "steps_counted" not in after
    for name, value in before.items():
        np.testing.assert_equal((with_row[name], after[name]), (value, value), err_msg=name)


def summit(values: np.ndarray) -> float:
    """Maximum of samples, by the parabola through the highest and its neighbours."""
    k = int(values.argmax())
    a, b, c = values[k - 1 : k + 2] if 0 < k < values.size - 1 else 3 * [values[k]]
    return float(b - (a - c) ** 2 / (8.0 * (a - 2.0 * b + c)) if a < b > c else b)


@pytest.mark.parametrize("modes", [1, 8, pytest.param(32, marks=pytest.mark.slow)])
def test_peaks_err_by_at_most_what_they_state(modes: int) -> None:
    """Maxima inside steps, against fine output at level reference; the comment has the bound of each level."""
    rng = np.random.default_rng(40 + modes)
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=modes, damping_ratio=0.005)
    compared = 0
    layers = sb.PiezoelectricHarvester(moment_per_volt=1e-4, capacitance=3e-7, resistance=1e4)
    for _ in range(4):
        ratio = rng.uniform(0.4, 3.0)
        shaker = sb.Shaker(frequency_ratio=ratio, velocity_amplitude=rng.uniform(0.03, 0.6))
        contact = sb.Contact(default_values.CONTACT, shaker)
        for peaks, around in (
            ({"peak_velocity": "velocity_at_striker", "peak_midspan_velocity": "midspan_velocity"}, []),
            ({"peak_voltage": "voltage"}, [layers]),
        ):
            system = sb.System(model, contacts=[contact], harvesters=around)
            end = 2 / (ratio * model.reference_frequency) * (1.0 - 1e-13)
            times = np.linspace(0.0, end, 40_001)
            fine = sb.simulate(system, sb.Integration(cycles=2, accuracy="reference"), sample_times=times)
            for name, variable in peaks.items():
                exact = summit(np.abs(fine.dataset[variable].values))
                comment = variable_attributes(name)["comment"]
                for accuracy in ("standard", "reference"):
                    bound = float(re.search(rf"([\de.-]+) \({accuracy}\)", comment)[1])
                    run = sb.simulate(system, sb.Integration(cycles=2, accuracy=accuracy), sample_times=times[::2000])
                    moved = [each.dataset["modal_amplitude"].values for each in (run, fine)]
                    strayed = np.abs(moved[0][:21] - moved[1][::2000][:21]).max() / np.abs(moved[1]).max()
                    if strayed < 1e-6:  # the error of the run itself is beside
                        compared += 1
                        assert run.summary[name] == pytest.approx(exact, rel=bound), (name, accuracy, ratio)
    assert compared >= 14
