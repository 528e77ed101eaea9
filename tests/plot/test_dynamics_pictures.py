"""Pictures of dynamics say what the runs say: what is drawn is counted again here."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr

import snapbeam as sb
from snapbeam.dynamics.lifetimes import refit
from snapbeam.plot.dynamics import plot_basins, plot_exponents, plot_section, plot_survival
from snapbeam.util.status_codes import RunStatus

CYCLES, QUIET = 400, 50.0


@pytest.fixture(autouse=True)
def closed():
    yield
    plt.close("all")


def lives(last: np.ndarray, failed: int = 0) -> xr.Dataset:
    """A point whose runs snap for the last time at these cycles; the first *failed* of them failed."""
    last = np.concatenate([np.full(failed, np.nan), last])[np.newaxis]
    status = np.full(last.shape, int(RunStatus.OK), dtype=np.int8)
    status[0, :failed] = int(RunStatus.DIVERGED)
    labels = {"units": "1"}
    columns = {
        "last_snap": last,
        "snaps": np.isfinite(last).astype(np.int32),
        "late_snaps": (last > CYCLES - QUIET).astype(np.int32),
        "end_well": np.ones(last.shape, dtype=np.int8),
        "final_well_proven": np.zeros(last.shape, dtype=np.int8),  # as files hold it
        "status": status,
    }
    ds = xr.Dataset(
        {name: (("point", "start"), values, labels) for name, values in columns.items()},
        attrs={"cycles": CYCLES, "quiet": QUIET, "confidence": 0.95},
    )
    return refit(ds, sb.dynamics.LifetimeSettings(settling_cycles=QUIET), [100])


def curve(ax: plt.Axes) -> tuple[np.ndarray, np.ndarray]:
    line = next(line for line in ax.lines if line.get_drawstyle() == "steps-post")
    return np.asarray(line.get_xdata()), np.asarray(line.get_ydata())


def test_survival_ends_in_a_ring_where_runs_still_snap() -> None:
    """Those that snapped in the quiet cycles did not end there: no drop, and a ring at their share."""
    rng = np.random.default_rng(3)
    last = rng.exponential(200.0, 100)
    never, going = 10, int((last > CYCLES - QUIET).sum())
    assert going > 5
    last[last > CYCLES] = CYCLES - rng.uniform(0.0, QUIET, (last > CYCLES).sum())
    ax = plot_survival(lives(np.append(last, np.full(never, np.nan))))
    x, y = curve(ax)
    runs = last.size + never
    assert y[1] == pytest.approx((last.size - 1) / runs), "what never snapped ended at once"
    for cycle in (50.0, 150.0, 300.0):
        assert y[x <= cycle][-1] == pytest.approx((last > cycle).sum() / runs)
    assert (x[-1], y[-1]) == (CYCLES - QUIET, pytest.approx(going / runs))
    (ring,) = [line for line in ax.lines if line.get_marker() == "o"]
    assert (ring.get_xdata()[0], ring.get_ydata()[0]) == (x[-1], y[-1])
    assert "right-censored" in [text.get_text() for text in ax.figure.legends[0].get_texts()]


def test_survival_without_a_ring_where_all_ended() -> None:
    """The curve falls to nothing, and a run that failed is not among them."""
    last = np.linspace(1.0, 200.0, 40)
    ax = plot_survival(lives(last, failed=4))
    _, y = curve(ax)
    assert y[1] == pytest.approx(39 / 40)
    assert y[-1] == 0.0
    assert not [line for line in ax.lines if line.get_marker() == "o"]
    assert "right-censored" not in [text.get_text() for text in ax.figure.legends[0].get_texts()]


def test_a_section_and_basins_draw_every_state() -> None:
    states = np.linspace(-1.0, 1.0, 7)
    section = xr.Dataset({"midspan_displacement": ("hit", states), "midspan_velocity": ("hit", states**2)})
    ax = plot_section(section)
    np.testing.assert_array_equal(ax.lines[0].get_xdata(), states)
    labels = np.array([[0, 1, -1], [1, 1, 0]])
    attrs = {"flag_values": np.array([-1, 0, 1]), "flag_meanings": "undecided a b"}
    basins = xr.Dataset(
        {
            "basin": (("amplitude[1]", "velocity[1]"), labels, attrs),
            "attractor_points": (("attractor", "point", "axis"), np.array([[[0.0, 1.0]], [[1.0, 2.0]]])),
        },
        {"amplitude[1]": [0.0, 1.0], "velocity[1]": [0.0, 1.0, 2.0]},
    )
    ax = plot_basins(basins)
    assert [(line.get_xdata()[0], line.get_ydata()[0]) for line in ax.lines] == [(0.0, 1.0), (1.0, 2.0)]
    mesh = ax.collections[0]
    np.testing.assert_array_equal(np.asarray(mesh.get_array()).reshape(3, 2), labels.T)


def test_what_holds_nothing_of_the_kind_is_refused() -> None:
    for plot in (plot_survival, plot_basins, plot_section):
        with pytest.raises(sb.InputError):
            plot(xr.Dataset({"response_class": ("x", [1.0])}))


def test_the_legend_has_the_exponents_with_their_errors() -> None:
    """Rounded to two digits of the error, and the value alone where no error is known."""
    over = ("run", "exponent_number")
    data = {
        "exponent": (over, [[2.3456, -30.04]], {"units": "1/s"}),
        "exponent_error": (over, [[0.0123, np.nan]], {"units": "1/s"}),
        "running": (("period", *over), np.ones((20, 1, 2)), {"units": "1/s"}),
    }
    ax = plot_exponents(xr.Dataset(data, {"exponent_number": [1, 2]}))
    legend = [each.get_text() for each in ax.figure.legends[0].get_texts()]
    assert legend == [r"$\lambda_{1}$ = 2.346 ± 0.012", "$\\lambda_{2}$ = \N{MINUS SIGN}30.040"]
