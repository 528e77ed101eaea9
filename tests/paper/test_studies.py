"""The studies that the claims need: what their numbers are made of, at sketch size."""

from __future__ import annotations

import io
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from studies import notch, switch
from studies.harvesting import PIEZO, power_above

import snapbeam as sb
from snapbeam import paper
from snapbeam.paper.recipes import disturbances
from snapbeam.paper.recipes.resonance import ridge
from snapbeam.paper.recipes.sensitivity import buckling_mode_damping
from snapbeam.paper.recipes.waveforms import passages
from snapbeam.paper.recipes.windows import longest_window
from snapbeam.paper.store import load_results
from snapbeam.util.status_codes import ResponseClass


@pytest.fixture(scope="module")
def results():
    return paper.Results()


DATA = Path(__file__).parents[2] / "docs" / "data"
STUDIES = (
    "low_frequency",
    "resonance",
    pytest.param("waveforms", marks=pytest.mark.slow),
    pytest.param("transients", marks=pytest.mark.slow),
    "windows",
    pytest.param("disturbances", marks=pytest.mark.slow),
    pytest.param("sensitivity", marks=pytest.mark.slow),
    pytest.param("lifetimes", marks=pytest.mark.slow),
    pytest.param("two_tips", marks=pytest.mark.slow),
    pytest.param("notch", marks=pytest.mark.slow),
    pytest.param("switch", marks=pytest.mark.slow),
    pytest.param("harvesting", marks=pytest.mark.slow),
)


@pytest.mark.parametrize("name", STUDIES)
def test_drawn(name, results):
    figure = paper.FIGURES[name](results=results)
    assert figure.axes
    figure.savefig(io.BytesIO(), format="png")
    plt.close(figure)


def test_the_stored_harvester_is_of_a_real_material():
    """Its coupling is that of PZT-5H, and the stored medians are those that the page states."""
    system = sb.System(
        sb.ReducedModel.from_beam(paper.BEAM, modes=1),
        harvesters=[PIEZO],
        base_excitation=sb.BaseExcitation(motion=sb.Sine(frequency_ratio=1.0, velocity_amplitude=0.1)),
    )
    assert "unphysical-coupling" not in {each.code for each in system.diagnostics()}
    found = xr.load_dataset(DATA / "harvesting.nc", group="power", engine="h5netcdf")
    power, kinds = 1e6 * found.power.values, found.kind.values
    assert np.median(power[kinds == ResponseClass.INTRAWELL]) == pytest.approx(4.6, abs=0.05)
    assert np.median(power[kinds == ResponseClass.CONTINUOUS]) == pytest.approx(250.0, abs=0.5)
    assert power.max() == pytest.approx(531.0, abs=1.0)


def test_damping_of_the_buckling_modes():
    """Its diagonal in the linear modes against the eigenvalues of the whole: light damping decouples."""
    model = sb.ReducedModel.from_beam(paper.BEAM, modes=8)
    projected, exact = buckling_mode_damping(model)
    np.testing.assert_allclose(projected, exact, rtol=1e-3)
    one = sb.ReducedModel.from_beam(paper.BEAM, modes=1)
    assert buckling_mode_damping(one)[0] == pytest.approx([0.005], rel=1e-12)


def test_passages_of_a_known_motion():
    """alpha_1 = cos passes zero at odd quarters; the others are constant."""
    time = np.linspace(0.0, 1.0, 4001)
    alpha = np.stack([np.cos(2.0 * np.pi * time), np.full(time.size, 0.3), np.full(time.size, 0.4)], axis=1)
    found = passages(alpha, time)
    np.testing.assert_allclose(found[:, 0], [0.25, 0.75], atol=1e-6)
    np.testing.assert_allclose(found[:, 1:3], [[0.3, 0.4]] * 2)
    # |cos| reaches 0.6 where the angle past the quarter is asin 0.6
    np.testing.assert_allclose(found[:, 3], np.arcsin(0.6) / (2.0 * np.pi), atol=3e-4)
    assert passages(alpha[:500], time[:500]).shape == (0, 4)


def test_notch_of_a_known_threshold():
    """The lowest that rises on both sides, not the window's edge; its stretch is what is within a step of it."""
    ratio = np.arange(1.0, 1.61, 0.1)
    rows = np.array([[[0.10, 0.20, 0.15, 0.155, 0.25, 0.18, 0.30], [0.10, 0.20, 0.30, 0.16, 0.25, np.nan, np.nan]]])
    ds = xr.Dataset(
        {"threshold": (("variant", "location", "frequency_ratio"), rows)},
        {"variant": ["v"], "location": [0.4, 0.5], "frequency_ratio": ratio},
        {"amplitude_step": 0.01},
    )
    first, second = notch.notches(ds, "v")
    assert (first.position, first.height, first.low, first.high) == pytest.approx((1.2, 0.15, 1.2, 1.3))
    assert (second.position, second.height, second.low, second.high) == pytest.approx((1.3, 0.16, 1.3, 1.3))
    assert notch.moved(ds, "v") == pytest.approx((1.25, 1.2, 1.3))


def test_notch_moves_with_the_mass_of_the_shaker_alone():
    """What the page says, from the stored data: one bar reaches 1.4, that of a shaker as light as the beam."""
    ds = load_results(DATA / "notch.nc", "full")["thresholds"]
    where = {str(name): notch.moved(ds, str(name)) for name in ds.variant.values}
    there = {name for name, (_, low, high) in where.items() if low <= notch.MEASURED <= high}
    assert there == {"2 g on 20 Hz", "10 g on 20 Hz"}
    assert where[notch.BASE][0] == pytest.approx(1.20625) and set(where) <= set(notch.VARIANTS)


def test_power_above_a_frequency():
    """Two tones of known strength: the share is that of the stronger one's square."""
    rate = 20_000.0
    time = np.arange(40_000) / rate
    voltage = 3.0 * np.sin(2.0 * np.pi * 80.0 * time) + 1.0 * np.sin(2.0 * np.pi * 900.0 * time + 0.3)
    power, share = power_above(voltage, rate, 50.0, 400.0)
    assert power == pytest.approx(5.0 / 50.0, rel=1e-6)
    assert share == pytest.approx(0.1, rel=1e-6)


def test_fold_of_a_biased_beam():
    """The bias at which the lower well is gone: by bisection, and the barrier vanishes there as the power 3/2."""
    fold = switch.fold_load(2)
    barriers = []
    for away in (0.04, 0.01):
        load = sb.Imperfection(uniform_load=(1.0 - away) * fold)
        model = sb.ReducedModel.from_beam(paper.BEAM, modes=2, imperfection=load)
        barriers.append(model.saddle_energy - float(model.potential_energy(model.wells[0])))
    assert np.log(barriers[0] / barriers[1]) / np.log(4.0) == pytest.approx(1.5, abs=0.05)


def test_every_impact_and_passage_belongs_to_a_run(results):
    data = results["waveforms"]
    count = data["runs"].sizes["run"]
    for name in ("impacts", "snap_throughs"):
        run = data[name].run.values
        assert run.min() >= 0 and run.max() < count and (np.diff(run) >= 0).all()
    assert (data["impacts"].duration.values > 0.0).all() and (data["impacts"].impulse.values > 0.0).all()
    runs = data["runs"]
    assert (runs.antisymmetric_exceed <= runs.higher_exceed).all() and (runs.higher_exceed <= runs.samples).all()


def test_ridge_of_a_known_resonance():
    """The maximum is followed up to the last drive at which nothing snaps."""
    ratio, drives = np.linspace(1.0, 2.0, 51), np.array([0.01, 0.02, 0.03, 0.04])
    height = np.exp(-(((ratio[:, None] - (1.8 - 10.0 * drives)) / 0.1) ** 2))
    response = np.zeros(height.shape, dtype=np.int8)
    response[10, 2] = ResponseClass.TRANSIENT_2
    ds = xr.Dataset(
        {"max_displacement": (("frequency_ratio", "velocity_amplitude"), height),
         "response_class": (("frequency_ratio", "velocity_amplitude"), response)},
        {"frequency_ratio": ratio, "velocity_amplitude": drives},
    )  # fmt: skip
    found = ridge(ds)
    np.testing.assert_allclose(found[0], [0.01, 0.02])
    np.testing.assert_allclose(found[1], [1.7, 1.6], atol=0.011)


def test_longest_window_forgives_single_points():
    kinds = np.zeros((2, 40), dtype=np.int8)
    kinds[0, 10:30] = ResponseClass.TRANSIENT_2
    kinds[0, 17] = ResponseClass.CONTINUOUS
    ds = xr.Dataset(
        {"response_class": (("location", "velocity_amplitude"), kinds)},
        {"location": [0.1, 0.5], "velocity_amplitude": np.arange(1.0, 41.0)},
    )
    low, high = longest_window(ds)
    assert (low[0], high[0]) == (11.0, 30.0) and np.isnan(low[1]) and np.isnan(high[1])


def test_a_drive_with_a_start_up_transient():
    """Its velocity is that of its displacement, 1 + excess times as great at first and steady at the end."""
    model = sb.ReducedModel.from_beam(paper.BEAM, modes=1)
    drive = disturbances._record(model, 1.2, 0.2, 12, excess=0.2).striker.drive
    numeric = np.gradient(drive.displacement, 1.0 / drive.sampling_frequency)
    np.testing.assert_allclose(drive.velocity[1:-1], numeric[1:-1], atol=2e-3 * np.abs(drive.velocity).max())
    steady = 0.2 * paper.BEAM.buckling_level * 2.0 * np.pi * model.reference_frequency
    assert drive.velocity[0] == pytest.approx(1.2 * steady) and drive.displacement[0] == 0.0
    assert np.abs(drive.velocity[-128:]).max() == pytest.approx(steady, rel=1e-3)


@pytest.mark.slow
def test_a_repeated_impact_is_that_of_the_run(results):
    """Going on from the state at the instant of touch gives the impulse that the run itself has."""
    table = results["disturbances"]["impacts"]
    assert table.sizes["impact"] >= 3
    np.testing.assert_allclose(table.impulse, table.impulse_run, rtol=2e-3)
    assert not np.allclose(table.impulse_alone, table.impulse, rtol=2e-3)


def test_longer_maps_go_on_from_the_shorter(results):
    """A beam that has snapped through has done so for good."""
    maps = list(results["transients"].values())
    for before, after in zip(maps[::2], maps[1::2], strict=True):
        snapped = before.response_class.values > ResponseClass.INTRAWELL
        assert (after.response_class.values[snapped] > ResponseClass.INTRAWELL).all()
        assert after.attrs["cycles"] == 3 * before.attrs["cycles"]
