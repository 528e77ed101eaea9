"""One run, recorded: what the dataset, the response and the table of impacts say of the same motion."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.model.early_termination import decidable_energy
from snapbeam.simulation.dataset import check_trajectory
from snapbeam.util.status_codes import ResponseClass, RunStatus

REGULAR = [(1.4, 0.02), (0.1, 0.05)]
ELSEWHERE = [(1.21, 0.18), (1.625, 0.3), (3.0, 0.5), (0.5, 0.4)]


@cache
def model_of(modes: int, damping_ratio: float = 0.005) -> sb.ReducedModel:
    return sb.ReducedModel.from_beam(default_values.BEAM, modes, damping_ratio)


def simulate(modes: int, ratio: float, velocity: float, cycles: int, **options: Any) -> sb.Run:
    drive = {name: options.pop(name) for name in ("location", "side") if name in options}
    shaker = sb.Shaker(frequency_ratio=ratio, velocity_amplitude=velocity, **drive)
    sample_times, start = options.pop("sample_times", None), options.pop("start", None)
    system = sb.System(model_of(modes), contacts=[sb.Contact(default_values.CONTACT, shaker)], initial_state=start)
    return sb.simulate(system, sb.Integration(cycles=cycles, **options), sample_times=sample_times)


def kick(modes: int, share: float) -> np.ndarray:
    """Velocity of the first mode with a *share* of the energy of the barrier."""
    model = model_of(modes)
    energy = share * (model.saddle_energy - model.well_energy)
    return model.linear_modes[:, 0] * math.sqrt(2.0 * energy)


def assert_same(a: sb.Run, b: sb.Run) -> None:
    np.testing.assert_equal(dict(a.summary), dict(b.summary))
    for name in a.impacts:
        np.testing.assert_array_equal(a.impacts[name], b.impacts[name])


# ---------------------------------------------------------------------- the dataset


def test_dataset() -> None:
    run = simulate(3, 1.21, 0.18, 4)
    data = check_trajectory(run.dataset, require=("displacement_at_striker", "contact_force", "modal_amplitude"))
    assert dict(data.sizes)["mode"] == 3
    assert data.mode.values.tolist() == [1, 2, 3]
    period = 1.0 / (1.21 * model_of(3).reference_frequency)
    assert data.time[0] == 0.0
    assert float(data.time[-1]) == pytest.approx(4.0 * period, rel=1e-14)
    np.testing.assert_allclose(data.cycle, data.time / period, rtol=1e-13)

    model, scale = model_of(3), default_values.BEAM.buckling_level
    alpha = data.modal_amplitude.values
    np.testing.assert_allclose(
        data.displacement_at_striker, alpha @ model.shape_at(default_values.LOCATION) / scale, atol=1e-14
    )
    np.testing.assert_allclose(data.midspan_displacement, alpha @ model.midspan_shape / scale, atol=1e-14)
    np.testing.assert_array_equal(alpha[0], model.well_amplitude)
    stroke = 0.18 / 1.21
    tip = float(data.displacement_at_striker[0]) + stroke * np.sin(2.0 * np.pi * data.cycle.values)
    np.testing.assert_allclose(data.striker_displacement, tip, atol=1e-12)
    np.testing.assert_allclose(
        data.penetration_normalised, data.striker_displacement - data.displacement_at_striker, atol=1e-14
    )
    depth = np.maximum(data.penetration_normalised.values * scale, 0.0)
    np.testing.assert_allclose(data.contact_force, 4e8 * depth**1.5, rtol=1e-13, atol=1e-15)
    np.testing.assert_allclose(data.energy_contact, 0.4 * 4e8 * depth**2.5, rtol=1e-12, atol=1e-30)
    assert data.attrs["modes"] == 3
    assert data.attrs["contact_stiffness"] == 4e8
    assert data.attrs["frequency_ratio"] == 1.21
    assert data.attrs["reference_frequency"] == model.reference_frequency


def test_energy_of_the_dataset_is_that_of_its_amplitudes() -> None:
    """Without damping the velocity follows from the energy: zero at a turning point of one mode."""
    model = model_of(1, 0.0)
    start = (model.well_amplitude, kick(1, 0.5) * 1.0)
    data = sb.simulate(
        sb.System(model, initial_state=sb.State(amplitude=start[0], velocity=start[1])), sb.Integration(cycles=3)
    ).dataset
    energy = model.kinetic_energy(start[1]) + model.potential_energy(start[0]) - model.well_energy
    np.testing.assert_allclose(data.energy_beam, energy, rtol=1e-6)
    potential = model.potential_energy(data.modal_amplitude.values) - model.well_energy
    assert (potential <= energy * (1.0 + 1e-6)).all()
    assert potential.max() == pytest.approx(energy, rel=1e-3)
    assert "striker_displacement" not in data


@pytest.mark.parametrize(("modes", "bound"), [(1, 1e-6), (8, 1e-6), (32, 5e-4)])
def test_free_decay_dissipates_what_the_beam_loses(modes: int, bound: float) -> None:
    """Measured over eight cycles: below 3e-7; for N = 32 5.4e-5, and 2e-8 at a quarter of the step."""
    data = sb.simulate(
        sb.System(
            model_of(modes), initial_state=sb.State(amplitude=model_of(modes).well_amplitude, velocity=kick(modes, 0.6))
        ),
        sb.Integration(cycles=8),
    )
    total = (data.dataset.energy_beam + data.dataset.energy_dissipated).values
    assert np.abs(total / total[0] - 1.0).max() < bound
    assert (np.diff(data.dataset.energy_dissipated) > 0.0).all()
    lost = float(data.dataset.energy_dissipated[-1]) / total[0]
    assert lost == pytest.approx(1.0 - math.exp(-2.0 * math.pi * 0.01 * 8), rel=0.1)


def ledger_error(run: sb.Run) -> float:
    """Greatest gap in the ledger over the gross work."""
    data = run.dataset
    total = (data.energy_beam + data.energy_contact + data.energy_dissipated - data.striker_work).values
    return float(np.abs(total - total[0]).max() / data.attrs["gross_work"])


@pytest.mark.parametrize("modes", [1, 8, 32])
@pytest.mark.parametrize("pair", REGULAR + ELSEWHERE)
def test_energy_balance(modes: int, pair: tuple[float, float]) -> None:
    """Measured: at most 2.5e-6 on the regular runs and 4e-5 elsewhere, over the first five cycles."""
    error = ledger_error(simulate(modes, *pair, 5))
    assert error < (1e-4 if pair in REGULAR else 1e-3)
    assert error < 1.2e-4


@pytest.mark.slow
@pytest.mark.parametrize(("modes", "pair"), [(n, pair) for n in (1, 8, 32) for pair in REGULAR + ELSEWHERE])
def test_energy_balance_of_a_full_run(modes: int, pair: tuple[float, float]) -> None:
    assert ledger_error(simulate(modes, *pair, 200)) < (1e-4 if pair in REGULAR else 1e-3)


@pytest.mark.parametrize("modes", [1, 8, 32])
@pytest.mark.parametrize("pair", REGULAR)
def test_order_of_the_energy_balance(modes: int, pair: tuple[float, float]) -> None:
    """The mean order over three halvings; measured 2.4 to 4.3."""
    step = simulate(modes, *pair, 1).dataset.attrs["step"]
    errors = [ledger_error(simulate(modes, *pair, 3, step=step / 2**i)) for i in (0, 3)]
    assert math.log2(errors[0] / errors[1]) / 3.0 > 2.2, errors


# ---------------------------------------------------------------------- mirror image


@pytest.mark.parametrize("modes", [1, 2, 32])
def test_mirror_image(modes: int) -> None:
    """side="above" negates every displacement and nothing else, to the last bit."""
    below, above = (simulate(modes, 1.21, 0.3, 4, location=0.42, side=side) for side in ("below", "above"))
    negated = {"displacement_at_striker", "midspan_displacement", "striker_displacement", "modal_amplitude"}
    negated |= {"velocity_at_striker", "midspan_velocity", "modal_velocity"}
    for name, values in below.dataset.variables.items():
        sign = -1.0 if name in negated else 1.0
        np.testing.assert_array_equal(above.dataset[name], sign * values.values, err_msg=str(name))
    for name in below.impacts:
        np.testing.assert_array_equal(above.impacts[name], below.impacts[name])
    one, other = below.summary, above.summary
    for name, value in one.items():
        if name.startswith(("min_", "max_")):
            opposite = name.replace("min_", "MAX_").replace("max_", "min_").lower()
            assert other[opposite] == -value
        elif name == "final_well":
            assert other[name] == -value
        else:
            np.testing.assert_equal(other[name], value)
    assert below.summary.zero_crossings > 0


def test_negated_start() -> None:
    model = model_of(8)
    alpha, velocity = model.well_amplitude * 1.1, kick(8, 1.6)
    below = simulate(8, 1.1, 0.2, 3, start=sb.State(amplitude=alpha, velocity=velocity))
    above = simulate(8, 1.1, 0.2, 3, start=sb.State(amplitude=-alpha, velocity=-velocity), side="above")
    np.testing.assert_array_equal(above.dataset.modal_amplitude, -below.dataset.modal_amplitude)
    np.testing.assert_array_equal(above.dataset.contact_force, below.dataset.contact_force)
    # a free beam has no shaker to say which well the arithmetic begins in: equal but for rounding
    free = [
        sb.simulate(
            sb.System(model, initial_state=sb.State(amplitude=s * alpha, velocity=s * velocity)),
            sb.Integration(cycles=3),
        )
        for s in (1.0, -1.0)
    ]
    np.testing.assert_allclose(
        free[1].dataset.displacement_at_striker, -free[0].dataset.displacement_at_striker, atol=1e-11
    )


def test_shaker_at_the_centre_leaves_the_antisymmetric_modes_at_rest() -> None:
    alpha = simulate(32, 1.21, 0.3, 4, location=0.5).dataset.modal_amplitude.values
    assert not alpha[:, 1::2].any()
    assert alpha[:, 2].any()


# ---------------------------------------------------------------------- recording


def test_sample_times_are_returned_exactly() -> None:
    end = 5.0 / (1.21 * model_of(2).reference_frequency)
    times = np.sort(np.random.default_rng(5).uniform(0.0, end, 300))
    times[0], times[-1] = 0.0, end
    run = simulate(2, 1.21, 0.18, 5, sample_times=times)
    np.testing.assert_array_equal(run.dataset.time, times)
    # the same instants among others give the same numbers
    some = simulate(2, 1.21, 0.18, 5, sample_times=times[::7])
    np.testing.assert_array_equal(some.dataset.modal_amplitude, run.dataset.modal_amplitude[::7])
    np.testing.assert_array_equal(some.dataset.striker_work, run.dataset.striker_work[::7])


@pytest.mark.parametrize("part", ["coil", "indentation"])
def test_a_run_with_a_state_beside_its_modes_is_the_point_of_a_sweep(part: str) -> None:
    """To the bit with 16 modes, the most that stand side by side in lanes of runs: a charge or an indentation is no mode there."""
    coil = sb.ElectromagneticHarvester(force_factor=0.7, resistance=47.0, coil_resistance=8.0, inductance=0.0175)
    law = sb.ElasticPlasticContact(1e5, 2e5) if part == "indentation" else default_values.CONTACT
    shaker = sb.Shaker(frequency_ratio=1.21, velocity_amplitude=0.18)
    model = sb.ReducedModel.from_beam(default_values.BEAM, 16)
    system = sb.System(model, contacts=[sb.Contact(law, shaker)], harvesters=[coil] if part == "coil" else [])
    summary = sb.simulate(system, sb.Integration(cycles=2)).summary
    point = sb.sweep(system, {"velocity_amplitude": [0.18]}, sb.Integration(cycles=2))
    for name in ("peak_force", "rms_displacement", "impulse", "energy_dissipated"):
        assert float(point[name][0]) == summary[name], name


@pytest.mark.parametrize("modes", [1, 32])
def test_recording_does_not_disturb(modes: int) -> None:
    default = simulate(modes, 1.21, 0.3, 4)
    end = float(default.dataset.time[-1])
    dense = simulate(modes, 1.21, 0.3, 4, sample_times=np.linspace(0.0, end, 20_001))
    single = simulate(modes, 1.21, 0.3, 4, sample_times=[0.5 * end])
    assert_same(default, dense)
    assert_same(default, single)


@pytest.mark.parametrize(("modes", "pair", "cycles"), [(1, (1.4, 0.02), 5), (32, (0.1, 0.05), 1), (8, (3.0, 0.5), 8)])
def test_default_sampling_shows_every_contact(modes: int, pair: tuple[float, float], cycles: int) -> None:
    run = simulate(modes, *pair, cycles)
    time, force = run.dataset.time.values, run.dataset.contact_force.values
    assert run.impacts.sizes["impact"] > 3
    for onset, duration, peak in zip(
        run.impacts.onset.values, run.impacts.duration.values, run.impacts.peak_force.values, strict=True
    ):
        inside = (time >= onset) & (time <= onset + duration)
        assert inside.sum() >= 10
        assert force[inside].max() == pytest.approx(peak, rel=0.1)
    assert run.dataset.sizes["time"] < 10_000


# ---------------------------------------------------------------------- response and impacts


@pytest.mark.parametrize(
    ("modes", "pair", "cycles"),
    [(1, (1.21, 0.18), 8), (2, (0.5, 0.4), 6), (8, (1.4, 0.02), 3), (8, (1.625, 0.3), 6), (32, (3.0, 0.5), 8)],
)
def test_response_agrees_with_the_dataset(modes: int, pair: tuple[float, float], cycles: int) -> None:
    response = (run := simulate(modes, *pair, cycles)).summary
    end = cycles / (pair[0] * model_of(modes).reference_frequency)
    shown = simulate(modes, *pair, cycles, sample_times=np.linspace(0.0, end, 60_001)).dataset
    center = shown.midspan_displacement.values
    signs = np.sign(center)
    changes = np.flatnonzero(signs[1:] != signs[:-1])
    assert response.zero_crossings == changes.size
    late = shown.time.values[changes] > 0.75 * end
    assert response.zero_crossings_last_quarter == np.count_nonzero(late)
    spacing = end / 60_000
    if changes.size:
        assert abs(response.last_zero_crossing - shown.time.values[changes[-1]]) <= 1.001 * spacing
    else:
        assert math.isnan(response.last_zero_crossing)
    assert response.final_well == signs[-1]

    # a cubic between flight steps sees the extremes to 2e-3 of b, the samples see them to less
    for name, values in (
        ("displacement", shown.displacement_at_striker),
        ("midspan_displacement", shown.midspan_displacement),
    ):
        assert getattr(response, f"max_{name}") == pytest.approx(float(values.max()), abs=2e-3)
        assert getattr(response, f"min_{name}") == pytest.approx(float(values.min()), abs=2e-3)
    assert response.peak_force == pytest.approx(float(shown.contact_force.max()), rel=5e-3)
    assert response.impacts == run.impacts.sizes["impact"]
    assert response.peak_force == run.impacts.peak_force.max()
    assert response.contact_time_fraction == pytest.approx(float(run.impacts.duration.sum()) / end, rel=1e-12)
    assert response.status == RunStatus.OK
    assert math.isnan(response.early_stop_time)
    # final is what the energy proves: in the far well, out of the tip's reach, with too little to come back to it
    model, scale = model_of(modes), default_values.BEAM.buckling_level
    energy = float(shown.energy_beam[-1] + shown.energy_contact[-1])
    highest = float(shown.displacement_at_striker[0]) * scale + pair[1] / pair[0] * scale
    bound = float(decidable_energy(model, np.array([default_values.LOCATION]), np.array([highest]))[0])
    out_of_reach = float(shown.displacement_at_striker[-1]) * scale > max(highest, 0.0)
    assert response.final_well_proven == (signs[-1] > 0 and out_of_reach and energy < bound)


@pytest.mark.parametrize(("modes", "pair", "cycles"), [(1, (1.21, 0.05), 6), (8, (1.4, 0.02), 2)])
def test_impulse_is_the_integral_of_the_force(modes: int, pair: tuple[float, float], cycles: int) -> None:
    run = simulate(modes, *pair, cycles)
    onset, duration = run.impacts.onset.values, run.impacts.duration.values
    instants = onset[:, None] + duration[:, None] * np.linspace(0.0, 1.0, 400)
    end = cycles / (pair[0] * model_of(modes).reference_frequency)
    shown = simulate(modes, *pair, cycles, sample_times=np.unique(np.clip(instants, 0.0, end))).dataset
    for impact in range(onset.size):
        inside = (shown.time >= onset[impact]) & (shown.time <= onset[impact] + duration[impact])
        force, time = shown.contact_force.values[inside], shown.time.values[inside]
        assert np.trapezoid(force, time) == pytest.approx(float(run.impacts.impulse[impact]), rel=5e-3)
    assert (np.diff(onset) > 0.0).all()
    assert (onset[1:] >= onset[:-1] + duration[:-1]).all()


@pytest.mark.parametrize(
    ("modes", "pair", "cycles"),
    [
        (1, (1.4, 0.02), 20),
        (1, (1.21, 0.05), 6),
        (2, (1.21, 0.05), 5),
        (8, (1.4, 0.02), 3),
        (8, (0.1, 0.05), 1),
        (32, (1.4, 0.02), 4),
        (32, (0.1, 0.05), 1),
    ],
)
def test_no_impact_is_missed(modes: int, pair: tuple[float, float], cycles: int) -> None:
    """The list at the default step is that at an eighth of it; measured: to 2.3e-7 s, forces to 1.1e-4."""
    run = simulate(modes, *pair, cycles)
    fine = simulate(modes, *pair, cycles, step=run.dataset.attrs["step"] / 8.0)
    assert run.impacts.sizes == fine.impacts.sizes
    np.testing.assert_allclose(run.impacts.onset, fine.impacts.onset, rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(run.impacts.peak_force, fine.impacts.peak_force, rtol=1e-3)


def test_nothing_is_final_of_a_beam_that_is_still_struck() -> None:
    """Below the barrier in its first well, the tip in reach: it may snap yet, and in a longer run some do."""
    model, changed = model_of(1), 0
    for velocity in np.linspace(0.05, 0.4, 36):
        shaker = sb.Shaker(frequency_ratio=1.21, velocity_amplitude=float(velocity))
        short, long = (
            sb.simulate(
                sb.System(model, contacts=[sb.Contact(default_values.CONTACT, shaker)]),
                sb.Integration(cycles=n),
                sample_times=[0.0],
            )
            for n in (10, 200)
        )
        if short.summary.final_well < 0:
            assert not short.summary.final_well_proven
            changed += long.summary.zero_crossings != short.summary.zero_crossings
        if short.summary.final_well_proven:
            assert (long.summary.zero_crossings, long.summary.final_well) == (short.summary.zero_crossings, 1)
    assert changed > 0


@pytest.mark.parametrize("start", [-1.0, 1.0])
def test_class_is_told_by_the_end(start: float) -> None:
    """A beam thrown over the barrier once, from the lower well, is transient; it rests where it is seen."""
    model = model_of(2, 0.05)
    velocity = -start * model.linear_modes[:, 0] * math.sqrt(3.5 * (model.saddle_energy - model.well_energy))
    run = sb.simulate(
        sb.System(model, initial_state=sb.State(amplitude=-start * model.well_amplitude, velocity=velocity)),
        sb.Integration(cycles=60),
    )
    assert run.summary.final_well == np.sign(run.dataset.midspan_displacement.values[-1])
    assert run.summary.final_well_proven
    if start < 0.0:
        assert run.summary.response_class == (
            ResponseClass.TRANSIENT_2 if run.summary.zero_crossings % 2 else ResponseClass.TRANSIENT_1
        )


def test_early_termination_ends_the_recording() -> None:
    full, early = (simulate(1, 1.21, 0.36, 60, early_termination=flag) for flag in (False, True))
    assert early.summary.status == RunStatus.EARLY_STOP
    assert early.summary.response_class == full.summary.response_class
    assert early.summary.early_stop_time < full.dataset.time[-1]
    assert early.dataset.time[-1] <= early.summary.early_stop_time


def test_instants_after_an_early_termination() -> None:
    full = simulate(1, 1.21, 0.36, 60, early_termination=True)
    late = [full.summary.early_stop_time + 0.01]
    run = simulate(1, 1.21, 0.36, 60, early_termination=True, sample_times=late)
    assert run.summary.early_stop_time == full.summary.early_stop_time
    assert run.dataset.time.values.tolist() == late
    assert run.dataset.valid.values.tolist() == [0]
    assert np.isnan(run.dataset.displacement_at_striker.values).all()


# ---------------------------------------------------------------------- failures


def test_a_run_that_overflows_says_so() -> None:
    """A failed run does not raise: its class is unknown and its status says why."""
    run = sb.simulate(
        sb.System(model_of(2), initial_state=sb.State(amplitude=[1e200, 0.0], velocity=[0.0, 0.0])),
        sb.Integration(cycles=2),
    )
    assert run.summary.response_class == ResponseClass.UNKNOWN
    assert run.summary.status == RunStatus.DIVERGED
    assert math.isnan(run.summary.max_displacement)
    assert run.dataset.attrs["status"].startswith("DIVERGED: ")
    assert run.dataset.time.values.tolist() == [0.0]
    assert run.dataset.valid.values.tolist() == [0]
    assert run.final_state is None
    some = sb.simulate(
        sb.System(model_of(2), initial_state=sb.State(amplitude=[1e200, 0.0], velocity=[0.0, 0.0])),
        sb.Integration(cycles=2),
        sample_times=[0.0, 0.01],
    )
    assert some.dataset.valid.values.tolist() == [0, 0]


def test_transient_2_from_the_upper_well() -> None:
    """classify() takes +1 for the well opposite to the one the run began in: one crossing is transient 2."""
    model = model_of(2, 0.05)
    velocity = model.linear_modes[:, 0] * math.sqrt(3.75 * (model.saddle_energy - model.well_energy))
    response = sb.simulate(
        sb.System(model, initial_state=sb.State(amplitude=-model.well_amplitude, velocity=velocity)),
        sb.Integration(cycles=40),
    ).summary
    assert (response.zero_crossings, response.final_well) == (1, -1)
    assert response.response_class == ResponseClass.TRANSIENT_2


def test_no_sample_before_an_early_end_with_the_native_core() -> None:
    """A record without a sample has the instants that were asked for, and none is valid."""
    full = simulate(1, 1.21, 0.36, 60, early_termination=True, engine="native")
    late = [full.summary.early_stop_time + 0.02]
    run = simulate(1, 1.21, 0.36, 60, early_termination=True, engine="native", sample_times=late)
    assert run.dataset.valid.values.tolist() == [0]
