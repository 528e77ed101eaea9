"""Fig. 4: three kinds of waveform, recorded and simulated, at parameters that are searched for.

Rows: a non-periodic intrawell response, a transient interwell one with a single snap-through, and one with
several, all at one frequency.  Left: files of measured runs if they are given; otherwise a synthetic
recording of each simulated run, drawn as a camera at 10 000 frames a second would see it and tracked like a
measured one.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import snapbeam as sb
from snapbeam.model.default_values import BEAM, CYCLES, LOCATION
from snapbeam.paper.system import TOLERANCE, class_map, paper_model, paper_run
from snapbeam.parts import installed_parts
from snapbeam.plot.style import BEAM_COLOR, SHAKER_COLOR, figure_style, fix_ticks, new_figure, panel_letters
from snapbeam.simulation.dataset import check_trajectory
from snapbeam.util.netcdf import read_netcdf
from snapbeam.util.validation import InputError

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from snapbeam.paper.recipe import Results

_Array = NDArray[np.float64]

OPTIONS = ("measured",)
KINDS = {
    "intrawell": "non-periodic intrawell",
    "single": "transient interwell, one snap-through",
    "several": "transient interwell, several snap-throughs",
}
_SHOWN = 20  # cycles
_TRIED = 12  # transient responses of a frequency that are looked at closely
_FRAME_RATE = 10_000.0
_REST_FRAMES = 40


def compute(results: Results) -> dict[str, xr.Dataset]:
    """The map that was searched, the three runs, and a tracked synthetic recording of each.

    Raises
    ------
    InputError
        If the lab part is not installed, or if the grid lacks one of the kinds of response.
    """
    if "lab" not in installed_parts():
        raise InputError("fig4: needs the package snapbeam.lab to track recordings; install snapbeam with its lab part")
    modes, cycles = results.pick(4, 32), results.pick(40, CYCLES)
    amplitude = results.pick(np.linspace(0.05, 0.3, 6), np.linspace(0.04, 0.4, 37))
    ratio = results.pick(np.array([1.4]), np.linspace(0.8, 2.0, 13))
    searched = class_map(
        results, "fig4", paper_model(modes), frequency_ratio=ratio, velocity_amplitude=amplitude, cycles=cycles
    )
    chosen = _choose(searched, modes, cycles)
    found = {"searched": searched}
    for kind, (omega, drive) in chosen.items():
        run = paper_run(modes, omega, drive, _SHOWN, tolerance=TOLERANCE)
        names = ["displacement_at_striker", "midspan_displacement", "striker_displacement"]
        found[kind] = run.dataset[names]
        found[f"{kind}_recorded"] = _recorded(run.dataset)
    return found


def _choose(searched: xr.Dataset, modes: int, cycles: int) -> dict[str, tuple[float, float]]:
    """Omega and V of each kind, by a rule.

    At each frequency: the smallest V that snaps through exactly once; the smallest above it that changes wells at
    least three times, both settled in the second well within the cycles shown; and of the three largest intrawell
    V below the threshold the one that repeats itself worst.  The frequency is the one at which that is worst.
    """
    best: tuple[float, dict[str, tuple[float, float]]] | None = None
    for omega in searched.frequency_ratio.values:
        column = searched.sel(frequency_ratio=omega)
        kind, crossings = column.response_class.values, column.zero_crossings.values
        drive = column.velocity_amplitude.values
        snapped = np.flatnonzero(kind > sb.ResponseClass.INTRAWELL)
        settled = kind == sb.ResponseClass.TRANSIENT_2
        if not snapped.size or snapped[0] == 0:
            continue
        candidates = np.flatnonzero(settled & (crossings % 2 == 1))
        swings = {i: _swings(modes, omega, drive[i]) for i in candidates[:_TRIED]}
        single = [i for i in swings if crossings[i] == 1 and swings[i] == 1][:1]
        several = [i for i in swings if single and i > single[0] and swings[i] >= 3 and swings[i] % 2 == 1][:1]
        if not several:
            continue
        below = range(max(snapped[0] - 3, 0), snapped[0])
        scatter = {i: _scatter(modes, omega, drive[i], min(cycles, 60)) for i in below}
        worst = max(scatter, key=lambda i: scatter[i])
        if best is None or scatter[worst] > best[0]:
            rows = zip(KINDS, (worst, single[0], several[0]), strict=True)
            best = scatter[worst], {name: (float(omega), float(drive[i])) for name, i in rows}
    if best is None:
        raise InputError("fig4: no frequency of the grid has all three kinds of response")
    return best[1]


def _swings(modes: int, omega: float, drive: float) -> int:
    """Number of snap-throughs within the cycles shown; 0 if the beam has not settled by 80 % of them.

    A well is reached half way from the straight beam, so that grazing zero is no snap-through.
    """
    run = paper_run(modes, float(omega), float(drive), _SHOWN, accuracy="reference")
    response = run.summary
    if not response.final_well_proven or response.last_zero_crossing > 0.8 * float(run.dataset.time[-1]):
        return 0
    centre = run.dataset.midspan_displacement.values
    wells = np.sign(centre[np.abs(centre) > 0.5])
    return int((wells[1:] != wells[:-1]).sum())


def _scatter(modes: int, omega: float, drive: float, cycles: int) -> float:
    """Standard deviation of the displacement once a cycle, over the second half of a run, in b."""
    period = 1.0 / (omega * paper_model(modes).reference_frequency)
    times = period * np.arange(cycles // 2, cycles)
    run = paper_run(modes, float(omega), float(drive), cycles, sample_times=times)
    return float(run.dataset.displacement_at_striker.std())


def _recorded(run: xr.Dataset) -> xr.Dataset:
    """Tracked synthetic camera recording of a run."""
    from snapbeam.lab.camera import open_recording
    from snapbeam.lab.synthetic import SyntheticCamera, render_run
    from snapbeam.lab.tracking.track import track

    camera = SyntheticCamera(frame_rate=_FRAME_RATE, shape=(288, 96))
    recording = render_run(run, camera=camera, rest_frames=_REST_FRAMES)
    with tempfile.TemporaryDirectory() as folder:
        file = recording.write(Path(folder) / "synthetic.cihx")
        with open_recording(file) as frames:
            tracked = track(frames, buckling_level=BEAM.buckling_level, location=LOCATION, rest_frames=_REST_FRAMES)
    tracked = tracked[["displacement_at_striker", "striker_displacement", "valid"]]
    frequency = float(run.attrs["frequency_ratio"]) * float(run.attrs["reference_frequency"])
    cycle = (tracked.time.values - _REST_FRAMES / _FRAME_RATE) * frequency
    tracked = tracked.assign_coords(cycle=("time", cycle, {"units": "1", "long_name": "cycles of excitation"}))
    tracked.attrs["title"] = "synthetic recording of a simulated run, tracked"
    return tracked


def read_measured(path: str | os.PathLike[str]) -> xr.Dataset:
    """A measured run: NetCDF with ``displacement_at_striker`` and ``striker_displacement``, in b, over ``time``."""
    dataset = read_netcdf(path, "measured")
    return check_trajectory(dataset, require=("displacement_at_striker", "striker_displacement"))


def draw(results: Results, measured: Sequence[str | os.PathLike[str]] | None = None) -> Figure:
    """Two columns, recorded and simulated, of three rows."""
    data = results["fig4"]
    if measured is not None and len(measured) != len(KINDS):
        raise InputError(f"measured: must be three files, one a kind of waveform, not {len(measured)}")
    left = [data[f"{kind}_recorded"] if measured is None else read_measured(measured[i])
            for i, kind in enumerate(KINDS)]  # fmt: skip
    with figure_style():
        figure = new_figure("double", 132.0)
        axes = figure.subplots(3, 2, sharey=True, sharex=measured is None)
        for row, ((first, second), recorded, (kind, words)) in enumerate(zip(axes, left, KINDS.items(), strict=True)):
            run = data[kind]
            _waveform(first, recorded)
            _waveform(second, run)
            first.set_ylabel("Displacement $w$")
            place = rf"$\Omega$ = {run.attrs['frequency_ratio']:.4g}, $V$ = {run.attrs['velocity_amplitude']:.4g}"
            second.set_title(f"{words[0].upper()}{words[1:]}\n{place}", loc="left")
            again = f"No measurement: the run of {'BDF'[row]}, drawn as\na camera would see it, and tracked"
            first.set_title(again if measured is None else "Measured", loc="left")
        for ax in axes[-1]:
            ax.set_xlabel(r"Cycles of excitation $\tau$" if ax.get_gid() == "cycles" else "Time (ms)")
        handles, labels = axes[0, 1].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=2)
        fix_ticks(*axes.ravel())
        panel_letters(axes.ravel())
    return figure


def _waveform(ax: Axes, run: Any) -> None:
    cycles = "cycle" in run.variables
    x = run["cycle"].values if cycles else 1e3 * run["time"].values
    ax.axhline(0.0, color="0.75", linewidth=0.5)
    ax.plot(x, run.displacement_at_striker, color=BEAM_COLOR, label=r"beam $w_\mathrm{b}(x_\mathrm{s})$", linewidth=0.8)
    ax.plot(x, run.striker_displacement, color=SHAKER_COLOR, label=r"shaker $w_\mathrm{s}$", linewidth=0.8)
    ax.set_xlim(0.0 if cycles else x[0], min(x[-1], _SHOWN) if cycles else x[-1])
    ax.set_gid("cycles" if cycles else "time")
