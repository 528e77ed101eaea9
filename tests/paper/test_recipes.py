"""Figures of the paper at sketch size: what they are computed from, what they show, what they write."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from matplotlib.collections import PathCollection
from matplotlib.colors import to_hex

import snapbeam as sb
from snapbeam import paper
from snapbeam.paper.recipes import fig4, fig5, fig8, figB10
from snapbeam.paper.store import load_results
from snapbeam.parts import installed_parts
from snapbeam.plot.style import CLASS_COLORS
from snapbeam.util.status_codes import ResponseClass
from snapbeam.util.validation import InputError

needs_lab = pytest.mark.skipif("lab" not in installed_parts(), reason="fig4 needs the lab part")


@pytest.fixture
def results():
    """Sketches shared by the whole process, examples included."""
    return paper.shared_results()


@pytest.fixture(autouse=True)
def close_figures():
    yield
    plt.close("all")


@pytest.mark.slow
def test_written_and_drawn_again(tmp_path, results):
    """PDF, PNG and data; the data give the same picture without computing."""
    files = paper.fig6.write(tmp_path, results=results)
    assert sorted(file.name for file in files) == ["fig6.nc", "fig6.pdf", "fig6.png"]
    stored = load_results(tmp_path / "fig6.nc", "quick")
    for name, ds in results["fig6"].items():
        assert (stored[name].response_class == ds.response_class).all()
        assert stored[name].attrs["parameter_hash"] == ds.attrs["parameter_hash"]
        np.testing.assert_array_equal(stored[name].frequency_ratio, ds.frequency_ratio)
    again = tmp_path / "again"
    again.mkdir()
    paper.fig6.write(again, data=tmp_path)
    assert (again / "fig6.png").read_bytes() == (tmp_path / "fig6.png").read_bytes()
    with pytest.raises(InputError, match="is of size 'quick', not 'full'"):
        paper.fig6("full", data=tmp_path)


def test_stored_whole_or_not_at_all(tmp_path, results):
    (tmp_path / "fig6.nc").write_bytes(b"no netcdf")
    with pytest.raises(InputError, match="is no NetCDF or HDF5 file"):
        paper.fig6(data=tmp_path)
    with pytest.raises(InputError, match="must be an existing folder"):
        paper.fig6.write(tmp_path / "none", results=results)
    with pytest.raises(InputError, match="is not an option of fig2; its options are none"):
        paper.fig2(results=results, measurements="a.csv")
    with pytest.raises(InputError, match="size = 'huge'"):
        paper.fig2("huge")


def test_recipes_of_one_size_share_a_grid(results):
    for name, ds in results["fig7"].items():
        short = results["fig6"][name]
        assert ds.response_class.shape == short.response_class.shape
        assert ds.attrs["cycles"] > short.attrs["cycles"]
        # a beam that has snapped through has done so for good
        snapped = short.response_class.values > ResponseClass.INTRAWELL
        assert (ds.response_class.values[snapped] > ResponseClass.INTRAWELL).all()


@pytest.mark.slow
def test_points_lie_where_they_were_measured(tmp_path, results):
    table = tmp_path / "dots.csv"
    table.write_text(
        "frequency_ratio,velocity_amplitude,location,response_class\n1.625,0.3,0.3,intrawell\n", encoding="utf-8"
    )
    figure = paper.fig8(results=results, measurements=table)
    found = [c for ax in figure.axes for c in ax.collections if isinstance(c, PathCollection)]
    assert len(found) == 2  # both panels at that frequency
    np.testing.assert_allclose(found[0].get_offsets()[0], [0.3, 0.3])
    assert to_hex(found[0].get_facecolor()[0]).upper() == CLASS_COLORS[0]


@pytest.mark.slow
def test_location_maps_reach_twice_the_static_threshold(results):
    for ds in results["fig8"].values():
        ratio = float(ds.frequency_ratio)
        static = sb.model.quasi_static_threshold(ds.location.values, ratio)
        np.testing.assert_allclose(ds.velocity_amplitude.isel(relative_amplitude=-1).values, 2.0 * static)
    assert {float(ds.frequency_ratio) for ds in results["fig8"].values()} == set(fig8.FREQUENCY_RATIOS)


@pytest.mark.slow
@needs_lab
def test_three_kinds_are_what_they_say(results):
    data = results["fig4"]
    crossings = {}
    for kind in fig4.KINDS:
        w = data[kind].midspan_displacement.values
        crossings[kind] = int((np.sign(w[1:]) != np.sign(w[:-1])).sum())
        recorded = data[f"{kind}_recorded"]
        seen = np.interp(recorded.cycle, data[kind].cycle, data[kind].displacement_at_striker)
        inside = (recorded.cycle.values > 0.0) & (recorded.valid.values == 1)
        # half a frame of exposure, 12 um pixels: the camera sees the run to some hundredths of b
        assert np.sqrt(np.mean((recorded.displacement_at_striker.values - seen)[inside] ** 2)) < 0.03
    assert crossings["intrawell"] == 0 and crossings["single"] == 1 and crossings["several"] >= 3
    with pytest.raises(InputError, match="must be three files"):
        paper.fig4(results=results, measured=["a.nc"])


def test_fig4_names_the_part_that_is_missing(monkeypatch):
    monkeypatch.setattr(fig4, "installed_parts", lambda: ["paper"])
    with pytest.raises(InputError, match=r"fig4: needs the package snapbeam\.lab"):
        fig4.compute(paper.Results("quick"))


@pytest.mark.slow
@needs_lab
def test_measured_runs_take_the_left_column(tmp_path, results):
    files = []
    for kind in fig4.KINDS:
        files.append(tmp_path / f"{kind}.nc")
        results["fig4"][f"{kind}_recorded"].to_netcdf(files[-1], engine="h5netcdf")
    figure = paper.fig4(results=results, measured=files)
    assert figure.axes[0].get_title(loc="left") == "Measured"


def test_snap_times_are_zeros_of_the_first_amplitude(results):
    run = results["fig5"]["run"]
    for at in fig5.snap_times(run):
        near = run.sel(time=at, method="nearest").modal_amplitude.values
        rest = results["fig5"]["shapes"].attrs["rest_amplitude"]
        assert abs(near[0] / rest) < 0.02


def test_maxima_of_a_curve_known_by_formula():
    ratio = np.linspace(0.0, 4.0, 401)
    curve = np.exp(-(((ratio - 1.8) / 0.1) ** 2)) + 0.5 * np.exp(-(((ratio - 3.6) / 0.1) ** 2))
    ds = xr.Dataset(
        {"max_displacement": (("frequency_ratio", "velocity_amplitude"), curve[:, None])},
        {"frequency_ratio": ratio, "velocity_amplitude": [0.01]},
    )
    found = figB10.maxima(ds, 0)
    assert found == [(pytest.approx(1.8), pytest.approx(1.0)), (pytest.approx(3.6), pytest.approx(0.5))]


@pytest.mark.slow
def test_video_of_added_modes(tmp_path, results):
    from snapbeam.paper.recipes import si5

    files = si5.write_video(results, tmp_path)
    assert [file.suffix for file in files] == [".mp4", ".gif"]
    from PIL import Image

    with Image.open(tmp_path / "si5.gif") as image:
        assert image.n_frames == len(results["si5"])


def test_first_impact_carries_one_mode_over_at_a_quarter():
    """At high frequency the shaker is a moving wall: the beam leaves at 2 V b omega_1, over the barrier for V > 1/4."""
    model = sb.ReducedModel.from_beam(paper.BEAM, modes=1, damping_ratio=0.0)
    for amplitude, snaps in ((0.248, False), (0.252, True)):
        shaker = sb.Shaker(frequency_ratio=6.0, velocity_amplitude=amplitude)
        # up to the top of the first flight; near the threshold it is slow, the wall comes back below
        run = sb.simulate(
            sb.System(model, contacts=[sb.Contact(sb.HertzContact(stiffness=4e10), shaker)]), sb.Integration(cycles=6)
        )
        assert (run.summary.max_midspan_displacement > 0.0) == snaps
