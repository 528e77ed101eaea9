"""States, tangents and the tools of dynamics with several strikers, and with motions of several frequencies."""

from __future__ import annotations

import math

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.dynamics.stroboscope import Stroboscope
from snapbeam.model import default_values
from snapbeam.model.drive.base import HORIZON

B = default_values.BEAM.buckling_level
RATIO = 1.2
EXACT = sb.Integration(accuracy="reference")
SLOW = pytest.mark.slow


def model(modes: int = 2, damping_ratio: float = 0.02) -> sb.ReducedModel:
    return sb.ReducedModel.from_beam(default_values.BEAM, modes=modes, damping_ratio=damping_ratio)


def struck(
    *,
    modes: int = 2,
    damping_ratio: float = 0.02,
    ratio: float = RATIO,
    velocity: float = 0.06,
    phases: tuple[float, float] = (0.0, 0.7),
    gap: float | None = None,
    second_gap: float = 0.02 * B,
    stiffness: float = 4e8,
    sides: tuple[str, str] = ("below", "above"),
    **around,
) -> sb.System:
    """A striker below, and another one opposite at another place, frequency and phase."""
    first = sb.Sine(frequency_ratio=RATIO, velocity_amplitude=velocity, phase=phases[0])
    second = sb.Sine(frequency_ratio=ratio, velocity_amplitude=0.05, phase=phases[1])
    strikers = [
        sb.Striker(drive=first, gap=gap, side=sides[0]),
        sb.Striker(drive=second, location=0.3, side=sides[1], gap=second_gap),
    ]
    return sb.System(
        model(modes, damping_ratio),
        contacts=[sb.Contact(sb.HertzContact(stiffness), each) for each in strikers],
        **around,
    )


def size_of(system: sb.System) -> float:
    return float(np.abs(system.model.well_amplitude).max())


def plain(state: sb.State) -> sb.State:
    """The state in numbers that a person could give."""
    return sb.State(
        amplitude=state.amplitude, velocity=state.velocity, phase=state.phase,
        striker_position=state.striker_position, contact_time=state.contact_time,
    )  # fmt: skip


# ---------------------------------------------------------------------- states


@pytest.fixture(scope="module")
def pressed() -> tuple[sb.System, sb.State, sb.State]:
    """Starts at 24 phases, and where they are after four periods: no contact closed, one of them, or both."""
    system = struck(modes=3, gap=-0.02 * B, second_gap=-0.02 * B, stiffness=3e6)
    begun = sb.State(
        amplitude=np.tile(system.model.well_amplitude, (24, 1)), phase=2.0 * math.pi * np.arange(24) / 24 / HORIZON
    )
    return system, begun, sb.advance(system, begun, 4)


@pytest.mark.slow
def test_calls_compose_whatever_is_closed(pressed) -> None:
    """Six periods at once are four and two, and the statistics of both add up; from plain numbers to rounding."""
    system, begun, between = pressed
    assert between.contact_time.shape == (24, 2)
    closed = between.contact_time >= 0.0
    assert {tuple(row) for row in closed.tolist()} == {(False, False), (False, True), (True, False), (True, True)}
    whole, rest = sb.advance(system, begun, 6), sb.advance(system, between, 2)
    again = sb.advance(system, plain(between), 2)
    for found, bound in ((rest, 1e-12), (again, 1e-9)):
        np.testing.assert_allclose(
            found.amplitude, whole.amplitude, rtol=0.0, atol=bound * size_of(system), err_msg=str(bound)
        )
        np.testing.assert_allclose(found.contact_time, whole.contact_time, rtol=0.0, atol=1e-12)
    total = {name: np.asarray(values) for name, values in whole.statistics.items()}
    for name in ("impacts", "zero_crossings", "impulse", "striker_work", "gross_work"):
        parts = between.statistics[name] + rest.statistics[name]
        np.testing.assert_allclose(parts, total[name], rtol=1e-10, atol=1e-10 * abs(total[name]).max(), err_msg=name)
    share = (4.0 * between.statistics["contact_time_fraction"] + 2.0 * rest.statistics["contact_time_fraction"]) / 6.0
    np.testing.assert_allclose(share, total["contact_time_fraction"], rtol=1e-12)
    peak = np.maximum(between.statistics["peak_force"], rest.statistics["peak_force"])
    np.testing.assert_allclose(peak, total["peak_force"], rtol=1e-10)
    # a batch is its states, and every period is a call of its own
    np.testing.assert_array_equal(sb.advance(system, begun[5], 4).amplitude, between.amplitude[5])
    every = sb.advance(system, begun, 6, save_every_period=True)
    np.testing.assert_array_equal(every.contact_time[3], between.contact_time)
    # contact times decide: the same positions with both contacts open move otherwise
    apart = sb.State(
        amplitude=between.amplitude, velocity=between.velocity, phase=between.phase,
        striker_position=between.striker_position, contact_time=[-1.0, -1.0],
    )  # fmt: skip
    other = sb.advance(system, apart, 2).amplitude[closed.any(axis=1)]
    assert np.abs(other - whole.amplitude[closed.any(axis=1)]).max() > 1e-9 * size_of(system)
    with pytest.raises(sb.InputError, match="state contact_time of 3 strikers: must have one number for each of the 2"):
        sb.advance(system, sb.State(amplitude=system.model.well_amplitude, contact_time=[0.0, 0.0, 0.0]))


@SLOW
def test_runs_and_states_agree(pressed, tmp_path) -> None:
    """Runs to any instant and on from there are one run; their final states are saved and loaded with every contact."""
    system, _, _ = pressed
    whole = sb.simulate(system, EXACT.replace(cycles=4), sample_times=[0.0]).final_state
    patterns = set()
    for cycles in np.linspace(1.0, 2.0, 17).tolist():
        half = sb.advance(system, periods=cycles, integration=EXACT)
        patterns.add(tuple((half.contact_time >= 0.0).tolist()))
        rest = sb.advance(system, half, 4.0 - cycles, integration=EXACT)
        np.testing.assert_allclose(rest.amplitude, whole.amplitude, rtol=0.0, atol=1e-9 * size_of(system))
        np.testing.assert_allclose(rest.contact_time, whole.contact_time, rtol=0.0, atol=1e-9)
    assert len(patterns) > 2
    run = sb.simulate(system, EXACT.replace(cycles=2))
    np.testing.assert_allclose(
        sb.advance(system, periods=2, integration=EXACT).contact_time, run.final_state.contact_time, atol=1e-9
    )
    assert run.final_state.contact_time.shape == (2,)
    run.save(tmp_path / "run.nc")
    again = sb.load(tmp_path / "run.nc").final_state
    np.testing.assert_array_equal(again.contact_time, run.final_state.contact_time)
    started = system.replace(initial_state=run.final_state)
    started.save(tmp_path / "system.toml")
    read = sb.System.load(tmp_path / "system.toml")
    assert read == started
    np.testing.assert_array_equal(read.initial_state.contact_time, run.final_state.contact_time)
    on = sb.simulate(read, EXACT.replace(cycles=2), sample_times=[0.0]).final_state
    np.testing.assert_allclose(on.amplitude, whole.amplitude, rtol=0.0, atol=1e-9 * size_of(system))


@SLOW
def test_mirror_image(pressed) -> None:
    system, begun, between = pressed
    changes = {"contact.side": "above", "contact.2.side": "below"}
    mirrored = sb.advance(system.replace(**changes), sb.State(amplitude=-begun.amplitude, phase=begun.phase), 4)
    np.testing.assert_array_equal(mirrored.amplitude, -between.amplitude)
    np.testing.assert_array_equal(mirrored.velocity, -between.velocity)
    np.testing.assert_array_equal(mirrored.contact_time, between.contact_time)


@SLOW
@pytest.mark.parametrize("around", ["chirp", "ramp"])
def test_advance_with_motions_that_do_not_repeat(around: str) -> None:
    """A base with a chirp and a load with a ramp: pieces against one run."""
    chirp = sb.Chirp(start_ratio=0.8, stop_ratio=1.2, velocity_amplitude=0.05, sweep_cycles=3.0)
    parts = {
        "chirp": {"base_excitation": sb.BaseExcitation(motion=chirp)},
        "ramp": {"axial_load": sb.AxialLoadModulation(motion=sb.RampForce(change=2.0, duration=2.0))},
    }
    system = struck(gap=0.0, **parts[around])
    run = sb.simulate(system, EXACT.replace(cycles=4), sample_times=[0.0])
    state = None
    for periods in (0.7, 1.0, 1.8, 0.5):
        state = sb.advance(system, state, periods, integration=EXACT)
    assert run.summary.impacts > 2
    np.testing.assert_allclose(state.amplitude, run.final_state.amplitude, rtol=0.0, atol=1e-8 * size_of(system))
    with pytest.raises(sb.InputError, match="does not repeat; the dynamics tools need a common period"):
        Stroboscope(system)


# ---------------------------------------------------------------------- tangents


@SLOW
@pytest.mark.parametrize(("modes", "snaps"), [(1, False), (3, False), (1, True), (3, True)])
def test_tangents_are_derivatives(modes: int, snaps: bool) -> None:
    """Every column after two periods with impacts; the determinant is that of damping.

    The second striker hits a beam that snaps on its way to the other well.
    """
    system = struck(modes=modes, gap=0.01 * B, second_gap=(1.4 if snaps else 0.02) * B, velocity=0.3 if snaps else 0.06)
    omega, well, size = float(system.model.omega[0]), system.model.well_amplitude, size_of(system)
    rng, weights = np.random.default_rng(3), 1.0 / np.arange(1, modes + 1) ** 2
    at = well + 1e-2 * size * rng.normal(size=modes) * weights
    rate = 1e-2 * omega * size * rng.normal(size=modes) * weights
    if snaps:
        at, rate = 0.3 * at, rate - 0.6 * omega * well
    changes = np.zeros((2 * modes, 2, modes))
    changes[:modes, 0], changes[modes:, 1] = np.eye(modes), omega * np.eye(modes)
    damping = float((system.model.damping_ratio * system.model.omega).sum())
    exact = -2.0 * damping * 4.0 * math.pi / (RATIO * omega)
    start = sb.State(amplitude=at, velocity=rate)
    for accuracy, bound in (("standard", 5e-4), ("reference", 1e-8)):
        gone = sb.advance(system, start, 2, changes, integration=sb.Integration(accuracy=accuracy))
        columns = np.concatenate((gone.tangent[:, 0], gone.tangent[:, 1] / omega), axis=1)
        assert np.linalg.slogdet(columns)[1] == pytest.approx(exact, abs=bound)
    run = sb.simulate(system.replace(initial_state=start), EXACT.replace(cycles=2), sample_times=[0.0])
    assert set(run.impacts.striker.values.astype(int)) >= ({2} if snaps else {1, 2})
    assert (run.summary.zero_crossings > 0) == snaps
    step = (1e-5 if snaps else 1e-6) * size
    steps = step * np.concatenate((changes, -changes))
    there = sb.advance(system, sb.State(amplitude=at + steps[:, 0], velocity=rate + steps[:, 1]), 2, integration=EXACT)
    for name, found in (("amplitude", gone.tangent[:, 0]), ("velocity", gone.tangent[:, 1])):
        values = getattr(there, name)
        differences = (values[: 2 * modes] - values[2 * modes :]) / (2.0 * step)
        bound = 2e-5 * np.abs(differences).max()
        np.testing.assert_allclose(found, differences, rtol=0.0, atol=bound, err_msg=name)
    # on from the other well too
    whole = sb.advance(system, start, 4)
    rest = sb.advance(system, sb.advance(system, start, 2), 2)
    np.testing.assert_allclose(rest.amplitude, whole.amplitude, rtol=0.0, atol=1e-12 * size)


# ---------------------------------------------------------------------- maps over a common period


@SLOW
@pytest.mark.parametrize(("ratio", "cycles"), [(1.2, 1), (2.4, 1), (1.8, 2)])
def test_exponents_and_the_map(ratio: float, cycles: int) -> None:
    """The exponents add up to the damping; the map is ``advance`` over the common period."""
    system = struck(ratio=ratio)
    flow = Stroboscope(system)
    assert flow.clock.cycles_per_period == cycles
    found = sb.dynamics.lyapunov_spectrum(system, periods=20, transient=5, k=4)
    expected = -2.0 * float((system.model.damping_ratio * system.model.omega).sum())
    assert float(found.exponent.sum()) == pytest.approx(expected, rel=2e-6)  # times of impacts at level standard
    every = sb.advance(flow.system, periods=4 * cycles, save_every_period=True)
    wanted = np.concatenate([every.amplitude, every.velocity], axis=1)[cycles - 1 :: cycles] / flow.space.scales
    once = flow.advance(flow.coordinates(), 4, every=True).every[0]
    np.testing.assert_array_equal(once, wanted)
    here = flow.coordinates()
    for _ in range(4):
        here = flow.advance(here, 1)
    np.testing.assert_allclose(here.states[0], wanted[-1], atol=1e-9)


@SLOW
@pytest.mark.parametrize(("ratio", "velocity"), [(1.2, 0.05), (1.8, 0.08)])
def test_an_orbit_is_one_of_the_run_itself(ratio: float, velocity: float) -> None:
    """A recorded run from it comes back after every common period; the multipliers' product is that of damping."""
    system = struck(ratio=ratio, velocity=velocity, damping_ratio=0.05, stiffness=4e8)
    orbit = sb.dynamics.periodic_orbit(system, integration=EXACT, transient=300)
    flow = Stroboscope(system, EXACT)
    lost = math.exp(-0.1 * float(system.model.omega.sum()) * flow.period)
    assert float(np.prod(orbit.multipliers).real) == pytest.approx(lost, rel=1e-8)
    how = EXACT.replace(cycles=6 * flow.clock.cycles_per_period)
    run = sb.simulate(orbit.system, how, sample_times=flow.period * np.arange(6))
    assert np.ptp(run.dataset.modal_amplitude.values, axis=0).max() < 1e-9 * flow.space.scales[0]
    assert set(run.impacts.striker.values.astype(int)) == {1, 2}
    seen = orbit.contact_summary
    assert 5 * seen.impacts <= run.summary.impacts <= 7 * seen.impacts
    assert 0.0 < seen.min_penetration < 0.1 and 0.0 < seen.clearance < 0.1


@SLOW
@pytest.mark.parametrize("shift", [0.4, 2.0])
def test_phases_of_each_striker_count(shift: float) -> None:
    """A start at a phase is a run of the system whose motions all begin later; so is a section at a phase."""
    at, gap = (0.2, 0.7), -0.06 * B
    system = struck(ratio=1.8, phases=at, gap=gap)
    shifted = struck(ratio=1.8, phases=(at[0] + shift, at[1] + 1.5 * shift), gap=gap)
    start = sb.State(amplitude=system.model.well_amplitude, phase=shift / HORIZON)
    times = np.linspace(0.0, 2e-3, 9)
    runs = [
        sb.simulate(each, EXACT.replace(cycles=2), sample_times=times)
        for each in (system.replace(initial_state=start), shifted)
    ]
    for name in ("striker_displacements", "striker_penetrations", "displacement_at_striker"):
        one, other = (run.dataset[name].values for run in runs)
        np.testing.assert_allclose(one, other, rtol=0.0, atol=1e-9, err_msg=name)
    one = sb.advance(system, start, 2, integration=EXACT)
    np.testing.assert_allclose(one.amplitude, runs[1].final_state.amplitude, rtol=0.0, atol=1e-8 * size_of(system))
    for name in ("drive.phase", "drive.2.phase"):
        moved = sb.simulate(system.replace(**{name: 0.0}), EXACT.replace(cycles=2), sample_times=times)
        assert np.abs(moved.final_state.amplitude - runs[1].final_state.amplitude).max() > 1e-3 * size_of(system)
    flow, other = Stroboscope(system, EXACT, phase=at[0] + shift), Stroboscope(shifted, EXACT)
    x = other.coordinates()
    np.testing.assert_allclose(flow.advance(x, 1).states, other.advance(x, 1).states, atol=1e-9)
    assert flow.clock.striker_phase == pytest.approx(other.clock.striker_phase)
    section = sb.dynamics.poincare_section(system, periods=3, transient=2, phase=at[0] + shift, integration=EXACT)
    np.testing.assert_allclose((section.drive_phase.values - at[0] - shift + 1.0) % (2.0 * math.pi), 1.0, atol=1e-9)
    with pytest.raises(sb.InputError, match=r"phase = .*: must not be given if drive.phase changes"):
        flow.changed({"drive.phase": 0.3})


@SLOW
@pytest.mark.filterwarnings("ignore:basins. the labels of")  # of a grid of eight states, some are near a border
def test_questions_of_dynamics() -> None:
    """Attractors, basins, diagrams, lifetimes and the growth of a perturbation."""
    system = struck(velocity=0.05, damping_ratio=0.05)
    found = sb.dynamics.find_attractors(system, 8)
    assert any(each.orbit is not None for each in found.attractors)
    grid = {"amplitude[1]": np.linspace(-1.2, 1.2, 4), "velocity[1]": [-0.1, 0.1]}
    with pytest.warns(sb.DiagnosticWarning, match=r"undecided .* search for further attractors"):
        basin = sb.dynamics.basins_of_attraction(found, grid, periods=30).basin
    assert basin.shape == (4, 2) and int(basin.max()) >= 0
    diagram = sb.dynamics.bifurcation_diagram(
        system, "drive.2.velocity_amplitude", [0.04, 0.05], periods=(100, 8), grazing=True
    )
    assert not diagram.failed.any() and float(diagram.clearance.max()) > 0.0
    lives = sb.dynamics.lifetime_map(system, integration=sb.Integration(cycles=100), initial_conditions=4)
    assert int(lives.runs_failed) == 0
    growth = sb.perturbation_growth(system, sb.Integration(cycles=3)).separation
    assert 0.0 < float(growth[-1]) < 1e-6
    with pytest.raises(sb.InputError, match=r"drive\.2\.frequency_ratio: the common period of all motions must have"):
        sb.dynamics.lyapunov_spectrum(system, periods=20, axes={"drive.2.frequency_ratio": np.array([1.2, 1.8])})
    with pytest.raises(sb.InputError, match=r"drive\.2: no common period with drive; the ratio of its frequency"):
        Stroboscope(struck(ratio=1.2345678))
    with pytest.raises(sb.InputError, match="phase = True: the half of a cycle in which"):
        sb.dynamics.lifetime_map(system, initial_conditions=sb.dynamics.InitialConditions(count=2, phase=True))


@SLOW
def test_a_single_striker_with_two_tones() -> None:
    """A motion of two sines repeats after their common period: the sum of the exponents, and an orbit of a run."""
    first = sb.Sine(frequency_ratio=1.2, velocity_amplitude=0.05)
    drive = first + sb.Sine(frequency_ratio=1.8, velocity_amplitude=0.02, phase=0.4)
    system = sb.System(model(2, 0.05), contacts=[sb.Contact(default_values.CONTACT, sb.Striker(drive=drive))])
    flow = Stroboscope(system)
    assert flow.clock.cycles_per_period == 2
    found = sb.dynamics.lyapunov_spectrum(system, periods=20, transient=5, k=4)
    assert float(found.exponent.sum()) == pytest.approx(-0.1 * float(system.model.omega.sum()), rel=1e-6)
    summed = first + sb.Sine(frequency_ratio=1.6, velocity_amplitude=0.02)
    assert Stroboscope(system.replace(drive=summed)).clock.cycles_per_period == 3


@SLOW
def test_lifetimes_of_a_shaken_beam() -> None:
    """Starts that differ by a ringing of the beam: a base that moves may take the place of the striker."""
    base = sb.BaseExcitation(motion=sb.AccelerationSine(frequency_ratio=0.9, acceleration_amplitude=0.25))
    lives = sb.dynamics.lifetime_map(
        sb.System(model(), base_excitation=base), integration=sb.Integration(cycles=100), initial_conditions=4
    )
    assert int(lives.runs_failed) == 0 and lives.last_snap.sizes == {"start": 4}
