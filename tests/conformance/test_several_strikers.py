"""Several strikers at once: an independent solution, limits to one striker, mirror images, the order, the ledger."""

from __future__ import annotations

import math

import numpy as np
import pytest
from oracle import CONTACT_STIFFNESS, LEVEL, PaperBeam
from several_oracle import Tip, solve_several

import snapbeam as sb
from snapbeam.model import default_values

FIRST = sb.Shaker(frequency_ratio=1.21, velocity_amplitude=0.12)
GAP = 0.1 * LEVEL


def model(modes: int) -> sb.ReducedModel:
    return sb.ReducedModel.from_beam(default_values.BEAM, modes=modes)


def stop(location: float = 0.3, side: str = "above", gap: float = GAP) -> sb.Striker:
    return sb.Striker(drive=sb.FixedStop(), location=location, side=side, gap=gap)


def sine(modes: int, ratio: float, amplitude: float):
    """The paper's sine by its velocity."""
    first = float(PaperBeam(modes).omega[0])
    rate, reach = ratio * first, amplitude * LEVEL / ratio
    return lambda t: (reach * math.sin(rate * t), reach * rate * math.cos(rate * t))


def still(t: float) -> tuple[float, float]:
    return 0.0, 0.0


CASES = [
    pytest.param("stop", 1, 3, marks=pytest.mark.slow),
    pytest.param("stop", 3, 2, marks=pytest.mark.slow),
    pytest.param("stop", 8, 2, marks=pytest.mark.slow),
    pytest.param("both move", 1, 3, marks=pytest.mark.slow),
    pytest.param("both move", 3, 2, marks=pytest.mark.slow),
    pytest.param("three", 3, 2, marks=pytest.mark.slow),
    pytest.param("five", 3, 2, marks=pytest.mark.slow),
]


@pytest.mark.parametrize(("case", "modes", "cycles"), CASES)
def test_against_an_independent_solution(case: str, modes: int, cycles: int) -> None:
    """Displacements, tips and the force of each: 1e-3 b at level *standard*, 1e-7 b at level *reference*; the ledger."""
    tips = [Tip(sine(modes, 1.21, 0.12)), Tip(still, 0.3, -1.0, GAP)]
    strikers: list[sb.Shaker | sb.Striker] = [FIRST, stop()]
    laws: list[sb.ContactLaw] = [default_values.CONTACT, default_values.CONTACT]
    if case != "stop":
        tips[1] = Tip(sine(modes, 2.0, 0.05), 0.3, -1.0, GAP)
        strikers[1] = sb.Striker(
            drive=sb.Sine(frequency_ratio=2.0, velocity_amplitude=0.05), location=0.3, side="above", gap=GAP
        )
    if case in ("three", "five"):
        power = sb.PowerLaw.from_stiffness(1e13, 2.0)
        tips.append(Tip(still, 0.7, 1.0, 0.05 * LEVEL, lambda d: 1e13 * d * d))
        strikers.append(stop(0.7, "below", 0.05 * LEVEL))
        laws.append(power)
    if case == "five":
        for location, side, gap in ((0.2, -1.0, 0.15 * LEVEL), (0.85, 1.0, 0.02 * LEVEL)):
            tips.append(Tip(still, location, side, gap))
            strikers.append(stop(location, "below" if side > 0.0 else "above", gap))
            laws.append(default_values.CONTACT)
    first = float(PaperBeam(modes).omega[0])
    times = np.linspace(0.0, cycles * 2.0 * math.pi / (1.21 * first), 401) * (1.0 - 1e-13)
    truth = solve_several(PaperBeam(modes), tips, times)
    system = sb.System(model(modes), contacts=list(map(sb.Contact, laws, strikers)))
    for accuracy, bound in (("standard", 1e-3), ("reference", 1e-7)):
        run = sb.simulate(system, sb.Integration(cycles=cycles, accuracy=accuracy), sample_times=times)
        data = run.dataset
        np.testing.assert_allclose(data.displacement_at_striker, truth.displacement, rtol=0.0, atol=bound)
        np.testing.assert_allclose(data.midspan_displacement, truth.midspan_displacement, rtol=0.0, atol=bound)
        np.testing.assert_allclose(data.striker_displacements, truth.tip, rtol=0.0, atol=bound)
        assert abs(data.attrs["energy_error"]) < 1e-4
    size = float(truth.force.max())
    np.testing.assert_allclose(data.striker_forces, truth.force, rtol=0.0, atol=1e-3 * size)
    np.testing.assert_allclose(data.striker_work, truth.work, rtol=0.0, atol=1e-5 * float(np.abs(truth.work).max()))
    hit = set(run.impacts.striker.values.astype(int).tolist())
    assert hit == {j + 1 for j in range(len(tips)) if truth.force[:, j].max() > 0.0}
    assert len(hit) > 1


@pytest.mark.slow
@pytest.mark.parametrize("early", [False, True])
def test_one_of_two_out_of_reach_is_none(early: bool) -> None:
    """Bit for bit the run with one striker, if the other stands still and far away; no run is decided early."""
    one = sb.System(model(3), contacts=[sb.Contact(default_values.CONTACT, FIRST)])
    two = one.replace(contacts=[*one.contacts, sb.Contact(default_values.CONTACT, stop(gap=20.0 * LEVEL))])
    how = sb.Integration(cycles=20)
    alone, beside = sb.simulate(one, how), sb.simulate(two, how.replace(early_termination=early))
    for name in alone.dataset.data_vars:
        np.testing.assert_array_equal(beside.dataset[name], alone.dataset[name], err_msg=name)
    for name in (
        "impacts",
        "zero_crossings",
        "peak_force",
        "striker_work",
        "impulse",
        "contact_time_fraction",
        "max_displacement",
    ):
        assert getattr(beside.summary, name) == getattr(alone.summary, name), name
    assert not beside.summary.final_well_proven
    assert np.isnan(beside.summary.early_stop_time)


@pytest.mark.slow
def test_mirrored() -> None:
    """The mirrored system's mirrored run, bit for bit."""
    below = sb.System(
        model(3), contacts=[sb.Contact(default_values.CONTACT, FIRST), sb.Contact(default_values.CONTACT, stop())]
    )
    above = below.replace(**{"contact.side": "above", "contact.2.side": "below"})
    how = sb.Integration(cycles=5)
    one, other = sb.simulate(below, how), sb.simulate(above, how)
    assert one.summary.impacts > 5
    np.testing.assert_array_equal(one.dataset.displacement_at_striker, -other.dataset.displacement_at_striker)
    np.testing.assert_array_equal(one.dataset.striker_displacements, -other.dataset.striker_displacements)
    np.testing.assert_array_equal(one.dataset.striker_forces, other.dataset.striker_forces)
    for name in ("peak_force_contact_1", "peak_force_contact_2", "striker_work_contact_1", "impulse_contact_2"):
        assert one.summary[name] == other.summary[name]


@pytest.mark.slow
def test_two_of_half_the_stiffness_are_one() -> None:
    """Two strikers at one place that move alike share the force of one."""
    half = sb.HertzContact(0.5 * CONTACT_STIFFNESS)
    how = sb.Integration(cycles=2, accuracy="reference")
    one = sb.System(
        model(3), contacts=[sb.Contact(default_values.CONTACT, FIRST), sb.Contact(default_values.CONTACT, stop())]
    )
    tip = sb.Striker(drive=sb.Sine(frequency_ratio=1.21, velocity_amplitude=0.12), gap=0.0)
    two = sb.System(
        model(3), contacts=[sb.Contact(half, FIRST), sb.Contact(half, tip), sb.Contact(default_values.CONTACT, stop())]
    )
    times = np.linspace(0.0, 2.0, 301) / (1.21 * model(3).reference_frequency) * (1.0 - 1e-12)
    found, expected = sb.simulate(two, how, sample_times=times), sb.simulate(one, how, sample_times=times)
    np.testing.assert_allclose(
        found.dataset.displacement_at_striker, expected.dataset.displacement_at_striker, rtol=0.0, atol=1e-7
    )
    force = found.dataset.striker_forces
    size = float(expected.dataset.contact_force.max())
    np.testing.assert_allclose(force[:, 0], force[:, 1], rtol=0.0, atol=1e-4 * size)
    np.testing.assert_allclose(force[:, 0] + force[:, 1], expected.dataset.contact_force, rtol=0.0, atol=1e-3 * size)


@pytest.mark.slow
def test_order() -> None:
    """Steps of an eighth, impacts of both on the way: order 3.9 measured; of one halving 2.8 to 4.6, since steps end at contacts."""
    system = sb.System(
        model(1), contacts=[sb.Contact(default_values.CONTACT, FIRST), sb.Contact(default_values.CONTACT, stop())]
    )
    times = np.linspace(0.0, 2.0, 101) / (1.21 * model(1).reference_frequency) * (1.0 - 1e-12)
    exact = sb.simulate(
        system, sb.Integration(cycles=2, accuracy="reference"), sample_times=times
    ).dataset.displacement_at_striker
    errors = []
    for step in (1e-4, 1.25e-5):
        run = sb.simulate(system, sb.Integration(cycles=2, step=step), sample_times=times)
        errors.append(float(np.abs(run.dataset.displacement_at_striker - exact).max()))
    assert math.log2(errors[0] / errors[1]) / 3.0 > 3.6, errors


@pytest.mark.slow
def test_swept_by_dotted_names(tmp_path) -> None:
    """A map over the place and the gap of the second striker has the runs of its points; its store is read again."""
    system = sb.System(
        model(3), contacts=[sb.Contact(default_values.CONTACT, FIRST), sb.Contact(default_values.CONTACT, stop())]
    )
    axes = {"contact.2.location": [0.3, 0.6], "contact.2.gap": [0.1 * LEVEL, 0.3 * LEVEL]}
    swept = sb.sweep(system, axes, sb.Integration(cycles=5), checkpoint=sb.CheckpointOptions(tmp_path / "store"))
    read = sb.read_checkpoint(tmp_path / "store")
    for name in ("response_class", "impacts_contact_1", "peak_force_contact_2"):
        np.testing.assert_array_equal(read[name].transpose(*swept[name].dims), swept[name], err_msg=name)
    assert swept.sizes["location_contact_2"] == 2
    for i, location in enumerate(axes["contact.2.location"]):
        for j, gap in enumerate(axes["contact.2.gap"]):
            own = system.replace(**{"contact.2.location": location, "contact.2.gap": gap})
            alone = sb.simulate(own, sb.Integration(cycles=5)).summary
            there = swept.isel(location_contact_2=i, striker_gap_contact_2=j)
            assert int(there.impacts) == alone.impacts
            assert float(there.peak_force) == pytest.approx(alone.peak_force, rel=1e-12)
            for name in ("impacts", "peak_force", "impulse", "striker_work"):
                for number in (1, 2):
                    each = f"{name}_contact_{number}"
                    assert there[each].item() == pytest.approx(alone[each], rel=1e-12), each
    assert swept.peak_force_contact_2.attrs["units"] == "N"
    assert swept.peak_force_contact_2.long_name == "peak contact force, contact 2"


@pytest.mark.slow
def test_statistics_of_each(tmp_path) -> None:
    """Against the list of impacts and the samples of the run; together they are the whole; one striker has none."""
    system = sb.System(
        model(3), contacts=[sb.Contact(default_values.CONTACT, FIRST), sb.Contact(default_values.CONTACT, stop())]
    )
    run = sb.simulate(system, sb.Integration(cycles=5))
    found, listed = run.summary, run.impacts
    assert found.impacts_contact_1 > 0 and found.impacts_contact_2 > 0
    for number in (1, 2):
        own = listed.isel(impact=listed.striker.values == number)
        assert found[f"impacts_contact_{number}"] == own.sizes["impact"]
        assert found[f"peak_force_contact_{number}"] == pytest.approx(float(own.peak_force.max()), rel=1e-12)
        assert found[f"impulse_contact_{number}"] == pytest.approx(float(own.impulse.sum()), rel=1e-9)
    run.save(tmp_path / "run.nc")
    assert dict(sb.load(tmp_path / "run.nc").summary) == pytest.approx(dict(found), nan_ok=True)
    assert found.peak_force == max(found.peak_force_contact_1, found.peak_force_contact_2)
    assert found.striker_work_contact_2 == 0.0  # a stop that stands still does none
    assert found.striker_work_contact_1 == pytest.approx(found.striker_work, rel=1e-12)
    assert not any(
        "_contact_" in name
        for name in sb.simulate(
            sb.System(model(3), contacts=[sb.Contact(default_values.CONTACT, FIRST)]), sb.Integration(cycles=2)
        ).summary
    )


@pytest.mark.slow
def test_work_of_each() -> None:
    """Of two that move: the force on the tip's motion, by the samples of the run."""
    second = sb.Striker(
        drive=sb.Sine(frequency_ratio=2.0, velocity_amplitude=0.05), location=0.3, side="above", gap=GAP
    )
    system = sb.System(
        model(1), contacts=[sb.Contact(default_values.CONTACT, FIRST), sb.Contact(default_values.CONTACT, second)]
    )
    length = model(1).length_scale
    end = 3.0 / (1.21 * model(1).reference_frequency)
    times = np.linspace(0.0, end, 60_001) * (1.0 - 1e-13)
    run = sb.simulate(system, sb.Integration(cycles=3), sample_times=times)
    force = run.dataset.striker_forces.values
    for j, push in enumerate((1.0, -1.0)):
        motion = push * length * run.dataset.striker_displacements.values[:, j]
        work = float(np.sum(0.5 * (force[1:, j] + force[:-1, j]) * np.diff(motion)))
        assert abs(work) > 0.0
        assert run.summary[f"striker_work_contact_{j + 1}"] == pytest.approx(work, rel=2e-3)


def test_refusals() -> None:
    two = sb.System(
        model(1), contacts=[sb.Contact(default_values.CONTACT, FIRST), sb.Contact(default_values.CONTACT, stop())]
    )
    with pytest.raises(sb.InputError, match="this system has 2 contacts"):
        two.replace(**{"contact.3.gap": 1e-5})


@pytest.mark.slow
def test_a_run_that_goes_on_shows_every_tip_where_it_is() -> None:
    """From a state within a cycle: displacements, forces and penetrations are those of one run."""
    second = sb.Striker(
        drive=sb.Sine(frequency_ratio=2.0, velocity_amplitude=0.05, phase=0.6), location=0.3, side="above", gap=GAP
    )
    system = sb.System(
        model(3), contacts=[sb.Contact(default_values.CONTACT, FIRST), sb.Contact(default_values.CONTACT, second)]
    )
    period = 1.0 / (1.21 * system.model.reference_frequency)
    times = np.linspace(0.0, 0.999 * period, 301)
    how = sb.Integration(cycles=3, accuracy="reference")
    whole = sb.simulate(system, how, sample_times=1.0 * period + times).dataset
    state = sb.simulate(system, how.replace(cycles=1)).final_state
    later = sb.simulate(system.replace(initial_state=state), how.replace(cycles=1), sample_times=times).dataset
    for name in ("striker_displacements", "striker_penetrations"):
        np.testing.assert_allclose(later[name], whole[name], rtol=0.0, atol=1e-9, err_msg=name)


def test_a_phase_of_several_motions_is_refused() -> None:
    """They share a clock: a phase that is given with a start is that of none of them."""
    start = sb.State(amplitude=model(3).well_amplitude, phase=0.7)
    second = sb.Striker(
        drive=sb.Sine(frequency_ratio=2.0, velocity_amplitude=0.05), location=0.3, side="above", gap=GAP
    )
    system = sb.System(
        model(3),
        contacts=[sb.Contact(default_values.CONTACT, FIRST), sb.Contact(default_values.CONTACT, second)],
        initial_state=start,
    )
    with pytest.raises(sb.InputError, match=r"state phase = .*0\.7.*: must not be given if several"):
        sb.simulate(system, sb.Integration(cycles=1))
