"""A slow pusher with one tip or two: how high it is when the beam snaps.

One slow tip has to cross the line between the clamps before the beam snaps; a pusher with two tips need not (Meulblok,
Bense, Caelen and van Hecke, Extreme Mechanics Letters 80, 102407, 2025).  Rigid tips at one height r press a beam of
buckling modes: the minimum of U = sum K_i alpha_i^2/2 + gamma (alpha . alpha)^2/4 under phi(x_j) . alpha >= r is
followed as the tips rise, until there is none near by.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

import snapbeam as sb
from snapbeam.model.default_values import BEAM
from snapbeam.paper.system import shapes_along
from snapbeam.plot.style import BEAM_COLOR, SHAKER_COLOR, figure_style, fix_ticks, new_figure, panel_letters

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from snapbeam.paper.recipe import Results

_Array = NDArray[np.float64]

LEVEL = 3.0
"""Buckling level over the thickness of the beam whose pairs are all tried; the paper's has 0.8375."""
_STEP, _FINE = 0.01, 1e-4
_ALONE = (0.453, 0.487, 0.5)
_LEFT, _RIGHT = np.linspace(0.213, 0.463, 6), (0.503, 0.513, 0.533, 0.573)
"""Places over the length that are tried at every buckling level: of a single tip, and of both of a pair."""
_FIRM, _STEPS, _STRIDE = 2e5, 5000, 0.03
"""Stiffness of a creeping beam's tips over the beam's maximum; its steps at most, and how long one is over b."""


@dataclass(frozen=True)
class Pushed:
    """Result of a beam under tips that rise together."""

    height: float
    """Height of the tips over b at the snap; NaN if the beam reaches its upper equilibrium in contact."""
    tips: int
    """Number of tips in contact just before the snap; fewer than all if the beam had left the others."""
    amplitude: _Array
    """Modal amplitudes just before, over b."""
    path: _Array
    """Heights over b, and the force of each tip over E I b/L^3, shape (points, 1 + tips)."""


@dataclass(frozen=True)
class _Press:
    """The beam in amplitudes over b, energies over E I b^2/L^3."""

    stiffness: _Array
    tension: float
    rows: _Array
    """Displacement at each tip over b."""

    def gradient(self, a: _Array) -> _Array:
        return np.asarray((self.stiffness + self.tension * float(a @ a)) * a)

    def tangent(self, a: _Array) -> _Array:
        own = np.diag(self.stiffness + self.tension * float(a @ a))
        return np.asarray(own + 2.0 * self.tension * np.outer(a, a))

    def held(self, a: _Array, heights: _Array, active: list[int]) -> tuple[_Array, _Array]:
        """The equilibrium near by with the active tips touching, and their forces; Newton's method."""
        rows, n = self.rows[active], a.size
        force = np.zeros(len(active))
        for _ in range(40):
            residual = np.concatenate((self.gradient(a) - rows.T @ force, rows @ a - heights[active]))
            matrix = np.block([[self.tangent(a), -rows.T], [rows, np.zeros((len(active),) * 2)]])
            change = np.linalg.solve(matrix, -residual)
            a, force = a + change[:n], force + change[n:]
            if np.abs(change[:n]).max() < 1e-13:
                break
        return a, force

    def lowest(self, a: _Array, active: list[int]) -> tuple[float, _Array]:
        """Minimum curvature of the energy along what the active tips leave free, and where it is."""
        free = scipy.linalg.null_space(self.rows[active])
        values, vectors = scipy.linalg.eigh(free.T @ self.tangent(a) @ free)
        return float(values[0]), free @ vectors[:, 0]

    def settled(self, a: _Array, heights: _Array) -> _Array:
        """Equilibrium that the beam approaches from a state, against nearly rigid tips that can only push.

        Implicit Euler's steps down the gradient of the energy, so short that they leave a saddle as the flow does.
        """
        firm, own = _FIRM * float(np.abs(self.stiffness).max()), np.eye(a.size)
        step = 0.01 / float(np.abs(self.stiffness).max())
        for _ in range(_STEPS):
            touching = (self.rows @ a < heights)[:, None] * self.rows
            least = float(scipy.linalg.eigvalsh(self.tangent(a) + firm * touching.T @ touching)[0])
            step = min(2.0 * step, 0.5 / max(-least, 1e-12))
            while True:
                new = a.copy()
                for _ in range(20):
                    touching = (self.rows @ new < heights)[:, None] * self.rows
                    pressed = firm * touching.T @ np.maximum(heights - self.rows @ new, 0.0)
                    residual = (new - a) / step + self.gradient(new) - pressed
                    change = np.linalg.solve(own / step + self.tangent(new) + firm * touching.T @ touching, -residual)
                    new = new + change
                    if np.abs(change).max() < 1e-11:
                        break
                if np.abs(change).max() < 1e-11 and np.abs(new - a).max() < _STRIDE:
                    break
                step *= 0.5
            a, moved = new, float(np.abs(new - a).max())
            if least > 0.0 and moved < 1e-10:
                break
        return a


def push(model: sb.ReducedModel, places: _Array, step: float = _STEP) -> Pushed:
    """Raise rigid tips, all to one height, from below until the beam snaps.

    Parameters
    ----------
    model : ReducedModel
        A buckled beam with equal wells.
    places : array_like
        Where the tips are, over the length.
    step : float
        Of the height, over b; the snap itself is found within 1e-4.
    """
    assert model.beam is not None
    beam, level = model.beam, _size(model)
    unit = beam.bending_stiffness / beam.length**3
    rows = np.atleast_2d([model.shape_at(float(x)) for x in np.atleast_1d(places)])
    press = _Press(model.stiffness / unit, model.nonlinear_stiffness * level**2 / unit, rows)
    a, active = model.well_amplitude / level, [int(np.argmin(rows @ model.well_amplitude))]
    at, highest = (float((rows @ a).min()), float((rows @ -a).max()))  # above its upper shape it cannot leave them
    path: list[list[float]] = []
    while at < highest:
        height = at + step
        new, now, force = _follow(press, a, np.full(len(rows), height), active)
        if new is None:
            if step > _FINE:
                step *= 0.1
                continue
            return Pushed(height, len(active), a, np.array(path))
        a, active, at = new, now, height
        forces = np.zeros(len(rows))
        forces[active] = force
        path.append([at, *forces])
    return Pushed(np.nan, len(active), a, np.array(path))


def _follow(press: _Press, a: _Array, heights: _Array, active: list[int]) -> tuple[_Array | None, list[int], _Array]:
    """The pressed state at the next height, with the tips that touch; none once the beam has left them all.

    Newton's method with the tips that touch, as long as that state is a minimum; then the beam creeps on, and may come
    to rest on fewer tips.
    """
    tried, nudge = a, 1e-6 * np.cos(np.arange(a.size))  # to neither side by itself
    for _ in range(12):
        new, force = press.held(tried, heights, active)
        if not np.abs(new - a).max() < 0.3:
            break
        lifted = [tip for tip, f in zip(active, force, strict=True) if f < 0.0]
        below = [tip for tip in range(len(heights)) if press.rows[tip] @ new < heights[tip] - 1e-12]
        changed = sorted({*active, *below} - set(lifted))
        if changed == active:
            least, direction = press.lowest(new, active)
            if least > 0.0:
                return new, active, force
            nudge = 1e-3 * direction
            break
        if not changed:
            break
        active, tried = changed, new
    for _ in range(4):
        end = press.settled(a + nudge, heights)
        active = [tip for tip in range(len(heights)) if press.rows[tip] @ end < heights[tip]]
        if not active:
            break
        new, force = press.held(end, heights, active)
        if np.abs(new - end).max() < 0.05 and (force > 0.0).all():
            least, direction = press.lowest(new, active)
            if least > 0.0:
                return new, active, force
            a, nudge = new, 3e-2 * direction
        else:
            a, nudge = end, 1e-3 * np.cos(np.arange(a.size))
    return None, active, np.zeros(0)


def compute(results: Results) -> dict[str, xr.Dataset]:
    """Height at the snap of every pair of tips of one beam, and of the best tip and pair over the buckling level."""
    from snapbeam.util.datasets import xr

    modes, step = results.pick(5, 8), 2.0 * _STEP
    # none at the centre and none symmetric about it: there chance decides to which side the beam gives way
    first = np.linspace(0.093, 0.913, results.pick(5, 21))
    model = beam_of(LEVEL, modes)
    height, tips = (np.full((first.size, first.size), np.nan), np.zeros((first.size, first.size), dtype=np.int8))
    shapes, places, lowest = [model.well_amplitude / _size(model)], [np.nan, np.nan], np.inf
    for i, j in itertools.combinations(range(first.size), 2):
        found = push(model, first[[i, j]], step)
        height[i, j], tips[i, j] = found.height, found.tips
        if found.height < lowest:
            lowest, shapes, places = found.height, [found.amplitude], [first[i], first[j]]
        results.progress("two_tips")(i + 1, first.size)
    levels = results.pick(np.array([0.8375, 3.0]), np.array([0.8375, 1.1, 1.3, 1.6, 2.0, 2.5, 3.0]))
    left, right = results.pick((_LEFT[::3], _RIGHT[::3]), (_LEFT, _RIGHT))
    best: list[list[float]] = []
    for level in levels:
        own = beam_of(float(level), modes)
        alone = [push(own, np.array([x]), step).height for x in _ALONE]
        pairs = [push(own, np.array([x, y]), step).height for x in left for y in right]
        best.append([min(alone), min(pairs)])
    shapes.insert(0, push(model, np.array(places[:1]), step).amplitude)
    units = {"units": "1", "long_name": "height of the tips over b at the snap"}
    ds = xr.Dataset(
        {
            "height": (("first_tip", "second_tip"), height, units | {"comment": "NaN: not left up to the upper well"}),
            "tips": (("first_tip", "second_tip"), tips, {"units": "1", "long_name": "tips that it left last"}),
            "best": (("level", "pusher"), np.array(best), units),
            "shape": (("pusher", "mode"), np.array(shapes), {"units": "1", "long_name": "amplitudes over b"}),
            "place": ("tip", np.array([places[0], *places]), {"units": "1", "long_name": "places of the tips"}),
        },
        {"first_tip": first, "second_tip": first, "level": levels, "pusher": ["one tip", "two tips"]},
        {"modes": modes, "buckling_level": LEVEL},
    )
    return {"snaps": ds}


def draw(results: Results) -> Figure:
    """Two beams about to snap; the height of the tips then over the places of both, and over the buckling level."""
    from cmcrameri import cm

    ds = results["two_tips"]["snaps"]
    model = beam_of(float(ds.attrs["buckling_level"]), int(ds.attrs["modes"]))
    x, shapes = shapes_along(model)
    with figure_style():
        figure = new_figure("double", 60.0)
        axes = figure.subplots(1, 3)
        rest = shapes @ model.well_amplitude / _size(model)
        axes[0].plot(x, rest, color="0.6", dashes=(4, 2), label="at rest")
        axes[0].axhline(0.0, color="0.4", linewidth=0.6, dashes=(1, 2))
        tips, colors = ds.place.values, (SHAKER_COLOR, BEAM_COLOR)
        for row, (at, color) in enumerate(zip((tips[:1], tips[1:]), colors, strict=True)):
            own = shapes @ ds["shape"].values[row]
            axes[0].plot(x, own, color=color, label=str(ds.pusher.values[row]))
            # both of a pusher at one height, that of the one that still presses
            height = np.full(at.size, np.interp(at, x, own).min())
            axes[0].plot(at, height - 0.07, "^", color=color, markersize=4)
        axes[0].set(xlabel="$x/L$", ylabel="$w/b$", xlim=(0.0, 1.0), ylim=(-1.2, 1.7))
        axes[0].legend(loc="upper left", fontsize=6)
        limit = float(np.nanmax(np.abs(ds.height.values), initial=0.1))
        axes[1].set_facecolor("0.88")
        mesh = axes[1].pcolormesh(
            ds.first_tip, ds.second_tip, ds.height.values.T, cmap=cm.vik, vmin=-limit, vmax=limit,
            shading="nearest", rasterized=True,
        )  # fmt: skip
        two_steps = np.argwhere((ds.tips.values == 1) & (ds.height.values < 0.0))
        axes[1].plot(*ds.first_tip.values[two_steps.T], ".", color="black", markersize=1.2)
        axes[1].plot(*tips[1:], "o", color="black", markersize=4, markerfacecolor="white")
        axes[1].set(xlabel="Left tip $x_1/L$", ylabel="Right tip $x_2/L$", aspect="equal")
        figure.colorbar(mesh, ax=axes[1], shrink=0.85)
        axes[1].set_title("Height at the snap $/b$")
        for which, color, marker in ((0, SHAKER_COLOR, "s"), (1, BEAM_COLOR, "o")):
            label = f"best of {('one tip', 'two tips')[which]}"
            axes[2].plot(ds.level, ds.best[:, which], color=color, marker=marker, markersize=2.5, label=label)
        axes[2].axvline(second_level(), color="0.4", linewidth=0.6, dashes=(1, 2))
        axes[2].set(xlabel="Buckling level $b/h$", ylabel="Least height at the snap $/b$")
        axes[2].legend(fontsize=6, loc="lower left")
        fix_ticks(*axes)
        panel_letters(axes)
    return figure


def second_level() -> float:
    """Buckling level over the thickness beyond which the load is above the second critical one."""
    excess = BEAM.second_critical_load - BEAM.critical_load
    stretch = np.pi**2 * BEAM.young_modulus * BEAM.thickness * BEAM.width / (4.0 * BEAM.length**2)
    return float(np.sqrt(excess / stretch) / BEAM.thickness)


def beam_of(level: float, modes: int) -> sb.ReducedModel:
    """The paper's beam at another buckling level, over its thickness."""
    return sb.ReducedModel.from_beam(BEAM.replace(buckling_level=level * BEAM.thickness), modes=modes)


def _size(model: sb.ReducedModel) -> float:
    """The buckling level b, m."""
    assert model.length_scale is not None
    return model.length_scale
