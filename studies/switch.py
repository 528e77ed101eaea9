"""The cheapest one-way switch: a burst that takes a beam with a bias over, and how surely.

A uniform load favours the upper well; a burst from below strikes and withdraws.  Over the burst's length and velocity:
the share of runs, each a little off, that end in the upper well for good, and the work that they took.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

import snapbeam as sb
from snapbeam.model.default_values import BEAM, CONTACT, LOCATION
from snapbeam.plot.style import BEAM_COLOR, SHAKER_COLOR, figure_style, fix_ticks, new_figure, panel_letters

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from snapbeam.paper.recipe import Results

_Array = NDArray[np.float64]

OMEGA = 1.2
_SHARES = (0.0, 0.3, 0.6, 0.8)
"""Bias over the load at which the lower well is gone."""
_OFF = {"velocity_amplitude": 0.01, "frequency_ratio": 0.01, "location": 0.002}
"""Standard deviations of the parameters, relative except for the location."""


def _model(modes: int, load: float) -> sb.ReducedModel:
    bias = sb.Imperfection(uniform_load=load) if load else None
    return sb.ReducedModel.from_beam(BEAM, modes=modes, imperfection=bias)


def fold_load(modes: int) -> float:
    """Uniform load (N/m) at which the lower well is gone."""
    low, high = 0.0, 1.0
    while _model(modes, high).is_bistable:
        low, high = high, 2.0 * high
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _model(modes, middle).is_bistable else (low, middle)
    return low


def compute(results: Results) -> dict[str, xr.Dataset]:
    """Share of runs that end in the upper well, and their median work, over bias, length and velocity."""
    from snapbeam.util.datasets import xr

    modes, repeats = results.pick(2, 4), results.pick(4, 16)
    lengths = results.pick(np.array([1.0, 3.0]), np.array([0.75, 1.0, 1.5, 2.0, 3.0, 5.0]))
    drives = np.round(np.linspace(0.05, 0.6, results.pick(3, 12)), 6)
    fold, shape = fold_load(modes), (lengths.size, drives.size, repeats)
    rng = np.random.default_rng(5)
    draws = {name: rng.standard_normal(shape) for name in _OFF}
    columns = {
        "drive.duration_cycles": np.broadcast_to(lengths[:, None, None], shape),
        "drive.velocity_amplitude": drives[:, None] * (1.0 + _OFF["velocity_amplitude"] * draws["velocity_amplitude"]),
        "drive.frequency_ratio": OMEGA * (1.0 + _OFF["frequency_ratio"] * draws["frequency_ratio"]),
        "contact.location": LOCATION + _OFF["location"] * draws["location"],
    }
    points = xr.Dataset({name: ("point", np.asarray(values).ravel()) for name, values in columns.items()})
    found, barriers, freq = [], [], []
    for share in _SHARES:
        model = _model(modes, share * fold)
        burst = sb.Burst(
            frequency_ratio=OMEGA,
            velocity_amplitude=0.1,
            duration_cycles=1.0,
            ramp_up_cycles=0.25,
            ramp_down_cycles=0.25,
            retraction=1.0,
        )
        system = sb.System(model, contacts=[sb.Contact(CONTACT, sb.Striker(drive=burst))])
        ds = sb.sweep(system, points, sb.Integration(cycles=results.pick(30, 40)))
        over = (ds.final_well.values > 0) & ds.final_well_proven.values
        open_ = ~ds.final_well_proven.values
        work = ds.striker_work.values
        found.append([each.reshape(shape) for each in (over, open_, work)])
        barriers.append(model.saddle_energy - float(model.potential_energy(model.wells[0])))
        freq.append(model.reference_frequency)
        results.progress("switch")(len(found), len(_SHARES))
    dims = ("bias", "length", "velocity_amplitude")
    over, undecided, work = (np.array([row[i] for row in found]) for i in range(3))
    ds = xr.Dataset(
        {
            "switched": (dims, over.sum(axis=-1), {"units": "1", "long_name": "runs that end in the upper well"}),
            "undecided": (dims, undecided.sum(axis=-1), {"units": "1", "long_name": "runs whose well is not final"}),
            "work": (dims, np.median(work, axis=-1), {"units": "J", "long_name": "median work of the striker"}),
            "barrier": ("bias", np.array(barriers), {"units": "J", "long_name": "barrier from the lower well"}),
            "reference_frequency": ("bias", np.array(freq), {"units": "Hz", "long_name": "omega_1/(2 pi)"}),
        },
        {"bias": list(_SHARES), "length": lengths, "velocity_amplitude": drives},
        {"modes": modes, "repeats": repeats, "fold_load": fold},
    )  # fmt: skip
    return {"bursts": ds}


def cheapest(ds: xr.Dataset, bias: float) -> tuple[float, float, float]:
    """Length, velocity and median work (J) of the cheapest burst that switched every run; NaN if none did."""
    row = ds.sel(bias=bias)
    work = np.where(row.switched.values == int(ds.attrs["repeats"]), row.work.values, np.nan)
    if np.isnan(work).all():
        return np.nan, np.nan, np.nan
    i, j = np.unravel_index(int(np.nanargmin(work)), work.shape)
    return float(ds.length[i]), float(ds.velocity_amplitude[j]), float(work[i, j])


def draw(results: Results) -> Figure:
    """The share that switches for each bias, the cheapest sure burst, and its work over the barrier."""
    from cmcrameri import cm

    ds = results["switch"]["bursts"]
    repeats, count = int(ds.attrs["repeats"]), ds.sizes["bias"]
    with figure_style():
        figure = new_figure("double", 58.0)
        axes = figure.subplots(1, count + 1, width_ratios=[1.0] * count + [1.25])
        rows = np.arange(ds.sizes["length"])
        for ax, bias in zip(axes, ds.bias.values, strict=False):
            share = ds.switched.sel(bias=bias).values / repeats
            mesh = ax.pcolormesh(
                ds.velocity_amplitude, rows, share, cmap=cm.batlow_r, vmin=0.0, vmax=1.0, shading="nearest",
                rasterized=True,
            )  # fmt: skip
            length, drive, _ = cheapest(ds, float(bias))
            if np.isfinite(length):
                at = int(np.argmin(np.abs(ds.length.values - length)))
                ax.plot([drive], [at], "*", color="white", markeredgecolor="black", markersize=7)
            ax.set_title(f"bias {100 * bias:.0f} %", loc="left", fontsize=7)
            ax.set_yticks(rows, [f"{each:g}" for each in ds.length.values] if ax is axes[0] else [""] * rows.size)
            ax.set_xlabel("Velocity $V$")
        axes[0].set_ylabel("Length of the burst (cycles)")
        figure.colorbar(mesh, ax=list(axes[:count]), label="Fraction that switches", pad=0.02)
        last = axes[count]
        found = [cheapest(ds, float(bias)) for bias in ds.bias.values]
        last.plot(
            ds.bias, 1e6 * np.array([each[2] for each in found]), "o-", color=SHAKER_COLOR, label="cheapest burst"
        )
        last.plot(ds.bias, 1e6 * ds.barrier, "s--", color=BEAM_COLOR, markersize=3, label="barrier")
        last.set(xlabel="Bias / fold", ylabel="Energy (µJ)")
        last.set_ylim(0.0)
        last.legend(fontsize=6)
        fix_ticks(last)
        panel_letters(axes)
    return figure
