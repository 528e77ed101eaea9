"""The schematic of a system, drawn from the system itself: beam, wells, striker, suspension, contact and drive."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon, Rectangle
from numpy.typing import NDArray

from snapbeam.model.drive.base import Drive
from snapbeam.model.drive.constant_velocity import ConstantVelocity
from snapbeam.model.drive.fixed_stop import FixedStop
from snapbeam.model.drive.shock import GRAVITY
from snapbeam.model.external_force import ExternalForce
from snapbeam.model.harvester import ElectromagneticHarvester, PiezoelectricHarvester, PiezoelectricPatches
from snapbeam.model.imperfection import Imperfection
from snapbeam.model.local_force import LocalSpring
from snapbeam.model.quantity import numbered
from snapbeam.model.striker import Contact, Striker
from snapbeam.model.system import System
from snapbeam.plot.run import ONE_EVENT
from snapbeam.plot.style import BEAM_COLOR, CENTER_COLOR, SERIES_COLORS, SHAKER_COLOR, figure_style, new_figure
from snapbeam.solver.excitation import motion_of
from snapbeam.util.si_prefixes import prefixed, scale_of
from snapbeam.util.validation import checked, instance

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
    for (number, drive), line in zip(tips, itertools.cycle(_LINES), strict=False):
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
    for harvester in system.harvesters:
        if isinstance(harvester, PiezoelectricHarvester | PiezoelectricPatches):
            _layers(ax, harvester, x, w, sign, wide)
        if isinstance(harvester, ElectromagneticHarvester):
            _coil(ax, harvester, x, w, sign, wide)
    for number, force in enumerate(system.forces, 1 if system.forces[1:] else 0):
        at = wide * (0.5 if force.location is None else force.location)
        _force(ax, force, number, at, float(np.interp(at, x, w)), sign)


def _force(ax: Axes, force: Any, number: int, at: float, there: float, sign: float) -> None:
    """An arrow of an external force; a spring, a damper or a body of a local one, all away from the striker."""
    far, reach = there + 0.75 * sign, there + 0.04 * sign
    if isinstance(force, ExternalForce):
        low, high = min(reach, far), max(reach, far)  # upwards, as a force counts positive
        ax.annotate("", (at, high), (at, low), arrowprops={"arrowstyle": "-|>", "lw": 1.0, "color": _COLOR})
        words = force.label or (f"$F_{number}(t)$" if number else "$F(t)$")
    else:
        words = force.label or force.name.removeprefix("local_").replace("_", " ")
        if isinstance(force, LocalSpring) and force.coordinate == "displacement":
            _spring(ax, (at, reach), (at, far))
        elif force.dissipative:
            _damper(ax, at, reach, far)
        body: Any = {"facecolor": "0.85", "edgecolor": BEAM_COLOR, "linewidth": 0.6}
        ax.add_patch(Rectangle((at - 0.22, min(far, far + 0.12 * sign)), 0.44, 0.12, **body))
    beside, side = (0.14, "left") if at < 0.6 * _WIDE else (-0.14, "right")
    ax.text(at + beside, there + 0.5 * sign, words, ha=side, va="center", color=_COLOR)


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
_END = 1.6
"""Distance of a body from the supports of its springs."""
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
_LONG = 22
"""Letters of a title that has room to the right of its axis."""
_LOAD_COLOR = _COLOR


@checked
def plot_system(system: System, title: str = "") -> Figure:
    """Draw a system: the beam in its initial well and, dashed, in the other, the strikers and the drive.

    Heights are to the scale of the buckling level, and so is the gap; lengths along the beam are to the scale of its
    length.  Masses, springs and dampers are signs.

    Parameters
    ----------
    system : System
        A structure given by matrices, which has no shape, is drawn as a body on springs.
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
    both = len({each.striker.side for each in system.contacts}) > 1
    tips = [(numbered(name)[1], drive) for name, drive in system.moving if numbered(name)[0] == "drive"]
    others = [each for each in system.moving if numbered(each[0])[0] != "drive"]
    rows = len(others) + bool(tips)
    figure = new_figure("double", max(72.0 if both else 52.0, 40.0 * rows))
    with figure_style():
        # each part is laid out alone, so that the labels of the motion leave the beam its height
        parts = figure.subfigures(1, 2 if rows else 1, squeeze=False, width_ratios=[2.6, 1.0] if rows else [1.0])[0]
        ax, striker = parts[0].subplots(), system.striker
        _draw_beam(ax, system)
        for number, each in enumerate(system.contacts, 1 if system.contacts[1:] else 0):
            _draw_striker(ax, system, each, number)
        panels = iter(parts[1].subplots(rows, squeeze=False)[:, 0] if rows else ())
        if tips[1:]:
            draw_tips(next(panels), system, tips)
        for panel, (section, drive) in zip(panels, others if tips[1:] else system.moving, strict=True):
            _draw_drive(panel, system, section, drive)
        if title:
            ax.set_title(title, loc="left")
        outward, inward = 2.55, 2.55 if both else 1.25
        ax.set_xlim(-0.85, _WIDE + 0.85)
        ax.set_ylim(*((-outward, inward) if _sign(striker) > 0.0 else (-inward, outward)))
        ax.set_aspect("equal")
        ax.set_axis_off()
    return figure


def _shape(system: System, amplitude: _Array) -> tuple[_Array, _Array]:
    """Places in units of the picture and displacements over b."""
    beam = system.model.beam
    x = np.linspace(0.0, 1.0, _POINTS)
    one = system.model.contact_shape
    if beam is None and one is not None:  # a body that moves as the contact point does
        return _WIDE * x, np.full(x.size, amplitude @ one) / system.scale.length
    assert beam is not None
    shapes = beam.buckling_modes(system.model.modes).shape(x * beam.length)
    return _WIDE * x, amplitude @ shapes / system.scale.length


def _sign(striker: Striker | None) -> float:
    return -1.0 if striker is not None and striker.side == "above" else 1.0


def _draw_beam(ax: Axes, system: System) -> None:
    sign = _sign(system.striker)
    lower, upper = system.model.wells
    rest, other = (lower, upper) if sign > 0.0 else (upper, lower)
    ax.plot([0.0, _WIDE], [0.0, 0.0], color="0.75", linewidth=0.5, linestyle=(0, (6, 4)))
    draw = _draw_shape if system.model.beam is not None else _draw_body
    if system.model.is_bistable:
        draw(ax, system, other, sign, {"linewidth": 0.8, "linestyle": "--"})
    draw(ax, system, rest, sign, {"linewidth": 1.8})
    draw_surroundings(ax, system, *_shape(system, rest), sign, _WIDE)
    if system.model.imperfection is not None:
        _draw_imperfection(ax, system, system.model.imperfection, rest)
    clamp: Any = {"facecolor": "0.85", "edgecolor": BEAM_COLOR, "linewidth": 0.6, "hatch": "////"}
    beam = system.model.beam
    if beam is None:
        for left in (-0.3, _WIDE):
            ax.add_patch(Rectangle((left, -0.35), 0.3, 0.7, **clamp))
        return
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


def _draw_shape(ax: Axes, system: System, amplitude: _Array, sign: float, line: dict[str, Any]) -> None:
    ax.plot(*_shape(system, amplitude), color=BEAM_COLOR, solid_capstyle="butt", **line)


def _draw_body(ax: Axes, system: System, amplitude: _Array, sign: float, line: dict[str, Any]) -> None:
    """A body between two springs, for a structure given by matrices; its face towards the striker is the contact point."""
    height = float(_shape(system, amplitude)[1][0])
    low = min(height, height + 0.24 * sign)
    ax.add_patch(Rectangle((_END, low), _WIDE - 2.0 * _END, 0.24, facecolor="none", edgecolor=BEAM_COLOR, **line))
    if "linestyle" in line:
        return
    for end, body in ((0.0, _END), (_WIDE, _WIDE - _END)):
        _spring(ax, (body, low + 0.12), (end, 0.0))
    words = f"{system.model.modes} coordinates, by matrices"
    ax.text(0.5 * _WIDE, low + 0.12, words, ha="center", va="center", fontsize=6)


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


def _draw_striker(ax: Axes, system: System, contact: Contact, number: int) -> None:
    """The tip under (or above) the beam, the rod, and what holds it; *number* tells several apart, 0: there is one."""
    striker = contact.striker
    sign = _sign(striker)
    x, w = _shape(system, system.model.wells[0 if _sign(system.striker) > 0.0 else 1])
    at = _WIDE * (0.5 if system.model.beam is None else striker.location)
    beam_there = float(np.interp(at, x, w))
    gap = 0.0 if striker.gap is None else striker.gap / system.scale.length
    center = beam_there - sign * (float(np.clip(gap, -0.6, 0.6 + abs(beam_there + sign))) + _RADIUS)
    ax.add_patch(Circle((at, center), _RADIUS, facecolor=SHAKER_COLOR, edgecolor="none", zorder=4))
    _caption(ax, at, sign, contact, number)
    below = center - sign * _RADIUS
    if striker.mass is None:
        _rod(ax, at, below, below - sign * 0.45)
        stands = isinstance(striker.drive, FixedStop)
        _block(ax, at, below - sign * 0.45, sign, "stop" if stands else "drive", moves=not stands)
        on_base = system.base_excitation is not None and system.base_excitation.striker_on_base
        if stands and on_base and sign == _sign(system.striker):
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
        _spring(ax, (at - 0.15, under), (at - 0.15, foot))
        _damper(ax, at + 0.15, under, foot)
    else:
        _spring(ax, (at, under), (at, foot))
    _block(ax, at, foot, sign, "")


def _caption(ax: Axes, at: float, sign: float, contact: Contact, number: int) -> None:
    """Write name, contact law, gap and mass next to the striker, clear of the beam."""
    striker, law = contact.striker, LAWS.get(contact.law.name, contact.law.name)
    name = contact.label or (f"striker {number}" if number else "contact")
    lines = [f"{name}: {law}"]
    if striker.gap:
        lines.append(f"{'gap' if striker.gap > 0.0 else 'preload'} {prefixed(abs(striker.gap), 'm')}")
    if striker.mass is not None:
        lines.append(r"$m_\mathrm{s}$ = " + prefixed(1e3 * striker.mass, "g"))
    right = at < 0.6 * _WIDE
    x, side = (at + 0.75, "left") if right else (at - 0.75, "right")
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


def _spring(ax: Axes, one: tuple[float, float], other: tuple[float, float]) -> None:
    share = np.array([0.0, 0.15, 0.22, 0.36, 0.5, 0.64, 0.78, 0.85, 1.0])[:, None]
    swing = np.array([0.0, 0.0, 1.0, -1.0, 1.0, -1.0, 1.0, 0.0, 0.0])[:, None]
    along = np.subtract(other, one)
    beside = np.array([-along[1], along[0]]) / np.hypot(*along)
    ax.plot(*(one + share * along + 0.07 * swing * beside).T, color=BEAM_COLOR, linewidth=0.8)


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
    section, number = numbered(section)
    words, label = _MOTIONS[section]
    of = f" {number}" if number > 1 else ""
    base = system.base_excitation if section == "base_excitation" else None
    side = -1.0 if base is not None and base.direction == "down" else 1.0
    color = SHAKER_COLOR if section == "drive" else _LOAD_COLOR
    if base is not None and drive.name in ONE_EVENT:
        end = min(getattr(drive, "duration_ms", np.inf) * 2e-3, _CYCLES * period)
        times = np.linspace(0.0, end, 1601)
        factor, unit = scale_of(times, "s")
        moved = motion_of(drive, scale, end)(times)[2] / GRAVITY
        ax.plot(times / factor, side * moved, color=color)
        ax.set(xlabel=f"Time ({unit})", ylabel="Base acceleration (g)", xlim=(0.0, end / factor))
    else:
        cycles = np.linspace(0.0, 2.0 if isinstance(drive, ConstantVelocity) else _CYCLES, 1601)
        per = 1.0 if section in ("axial_load", "force") else scale.length
        ax.plot(cycles, side * _moved(drive, system, cycles * period) / per, color=color)
        ax.set(xlabel="Cycles", ylabel=label, xlim=(0.0, cycles[-1]))
    kind = " + ".join(each.removesuffix("_force").replace("_", " ") for each in drive.name.split("+"))
    text = f"{words}{of}: {kind}"
    ax.set_title(text, loc="left" if len(text) < _LONG else "right")
