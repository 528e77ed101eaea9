"""The schematic of a system, drawn from the system itself: beam, wells, striker, suspension, contact and drive."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon, Rectangle
from numpy.typing import NDArray

from snapbeam.model.contact.base import ContactLaw
from snapbeam.model.drive.base import Drive
from snapbeam.model.drive.constant_velocity import ConstantVelocity
from snapbeam.model.drive.fixed_stop import FixedStop
from snapbeam.model.harvester import ElectromagneticHarvester, PiezoelectricHarvester, PiezoelectricPatches
from snapbeam.model.imperfection import Imperfection
from snapbeam.model.quantity import numbered
from snapbeam.model.striker import Striker
from snapbeam.model.system import System
from snapbeam.plot.style import BEAM_COLOR, CENTER_COLOR, SERIES_COLORS, SHAKER_COLOR, figure_style, new_figure
from snapbeam.solver.excitation import motion_of
from snapbeam.util.si_prefixes import prefixed
from snapbeam.util.validation import InputError, checked, instance

# ----------------------------------------------------------------------------------------------------
# The motions of tips in the schematic of a system: one, or those of several strikers in one pair of axes.


_LINES: tuple[dict[str, Any], ...] = (
    {"color": SHAKER_COLOR}, {"color": CENTER_COLOR, "linestyle": "--"}, {"color": "0.3", "linestyle": ":"},
    {"color": "0.6"},
)  # fmt: skip


def draw_tips(ax: Axes, system: System, tips: list[tuple[int, Any]]) -> None:
    """Displacements of tips from their mid-positions over the first cycles of the first one, each towards the beam."""
    scale = system.scale
    lead = tips[0][1]
    times = np.linspace(0.0, _CYCLES * float(lead.cycle(lead.columns(), scale)[0]), 1601)
    for (number, drive), line in zip(tips, _LINES, strict=False):
        moved = _moved(drive, system, times)
        ax.plot(times / times[-1] * _CYCLES, moved / scale.length, label=f"striker {number}", **line)
    ax.set_xlabel("Cycles of the drive")
    ax.set_ylabel(_MOTIONS["drive"][1])
    ax.set_xlim(0.0, _CYCLES)
    ax.legend(ncols=2, loc="lower center", bbox_to_anchor=(0.45, 1.0), frameon=False, columnspacing=1.0)


def _moved(drive: Drive, system: System, times: _Array) -> _Array:
    """Displacement of a tip from its mid-position at instants, m, or the change of a load, N; after a record its end."""
    if drive.recorded:
        times = np.minimum(times, drive.duration)  # type: ignore[attr-defined]
    return motion_of(drive, system.scale, float(times[-1]))(times)[0]


# ----------------------------------------------------------------------------------------------------
# What surrounds a beam, in the schematic of a system: its base, a load that changes, layers, a coil and their load.


FRAME = 2.3
"""Distance of the base's bar from the straight beam, b."""
_LAYER = 0.09
"""Thickness of a layer in the picture, b."""
_COLOR = SERIES_COLORS[0]


def draw_surroundings(ax: Axes, system: System, x: _Array, w: _Array, sign: float, wide: float) -> None:
    """Draw what surrounds the beam; *x* and *w* are its shape at rest, *sign* the striker's side."""
    if system.base_excitation is not None:
        _base(ax, system, sign, wide)
    if isinstance(system.harvester, PiezoelectricHarvester | PiezoelectricPatches):
        _layers(ax, system.harvester, x, w, sign, wide)
    if isinstance(system.harvester, ElectromagneticHarvester):
        _coil(ax, system.harvester, x, w, sign, wide)


def _base(ax: Axes, system: System, sign: float, wide: float) -> None:
    """A frame under the clamps, and the arrow of its motion."""
    assert system.base_excitation is not None
    foot = -sign * FRAME
    bar: Any = {"facecolor": "0.88", "edgecolor": BEAM_COLOR, "linewidth": 0.6}
    for left in (-0.3, wide + 0.06):
        ax.add_patch(Rectangle((left, min(foot, -0.35 * sign)), 0.24, FRAME - 0.35, zorder=0, **bar))
    ax.add_patch(Rectangle((-0.3, min(foot, foot - 0.16 * sign)), wide + 0.6, 0.16, zorder=0, **bar))
    up = 1.0 if system.base_excitation.direction == "up" else -1.0
    arrow: Any = {"arrowstyle": "-|>", "lw": 1.0, "color": _COLOR}
    middle = -sign * (FRAME - 0.75)
    ax.annotate("", (0.62, middle + 0.4 * up), (0.62, middle - 0.4 * up), arrowprops=arrow)
    ax.text(0.76, middle, "$y(t)$", ha="left", va="center", color=_COLOR)
    if system.striker is not None and not system.base_excitation.striker_on_base:
        at = system.striker.location * wide
        ax.text(at + 0.75, -sign * 2.05, "not on the base", ha="left", va="center", color=_COLOR)


def _layers(
    ax: Axes, piezo: PiezoelectricHarvester | PiezoelectricPatches, x: _Array, w: _Array, sign: float, wide: float
) -> None:
    """Both layers of each patch along the beam, and wires of the first to a resistor on the other side than the striker."""
    for away, (first, last) in itertools.product((1.0, -1.0), piezo.ends):
        inside = (x >= first * wide) & (x <= last * wide)
        outline = np.concatenate((
            np.stack((x[inside], w[inside] + 0.03 * away), axis=1),
            np.stack((x[inside], w[inside] + (0.03 + _LAYER) * away), axis=1)[::-1],
        ))  # fmt: skip
        ax.add_patch(Polygon(outline, closed=True, facecolor=_COLOR, alpha=0.75, edgecolor="none", zorder=4))
    at = 0.5 * float(piezo.ends[0].sum()) * wide
    there = float(np.interp(at, x, w))
    _resistor(ax, at, there + sign * (0.03 + _LAYER), sign, prefixed(piezo.resistance, r"$\Omega$"))


def _coil(ax: Axes, coil: ElectromagneticHarvester, x: _Array, w: _Array, sign: float, wide: float) -> None:
    """Draw a magnet on the beam and the coil next to it."""
    at = coil.location * wide
    there = float(np.interp(at, x, w))
    edge = there + 0.03 * sign
    corner = (at - 0.09, min(edge, edge + 0.34 * sign))
    ax.add_patch(Rectangle(corner, 0.18, 0.34, facecolor="0.55", edgecolor=BEAM_COLOR, linewidth=0.5, zorder=4))
    for side in (-1.0, 1.0):
        for turn in range(4):
            y = there + sign * (0.22 + 0.1 * turn)
            ax.plot(at + side * 0.19, y, marker="o", markersize=2.2, color=_COLOR, zorder=4)
    _resistor(ax, at, there + sign * 0.6, sign, prefixed(coil.resistance, r"$\Omega$"), apart=0.19)


def _resistor(ax: Axes, at: float, edge: float, sign: float, words: str, apart: float = 0.14) -> None:
    top = sign * 0.85
    share = np.linspace(0.0, 1.0, 9)
    swing = np.array([0.0, 0.0, 1.0, -1.0, 1.0, -1.0, 1.0, 0.0, 0.0])
    for side in (-1.0, 1.0):
        wire = [at + side * apart, at + side * apart, at + side * 0.32, at + side * 0.32]
        ax.plot(wire, [edge, top, top, top + 0.28 * sign], color=_COLOR, linewidth=0.7)
    ax.plot(at - 0.32 + 0.64 * share, top + 0.28 * sign + 0.06 * swing, color=_COLOR, linewidth=0.9)
    # over the resistor, clear of the shape of the other well
    ax.text(at, top + 0.58 * sign, words, ha="center", va="center", color=_COLOR)


# ----------------------------------------------------------------------------------------------------


_Array = NDArray[np.float64]
_POINTS = 201
_RADIUS = 0.10
"""Radius of the tip, in units of the picture: b upwards, L/7 sideways."""
_WIDE = 7.0
"""Length of the beam in those units."""
_MOTIONS = {
    "drive": ("Drive", "Tip displacement $/\\,b$"),
    "base_excitation": ("Base", "Base displacement $y/b$"),
    "axial_load": ("Axial load", "Change $P(t) - P$ (N)"),
    "force": ("Force", "Force $F(t)$ (N)"),
}
"""Title of the motion in the schematic, and label of its axis."""
LAWS = {
    "elastic_plastic": "elastic-plastic",
    "hertz": "Hertz",
    "hunt_crossley": "Hunt–Crossley",
    "kelvin_voigt": "Kelvin–Voigt",
    "layer": "Hertz, layer",
    "power": "power law",
    "restitution": "restitution",
}
_CYCLES = 8.0
_LOAD_COLOR = _COLOR


@checked
def plot_system(system: System, title: str = "") -> Figure:
    """Draw a system: the beam in its initial well and, dashed, in the other, the strikers and the drive.

    Heights are to the scale of the buckling level, and so is the gap; lengths along the beam are to the scale of its
    length.  Masses, springs and dampers are signs.

    Parameters
    ----------
    system : System
        Of a beam; a structure given by matrices has no shape to draw.
    title : str

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> system = paper.struck_beam(frequency_ratio=1.2, velocity_amplitude=0.18)
    >>> figure = sb.plot.plot_system(system, title="Beam of the paper")
    """
    instance("system", system, System, "a System")
    instance("title", title, str, "text")
    if system.model.beam is None:
        raise InputError("system: a structure given by matrices has no shape; give a model made from a beam")
    figure = new_figure("double", 52.0)
    with figure_style():
        striker = system.striker
        widths = [2.6, 1.0] if striker is not None or system.primary_excitation is not None else [1.0]
        # each part is laid out alone, so that the labels of the motion leave the beam its height
        axes = [part.subplots() for part in figure.subfigures(1, len(widths), squeeze=False, width_ratios=widths)[0]]
        _draw_beam(axes[0], system)
        for number, each in enumerate(system.contacts, 1 if system.contacts[1:] else 0):
            _draw_striker(axes[0], system, each.striker, each.law, number)
        tips = [(numbered(name)[1], drive) for name, drive in system.moving if numbered(name)[0] == "drive"]
        if len(tips) > 1:
            draw_tips(axes[1], system, tips)
        elif system.primary_excitation is not None:
            _draw_drive(axes[1], system, *system.primary_excitation)
        if title:
            axes[0].set_title(title, loc="left")
        both = len({each.striker.side for each in system.contacts}) > 1
        outward, inward = (2.0, 1.7) if both else (2.55, 1.25)
        axes[0].set_xlim(-0.85, _WIDE + 0.85)
        axes[0].set_ylim(*((-outward, inward) if _sign(striker) > 0.0 else (-inward, outward)))
        axes[0].set_aspect("equal")
        axes[0].set_axis_off()
    return figure


def _shape(system: System, amplitude: _Array) -> tuple[_Array, _Array]:
    """Places in units of the picture and displacements over b."""
    beam = system.model.beam
    assert beam is not None
    x = np.linspace(0.0, beam.length, _POINTS)
    shapes = beam.buckling_modes(system.model.modes).shape(x)
    return _WIDE * x / beam.length, amplitude @ shapes / system.scale.length


def _sign(striker: Striker | None) -> float:
    return -1.0 if striker is not None and striker.side == "above" else 1.0


def _draw_beam(ax: Axes, system: System) -> None:
    sign = _sign(system.striker)
    lower, upper = system.model.wells
    rest, other = (lower, upper) if sign > 0.0 else (upper, lower)
    ax.plot([0.0, _WIDE], [0.0, 0.0], color="0.75", linewidth=0.5, linestyle=(0, (6, 4)))
    if system.model.is_bistable:
        ax.plot(*_shape(system, other), color=BEAM_COLOR, linewidth=0.8, linestyle="--")
    ax.plot(*_shape(system, rest), color=BEAM_COLOR, linewidth=1.8, solid_capstyle="butt")
    draw_surroundings(ax, system, *_shape(system, rest), sign, _WIDE)
    if system.model.imperfection is not None:
        _draw_imperfection(ax, system, system.model.imperfection, rest)
    clamp: Any = {"facecolor": "0.85", "edgecolor": BEAM_COLOR, "linewidth": 0.6, "hatch": "////"}
    beam = system.model.beam
    assert beam is not None
    for at, outward, stiffness in (
        (0.0, -1.0, beam.boundary.left_rotational_stiffness),
        (_WIDE, 1.0, beam.boundary.right_rotational_stiffness),
    ):
        if stiffness is None:
            ax.add_patch(Rectangle((min(at, at + 0.3 * outward), -0.35), 0.3, 0.7, **clamp))
        else:
            _draw_hinge(ax, at, outward, stiffness, sign, clamp)
    if system.axial_load is None and beam.axial_load == 0.0:
        return
    arrow: Any = {"arrowstyle": "-|>", "lw": 0.8, "color": BEAM_COLOR}
    for x, toward in ((-0.85, 0.5), (_WIDE + 0.85, -0.5)):
        ax.annotate("", (x + toward, 0.0), (x, 0.0), arrowprops=arrow)
    changes = system.axial_load is not None
    ax.text(
        -0.62, 0.14, "$P(t)$" if changes else "$P$", ha="center", va="bottom",
        color=_LOAD_COLOR if changes else BEAM_COLOR,
    )  # fmt: skip


def _draw_hinge(ax: Axes, at: float, outward: float, stiffness: float, sign: float, block: Any) -> None:
    """A pin on its support, away from the striker's side, and a coil about it if it is a spring."""
    foot = 0.34 * sign
    ax.add_patch(Polygon([(at, 0.0), (at - 0.2, foot), (at + 0.2, foot)], fc="0.95", ec=BEAM_COLOR, lw=0.7))
    ax.add_patch(Rectangle((at - 0.3, min(foot, foot + 0.12 * sign)), 0.6, 0.12, **block))
    ax.add_patch(Circle((at, 0.0), 0.06, facecolor="white", edgecolor=BEAM_COLOR, linewidth=0.8, zorder=5))
    if stiffness > 0.0:
        turn = np.linspace(0.0, 3.5 * np.pi, 90)
        reach = 0.1 + 0.022 * turn
        ax.plot(at + reach * np.cos(turn), reach * np.sin(turn), color=BEAM_COLOR, linewidth=0.6)
        ax.text(at + 0.42 * outward, -0.42 * sign, r"$k_\theta$", ha="center", va="center")


def _draw_imperfection(ax: Axes, system: System, imperfection: Imperfection, rest: _Array) -> None:
    """The initial shape, dotted, and arrows for the side load, on the side that it pushes from."""
    beam, model = system.model.beam, system.model
    assert beam is not None
    initial = imperfection.initial_shape(beam.buckling_modes(model.modes))
    if initial.any():
        ax.plot(*_shape(system, initial), color=BEAM_COLOR, linewidth=0.9, linestyle=":")
    x, w = _shape(system, rest)
    arrow: Any = {"arrowstyle": "-|>", "lw": 0.8, "color": _LOAD_COLOR}
    uniform = imperfection.uniform_load - beam.mass_per_length * imperfection.gravity
    for load, places, reach in (
        (imperfection.point_load, [imperfection.point_location], 0.55),
        (uniform, np.linspace(0.1, 0.9, 9), 0.25),
    ):
        if load == 0.0:
            continue
        push = 1.0 if load > 0.0 else -1.0
        for place in places:
            at, height = place * _WIDE, float(np.interp(place * _WIDE, x, w))
            ax.annotate("", (at, height - 0.03 * push), (at, height - reach * push), arrowprops=arrow)
    if imperfection.point_load != 0.0:
        push = 1.0 if imperfection.point_load > 0.0 else -1.0
        at = imperfection.point_location * _WIDE
        height = float(np.interp(at, x, w)) - 0.35 * push
        ax.text(at + 0.12, height, "$F$", ha="left", va="center", color=_LOAD_COLOR)


def _draw_striker(ax: Axes, system: System, striker: Striker, contact: ContactLaw, number: int) -> None:
    """The tip under (or above) the beam, the rod, and what holds it; *number* tells several apart, 0: there is one."""
    sign = _sign(striker)
    x, w = _shape(system, system.model.wells[0 if _sign(system.striker) > 0.0 else 1])
    at = striker.location * _WIDE
    beam_there = float(np.interp(at, x, w))
    gap = 0.0 if striker.gap is None else striker.gap / system.scale.length
    center = beam_there - sign * (float(np.clip(gap, -0.6, 0.6)) + _RADIUS)
    ax.add_patch(Circle((at, center), _RADIUS, facecolor=SHAKER_COLOR, edgecolor="none", zorder=4))
    _caption(ax, at, sign, contact, striker, gap, number, system.striker)
    below = center - sign * _RADIUS
    if striker.mass is None:
        _rod(ax, at, below, below - sign * 0.45)
        stands = isinstance(striker.drive, FixedStop)
        _block(ax, at, below - sign * 0.45, sign, "stop" if stands else "drive", moves=not stands)
        if stands and system.base_excitation is not None and system.base_excitation.striker_on_base:
            _rod(ax, at, below - sign * 0.67, -sign * FRAME)
        return
    if striker.suspension_stiffness == 0.0:
        if isinstance(striker.drive, ConstantVelocity):
            arrow: Any = {"arrowstyle": "-|>", "lw": 1.0, "color": SHAKER_COLOR}
            ax.annotate("", (at, below - sign * 0.08), (at, below - sign * 0.75), arrowprops=arrow)
            ax.text(at - 0.15, below - sign * 0.45, "$v$", ha="right", va="center", color=SHAKER_COLOR)
        return
    _rod(ax, at, below, below - sign * 0.12)
    edge = below - sign * 0.12
    corner = (at - 0.28, min(edge, edge - sign * 0.26))
    ax.add_patch(Rectangle(corner, 0.56, 0.26, facecolor="0.9", edgecolor=BEAM_COLOR, lw=0.7))
    under = edge - sign * 0.26
    foot = under - sign * 0.5
    if striker.suspension_damping > 0.0:
        _spring(ax, at - 0.15, under, foot)
        _damper(ax, at + 0.15, under, foot)
    else:
        _spring(ax, at, under, foot)
    _block(ax, at, foot, sign, "")


def _caption(
    ax: Axes, at: float, sign: float, contact: ContactLaw, striker: Striker, gap: float, number: int, first: Striker | None
) -> None:  # fmt: skip
    """Write the contact law, gap and mass next to the striker, clear of the beam."""
    law = LAWS.get(contact.name, contact.name)
    lines = [f"striker {number}: {law}" if number else f"contact: {law}"]
    if gap != 0.0:
        lines.append(f"gap {gap:.3g} $b$" if gap > 0.0 else f"preload {-gap:.3g} $b$")
    if striker.mass is not None:
        lines.append(r"$m_\mathrm{s}$ = " + prefixed(1e3 * striker.mass, "g"))
    lines = [", ".join(lines)] if number else lines
    right = at < 0.6 * _WIDE
    x, side = (at + 0.75, "left") if right else (at - 0.75, "right")
    if number and sign != _sign(first):  # over the other well there is room at the tip
        x, side = float(np.clip(at, 0.25 * _WIDE, 0.75 * _WIDE)), "center"
    for i, line in enumerate(lines):
        y = -sign * (1.35 + 0.42 * i)
        ax.text(x, y, line, ha=side, va="center", color=SHAKER_COLOR)


def _rod(ax: Axes, x: float, one: float, other: float) -> None:
    ax.plot([x, x], [one, other], color=SHAKER_COLOR, linewidth=1.4)


def _block(ax: Axes, x: float, edge: float, sign: float, words: str, moves: bool = True) -> None:
    """Draw a body with prescribed motion."""
    corner = (x - 0.34, min(edge, edge - sign * 0.22))
    ax.add_patch(Rectangle(corner, 0.68, 0.22, facecolor=SHAKER_COLOR, alpha=0.25, lw=0))
    if moves:
        _moves(ax, x, edge, sign)
    if words:
        ax.text(x, edge - sign * 0.11, words, ha="center", va="center", fontsize=6)


def _moves(ax: Axes, x: float, edge: float, sign: float) -> None:
    ax.annotate(
        "", (x + 0.5, edge - sign * 0.30), (x + 0.5, edge + sign * 0.18),
        arrowprops={"arrowstyle": "<|-|>", "lw": 0.8, "color": SHAKER_COLOR, "mutation_scale": 6},
    )  # fmt: skip


def _spring(ax: Axes, x: float, one: float, other: float) -> None:
    share = np.array([0.0, 0.15, 0.22, 0.36, 0.5, 0.64, 0.78, 0.85, 1.0])
    swing = np.array([0.0, 0.0, 1.0, -1.0, 1.0, -1.0, 1.0, 0.0, 0.0])
    ax.plot(x + 0.07 * swing, one + share * (other - one), color=BEAM_COLOR, linewidth=0.8)


def _damper(ax: Axes, x: float, one: float, other: float) -> None:
    middle = 0.5 * (one + other)
    ax.plot([x, x], [one, middle], color=BEAM_COLOR, linewidth=0.8)
    ax.plot([x - 0.06, x + 0.06], [middle, middle], color=BEAM_COLOR, linewidth=0.8)
    low = other + 0.25 * (one - other)
    top = middle + 0.2 * (one - other)
    ax.plot([x - 0.09, x - 0.09, x + 0.09, x + 0.09], [top, low, low, top], color=BEAM_COLOR, linewidth=0.8)
    ax.plot([x, x], [low, other], color=BEAM_COLOR, linewidth=0.8)


def _draw_drive(ax: Axes, system: System, section: str, drive: Any) -> None:
    """Draw the motion of the tip without contact, the base motion, or the change of the axial load."""
    scale = system.scale
    period = float(drive.cycle(drive.columns(), scale)[0])
    cycles = np.linspace(0.0, 2.0 if isinstance(drive, ConstantVelocity) else _CYCLES, 1601)
    moved = _moved(drive, system, cycles * period)
    section = numbered(section)[0]
    per = 1.0 if section in ("axial_load", "force") else scale.length
    base = system.base_excitation if section == "base_excitation" else None
    down = base is not None and base.direction == "down"
    color = SHAKER_COLOR if section == "drive" else _LOAD_COLOR
    ax.plot(cycles, (-moved if down else moved) / per, color=color)
    ax.set_xlabel("Cycles")
    words, label = _MOTIONS[section]
    ax.set_ylabel(label)
    ax.set_xlim(0.0, cycles[-1])
    ax.set_title(f"{words}: {drive.name.replace('_', ' ')}", loc="left")
