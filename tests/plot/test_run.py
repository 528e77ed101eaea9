"""The picture of a run: what it draws, and that it draws what is there."""

from __future__ import annotations

import re

import matplotlib.pyplot as plt
import numpy as np
import pytest

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
    assert re.search(r"= (3\.099|3\.1)$", close[2].get_xlabel())


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
