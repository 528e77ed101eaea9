"""The picture of a run: what it draws, and that it draws what is there."""

from __future__ import annotations

import re

import matplotlib.pyplot as plt
import numpy as np
import pytest

import snapbeam as sb
from snapbeam.plot.run import plot_run
from snapbeam.plot.style import save_figure
from snapbeam.util.validation import InputError


@pytest.fixture(autouse=True)
def _close():
    yield
    plt.close("all")


def test_panels_and_curves(synthetic_run, tmp_path):
    figure = plot_run(synthetic_run).figure
    assert len(figure.axes) == 6
    assert [text.get_text() for text in figure.legends[0].get_texts()] == [
        "beam, centre",
        "beam, at the striker",
        "striker",
    ]
    displacement, penetration, force = figure.axes[:3]
    np.testing.assert_array_equal(displacement.lines[1].get_ydata(), synthetic_run["displacement_at_striker"])
    assert force.get_ylabel().endswith("(mN)")
    np.testing.assert_allclose(force.lines[0].get_ydata(), 1e3 * synthetic_run["contact_force"], rtol=1e-12)
    assert displacement.get_xlim()[0] < 0.0, "an impact that begins at once is seen"
    assert penetration.lines[0].get_ydata().max() == pytest.approx(4.0, rel=1e-3)
    assert force.get_xlabel() == r"Cycles of excitation $\tau$"
    assert save_figure(figure, tmp_path / "run.png").stat().st_size > 20_000


def test_close_up_shows_one_whole_impact(synthetic_run):
    close = plot_run(synthetic_run, window=(3.0, 6.0)).figure.axes[3:]
    milliseconds, force = close[2].lines[0].get_data()
    touching = milliseconds[force > 0.0]
    assert 1e-3 * force.max() == pytest.approx(float(synthetic_run["contact_force"].max()), rel=1e-6)
    assert touching[0] > 0.0 and 1e-3 * touching[-1] == pytest.approx(0.5, abs=0.01)
    assert milliseconds[0] < 0.0 and milliseconds[-1] > touching[-1]
    shown = float(re.search(r"= (\S+)$", close[2].get_xlabel())[1])
    assert shown == pytest.approx(3.0995, abs=1e-3)


def test_window(synthetic_run):
    figure = plot_run(synthetic_run, window=(2.0, 4.0)).figure
    assert figure.axes[0].get_xlim() == pytest.approx((2.0, 4.0))
    with pytest.raises(InputError, match="must hold at least two samples of a run of 10 cycles"):
        plot_run(synthetic_run, window=(20.0, 30.0))


def test_measured_run_without_force(synthetic_run):
    measured = synthetic_run.drop_vars(["contact_force", "penetration_normalised", "midspan_displacement"])
    figure = plot_run(measured).figure
    assert len(figure.axes) == 1
    assert len(figure.legends[0].get_texts()) == 2
    free = plot_run(measured.drop_vars(["cycle", "striker_displacement"])).figure
    assert free.axes[0].get_xlabel() == "Time (s)"


def test_never_touching(synthetic_run):
    apart = synthetic_run.copy(deep=True)
    apart["contact_force"][:] = 0.0
    assert len(plot_run(apart).figure.axes) == 3


def test_no_run(synthetic_map):
    with pytest.raises(InputError, match="run without time, displacement_at_striker"):
        plot_run(synthetic_map)


def test_the_label_of_a_close_up_resolves_it(synthetic_run):
    """At 20 kHz and late in a run, the onset is stated to a hundredth of the close-up."""
    fast = synthetic_run.assign_coords(time=synthetic_run.time / 200.0, cycle=synthetic_run.cycle + 90.0)
    close = plot_run(fast).figure.axes[5]
    digits = re.search(r"= \d+\.(\d+)$", close.get_xlabel())[1]
    span = np.ptp(close.lines[0].get_xdata()) * 1e-6 * 20e3  # cycles
    assert 0.5 * 10.0 ** -len(digits) <= 0.01 * span


def test_a_close_up_of_few_samples_is_smooth_and_shows_them(synthetic_run):
    coarse = synthetic_run.isel(time=slice(0, None, 10))
    curve, samples = plot_run(coarse).figure.axes[5].lines
    assert curve.get_xdata().size > 10 * samples.get_xdata().size
    assert curve.get_ydata().max() == samples.get_ydata().max()
    assert samples.get_linestyle() == "None"


def test_a_long_run_is_drawn_by_its_range(synthetic_run):
    """Of 500 cycles each interval of 5 cycles has the minimum and the maximum of the samples in it."""
    long = synthetic_run.assign_coords(cycle=synthetic_run.cycle * 50.0)
    figure = plot_run(long).figure
    assert not [line for line in figure.axes[2].lines if line.get_xdata().size > 2]
    (band,) = figure.axes[2].collections
    top = band.get_paths()[0].vertices
    force, cycle = long.contact_force.values, long.cycle.values
    assert top[top[:, 0] < 4.9][:, 1].max() == 1e3 * force[cycle < 5.0].max() == 0.0
    second = (top[:, 0] > 4.9) & (top[:, 0] < 10.1)
    most = 1e3 * force[(cycle >= 5.0) & (cycle < 10.0)].max()
    assert top[second][:, 1].max() == pytest.approx(most, rel=1e-9) and most > 0.0
    assert figure.legends[0].get_texts()[0].get_text() == "beam, centre (range)"
    assert not plot_run(long, window=(0.0, 50.0)).figure.axes[2].collections


@pytest.mark.parametrize("seed", range(8))
def test_the_curve_between_samples_is_that_of_scipy(seed):
    from scipy.interpolate import PchipInterpolator

    from snapbeam.plot.run import _smooth

    random = np.random.default_rng(seed)
    x, y = np.sort(random.random(25)), random.normal(size=25)
    y[7], y[12] = y[8], np.nan
    kept = np.isfinite(y)
    dense, curve = _smooth(x, y)
    assert np.allclose(curve, PchipInterpolator(x[kept], y[kept])(dense), rtol=0.0, atol=1e-13)


def test_a_structure_given_by_matrices_between_two_stops_on_a_random_base():
    """Both stops are drawn, over time; no location and no beam is told of."""
    model = sb.ReducedModel.from_matrices(
        [[2.0]], [[1.1e4]], contact_shape=[1.0], base_shape=[1.0], length_scale=2e-3, damping_ratio=0.05
    )
    stops = [
        sb.Contact(sb.KelvinVoigt(linear_stiffness=5e5, linear_damping=40.0), sb.Striker(drive=sb.FixedStop(), side=side, gap=1e-3))
        for side in ("above", "below")
    ]  # fmt: skip
    base = sb.RecordedAcceleration.from_psd([(5, 0.01), (100, 0.01)], duration_s=2.0, seed=1, ramp_up_s=0.1)
    system = sb.System(model, contacts=stops, base_excitation=sb.BaseExcitation(motion=base))
    ax = sb.plot.plot_run(sb.simulate(system, sb.Integration(cycles=10)))
    assert sorted({float(line.get_ydata()[0]) for line in ax.get_lines() if np.ptp(line.get_ydata()) < 1e-9}) == [
        -0.5,
        0.0,
        0.5,
    ]
    figure = ax.figure
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert words == ["structure, centre", "structure, at the striker", "strikers"]
    assert "x_" not in figure.axes[0].get_title() + str(figure._suptitle)
    assert any(each.get_xlabel().startswith("Time (") for each in figure.axes)


def test_a_long_run_after_a_shock_is_drawn_over_time_as_it_is() -> None:
    """Intervals of whole cycles would be seconds there; and its spectrum is over hertz."""
    model = sb.ReducedModel.from_matrices(
        [[1e-3]], [400.0], contact_shape=[1.0], base_shape=[1.0], length_scale=1e-3, damping_ratio=0.01
    )
    shock = sb.BaseExcitation(motion=sb.Shock(acceleration_g=2.0, duration_ms=4.0))
    run = sb.simulate(sb.System(model, base_excitation=shock), sb.Integration(cycles=150))
    ax = plot_run(run)
    (curve,) = (line for line in ax.lines if line.get_label() == "structure, centre")
    assert np.asarray(curve.get_ydata()) == pytest.approx(run.dataset["midspan_displacement"].values)
    assert not ax.collections
    spectrum = sb.plot.plot_spectrum(run)
    assert "Hz)" in spectrum.get_xlabel()
    frequency, level = (np.asarray(each) for each in spectrum.lines[0].get_data())
    hertz = frequency * (1e3 if "kHz" in spectrum.get_xlabel() else 1.0)
    assert hertz[np.argmax(level)] == pytest.approx(np.sqrt(400.0 / 1e-3) / (2.0 * np.pi), rel=0.02)
    plt.close("all")
