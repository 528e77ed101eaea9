"""Many runs at random points of Fig. 6: what every snap-through, every impact and every mode does.

The paper shows single waveforms and says what often happens.  Here the points are drawn evenly over the map
of 32 modes, each run lasts as many periods of the first mode, and what is said of one waveform is measured on
all of them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import snapbeam as sb
from snapbeam.paper.system import paper_model, paper_run
from snapbeam.plot.style import BEAM_COLOR, SHAKER_COLOR, figure_style, fix_ticks, new_figure, panel_letters
from snapbeam.util.provenance import made_by

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from snapbeam.paper.recipe import Results

_Array = NDArray[np.float64]

BIN_EDGES = np.linspace(0.0, 1.5, 31)
"""Borders of the bins of |alpha_1| over its value at rest."""
_SEED = 118291
_RANGES = ((0.3, 4.0), (0.05, 0.65))
"""Omega and V: Fig. 6 without its slowest and weakest drives, which rarely snap the beam through."""
_PERIODS = 25  # of the first mode, a run
_SAMPLES = 400  # a period of the first mode
_STROBE_PHASES = 16
_STROBED = 200  # cycles, at most


def compute(results: Results) -> dict[str, xr.Dataset]:
    """Tables of the runs, their snap-throughs and their impacts, and long strobed records of the intrawell ones."""
    modes, count = results.pick(8, 32), results.pick(16, 160)
    draw_from = np.random.default_rng(_SEED)
    points = np.column_stack([draw_from.uniform(low, high, count) for low, high in _RANGES])
    runs, snaps, impacts = [], [], []
    for at, (omega, drive) in enumerate(points):
        run = _one(modes, float(omega), float(drive))
        table, own = _shares(run, modes)
        runs.append(table)
        snaps.append(np.column_stack([np.full(len(own), at), own]))
        hits = run.impacts
        columns = [hits[name].values for name in ("onset", "duration", "peak_force", "impulse")]
        impacts.append(np.column_stack([np.full(hits.sizes["impact"], at), *columns]))
        results.progress(f"waveforms, N = {modes}")(at + 1, count)
    calm = np.array([row["response_class"] == sb.ResponseClass.INTRAWELL for row in runs])
    stamp: dict[str, Any] = made_by({"modes": modes, "seed": _SEED, "periods": _PERIODS, "runs": count})
    stamp |= {"modes": modes, "reference_frequency": paper_model(modes).reference_frequency}
    return {
        "runs": _run_table(points, runs, stamp),
        "snap_throughs": _table("snap_through", _SNAP_COLUMNS, np.concatenate(snaps), stamp),
        "impacts": _table("impact", _IMPACT_COLUMNS, np.concatenate(impacts), stamp),
        "strobed": _strobed(results, modes, points[calm], stamp),
    }


def _one(modes: int, omega: float, drive: float) -> sb.Run:
    first = paper_model(modes).reference_frequency
    cycles = int(np.ceil(_PERIODS * omega))
    times = np.arange(_PERIODS * _SAMPLES) / (_SAMPLES * first)
    return paper_run(modes, omega, drive, cycles, sample_times=times, accuracy="reference")


_SNAP_COLUMNS = {
    "run": ("1", "which run"),
    "time": ("s", "time at which alpha_1 passes zero"),
    "antisymmetric": ("1", "norm of the antisymmetric amplitudes there, over alpha_1 at rest"),
    "symmetric": ("1", "norm of the symmetric amplitudes from the third on there, over alpha_1 at rest"),
    "delay": ("s", "time until |alpha_1| is twice the norm of the antisymmetric amplitudes"),
}
_IMPACT_COLUMNS = {
    "run": ("1", "which run"),
    "onset": ("s", "onset of the impact"),
    "duration": ("s", "duration of the impact"),
    "peak_force": ("N", "peak contact force"),
    "impulse": ("N s", "impulse on the beam"),
}


def passages(alpha: _Array, time: _Array) -> _Array:
    """Each passage of the first amplitude through zero: time, antisymmetric and symmetric norms, delay.

    *alpha*, of shape (samples, N), is over the first amplitude at rest.  The delay runs until |alpha_1| is twice
    the norm of the antisymmetric amplitudes, NaN if the record ends before or alpha_1 passes zero again first.
    """
    first = alpha[:, 0]
    uneven = np.sqrt(np.sum(alpha[:, 1::2] ** 2, axis=1))
    even = np.sqrt(np.sum(alpha[:, 2::2] ** 2, axis=1))
    at = np.flatnonzero(np.sign(first[:-1]) * np.sign(first[1:]) < 0)
    rows = []
    for i, stop in zip(at, [*at, first.size - 1][1:], strict=True):
        share = first[i] / (first[i] - first[i + 1])
        when = time[i] + share * (time[i + 1] - time[i])
        later = np.abs(first[i + 1 : stop + 1]) >= 2.0 * uneven[i + 1 : stop + 1]
        delay = time[i + 1 + np.argmax(later)] - when if later.any() else np.nan
        rows.append([when, *(norm[i] + share * (norm[i + 1] - norm[i]) for norm in (uneven, even)), delay])
    return np.array(rows).reshape(-1, 4)


def _shares(run: sb.Run, modes: int) -> tuple[dict[str, Any], _Array]:
    """Histograms of |alpha_1|, and of |alpha_1| where the other modes exceed it, and the peak of each mode."""
    rest = abs(float(paper_model(modes).well_amplitude[0]))
    alpha = run.dataset.modal_amplitude.values.astype(float) / rest
    first = np.abs(alpha[:, 0])
    higher = np.sqrt(np.sum(alpha[:, 1:] ** 2, axis=1))
    uneven = np.sqrt(np.sum(alpha[:, 1::2] ** 2, axis=1))
    counted = {
        "samples": np.histogram(first, BIN_EDGES)[0],
        "higher_exceed": np.histogram(first[higher > first], BIN_EDGES)[0],
        "antisymmetric_exceed": np.histogram(first[uneven > first], BIN_EDGES)[0],
        "peak_amplitude": np.abs(alpha).max(axis=0),
        "response_class": int(run.summary.response_class),
    }
    return counted, passages(alpha, run.dataset.time.values)


def _run_table(points: _Array, rows: list[dict[str, Any]], attrs: dict[str, Any]) -> xr.Dataset:
    from snapbeam.util.datasets import xr

    words = {
        "samples": (("run", "bin"), "samples with |alpha_1| in the bin"),
        "higher_exceed": (("run", "bin"), "of these, with the norm of all other amplitudes above |alpha_1|"),
        "antisymmetric_exceed": (("run", "bin"), "of these, with the norm of the antisymmetric ones above it"),
        "peak_amplitude": (("run", "mode"), "maximum |alpha_i| over alpha_1 at rest"),
    }
    data: dict[str, Any] = {
        name: (dims, np.stack([row[name] for row in rows]), {"units": "1", "long_name": text})
        for name, (dims, text) in words.items()
    }
    for name, column in zip(("frequency_ratio", "velocity_amplitude"), points.T, strict=True):
        data[name] = (("run",), column, {"units": "1"})
    middle = 0.5 * (BIN_EDGES[1:] + BIN_EDGES[:-1])
    coords = {"bin": ("bin", middle, {"units": "1", "long_name": "|alpha_1| over its value at rest"})}
    return xr.Dataset(data, coords, attrs)


def _table(dim: str, columns: dict[str, tuple[str, str]], rows: _Array, attrs: dict[str, Any]) -> xr.Dataset:
    from snapbeam.util.datasets import xr

    data = {
        name: ((dim,), rows[:, i], {"units": units, "long_name": words})
        for i, (name, (units, words)) in enumerate(columns.items())
    }
    return xr.Dataset(data, attrs=attrs)


def _strobed(results: Results, modes: int, points: _Array, attrs: dict[str, Any]) -> xr.Dataset:
    """Displacement at the contact at 16 phases of the last cycles of long runs that do not snap."""
    from snapbeam.util.datasets import xr

    cycles = results.pick(60, 800)
    kept_cycles = min(cycles // 2, _STROBED)
    model, found, kept = paper_model(modes), [], []
    for at, (omega, drive) in enumerate(points):
        period = 1.0 / (omega * model.reference_frequency)
        steps = np.arange(_STROBE_PHASES * (cycles - kept_cycles), _STROBE_PHASES * cycles)
        run = paper_run(
            modes, float(omega), float(drive), cycles, sample_times=steps * period / _STROBE_PHASES
        )  # fmt: skip
        if run.summary.response_class == sb.ResponseClass.INTRAWELL:
            found.append(run.dataset.displacement_at_striker.values.reshape(-1, _STROBE_PHASES))
            kept.append((omega, drive))
        results.progress(f"waveforms, {cycles} cycles")(at + 1, len(points))
    words = {"units": "b", "long_name": "beam displacement at the shaker"}
    shape = (len(found), kept_cycles, _STROBE_PHASES)
    record = np.array(found, dtype=np.float64).reshape(shape)
    data: dict[str, Any] = {"displacement": (("run", "cycle", "phase"), record, words)}
    for name, column in zip(("frequency_ratio", "velocity_amplitude"), np.reshape(kept, (-1, 2)).T, strict=True):
        data[name] = (("run",), column, {"units": "1"})
    return xr.Dataset(data, {"cycle": np.arange(cycles - kept_cycles, cycles)}, attrs | {"cycles": cycles})


def draw(results: Results) -> Figure:
    """Four panels: which modes dominate, how antisymmetric a passage is, how long impacts last, every mode's peak."""
    data = results["waveforms"]
    with figure_style():
        figure = new_figure("double", 118.0)
        axes = figure.subplots(2, 2)
        _dominance(axes[0, 0], data["runs"])
        _antisymmetry(axes[0, 1], data["snap_throughs"])
        _durations(axes[1, 0], data["impacts"])
        _peaks(axes[1, 1], data["runs"])
        fix_ticks(*axes.ravel())
        panel_letters(axes.ravel())
    return figure


def _dominance(ax: Axes, runs: xr.Dataset) -> None:
    total = runs.samples.values.sum(axis=0)
    for name, color, words in (
        ("higher_exceed", BEAM_COLOR, "all higher modes"),
        ("antisymmetric_exceed", SHAKER_COLOR, "antisymmetric modes"),
    ):
        share = runs[name].values.sum(axis=0) / np.maximum(total, 1)
        ax.stairs(share, BIN_EDGES, color=color, label=words)
    ax.axhline(0.5, color="0.7", linewidth=0.5, zorder=0)
    ax.set(xlabel=r"$|\alpha_1|$ / its value at rest", ylabel=r"Fraction of time above $|\alpha_1|$")
    ax.set(xlim=(0.0, 1.0), ylim=(0.0, 1.02))
    ax.legend(loc="upper right")


def _antisymmetry(ax: Axes, snaps: xr.Dataset) -> None:
    for name, color, words in (
        ("antisymmetric", SHAKER_COLOR, "antisymmetric modes"),
        ("symmetric", BEAM_COLOR, "symmetric modes but the first"),
    ):
        ordered = np.sort(snaps[name].values)
        ax.step(ordered, np.arange(1, ordered.size + 1) / max(ordered.size, 1), color=color, label=words)
    ax.axvline(0.1, color="0.7", linewidth=0.5, zorder=0)
    ax.set(xlabel=r"Norm where $\alpha_1 = 0$ / $|\alpha_1|$ at rest", ylabel="Fraction of snap-throughs")
    ax.set(xlim=(0.0, None), ylim=(0.0, 1.02))
    ax.legend(loc="lower right")


def _durations(ax: Axes, impacts: xr.Dataset) -> None:
    share = impacts.duration.values * float(impacts.attrs["reference_frequency"])
    ax.loglog(share, impacts.peak_force.values, ".", color=BEAM_COLOR, markersize=1.5, rasterized=True)
    ax.axvline(0.1, color="0.7", linewidth=0.5, zorder=0)
    ax.set(xlabel="Duration of an impact / first natural period", ylabel="Peak contact force (N)")


def _peaks(ax: Axes, runs: xr.Dataset) -> None:
    peak = runs.peak_amplitude.values
    mode = np.arange(1, peak.shape[1] + 1)
    low, middle, high = np.quantile(peak, (0.05, 0.5, 0.95), axis=0)
    ax.fill_between(mode, low, high, color="0.85", linewidth=0, label="90 % of the runs")
    ax.semilogy(mode, middle, ".-", color=BEAM_COLOR, markersize=3, label="median")
    ax.set(xlabel="Buckling mode $i$", ylabel=r"Maximum $|\alpha_i|$ / $|\alpha_1|$ at rest")
    ax.set_xlim(0.5, mode[-1] + 0.5)
    ax.legend(loc="upper right")
