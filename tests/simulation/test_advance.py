"""Going on from a state: composition, agreement with a run, tangents."""

from __future__ import annotations

import dataclasses
import math
from functools import cache

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.solver.step_size import choose_base_step
from snapbeam.util.validation import InputError, InputTypeError

REGULAR = {1: (1.6, 0.03), 8: (1.4, 0.03), 32: (3.5, 0.06)}
"""Omega and V of well-conditioned motions with impacts, by the number of modes."""
REFERENCE = sb.Integration(accuracy="reference")


@cache
def system_of(modes: int, ratio: float = 1.21, velocity: float = 0.18, side: str = "below") -> sb.System:
    return sb.System(
        sb.ReducedModel.from_beam(default_values.BEAM, modes),
        contacts=[
            sb.Contact(default_values.CONTACT, sb.Shaker(frequency_ratio=ratio, velocity_amplitude=velocity, side=side))
        ],
    )


def energy(system: sb.System, state: sb.State) -> float:
    """Above the well, J."""
    model = system.model
    return float(model.kinetic_energy(state.velocity) + model.potential_energy(state.amplitude) - model.well_energy)


def plain(state: sb.State) -> sb.State:
    """The state in numbers that a person could give."""
    return sb.State(
        amplitude=state.amplitude, velocity=state.velocity, phase=state.phase,
        striker_position=state.striker_position, contact_time=state.contact_time,
    )  # fmt: skip


def assert_equal(one: sb.State, other: sb.State) -> None:
    for name in ("amplitude", "velocity", "phase", "striker_position", "contact_time"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)


def somewhere(system: sb.System) -> sb.State:
    """Moving in its first two modes, the tip away from it, the drive in mid-stroke."""
    model = system.model
    sign = -1.0 if system.striker is not None and system.striker.side == "above" else 1.0
    velocity = model.linear_modes[:, 0] * 2e-3 + (model.linear_modes[:, 1] * 1e-3 if model.modes > 1 else 0.0)
    return sb.State(
        amplitude=sign * 0.6 * model.well_amplitude, velocity=sign * velocity, phase=1.1, striker_position=-sign * 2e-4
    )


# ---------------------------------------------------------------------- composition


SYSTEMS = {
    "one mode": system_of(1),
    "eight modes": system_of(8),
    "above": system_of(8, 1.3, 0.3, "above"),
    "many modes": system_of(32, 3.0, 0.5),
    "undriven": sb.System(
        sb.ReducedModel.from_beam(default_values.BEAM, 3),
        initial_state=sb.State(amplitude=[1e-3, 2e-4, 1e-5], velocity=[0.1, 0.0, 0.0]),
    ),
    "elastic": sb.System(
        sb.ReducedModel.from_beam(default_values.BEAM, 1),
        contacts=[sb.Contact(sb.Restitution(0.9), system_of(1).striker)],
    ),
    "plastic": sb.System(
        sb.ReducedModel.from_beam(default_values.BEAM, 1),
        contacts=[sb.Contact(sb.Restitution(0.0), system_of(1).striker)],
    ),
}


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[pytest.mark.slow] if n in ("elastic", "plastic") else []) for n in SYSTEMS]
)
def test_calls_compose_bit_for_bit(name: str) -> None:
    """Twelve periods in one call, in twelve, in four of three; and all the states on the way."""
    system = SYSTEMS[name]
    whole, every = sb.advance(system, periods=12), sb.advance(system, periods=12, save_every_period=True)
    assert every.batch == (12,)
    state = None
    for number in range(12):
        state = sb.advance(system, state)
        assert_equal(state, every[number])
    assert_equal(state, whole)
    state = None
    for _ in range(4):
        state = sb.advance(system, state, 3)
    assert_equal(state, whole)


@pytest.mark.parametrize("name", ["one mode", "above", "many modes"])
def test_calls_compose_from_anywhere(name: str) -> None:
    """Any phase, a striker that stands anywhere: bit for bit too."""
    system = SYSTEMS[name]
    start = somewhere(system)
    whole, state = sb.advance(system, start, 6), start
    for _ in range(6):
        state = sb.advance(system, state)
    assert_equal(state, whole)
    assert float(whole.phase) == 1.1, "whole periods bring the drive back"
    assert float(whole.striker_position) == pytest.approx(float(start.striker_position), rel=1e-14)
    assert int(whole.statistics["impacts"]) > 0


def test_less_than_a_tick_is_refused() -> None:
    """It ran for ever."""
    with pytest.raises(InputError, match=r"periods = 1e-09: must be at least \S+, a tick of the clock"):
        sb.advance(system_of(2), periods=1e-9)
    assert sb.advance(system_of(2), periods=1e-6).statistics["status"] == 0


def test_parts_of_periods_compose_to_rounding() -> None:
    system = system_of(8)
    whole = sb.advance(system, periods=2)
    state = sb.advance(system, sb.advance(system, periods=0.3), 0.45)
    assert float(state.phase) == pytest.approx(2.0 * math.pi * 0.75, rel=1e-12)
    state = sb.advance(system, state, 1.25)
    np.testing.assert_allclose(state.amplitude, whole.amplitude, rtol=0.0, atol=1e-5 * abs(whole.amplitude[0]))
    assert math.cos(float(state.phase)) == pytest.approx(1.0, abs=1e-12)


def test_a_state_in_plain_numbers_goes_on_alike() -> None:
    """Without the engine's own coordinates: equal to rounding, in contact and apart."""
    system = system_of(4, 1.21, 0.18)
    state = sb.advance(system, periods=1)
    for _ in range(8):
        touching = bool(state.contact_time[0] >= 0.0)
        following, same = sb.advance(system, state, 0.37), sb.advance(system, plain(state), 0.37)
        np.testing.assert_allclose(same.amplitude, following.amplitude, rtol=0.0, atol=1e-13)
        assert int(following.statistics["impacts"]) == int(same.statistics["impacts"]), touching
        state = following


def test_statistics_of_the_way_add_up() -> None:
    system = system_of(8, *REGULAR[8])
    whole, state = sb.advance(system, periods=20), None
    total = dict.fromkeys(("zero_crossings", "impacts", "impulse", "striker_work", "gross_work"), 0.0)
    peak = 0.0
    for _ in range(20):
        state = sb.advance(system, state)
        for name in total:
            total[name] += float(state.statistics[name])
        peak = max(peak, float(state.statistics["peak_force"]))
    for name, value in total.items():
        assert float(whole.statistics[name]) == pytest.approx(value, rel=1e-12), name
    assert float(whole.statistics["peak_force"]) == peak


# ---------------------------------------------------------------------- against an uninterrupted run


@pytest.mark.parametrize("modes", [pytest.param(n, marks=pytest.mark.slow if n > 1 else ()) for n in REGULAR])
def test_two_hundred_calls_against_a_run_of_two_hundred_cycles(modes: int) -> None:
    """Energies, crossings and impacts of regular motions agree to the error of the accuracy level.

    Measured: energies to 2e-7 (N = 1, 8) and 2e-5 (N = 32), works to 1e-5, positions to 1e-6 of b.
    """
    system = system_of(modes, *REGULAR[modes])
    run = sb.simulate(system, sb.Integration(cycles=200), sample_times=[0.0])
    state, crossings, impacts, work = None, 0, 0, 0.0
    for _ in range(200):
        state = sb.advance(system, state)
        crossings += int(state.statistics["zero_crossings"])
        impacts += int(state.statistics["impacts"])
        work += float(state.statistics["striker_work"])
    impacts += int(state.contact_time[0] >= 0.0)  # one that is still going on
    assert (crossings, impacts) == (run.summary.zero_crossings, run.summary.impacts)
    assert impacts >= 170
    assert energy(system, state) == pytest.approx(energy(system, run.final_state), rel=1e-4)
    assert work == pytest.approx(run.summary.striker_work, rel=1e-4)
    np.testing.assert_allclose(
        state.amplitude, run.final_state.amplitude, rtol=0.0, atol=1e-4 * abs(state.amplitude[0])
    )


@pytest.mark.parametrize("modes", [1, 8])
def test_at_the_reference_level_they_are_one(modes: int) -> None:
    """Measured over 200 cycles: energies to 1e-11, as the level promises, not the way it is cut."""
    system = system_of(modes, *REGULAR[modes])
    run = sb.simulate(system, REFERENCE.replace(cycles=200), sample_times=[0.0])
    state = sb.advance(system, periods=200, integration=REFERENCE)
    assert energy(system, state) == pytest.approx(energy(system, run.final_state), rel=1e-9)
    assert int(state.statistics["impacts"]) == run.summary.impacts
    assert float(state.statistics["impulse"]) == pytest.approx(run.summary.impulse, rel=1e-9)


def test_a_run_ends_where_a_state_goes_on() -> None:
    """Run.end is a state like any other."""
    system = system_of(8, *REGULAR[8])
    half = sb.simulate(system, sb.Integration(cycles=10), sample_times=[0.0])
    whole = sb.simulate(system, sb.Integration(cycles=20), sample_times=[0.0])
    gone_on = sb.advance(system, half.final_state, 10)
    np.testing.assert_allclose(
        gone_on.amplitude, whole.final_state.amplitude, rtol=0.0, atol=1e-6 * abs(whole.final_state.amplitude[0])
    )
    again = sb.simulate(
        system.replace(initial_state=plain(half.final_state)), sb.Integration(cycles=10), sample_times=[0.0]
    )
    np.testing.assert_allclose(
        again.final_state.amplitude,
        whole.final_state.amplitude,
        rtol=0.0,
        atol=1e-6 * abs(whole.final_state.amplitude[0]),
    )


def test_mirror_image() -> None:
    below, above = system_of(8, 1.3, 0.3), system_of(8, 1.3, 0.3, "above")
    one, other = (sb.advance(system, somewhere(system), 7) for system in (below, above))
    np.testing.assert_array_equal(one.amplitude, -other.amplitude)
    np.testing.assert_array_equal(one.velocity, -other.velocity)
    assert float(one.striker_position) == -float(other.striker_position)
    for name, value in one.statistics.items():
        if not name.startswith(("min_", "max_")):
            np.testing.assert_array_equal(value, other.statistics[name], err_msg=name)


# ---------------------------------------------------------------------- batches


def test_a_batch_is_its_states() -> None:
    """In any shape, on any number of threads, to the last bit."""
    system = system_of(4, 1.3, 0.3)
    rng = np.random.default_rng(3)
    batch = sb.State(
        amplitude=system.model.well_amplitude * rng.uniform(-1.2, 1.2, (3, 5, 1)),
        velocity=1e-2 * rng.normal(size=(3, 5, 4)),
        phase=rng.uniform(0.0, 6.0, (3, 5)),
        striker_position=rng.uniform(-4e-4, -2e-4, (3, 5)),
    )
    many = sb.advance(system, batch, 4)
    assert many.batch == (3, 5) and many.statistics["impacts"].shape == (3, 5)
    for at in ((0, 0), (1, 3), (2, 4)):
        alone = sb.advance(system, batch[at], 4)
        assert_equal(many[at], alone)
        assert {name: values[at] for name, values in many.statistics.items()} == pytest.approx(
            {name: float(value) for name, value in alone.statistics.items()}, nan_ok=True, rel=0.0
        )
    for threads in (1, 3):
        assert_equal(sb.advance(system, batch, 4, integration=sb.Integration(threads=threads)), many)
    every = sb.advance(system, batch, 4, save_every_period=True)
    assert every.batch == (4, 3, 5)
    assert_equal(every[3], many)
    assert every.statistics["impacts"].tolist() == many.statistics["impacts"].tolist(), "of the whole way"
    assert every[3].statistics.keys() == {"status"}
    assert_equal(sb.advance(system, every[1], 2), many)
    assert_equal(sb.advance(system, many, 2), sb.advance(system, batch, 6))


def test_a_striker_that_is_moved_strikes_where_it_is() -> None:
    """A state goes on under another location, drive or law: the tip stays where it was in space."""
    system = system_of(4, 1.4, 0.03)
    state = sb.advance(system, periods=3)
    for changes in ({"contact.location": 0.3}, {"drive.velocity_amplitude": 0.025}, {"contact.stiffness": 1e7}):
        other = system.replace(**changes)
        following = sb.advance(other, state, 6)
        same = sb.advance(other, plain(state), 6)
        np.testing.assert_allclose(following.amplitude, same.amplitude, rtol=0.0, atol=1e-11)
        assert float(following.striker_position) == pytest.approx(float(state.striker_position), rel=1e-13)
        assert abs(following.amplitude - sb.advance(system, state, 6).amplitude).max() > 1e-6


def test_progress() -> None:
    seen = []
    system = system_of(1)
    batch = sb.State(amplitude=np.tile(system.model.well_amplitude, (40, 1)))
    sb.advance(system, batch, 3, progress=lambda done, total: seen.append((done, total)))
    assert seen[-1] == (40, 40)


# ---------------------------------------------------------------------- recorded drives


def record(model: sb.ReducedModel) -> sb.Striker:
    """Eight cycles and a half of a sine of 100 Hz."""
    t = np.arange(int(8.5 * 200)) / 20_000.0
    omega = 2.0 * math.pi * 100.0
    return sb.Striker(
        drive=sb.RecordedMotion(
            displacement=5e-5 * np.sin(omega * t),
            velocity=5e-5 * omega * np.cos(omega * t),
            sampling_frequency=20_000.0,
            frequency=100.0,
        )
    )


@pytest.mark.slow
def test_a_record_goes_on_where_it_was_and_ends() -> None:
    model = sb.ReducedModel.from_beam(default_values.BEAM, 4)
    system = sb.System(model, contacts=[sb.Contact(default_values.CONTACT, record(model))])
    held = system.striker.drive.duration * 100.0
    whole, half = sb.advance(system, periods=8), sb.advance(system, periods=5)
    assert float(half.phase) == pytest.approx(2.0 * math.pi * 5.0 / held, rel=1e-7)
    rest = sb.advance(system, half, 3)
    np.testing.assert_allclose(rest.amplitude, whole.amplitude, rtol=0.0, atol=1e-12)
    every = sb.advance(system, periods=8, save_every_period=True)
    assert every.batch == (8,)
    np.testing.assert_allclose(every[4].amplitude, half.amplitude, rtol=0.0, atol=1e-15)
    with pytest.raises(
        InputError, match=r"cycles = 5\.0: must be at most the 3\.5 cycles that are left of the recorded"
    ):
        sb.advance(system, half, 5)
    with pytest.raises(InputError, match=r"must be at most the 8\.5 cycles of the recorded drive"):
        sb.advance(system, periods=9)
    end = sb.advance(system, half, held - 5.0)
    with pytest.raises(InputError, match=r"must be at most the 0\.0 cycles that are left"):
        sb.advance(system, end)
    started = system.replace(initial_state=plain(half))
    run = sb.simulate(started, sb.Integration(cycles=3), sample_times=[0.0])
    np.testing.assert_allclose(
        run.final_state.amplitude, whole.amplitude, rtol=0.0, atol=1e-4 * abs(whole.amplitude[0])
    )


# ---------------------------------------------------------------------- tangents


def full_basis(modes: int) -> np.ndarray:
    """Every direction of state space, shape (2N, 2, N)."""
    return np.eye(2 * modes).reshape(2 * modes, 2, modes)


@pytest.mark.parametrize("modes", [1, 3, 8])
@pytest.mark.parametrize("name", ["struck", "from anywhere", "undriven"])
def test_the_tangent_flow_contracts_as_the_damping_says(modes: int, name: str) -> None:
    """log det = -2 sum zeta omega T, with contact: the sum of all Lyapunov exponents; differences of a light impact off by 7e-5 of it."""
    system = system_of(modes)
    state = None
    if name == "from anywhere":
        state = somewhere(system)
    elif name == "undriven":
        system = sb.System(
            system.model, initial_state=somewhere(system.replace(contacts=[], initial_state=somewhere(system)))
        )
    impacts = 0
    for _ in range(3):
        state = sb.advance(system, state, tangent=full_basis(modes), integration=REFERENCE)
        impacts += int(state.statistics["impacts"])
        matrix = state.tangent.reshape(2 * modes, 2 * modes).T
        sign, logarithm = np.linalg.slogdet(matrix)
        model = system.model
        period = 1.0 / (model.reference_frequency * (1.0 if system.striker is None else 1.21))
        expected = -2.0 * float(np.sum(model.damping_ratio * model.omega)) * period
        assert sign == 1.0
        assert logarithm == pytest.approx(expected, rel=1e-4 if name == "from anywhere" else 5e-6)
    assert (impacts > 0) == (name != "undriven")


def test_tangents_do_not_disturb() -> None:
    """The state is that of a call without tangents, and a tangent does not depend on those beside it."""
    system = system_of(3)
    both = np.random.default_rng(2).normal(size=(2, 2, 3))
    alone, with_both = sb.advance(system, periods=5), sb.advance(system, periods=5, tangent=both)
    assert_equal(alone, with_both)
    for i in range(2):
        one = sb.advance(system, periods=5, tangent=both[i : i + 1])
        np.testing.assert_array_equal(one.tangent[0], with_both.tangent[i])
    sum_of = sb.advance(system, periods=5, tangent=(both[:1] + 3.0 * both[1:]))
    np.testing.assert_allclose(sum_of.tangent[0], with_both.tangent[0] + 3.0 * with_both.tangent[1], rtol=1e-6)
    # carried on from call to call
    state = sb.advance(system, sb.advance(system, periods=2, tangent=both), 3, tangent=None)
    assert state.tangent is None
    first = sb.advance(system, periods=2, tangent=both)
    second = sb.advance(system, first, 3, tangent=first.tangent)
    np.testing.assert_allclose(second.tangent, with_both.tangent, rtol=1e-5)


def test_tangents_by_differences_keep_the_tip_where_it_is() -> None:
    """A state without a position of the tip: it touches this run's beam, not that of each neighbour."""
    damped = sb.HuntCrossley(stiffness=default_values.CONTACT.stiffness, damping_factor=1e-9)
    shaker = sb.Shaker(frequency_ratio=1.21, velocity_amplitude=0.3)
    model = sb.ReducedModel.from_beam(default_values.BEAM, 2)
    elastic, lossy = (
        sb.advance(sb.System(model, contacts=[sb.Contact(law, shaker)]), tangent=full_basis(2), integration=REFERENCE)
        for law in (default_values.CONTACT, damped)
    )
    assert int(elastic.statistics["impacts"]) > 0
    scale = np.abs(elastic.tangent).max(axis=(0, 2))[:, None]
    np.testing.assert_allclose(lossy.tangent / scale, elastic.tangent / scale, rtol=0.0, atol=1e-4)


@pytest.mark.parametrize(("modes", "bound"), [(1, 1e-7), (3, 1e-4), (8, 1e-5), (32, 1e-5)])
def test_tangents_are_derivatives(modes: int, bound: float) -> None:
    """Against central differences over a period with impacts, at the reference level.

    Measured: 2e-9 to 1e-5, the size of the steps' own error (of level "standard": 2e-3 to 6e-2, where steps end at contact).
    """
    system = system_of(modes)
    model, rng = system.model, np.random.default_rng(0)
    state = sb.advance(system, periods=1)
    size = abs(float(model.well_amplitude[0]))
    falling = rng.normal(size=(2, modes)) / np.arange(1, modes + 1) ** 2
    direction = falling * np.array([[size], [size * model.omega[0]]])
    found = sb.advance(system, state, tangent=direction[None], integration=REFERENCE)
    ends = []
    for step in (1e-6, -1e-6):
        moved = sb.State(
            amplitude=state.amplitude + step * direction[0], velocity=state.velocity + step * direction[1],
            phase=state.phase, striker_position=state.striker_position, contact_time=state.contact_time,
        )  # fmt: skip
        ends.append(sb.advance(system, moved, integration=REFERENCE))
    for row, (plus, minus) in enumerate(((ends[0].amplitude, ends[1].amplitude), (ends[0].velocity, ends[1].velocity))):
        difference = (plus - minus) / 2e-6
        error = np.linalg.norm(found.tangent[0, row] - difference) / np.linalg.norm(difference)
        assert error < bound, (row, error)
    if modes > 1:
        assert int(found.statistics["impacts"]) > 0


def test_tangents_of_a_batch() -> None:
    system = system_of(2)
    states = sb.State(amplitude=np.array([[1.0], [0.7]]) * system.model.well_amplitude, phase=[0.0, 1.0])
    same = np.random.default_rng(1).normal(size=(3, 2, 2))
    found = sb.advance(system, states, 2, tangent=same)
    assert found.tangent.shape == (2, 3, 2, 2)
    for i in range(2):
        np.testing.assert_array_equal(found.tangent[i], sb.advance(system, states[i], 2, tangent=same).tangent)
    own = np.stack((same, 2.0 * same))
    np.testing.assert_allclose(
        sb.advance(system, states, 2, tangent=own).tangent[1], 2.0 * found.tangent[1], rtol=1e-12
    )


# ---------------------------------------------------------------------- refusals and failures


SYSTEM = system_of(2)


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda: sb.advance(SYSTEM.model), InputTypeError, "must be a System"),
        (lambda: sb.advance(SYSTEM, 3), InputTypeError, "state = 3: must be a State"),
        (lambda: sb.advance(SYSTEM, periods=0), InputError, "periods = 0: must be a finite number greater than 0"),
        (
            lambda: sb.advance(SYSTEM, periods=1.5, save_every_period=True),
            InputError,
            "periods = 1.5 with save_every_period = True",
        ),
        (
            lambda: sb.advance(SYSTEM, sb.State(amplitude=[1.0, 2.0, 3.0])),
            InputError,
            "state of 3 modes: must have the 2 modes of the model",
        ),
        (
            lambda: sb.advance(SYSTEM, integration=sb.Integration(tolerance=1e-3)),
            InputError,
            "tolerance = 0.001: applies to simulate",
        ),
        (
            lambda: sb.advance(sb.System(SYSTEM.model)),
            InputError,
            r"contacts = \[\]: without a striker the beam needs an initial_state",
        ),
        (
            lambda: sb.advance(SYSTEM, tangent=np.zeros((2, 2))),
            InputError,
            r"tangent of shape \(2, 2\): must have the shape \(\.\.\., k, 2, 2\)",
        ),
        (
            lambda: sb.advance(SYSTEM, sb.State(amplitude=np.zeros((4, 2))), tangent=np.zeros((3, 1, 2, 2))),
            InputError,
            r"must have the batch \(4,\) of the states before \(k, 2, N\)",
        ),
    ],
)
def test_refusals(call, error, message: str) -> None:
    with pytest.raises(error, match=message):
        call()


def test_what_cannot_be_reached_is_nan_and_says_why() -> None:
    """One of three states overflows: the others are what they are alone, it is no state to go on from."""
    model = SYSTEM.model
    batch = sb.State(amplitude=np.stack((model.well_amplitude, [1e200, 0.0], 0.5 * model.well_amplitude)))
    found = sb.advance(SYSTEM, batch, 2, tangent=full_basis(2))
    assert found.statistics["status"].tolist() == [sb.RunStatus.OK, sb.RunStatus.DIVERGED, sb.RunStatus.OK]
    assert np.isnan(found.amplitude[1]).all() and np.isnan(found.velocity[1]).all()
    assert np.isnan(found.tangent[1]).all()
    assert_equal(found[2], sb.advance(SYSTEM, batch[2], 2))
    with pytest.raises(InputError, match=r"state amplitude\[1, 0\] = .*nan.*: must be finite"):
        sb.advance(SYSTEM, found)
    # as many steps as forty periods of flight would take: what contacts take beyond is too much
    plan = choose_base_step(model, SYSTEM.contact_law)
    flight = 40 * math.ceil(2.0 * math.pi / (1.21 * SYSTEM.scale.omega * plan.step))
    limited = sb.advance(SYSTEM, periods=40, integration=sb.Integration(max_steps=flight), save_every_period=True)
    reached = np.isfinite(limited.amplitude).all(axis=-1)
    assert limited.statistics["status"].tolist() == [0 if each else sb.RunStatus.STEP_LIMIT for each in reached]
    assert limited[39].statistics["status"] == sb.RunStatus.STEP_LIMIT
    assert 0 < reached.sum() < 40
    whole = sb.advance(SYSTEM, periods=40, save_every_period=True)
    np.testing.assert_array_equal(limited.amplitude[reached], whole.amplitude[reached])
    assert reached.tolist() == sorted(reached.tolist(), reverse=True)


LOOSE = {"KelvinVoigt": sb.KelvinVoigt(3e2, 1.0), "HuntCrossley": sb.HuntCrossley(1e6, 200.0)}
"""Laws under which a tip that withdraws stays inside the beam for long without a force."""


def loosened(law: str) -> sb.System:
    model = sb.ReducedModel.from_beam(default_values.BEAM, 2, damping_ratio=0.02)
    drive = sb.Sine(frequency_ratio=1.2, velocity_amplitude=0.2, phase=0.74 * math.pi)
    gap = -0.1 * model.length_scale
    return sb.System(model, contacts=[sb.Contact(LOOSE[law], sb.Striker(drive=drive, gap=gap, location=0.5))])


@pytest.mark.parametrize("law", LOOSE)
def test_outputs_while_a_tip_inside_does_not_press(law: str) -> None:
    """The force at an output was taken from the jump of a gap that was not there: 4e10 N, and an impact more."""
    system, run = loosened(law), sb.simulate(loosened(law), sb.Integration(cycles=6)).summary
    found = sb.advance(system, periods=6).statistics
    assert int(found["impacts"]) == run.impacts
    for name in ("peak_force", "impulse", "energy_dissipated"):
        assert float(found[name]) == pytest.approx(run[name], rel=1e-6), name


@pytest.mark.filterwarnings("ignore:engine = .python")
@pytest.mark.parametrize("law", LOOSE)
def test_a_run_that_begins_while_a_tip_inside_does_not_press(law: str) -> None:
    """Goes on as the Python engine says."""
    system = loosened(law)
    for periods in np.arange(1.0, 2.0, 0.05):
        begun = sb.advance(system, periods=periods)
        first = sb.simulate(system.replace(initial_state=begun), sb.Integration(cycles=1)).dataset.isel(time=0)
        if float(begun.contact_time[0]) < 0.0 and float(first["penetration_normalised"]) > 1e-3:
            break
    else:
        pytest.fail("no such state")
    own, core = (
        sb.simulate(system.replace(initial_state=begun), sb.Integration(cycles=1, engine=engine, accuracy="reference"))
        for engine in ("python", "native")
    )
    assert own.summary.impacts == core.summary.impacts
    for name in ("peak_force", "impulse", "energy_dissipated", "energy_lost_contact", "gross_work"):
        assert own.summary[name] == pytest.approx(core.summary[name], rel=2e-3), name
    assert own.impacts["onset"].values == pytest.approx(core.impacts["onset"].values, abs=1e-8)


PARTS = {"body": {"mass": 2e-3, "suspension_stiffness": 2e3}, "circuit": {}}


@pytest.mark.parametrize("part", PARTS)
def test_tangents_of_several_periods_take_other_parts_along(part: str) -> None:
    """Changes of a body or a circuit act on the beam in the next period, too."""
    model = sb.ReducedModel.from_beam(default_values.BEAM, 2, damping_ratio=0.02)
    drive = sb.Sine(frequency_ratio=1.2, velocity_amplitude=0.05)
    striker = sb.Striker(drive=drive, location=0.45, gap=0.0, **PARTS[part])
    piezo = (
        [sb.PiezoelectricHarvester(moment_per_volt=2e-4, capacitance=6e-8, resistance=2e4)] if part == "circuit" else []
    )
    system = sb.System(model, contacts=[sb.Contact(sb.KelvinVoigt(3e2, 0.2), striker)], harvesters=piezo)
    start, change = sb.advance(system, integration=REFERENCE), np.array([[1.0, -0.4], [300.0, 200.0]])
    size = 1e-9
    sides, own = [], {name: getattr(start, name) for name in ("striker_shift", "striker_rate", "circuit")}
    for sign in (size, -size):
        moved = {"amplitude": start.amplitude + sign * change[0], "velocity": start.velocity + sign * change[1]}
        sides.append(sb.advance(system, dataclasses.replace(plain(start), **own, **moved), 2, integration=REFERENCE))
    found = sb.advance(system, start, 2, tangent=change[None], integration=REFERENCE).tangent[0]
    for i, name in enumerate(("amplitude", "velocity")):
        wanted = (getattr(sides[0], name) - getattr(sides[1], name)) / (2.0 * size)
        np.testing.assert_allclose(found[i], wanted, rtol=1e-3, atol=1e-4 * np.abs(wanted).max())
