"""The paper by name: its beam and runs, each of its figures as a recipe, and each of its claims measured.

A recipe computes its data by the public interface alone and draws them:

>>> from snapbeam import paper
>>> system = paper.struck_beam(frequency_ratio=1.2, velocity_amplitude=0.18)
>>> figure = paper.fig2()  # doctest: +SKIP
>>> paper.fig6.write("out", size="quick")  # doctest: +SKIP

``size="quick"`` is a sketch for tests (small grids, few modes, few cycles), ``"full"`` what the documentation
shows. :func:`snapbeam.paper.claims.measure_claims` measures the statements of the paper.
"""

from __future__ import annotations

from snapbeam.model.default_values import (
    BEAM,
    CONTACT,
    CYCLES,
    DAMPING_RATIO,
    LOCATION,
    LONG_CYCLES,
    MODES,
    STRAIGHT_BEAM,
)
from snapbeam.paper.recipe import Recipe, Results, shared_results
from snapbeam.paper.system import struck_beam

__all__ = [
    "BEAM", "CONTACT", "CYCLES", "DAMPING_RATIO", "FIGURES", "LOCATION", "LONG_CYCLES", "MODES", "STRAIGHT_BEAM",
    "Recipe", "Results", "disturbances", "fig2", "fig3", "fig4", "fig5", "fig6", "fig7", "fig8", "figA9", "figB10",
    "low_frequency", "resonance", "sensitivity", "shared_results", "si5", "struck_beam", "transients", "waveforms",
    "windows",
]  # fmt: skip


fig2 = Recipe("fig2", "the beam and the shaker, with their symbols")
fig3 = Recipe("fig3", "a waveform, a shallow penetration closer, and the contact force")
fig4 = Recipe("fig4", "three kinds of waveform, measured and simulated")
fig5 = Recipe("fig5", "a snap-through: waveform, shapes of the beam, modal amplitudes")
fig6 = Recipe("fig6", "response over frequency and amplitude after 200 cycles, 1 and 32 modes")
fig7 = Recipe("fig7", "response over frequency and amplitude after 1000 cycles, 1 and 32 modes")
fig8 = Recipe("fig8", "response over location and amplitude, 1 and 32 modes")
figA9 = Recipe("figA9", "error of the natural frequencies over the number of modes")
figB10 = Recipe("figB10", "maximum displacement over frequency at two drives, 1 and 32 modes")
si5 = Recipe("si5", "response over location and amplitude as modes are added (animation)")

low_frequency = Recipe("low_frequency", "threshold over the quasi-static one at low frequency")
resonance = Recipe("resonance", "the resonance of the intrawell response and the notch of fig6")
waveforms = Recipe("waveforms", "snap-throughs, impacts and modes of runs at random points of fig6")
transients = Recipe("transients", "what still changes after the cycles of fig7")
windows = Recipe("windows", "amplitudes of transient responses near a clamp and near the centre")
disturbances = Recipe("disturbances", "start-up transients, starts off the well, impacts without higher modes")
sensitivity = Recipe("sensitivity", "how the map changes with what the paper leaves open")

FIGURES: dict[str, Recipe] = {
    recipe.name: recipe
    for recipe in (
        fig2, fig3, fig4, fig5, fig6, fig7, fig8, figA9, figB10, si5,
        low_frequency, resonance, waveforms, transients, windows, disturbances, sensitivity,
    )
}  # fmt: skip
"""Every recipe by name: the figures of the paper, its fifth video, and further runs of its claims."""
