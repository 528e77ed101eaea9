"""Pictures of what else runs and maps show: amplitudes, energies, spectra, portraits, statistics, lines."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from matplotlib.axes import Axes

import snapbeam as sb
from snapbeam import plot as plots
from snapbeam.model import default_values
from snapbeam.plot.style import caption
from snapbeam.util.validation import InputError


@pytest.fixture(autouse=True)
def _close():
    yield
    plt.close("all")


@pytest.fixture(scope="module")
def run():
    system = sb.System(
        sb.ReducedModel.from_beam(default_values.BEAM, modes=3),
        contacts=[sb.Contact(default_values.CONTACT, sb.Shaker(frequency_ratio=1.21, velocity_amplitude=0.18))],
    )
    return sb.simulate(system, sb.Integration(cycles=12))


def test_captions(run):
    text = caption(run.dataset)
    for part in ("161 mm × 400 µm", "335 µm", "$N$ = 3", "= 1.21 (", "$V$ = 0.18 (", "mm/s", "= 0.476"):
        assert part in text
    assert text.endswith(f": {run.summary.response_class.label}")
    assert caption(run.dataset, 2).count("\n") == 1
    assert caption(xr.Dataset()) == ""


@pytest.mark.parametrize("kind", ["run", "modal_amplitudes", "energies", "spectrum", "spectrogram", "phase_portrait"])
def test_every_plotter_takes_axes_and_returns_them(run, kind):
    plotter = getattr(plots, f"plot_{kind}")
    assert isinstance(plotter(run), Axes)
    ax = plt.figure().add_subplot()
    assert plotter(run.dataset, ax=ax) is ax and ax.has_data() and ax.get_xlabel() and ax.get_ylabel()
    assert isinstance(run.plot(kind), Axes)


def test_what_is_drawn(run):
    energy = run.dataset.energy_beam.values
    lines = {line.get_label(): line for line in run.plot("energies").lines}
    np.testing.assert_allclose(lines["in the beam"].get_ydata() * 1e-6, energy, rtol=1e-12)
    alpha = run.plot("modal_amplitudes", modes=2).lines
    assert len(alpha) == 2 and alpha[0].get_ydata()[0] == pytest.approx(-1.0)
    portrait = run.plot("phase_portrait")
    np.testing.assert_array_equal(portrait.lines[0].get_xdata(), run.dataset.midspan_displacement)
    assert portrait.lines[1].get_xdata().size == 13, "whole cycles, both ends"


def test_spectrum_of_a_sine():
    cycle = np.linspace(0.0, 40.0, 8001)
    attrs = {"units": "1", "long_name": "beam displacement at the striker, over b"}
    run = xr.Dataset(
        {"displacement": ("time", 0.3 * np.sin(2 * np.pi * 3.0 * cycle), attrs)},
        {"time": ("time", cycle * 0.01, {"units": "s"}), "cycle": ("time", cycle, {"units": "1"})},
    )
    line = plots.plot_spectrum(run, variable="displacement").lines[0]
    at = int(np.argmax(line.get_ydata()))
    assert line.get_xdata()[at] == pytest.approx(3.0, abs=0.03)
    assert line.get_ydata()[at] == pytest.approx(0.3, rel=0.02)
    with pytest.raises(InputError, match="at least 16 samples"):
        plots.plot_spectrum(run, variable="displacement", window=(0.0, 0.01))


def test_spectrogram_of_a_sine_that_changes_its_frequency():
    """The line is at 2 before the change and at 5 after it, and 20 dB lower."""
    cycle = np.linspace(0.0, 80.0, 16001)
    values = np.where(cycle < 40.0, np.sin(2 * np.pi * 2.0 * cycle), 0.1 * np.sin(2 * np.pi * 5.0 * cycle))
    run = xr.Dataset(
        {"displacement": ("time", 3.0 + values, {"units": "1"})},
        {"time": ("time", cycle * 0.01, {"units": "s"}), "cycle": ("time", cycle, {"units": "1"})},
    )
    ax = plots.plot_spectrogram(run, variable="displacement", segment=4.0)
    mesh = ax.collections[0]
    level, corners = mesh.get_array(), mesh.get_coordinates()
    at = 0.5 * (corners[0, 1:, 0] + corners[0, :-1, 0])
    lines = 0.5 * (corners[1:, 0, 1] + corners[:-1, 0, 1])
    assert at[0] == pytest.approx(2.0, abs=0.1) and at[-1] == pytest.approx(78.0, abs=1.1), "whole windows only"
    for part, frequency, height in ((at < 37.0, 2.0, 0.0), (at > 43.0, 5.0, -20.0)):
        np.testing.assert_allclose(lines[level[:, part].argmax(axis=0)], frequency, atol=0.13)
        np.testing.assert_allclose(level[:, part].max(axis=0), height, atol=0.2)
    for length in (0.01, 41.0):
        with pytest.raises(InputError, match=r"segment = .*: must be from 0.08 cycles, 16 samples, to 40 cycles"):
            plots.plot_spectrogram(run, variable="displacement", segment=length)
    for length in (0.08, 40.0):
        plots.plot_spectrogram(run, variable="displacement", segment=length)
    run["displacement"][100] = np.nan
    for draw in (plots.plot_spectrum, plots.plot_spectrogram):
        with pytest.raises(InputError, match="has 1 samples without a value"):
            draw(run, variable="displacement")
        draw(run, variable="displacement", window=(10.0, 60.0))


def test_statistics_of_a_map(synthetic_map):
    force = xr.DataArray(
        np.geomspace(1e-5, 1e-1, synthetic_map.response_class.size).reshape(synthetic_map.response_class.shape),
        dims=synthetic_map.response_class.dims, attrs={"units": "N", "long_name": "peak contact force"},
    )  # fmt: skip
    ds = synthetic_map.assign(peak_force=force)
    ax = plots.plot_statistic(ds, "peak_force")
    mesh = ax.collections[0]
    assert mesh.norm.vmin == pytest.approx(1e-2) and mesh.norm.vmax == pytest.approx(100.0), "mN, by powers of ten"
    assert "(mN)" in ax.figure.axes[1].get_ylabel()
    line = plots.plot_statistic(ds.isel(frequency_ratio=3), "peak_force", ax=plt.figure().add_subplot())
    assert line.lines[0].get_ydata().size == ds.sizes["velocity_amplitude"]
    with pytest.raises(InputError, match="nosuch"):
        plots.plot_statistic(ds, "nosuch")


def test_a_map_over_one_axis(synthetic_map):
    ax = plots.plot_response_map(synthetic_map.isel(frequency_ratio=3))
    assert ax.get_xlabel() == "Velocity amplitude $V$" and "Mid-span displacement" in ax.get_ylabel()
    with pytest.raises(InputError, match="are drawn over two axes"):
        plots.plot_response_map(synthetic_map.isel(frequency_ratio=3), quasi_static_line=True)
