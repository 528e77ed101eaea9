"""Lifetimes of snapping: the four points that were measured, nothing that depends on how it is computed, stores."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import snapbeam as sb
from snapbeam.dynamics.lifetimes import refit
from snapbeam.model import default_values
from snapbeam.model.state import rest_state

MEASURED = {(1.21, 0.25): 32.0, (1.625, 0.3): 46.0, (2.5, 0.55): 89.0, (3.5, 0.6): 99.0}
"""Lifetimes in cycles, N = 32, from some 210 runs each: to 7 %."""


def system_of(modes: int, ratio: float = 1.625, velocity: float = 0.3) -> sb.System:
    shaker = sb.Shaker(frequency_ratio=ratio, velocity_amplitude=velocity)
    return sb.System(
        sb.ReducedModel.from_beam(default_values.BEAM, modes), contacts=[sb.Contact(default_values.CONTACT, shaker)]
    )


AXES = {"frequency_ratio": [1.2, 1.625], "velocity_amplitude": [0.01, 0.2, 0.3]}
SHORT = sb.Integration(cycles=120)
TELL = {"settings": sb.dynamics.LifetimeSettings(settling_cycles=20.0), "initial_conditions": 6}


def test_nothing_depends_on_threads_order_or_the_other_points(tmp_path) -> None:
    system = system_of(2)
    whole = sb.dynamics.lifetime_map(system, AXES, SHORT, **TELL)
    one = sb.dynamics.lifetime_map(system, AXES, SHORT.replace(threads=1), **TELL)
    kept = sb.dynamics.lifetime_map(
        system, AXES, SHORT, checkpoint=sb.CheckpointOptions(tmp_path / "kept", points_per_task=2), **TELL
    )
    for other in (one, kept):
        for name in whole.data_vars:
            np.testing.assert_array_equal(whole[name].values, other[name].values, err_msg=str(name))
    points = xr.Dataset({"frequency_ratio": ("point", [1.625, 1.2]), "velocity_amplitude": ("point", [0.3, 0.2])})
    some = sb.dynamics.lifetime_map(system, points, SHORT, **TELL)
    np.testing.assert_array_equal(some.last_snap[0], whole.last_snap.sel(frequency_ratio=1.625, velocity_amplitude=0.3))
    np.testing.assert_array_equal(some.last_snap[1], whole.last_snap.sel(frequency_ratio=1.2, velocity_amplitude=0.2))


def test_a_store_is_resumed_and_refuses_other_starts(tmp_path) -> None:
    system, tally = system_of(1), sb.SweepReport()
    first = sb.dynamics.lifetime_map(
        system, AXES, SHORT, checkpoint=sb.CheckpointOptions(tmp_path / "s", points_per_task=2), **TELL
    )
    again = sb.dynamics.lifetime_map(
        system, AXES, SHORT, checkpoint=sb.CheckpointOptions(tmp_path / "s", report=tally), **TELL
    )
    assert tally.computed == 0 and tally.resumed == 3
    assert first.drop_attrs().equals(again.drop_attrs())
    with pytest.raises(sb.InputError, match="starts"):
        sb.dynamics.lifetime_map(
            system,
            AXES,
            SHORT,
            checkpoint=tmp_path / "s",
            **(TELL | {"initial_conditions": sb.dynamics.InitialConditions(count=6, seed=1)}),
        )


def test_counts_add_up() -> None:
    ds = sb.dynamics.lifetime_map(system_of(2), AXES, SHORT, **TELL)
    settled = (ds.last_snap.notnull() & (ds.runs_snapping < 6)).any()
    assert bool(settled)
    runs = 6 - ds.runs_failed
    assert ((ds.end_probability.sum("well") * runs).round() == runs - ds.runs_snapping).all()
    assert (ds.runs_never.sel(velocity_amplitude=0.01) == 6).all(), "a weak drive never snaps it"
    assert (ds.end_probability.sel(velocity_amplitude=0.01, well="first") == 1.0).all()
    assert ds.lifetime.sel(velocity_amplitude=0.01).isnull().all()
    falling = ds.snapping_probability.diff("after")
    assert (falling <= 0.0).all()
    assert (ds.lifetime_low <= ds.lifetime_high).all()
    wider = refit(ds, sb.dynamics.LifetimeSettings(settling_cycles=20.0, confidence=0.99))
    known = ds.lifetime.notnull()
    assert (wider.lifetime_low <= ds.lifetime_low).where(known, True).all()


def test_the_tip_stands_still_in_space() -> None:
    """A start with the phase drawn differs from one without; none presses the beam before the drive moves."""
    system = system_of(2)
    starts = sb.dynamics.InitialConditions(count=8, phase=True, displacement=0.0)
    phases = [float(starts.state(system, s).phase) for s in range(8)]
    assert len(set(phases)) == 8 and all(np.pi <= phase <= 2.0 * np.pi for phase in phases)
    ds = sb.dynamics.lifetime_map(
        system, None, SHORT, initial_conditions=starts, settings=sb.dynamics.LifetimeSettings(settling_cycles=20.0)
    )
    assert ds.last_snap.dims == ("start",)
    assert len(np.unique(ds.last_snap)) > 1


def test_runs_that_snap_on_are_followed_to_the_end() -> None:
    """One mode at a point where many runs go on: none is stopped because it is sure to be called continuous."""
    ds = sb.dynamics.lifetime_map(
        system_of(1), None, sb.Integration(cycles=400), initial_conditions=24, after=[200, 350]
    )
    lasting = ds.last_snap.values[ds.last_snap.values > 350.0]
    assert lasting.size == int(ds.runs_snapping) >= 8
    assert (lasting > 390.0).all(), "they still cross in the last cycles"
    assert float(ds.snapping_probability.sel(after=350)) == pytest.approx(lasting.size / 24)
    assert (ds.status.values[ds.last_snap.values > 350.0] == sb.RunStatus.OK).all()


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:400 runs of .* steps in flight")
@pytest.mark.parametrize("point", MEASURED)
def test_measured_lifetimes_come_again(point) -> None:
    """Measured twice, once with some 210 runs and here with 400: within both errors, and all of them end in well 2."""
    ds = sb.dynamics.lifetime_map(system_of(32, *point), None, sb.Integration(cycles=1000), initial_conditions=400)
    assert int(ds.runs_snapping) == 0
    assert float(ds.end_probability.sel(well="other")) == 1.0
    relative = float(ds.lifetime) / MEASURED[point] - 1.0
    # three standard errors of a count of 210 and of one of 400
    assert abs(relative) < 3.0 * np.hypot(1.0 / np.sqrt(210.0), 1.0 / np.sqrt(400.0))
    assert float(ds.goodness) > 0.01


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"initial_conditions": 0}, "count = 0"),
        ({"initial_conditions": 2.5}, "initial_conditions = 2.5"),
        ({"settings": sb.dynamics.LifetimeSettings(settling_cycles=500.0)}, "must be more than settling_cycles"),
        ({"after": [50, 20]}, "after = [50, 20]"),
        ({"after": [1000]}, "after[0]"),
        ({"axes": {"velocity_amplitde": [0.1, 0.2]}}, "did you mean"),
    ],
)
def test_refusals(given, words: str) -> None:
    with pytest.raises(sb.InputError) as error:
        sb.dynamics.lifetime_map(system_of(1), integration=SHORT, **given)
    assert words in str(error.value)


def test_a_free_beam_is_refused() -> None:
    with pytest.raises(sb.InputError, match=r"contacts = \[\]"):
        sb.dynamics.lifetime_map(sb.System(sb.ReducedModel.from_beam(default_values.BEAM, 1)))


def test_no_start_presses_the_tip() -> None:
    """Beside a tip that hardly moves nothing touches at the start: an overlap would shoot the beam away."""
    ds = sb.dynamics.lifetime_map(
        system_of(1, 1.2, 0.0005), {"location": [0.3, 0.5]}, SHORT, initial_conditions=sb.dynamics.InitialConditions(count=64, displacement=1e-5),
        settings=sb.dynamics.LifetimeSettings(settling_cycles=20.0),
    )  # fmt: skip
    assert (ds.runs_never == 64).all() and (ds.end_probability.sel(well="first") == 1.0).all()
    system = system_of(4)
    for side, away in (("below", 1.0), ("above", -1.0)):
        turned = system.replace(**{"contact.side": side})
        for number in range(6):
            place = np.array([0.1, 0.35, 0.5])
            many = sb.dynamics.InitialConditions(count=6).state(turned, number, location=place)
            rest = rest_state(turned.model, turned.striker)
            moved = np.sum(turned.model.shape_at(place) * (many.amplitude - rest.amplitude), axis=-1)
            assert (away * moved > 0.0).all()
            one = sb.dynamics.InitialConditions(count=6).state(turned.replace(**{"contact.location": 0.35}), number)
            np.testing.assert_array_equal(one.amplitude, many.amplitude[1])
