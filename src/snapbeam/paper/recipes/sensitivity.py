"""Sensitivity of the map of 32 modes to unspecified parameters and to the numerics.

Variants of one map after 200 cycles: an excitation changed by 1e-9 (what chaos alone does), half the step,
the contact stiffness that common values of the stated materials give, damping applied to the buckling modes
instead of the linear modes about a well, twice the modes; and for one mode, beside the first two, the natural
frequency of 32 modes as omega_1.  The map and the changed excitation are also run for 1000 cycles.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

import snapbeam as sb
from snapbeam.model.default_values import CYCLES, DAMPING_RATIO, LONG_CYCLES
from snapbeam.paper.system import class_map, legend_handles, paper_model
from snapbeam.plot.map import plot_response_map
from snapbeam.plot.style import figure_legend, figure_style, new_figure, panel_letters

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from snapbeam.paper.recipe import Results

_Array = NDArray[np.float64]

VARIANTS = {
    "perturbed": "$V$ changed by $10^{-9}$",
    "half_step": "half the step",
    "soft_contact": "contact stiffness of common PLA",
    "buckling_damping": "damping of the buckling modes",
    "double_modes": "twice the modes",
}


def tip_contact(modulus: float = 3.5e9, radius: float = 2.5e-3) -> sb.HertzContact:
    """Contact of a sphere of polylactic acid, 5 mm in diameter and of a common modulus (Pa), with steel."""
    return sb.HertzContact.from_materials(radius, (modulus, 200e9), (0.36, 0.3))


def buckling_mode_damping(model: sb.ReducedModel, ratio: float = DAMPING_RATIO) -> tuple[_Array, _Array]:
    """Damping ratios of the linear modes if each buckling mode, by itself, has the damping *ratio*.

    The damping matrix is then diagonal in the buckling modes, C_ii = 2 ratio sqrt(K_ii m_ii), with K about a
    well. Returned are its diagonal in the linear modes over 2 omega, which is what the engine can take, and
    the ratios of the exact eigenvalues with the whole of C, both by ascending frequency.
    """
    tangent = model.stiffness + model.nonlinear_stiffness * float(model.well_amplitude @ model.well_amplitude)
    tangent[0] += 2.0 * model.nonlinear_stiffness * float(model.well_amplitude @ model.well_amplitude)
    own = 2.0 * ratio * np.sqrt(tangent * np.diag(model.mass))
    whole = model.linear_modes.T @ (own[:, None] * model.linear_modes)
    projected = np.diag(whole) / (2.0 * model.omega)
    n = model.modes
    flow = np.block([[np.zeros((n, n)), np.eye(n)], [-np.diag(model.omega**2), -whole]])
    roots = np.linalg.eigvals(flow)
    roots = roots[roots.imag > 0.0]
    roots = roots[np.argsort(np.abs(roots))]
    return projected, -roots.real / np.abs(roots)


def compute(results: Results) -> dict[str, xr.Dataset]:
    """Every variant on one grid, and the two of one mode."""
    modes = results.pick(4, 32)
    ratio = results.pick(np.linspace(0.4, 4.0, 10), np.linspace(0.15, 4.0, 56))
    amplitude = results.pick(np.linspace(0.06, 0.65, 8), np.linspace(0.65 / 36, 0.65, 36))
    cycles = results.pick(30, CYCLES)
    model = paper_model(modes)
    grid = {"frequency_ratio": ratio, "velocity_amplitude": amplitude, "cycles": cycles}

    def run(what: str, of: sb.ReducedModel, **more: object) -> xr.Dataset:
        return class_map(results, f"sensitivity, {what}", of, **(grid | more))

    found = {}
    nudged = {"velocity_amplitude": amplitude * (1.0 + 1e-9)}
    long = {"cycles": results.pick(90, LONG_CYCLES)}
    for name, of in (("base", model), ("one_mode", paper_model(1))):
        first = run(name, of)
        start = "" if name == "base" else f"{name}_"
        found[name] = first
        found[f"{start}perturbed"] = run(f"{name}, perturbed", of, **nudged)
        found[f"{start}half_step"] = run(f"{name}, half step", of, step=0.5 * float(first.attrs["step"]))
        found[f"{start}long"] = run(f"{name}, long", of, **long)
        found[f"{start}perturbed_long"] = run(f"{name}, perturbed, long", of, **nudged, **long)
    projected, _ = buckling_mode_damping(model)
    found["soft_contact"] = run("soft contact", model, contact=tip_contact())
    found["buckling_damping"] = run("buckling damping", paper_model(modes, projected))
    # Omega and V of the map stay those of the model it is compared with
    found["double_modes"] = run(
        "twice the modes", paper_model(2 * modes), reference_frequency=model.reference_frequency
    )
    found["one_mode_reference"] = run(
        "one mode, other omega_1", paper_model(1), reference_frequency=model.reference_frequency
    )
    return found


def draw(results: Results) -> Figure:
    """The map, and the points of another class in each variant."""
    data = results["sensitivity"]
    base = data["base"]
    shown = [(name, "base", words) for name, words in VARIANTS.items()]
    shown.append(("one_mode_reference", "one_mode", r"$N$ = 1, $\omega_1$ of the full model"))
    shown.append(("one_mode_perturbed", "one_mode", "$N$ = 1, $V$ changed by $10^{-9}$"))
    with figure_style():
        figure = new_figure("double", 235.0)
        axes = figure.subplots(4, 2, sharex=True, sharey=True)
        plot_response_map(base, axes[0, 0], legend=False)
        drawn = [axes[0, 0]]
        for ax, (name, first, words) in zip(axes.ravel()[1:], shown, strict=True):
            if name not in data:  # stored by an older recipe
                ax.set_axis_off()
                continue
            before = data[first]
            after = data[name].assign_coords(velocity_amplitude=before.velocity_amplitude)
            changed = after.response_class.values != before.response_class.values
            plot_response_map(after.assign(response_class=after.response_class.where(changed)), ax, legend=False)
            ax.set_title(f"{words}: {100.0 * changed.mean():.1f} % changed", loc="center")
            drawn.append(ax)
        for ax in axes[:, 1]:
            ax.set_ylabel("")
        for ax in axes[:-1].ravel():
            ax.set_xlabel("")
        panel_letters(drawn)
        figure_legend(figure, legend_handles(base.response_class.values))
    return figure
