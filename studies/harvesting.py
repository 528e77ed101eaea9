"""Power of a harvester by impact over the plane of Fig. 6, and how much of it comes at high frequencies.

Piezoelectric layers next to a clamp of the paper's beam, struck by the shaker: mean power in the load over the
second half of a run, and the share of it above five times the first natural frequency, from the voltage's spectrum.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

import snapbeam as sb
from snapbeam.model.default_values import BEAM, CONTACT
from snapbeam.plot.style import figure_style, fix_ticks, new_figure, panel_letters
from snapbeam.util.status_codes import ResponseClass

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from snapbeam.paper.recipe import Results

_Array = NDArray[np.float64]

PIEZO = sb.PiezoelectricHarvester.from_material(
    stress_constant=-16.6,
    permittivity=25.55e-9,
    layer_thickness=0.1e-3,
    layer_width=BEAM.width,
    beam=BEAM,
    resistance=1e4,
    patch_start=0.0,
    patch_end=0.25,
)
"""Two layers of PZT-5H: the effective e_31 (C/m^2) and the permittivity at constant strain (F/m)."""
SPLIT = 5.0
"""Over the first natural frequency: what is above is up-converted."""
_RATE = 400.0
"""Samples per period of the first mode; the highest of eight modes is at 34 of its frequencies."""


def power_above(voltage: _Array, rate: float, resistance: float, freq: float) -> tuple[float, float]:
    """Mean power in a resistance (W), and the share of it above a frequency, by Parseval's sum under a Hann window."""
    window = np.hanning(voltage.size)
    lines = np.abs(np.fft.rfft(voltage * window)) ** 2
    lines[1:-1] *= 2.0
    above = np.fft.rfftfreq(voltage.size, 1.0 / rate) > freq
    total = float(lines.sum())
    return float(np.mean(voltage**2) / resistance), float(lines[above].sum()) / total if total > 0.0 else 0.0


def compute(results: Results) -> dict[str, xr.Dataset]:
    """Power, share and class over frequency and velocity."""
    from snapbeam.util.datasets import xr

    modes, cycles = results.pick(2, 8), results.pick(8, 40)
    ratio = np.round(np.linspace(0.4, 3.6, results.pick(3, 14)), 6)
    drives = np.round(np.linspace(0.05, 0.6, results.pick(3, 10)), 6)
    model = sb.ReducedModel.from_beam(BEAM, modes=modes)
    rate, freq = _RATE * model.reference_frequency, model.reference_frequency
    found = np.zeros((ratio.size, drives.size, 4))
    for i, omega in enumerate(ratio):
        for j, velocity in enumerate(drives):
            drive = sb.Sine(frequency_ratio=float(omega), velocity_amplitude=float(velocity))
            system = sb.System(model, contacts=[sb.Contact(CONTACT, sb.Striker(drive=drive))], harvesters=[PIEZO])
            end = cycles / (omega * freq)
            times = np.arange(0.5 * end, end * (1.0 - 1e-9), 1.0 / rate)
            run = sb.simulate(system, sb.Integration(cycles=cycles), sample_times=times)
            power, share = power_above(run.dataset.voltage.values, rate, PIEZO.resistance, SPLIT * freq)
            found[i, j] = power, share, int(run.summary.response_class), run.summary.harvested_power
        results.progress("harvesting")(i + 1, ratio.size)
    dims = ("frequency_ratio", "velocity_amplitude")
    ds = xr.Dataset(
        {
            "power": (dims, found[..., 0], {"units": "W", "long_name": "mean power in the load, second half"}),
            "share_above": (dims, found[..., 1], {"units": "1", "long_name": "fraction of it above 5 omega_1"}),
            "kind": (dims, found[..., 2].astype(np.int8), {"units": "1", "long_name": "response class"}),
            "whole_power": (dims, found[..., 3], {"units": "W", "long_name": "mean power of the whole run"}),
        },
        {"frequency_ratio": ratio, "velocity_amplitude": drives},
        {"modes": modes, "cycles": cycles, "reference_frequency": freq},
    )  # fmt: skip
    return {"power": ds}


def draw(results: Results) -> Figure:
    """Power and share over the plane, and one against the other by class."""
    from cmcrameri import cm
    from matplotlib.colors import LogNorm

    from snapbeam.plot.style import CLASS_COLORS

    ds = results["harvesting"]["power"]
    power, share = 1e6 * ds.power.values, 100.0 * ds.share_above.values
    with figure_style():
        figure = new_figure("double", 68.0)
        axes = figure.subplots(1, 3)
        norm = LogNorm(max(float(power.max()) * 1e-4, 1e-12), float(power.max()))
        for ax, values, how, words in (
            (axes[0], power, {"cmap": cm.lajolla_r, "norm": norm}, "Power (µW)"),
            (axes[1], share, {"cmap": cm.davos_r, "vmin": 0.0}, r"Fraction above $5\,\omega_1$ (%)"),
        ):
            mesh = ax.pcolormesh(
                ds.frequency_ratio, ds.velocity_amplitude, values.T, shading="nearest", rasterized=True, **how
            )
            figure.colorbar(mesh, ax=ax)
            ax.set(title=words, xlabel=r"Excitation frequency $\Omega$", ylabel="Velocity amplitude $V$")
        for kind in np.unique(ds.kind.values):
            own = ds.kind.values == kind
            response = ResponseClass(int(kind))
            axes[2].plot(
                power[own], share[own], "o", markersize=2.5, markeredgecolor="0.3", markeredgewidth=0.3,
                color=CLASS_COLORS[response], label=response.label,
            )  # fmt: skip
        axes[2].set(xscale="log", xlabel="Power (µW)", ylabel=r"Fraction above $5\,\omega_1$ (%)")
        axes[2].set_ylim(0.0)
        handles, labels = axes[2].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=len(labels))
        fix_ticks(*axes)
        panel_letters(axes)
    return figure
