"""Newton's law of impact for one mode: energy, bouncing, sticking, and why it takes one mode."""

import numpy as np
import pytest
from small_map import swept

import snapbeam as sb
from snapbeam.model import default_values


@pytest.fixture(scope="module")
def one_mode():
    return sb.ReducedModel.from_beam(default_values.BEAM, modes=1)


def ledger(run):
    ds = run.dataset
    residual = ds.energy_beam + ds.energy_contact + ds.energy_dissipated - ds.striker_work
    return float(abs(residual).max()) / ds.attrs["gross_work"]


@pytest.mark.slow
def test_free_mass_rebounds_with_its_coefficient():
    mass, speed = 0.01, 0.1
    model = sb.ReducedModel.from_matrices(
        [[mass]], [0.0], contact_shape=[1.0], length_scale=1e-3, reference_frequency=100.0
    )
    wall = sb.Shaker(frequency_ratio=1.0, velocity_amplitude=0.0)
    for coefficient in (0.25, 0.5, 1.0):
        run = sb.simulate(
            sb.System(
                model,
                contacts=[sb.Contact(sb.Restitution(coefficient), wall)],
                initial_state=sb.State(amplitude=[0.0], velocity=[-speed]),
            ),
            sb.Integration(cycles=1),
        )
        assert run.impacts.impulse.values == pytest.approx([(1.0 + coefficient) * mass * speed], rel=1e-12)
        last = run.dataset.displacement_at_striker.values * 1e-3
        slope = np.diff(last)[-1] / np.diff(run.dataset.time.values)[-1]
        assert slope == pytest.approx(coefficient * speed, rel=1e-9)


@pytest.mark.parametrize("coefficient", [0.0, 0.3, 0.9, 1.0])
@pytest.mark.parametrize(("ratio", "amplitude"), [(1.21, 0.18), (0.5, 0.3)])
def test_energy_balance_closes_and_the_tip_stays_outside(one_mode, coefficient, ratio, amplitude):
    shaker = sb.Shaker(frequency_ratio=ratio, velocity_amplitude=amplitude)
    run = sb.simulate(
        sb.System(one_mode, contacts=[sb.Contact(sb.Restitution(coefficient), shaker)]), sb.Integration(cycles=20)
    )
    assert run.summary.status is sb.RunStatus.OK
    assert ledger(run) < 1e-4
    assert (
        float(run.dataset.penetration_normalised.max()) < 2e-3
    )  # of b: one cubic against the exact flow inside a step


def test_a_plastic_impact_sticks_until_the_force_would_pull(one_mode):
    shaker = sb.Shaker(frequency_ratio=0.1, velocity_amplitude=0.05)
    run = sb.simulate(sb.System(one_mode, contacts=[sb.Contact(sb.Restitution(0.0), shaker)]), sb.Integration(cycles=4))
    assert run.summary.contact_time_fraction > 0.3
    together = run.impacts.duration.values > 0.0
    assert together.any()
    assert (run.impacts.peak_force.values[together] > 0.0).all()
    force = run.dataset.contact_force.values
    assert force.min() > -1e-8 * force.max() - 1e-8  # N: within a tick of the release
    held = force > 0.0
    assert abs(run.dataset.penetration_normalised.values[held]).max() < 1e-12


def test_a_plastic_landing_is_one_impact(one_mode):
    """Landing and sustained contact are one impact, whose impulse is that of the landing and that of the force after it."""
    shaker = sb.Shaker(frequency_ratio=0.1, velocity_amplitude=0.05)
    run = sb.simulate(sb.System(one_mode, contacts=[sb.Contact(sb.Restitution(0.0), shaker)]), sb.Integration(cycles=4))
    impacts, force = run.impacts, run.dataset.contact_force
    apart = impacts.onset.values[1:] - (impacts.onset + impacts.duration).values[:-1]
    assert apart.size >= 3
    assert apart.min() > 1e-6  # s
    time = force.time.values
    columns = (impacts[name].values for name in ("onset", "duration", "peak_force", "impulse"))
    for onset, duration, peak, impulse in zip(*columns, strict=True):
        during = (time >= onset) & (time <= onset + duration)
        pushed = np.trapezoid(force.values[during], time[during])
        assert impulse > pushed * (1.0 - 1e-3)  # the landing adds to it
        assert peak >= force.values[during].max() * (1.0 - 1e-5)  # at the ends of steps
    assert run.summary.impulse == pytest.approx(float(impacts.impulse.sum()), rel=1e-12)


def test_a_plastic_landing_that_nothing_presses_is_one_impact():
    mass, speed = 0.01, 0.1
    model = sb.ReducedModel.from_matrices(
        [[mass]], [0.0], contact_shape=[1.0], length_scale=1e-3, reference_frequency=100.0
    )
    wall = sb.Shaker(frequency_ratio=1.0, velocity_amplitude=0.0)
    start = sb.State(amplitude=[0.02 * speed], velocity=[-speed])
    run = sb.simulate(
        sb.System(model, contacts=[sb.Contact(sb.Restitution(0.0), wall)], initial_state=start),
        sb.Integration(cycles=20),
    )
    assert run.impacts.impulse.values == pytest.approx([mass * speed], rel=1e-12)


def test_mirror_image_is_exact(one_mode):
    runs = [
        sb.simulate(
            sb.System(
                one_mode,
                contacts=[
                    sb.Contact(sb.Restitution(0.6), sb.Shaker(frequency_ratio=1.21, velocity_amplitude=0.18, side=side))
                ],
            ),
            sb.Integration(cycles=20),
        )
        for side in ("below", "above")
    ]
    below, above = (run.dataset.modal_amplitude.values for run in runs)
    assert np.array_equal(below, -above)
    assert runs[0].summary.zero_crossings == runs[1].summary.zero_crossings


@pytest.mark.parametrize("coefficient", [0.0, 0.6, 1.0])
def test_one_mode_has_one_shape(one_mode, coefficient):
    """Extremes at the striker and at the centre are in the ratio of the shape, exactly: no hit is passed over."""
    shaker = sb.Shaker(frequency_ratio=1.21, velocity_amplitude=0.3, location=0.3)
    outcome = sb.simulate(
        sb.System(one_mode, contacts=[sb.Contact(sb.Restitution(coefficient), shaker)]), sb.Integration(cycles=30)
    ).summary
    ratio = float(one_mode.midspan_shape[0] / one_mode.shape_at(0.3)[0])
    for name in ("min", "max"):
        at_striker, at_center = outcome[f"{name}_displacement"], outcome[f"{name}_midspan_displacement"]
        assert at_center == pytest.approx(ratio * at_striker, rel=1e-12)


def test_no_force_is_told_of_an_impact_that_lasts_no_time(one_mode):
    """As the table of impacts says of each; where the bodies stay together there is one."""
    shaker = sb.Shaker(frequency_ratio=1.21, velocity_amplitude=0.18)
    run = sb.simulate(
        sb.System(one_mode, contacts=[sb.Contact(sb.Restitution(0.6), shaker)]), sb.Integration(cycles=10)
    )
    assert run.summary.impacts > 0 and np.isnan(run.summary.peak_force)
    assert np.isnan(run.impacts.peak_force.values).all()
    held = sb.simulate(
        sb.System(
            one_mode,
            contacts=[sb.Contact(sb.Restitution(0.0), sb.Shaker(frequency_ratio=0.1, velocity_amplitude=0.05))],
        ),
        sb.Integration(cycles=2),
    )
    assert held.summary.peak_force == pytest.approx(float(np.nanmax(held.impacts.peak_force)), rel=1e-9)


@pytest.mark.parametrize("coefficient", [0.3, 0.9])
def test_early_termination_is_kept_and_reported(one_mode, coefficient):
    """The class is that of the whole run, and the attribute says what was asked."""
    decided = 0
    for amplitude in np.linspace(0.2, 0.6, 9):
        shaker = sb.Shaker(frequency_ratio=1.21, velocity_amplitude=float(amplitude))
        full, early = (
            sb.simulate(
                sb.System(one_mode, contacts=[sb.Contact(sb.Restitution(coefficient), shaker)]),
                sb.Integration(cycles=60, early_termination=flag),
                sample_times=[0.0],
            )
            for flag in (False, True)
        )
        assert early.summary.response_class == full.summary.response_class
        assert early.dataset.attrs["early_termination"] == 1
        decided += early.summary.status == sb.RunStatus.EARLY_STOP
    assert decided > 0


@pytest.mark.slow
def test_a_map_takes_the_law(one_mode):
    ds = swept(one_mode, sb.Restitution(0.6), frequency_ratio=[0.8, 1.2], velocity_amplitude=[0.05, 0.3], cycles=10)
    assert ds.attrs["restitution_coefficient"] == 0.6
    assert (ds.response_class >= 0).all()
    run = sb.simulate(
        sb.System(
            one_mode, contacts=[sb.Contact(sb.Restitution(0.6), sb.Shaker(frequency_ratio=1.2, velocity_amplitude=0.3))]
        ),
        sb.Integration(cycles=10),
    )
    assert int(ds.zero_crossings[1, 1]) == run.summary.zero_crossings


def test_results_of_many_modes_belong_to_their_number_and_the_reason_is_true():
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=7)
    shaker = sb.Shaker(frequency_ratio=1.0, velocity_amplitude=0.1)
    system = sb.System(model, contacts=[sb.Contact(sb.Restitution(0.5), shaker)])
    with pytest.warns(sb.DiagnosticWarning, match=r"falls to zero.*belong to modes = 7"):
        sb.simulate(system, sb.Integration(cycles=1, engine="native"))
    beam = default_values.BEAM
    total = beam.mass_per_length * beam.length
    masses = {
        n: sb.ReducedModel.from_beam(beam, modes=n).contact_mass(default_values.LOCATION) for n in (1, 16, 64, 256)
    }
    assert masses[1] > masses[16] > masses[64] > masses[256]
    assert masses[256] * 256 == pytest.approx(total, rel=0.1)  # falls like rho S L / N
