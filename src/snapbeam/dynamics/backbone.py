"""Backbone curves: families of free periodic motions without damping, over their energy."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.dynamics.arclength import Equations, Point, follow
from snapbeam.dynamics.results import beam_attributes, in_unit, labelled, reported
from snapbeam.dynamics.shooting import OrbitNotFoundError
from snapbeam.model.drive.fixed_stop import FixedStop
from snapbeam.model.harvester import Harvester
from snapbeam.model.state import amplitude_scale
from snapbeam.model.striker import Contact
from snapbeam.model.system import System
from snapbeam.util.provenance import canonical_json
from snapbeam.util.singular_values import lstsq
from snapbeam.util.validation import InputError, checked, choice, instance, integer, positive, shown, within

if TYPE_CHECKING:
    import xarray as xr

_Array = NDArray[np.float64]

_WELLS = ("lower", "upper", "both")
_RTOL, _ATOL = 1e-11, 1e-13
"""Tolerances of the integration, in units of the well's amplitude and of 1/omega_1."""
_CONVERGED = 1e-10
"""Velocity at the turning point, in the same units."""
_FIRST = 0.02
"""First arc length between two points, if it is not above the maximum."""
_SAME_STATE = 1e-6
"""Difference of the two turning points, in units of the well's amplitude, up to which a motion has only one."""
_NEAR_ZERO = 0.1
"""Distance of a chord from zero, over its length, up to which the curve passes through zero."""
_AT_REST, _OTHER_REST = "back at the equilibrium", "at another equilibrium"
_RETRACED = "the turning points meet: the curve goes on through the same motions from their other turning points"
_SAMPLES = 64
"""Instants of half a period from which means are taken."""
_STABLE = 1e-4
"""Tolerance of the modulus of a Floquet multiplier of a stable orbit, for rounding."""
_OPEN = 1e30
"""Load resistance, ohm, of a circuit without current."""
_SLOW, _FAST = 1e-9, 1e9
"""Rates of a circuit, over omega_1, at which it keeps what it has, and at which it has nothing."""


@checked
def backbone_curve(
    system: System,
    *,
    well: str = "lower",
    mode: int = 1,
    amplitude_limit: float = 2.5,
    lowest_frequency_ratio: float = 0.3,
    max_points: int = 200,
    max_step: float = 0.1,
    progress: Callable[[int, int], object] | bool | None = None,
) -> xr.Dataset:
    """Compute a backbone curve: free periodic motions without damping and excitation, over their energy.

    Each motion begins and turns back at rest (a nonlinear normal mode). About a well the curve begins at a natural
    frequency with a vanishing amplitude; across both wells it begins at three times the energy of the barrier, in both
    directions. DOP853 of SciPy integrates half a period with tangents; Newton's method and steps of arc length follow
    the curve; Floquet multipliers give the stability.

    Local forces are conservative, circuits of harvesters open: piezoelectric layers stiffen the beam, a coil has no
    force. Strikers stand still; one with a mass moves on its suspension.

    Parameters
    ----------
    system : System
        System without excitation; damping is ignored. Strikers are :class:`~snapbeam.FixedStop` under elastic laws.
    well : {"lower", "upper", "both"}
        Motion about a well, or across both.
    mode : int
        Linear mode with which the motion about a well begins, 1 for the lowest.
    amplitude_limit : float
        Displacement of the centre from its middle position, in length scales, at which the curve ends.
    lowest_frequency_ratio : float
        Frequency over the first natural frequency at which the curve ends: towards the barrier it vanishes.
    max_points : int
        Maximum number of points of the curve.
    max_step : float
        Maximum arc length between two points, in length scales and in half periods over pi/omega_1. A short step
        follows the tongue of an internal resonance, a long one passes it.
    progress : callable or bool, optional
        Report of points, as in :func:`snapbeam.sweep`.

    Returns
    -------
    xarray.Dataset
        Variables over ``point``: ``frequency`` (Hz), ``frequency_ratio``, ``energy`` (J, above the well),
        ``min_midspan`` and ``max_midspan`` (over the length scale), ``stable``, ``unstable_multipliers``.
        ``participation`` over ``point`` and ``mode`` is the share of each linear mode in the mean kinetic energy.
        ``initial_amplitude`` over ``point`` and ``buckling_mode`` and, for strikers with mass, ``initial_shift`` over
        ``striker`` are those at rest; ``multiplier_size`` and ``multiplier_angle``. Attribute ``end``: the reason.

    Raises
    ------
    InputError
        For an excitation, a lossy contact, a free striker, or ``well="both"`` without two wells.
    OrbitNotFoundError
        If no first motion is found.

    See Also
    --------
    snapbeam.dynamics.continuation, snapbeam.plot.plot_backbone

    Notes
    -----
    With one mode the periods are elliptic integrals: for U = -k x^2/2 + g x^4/4 and the mass m, about a well
    2 K(1 - x_1^2/x_0^2) / (x_0 sqrt(g/2m)), with turning points x_1 < x_0 (Kovacic and Brennan, The Duffing Equation,
    Wiley, 2011, chapter 4). Use up to about 12 modes: the cost grows with their square and the highest frequency.

    Examples
    --------
    >>> import snapbeam as sb
    >>> model = sb.ReducedModel.from_beam(sb.paper.BEAM, modes=1)
    >>> curve = sb.dynamics.backbone_curve(sb.System(model), amplitude_limit=0.3)
    >>> bool(curve.frequency[0] > curve.frequency[-1])  # the motion about a well softens
    True
    """
    choice("well", well, _WELLS)
    within("lowest_frequency_ratio", lowest_frequency_ratio, 0.0, 1.0)
    limit = positive("amplitude_limit", amplitude_limit)
    within("max_step", max_step, 1e-4, 1.0)
    integer("max_points", max_points, 3, 100_000)
    structure = _Structure(system, well)
    integer("mode", mode, 1, structure.size)
    motions = _Motions(structure, limit, np.pi / lowest_frequency_ratio)
    report = reported(progress, "backbone curve", "points")
    first = motions.about_well(mode) if well != "both" else motions.across()

    def branch(way: float, before: int, most: int) -> tuple[list[Any], str]:
        start = first._replace(tangent=way * first.tangent)
        path = follow(
            motions, start, limits=np.empty((0, 2)), max_points=most, step=_FIRST, max_step=max_step,
            progress=lambda done, _: report(before + done, max_points), what="motion",
        )  # fmt: skip
        return [*begun, *path.events][: len(path.points)], path.end

    begun = [_measures(structure, first)]
    report(1, max_points)
    back = branch(-1.0, 0, max_points // 2)[0] if well == "both" else begun
    ahead, end = branch(1.0, len(back) - 1, max_points - len(back) + 1)
    return _dataset(structure, [*reversed(back[1:]), *ahead], end)


class _Structure:
    """Equations of free motion of the beam and of strikers with mass, in linear modes about a well, over 1/omega_1."""

    def __init__(self, system: System, well: str) -> None:
        self.system = system = instance("system", system, System, "a System")
        moving = [name for name, drive in system.moving if not isinstance(drive, FixedStop)]
        if moving:
            raise InputError(
                f"system with {', '.join(moving)}: a backbone curve is of free motion; leave {'it' if len(moving) == 1 else 'them'} out, "
                "or give a FixedStop"
            )
        model, potential = system.model, system.potential
        if model.length_scale is None:
            raise InputError("system: a straight beam has no length scale; give a buckled beam or a length_scale")
        if not potential.wells:
            raise InputError("system: its equilibrium is not stable; a backbone curve needs a well")
        alone = well == "lower" and len(potential.wells) == 1
        self.model, self.potential, self.well = model, potential, well
        amplitude = potential.well(0 if alone else "lower" if well == "both" else well).amplitude
        self.bodies = [i for i, each in enumerate(system.contacts) if each.striker.mass is not None]
        self.size, n = model.modes + len(self.bodies), model.modes
        self.rest = np.append(amplitude, np.zeros(len(self.bodies)))
        self.stops = [self._stop(i, each) for i, each in enumerate(system.contacts)]
        mass, self.linear = np.zeros((2, self.size, self.size))
        mass[:n, :n] = model.mass
        for place, i in enumerate(self.bodies, n):
            striker = system.contacts[i].striker
            mass[place, place], self.linear[place, place] = striker.mass, striker.suspension_stiffness
            if striker.suspension_stiffness == 0.0:
                raise InputError(
                    f"contact {i + 1}: nothing holds its striker with mass = {striker.mass:g} kg, so that it has no free "
                    "vibration; give suspension_stiffness"
                )
        reference = 2.0 * np.pi * model.reference_frequency
        for harvester in system.harvesters:
            row = np.append(harvester.row(model), np.zeros(len(self.bodies)))
            self.linear += np.outer(row, row) * _open_stiffness(harvester, reference)
        from scipy.linalg import eigh

        squares, self.shapes = eigh(self._stiffness(self.rest), mass)
        if squares[0] <= 0.0:
            raise InputError("system: its equilibrium is not stable; a backbone curve needs a well")
        self.omega = np.sqrt(squares)
        self.unit = float(self.omega[0])
        self.scale = model.length_scale / float(np.abs(model.midspan_shape @ self.shapes[:n]).max())
        """Length of a coordinate of 1: it moves mid-span by about the length scale."""
        self.back = self.shapes * self.scale
        """Generalised coordinates for each coordinate."""
        for _, row, begin in self.stops:
            if begin + float(row @ self.rest) > 1e-12 * model.length_scale:
                raise InputError("system: the stop presses on the beam at rest; give a gap of 0 or more")

    def _stop(self, number: int, contact: Contact) -> tuple[Any, _Array, float]:
        """Law of a contact, and its penetration by the generalised coordinates, a row and a constant."""
        law, striker = contact.law, contact.striker
        if law.is_dissipative or law.impulsive:
            raise InputError(f"contact = {shown(law)}: loses energy; use a HertzContact or a PowerLaw")
        sides = [1.0 if each.side == "below" else -1.0 for each in (self.system.contacts[0].striker, striker)]
        wells = self.potential.wells
        facing = wells[0 if sides[0] > 0.0 else -1].amplitude
        row = np.zeros(self.size)
        row[: self.model.modes] = -sides[1] * np.asarray(self.model.shape_at(striker.location))
        begin = -float(row[: self.model.modes] @ facing) - (0.0 if striker.gap is None else float(striker.gap))
        if number in self.bodies:
            row[self.model.modes + self.bodies.index(number)] = sides[1]
        return law, row, begin

    def _stiffness(self, z: _Array) -> _Array:
        """Second derivative of the potential energy without contacts."""
        found, n = self.linear.copy(), self.model.modes
        found[:n, :n] += self.potential._tangent(z[:n])
        return found

    def _closed(self, z: _Array) -> list[tuple[Any, _Array, float]]:
        """Law, row and penetration of the contacts that are closed."""
        depths = ((law, row, begin + float(row @ z)) for law, row, begin in self.stops)
        return [each for each in depths if each[2] > 0.0]

    def acceleration(self, y: _Array) -> _Array:
        """y'' of coordinates about the well, per omega_1^2."""
        away = self.back @ y
        z, n = self.rest + away, self.model.modes
        if self.potential.local_forces and not self.potential._holds(z[:n]):
            raise OrbitNotFoundError("the motion leaves the range of the law of a local force")
        force = -self.linear @ away
        force[:n] -= self.potential._gradient(z[:n])
        for law, row, depth in self._closed(z):
            force -= row * type(law).force(law, depth)
        return np.asarray(self.shapes.T @ force / (self.scale * self.unit**2))

    def slope(self, y: _Array) -> _Array:
        """Derivative of the acceleration."""
        z = self.rest + self.back @ y
        stiffness = self._stiffness(z)
        for law, row, depth in self._closed(z):
            stiffness += np.outer(row, row) * type(law).slope(law, depth)
        return np.asarray(-self.shapes.T @ stiffness @ self.shapes / self.unit**2)

    def energy(self, y: _Array) -> float:
        """Potential energy above the well, J."""
        away, n = self.back @ y, self.model.modes
        z = self.rest + away
        found = float(self.potential.energy(z[:n]) - self.potential.energy(self.rest[:n]))
        found += 0.5 * float(away @ self.linear @ away)
        return found + sum(float(type(law).energy(law, depth)) for law, _, depth in self._closed(z))

    def centre(self, y: _Array) -> _Array:
        """Displacement of the centre over the length scale, for coordinates of shape (..., n)."""
        z = self.rest + y @ self.back.T
        return np.asarray(z[..., : self.model.modes] @ self.model.midspan_shape / self.model.length_scale)

    def _run(self, y: _Array, time: float, columns: int = 0, times: _Array | None = None) -> _Array:
        """Motion from rest, and its derivative by the first *columns* of the start, shape (numbers, instants)."""
        from scipy.integrate import solve_ivp

        n = self.size

        def rate(_: float, z: _Array) -> _Array:
            y, v = z[:n], z[n : 2 * n]
            if not columns:
                return np.concatenate((v, self.acceleration(y)))
            carried = z[2 * n :].reshape(2 * n, columns)
            bent = self.slope(y) @ carried[:n]
            return np.concatenate((v, self.acceleration(y), carried[n:].ravel(), bent.ravel()))

        begun = np.concatenate((y, np.zeros(n), np.eye(2 * n)[:, :columns].ravel()))
        done = solve_ivp(rate, (0.0, time), begun, method="DOP853", t_eval=times, rtol=_RTOL, atol=_ATOL)
        return np.asarray(done.y)

    def half(self, y: _Array, time: float, columns: int) -> tuple[_Array, _Array, _Array]:
        """State after half a period from rest, and its derivative by the first *columns* of the initial state."""
        n, last = self.size, self._run(y, time, columns)[:, -1]
        return last[:n], last[n : 2 * n], last[2 * n :].reshape(2 * n, columns)

    def waveform(self, y: _Array, time: float) -> tuple[_Array, _Array]:
        """Coordinates and velocities at even instants of half a period, each of shape (instants, N)."""
        found = self._run(y, time, 0, np.linspace(0.0, time, _SAMPLES + 1))
        return found[: self.size].T, found[self.size :].T


def _open_stiffness(harvester: Harvester, omega: float) -> float:
    """Stiffness, along its row, of a harvester whose circuit is open: of the z that M z' = -theta . alpha' leaves, or none."""
    rate = float(harvester.loss(np.array(_OPEN)))
    if harvester.inertia > 0.0 and rate < _SLOW * harvester.inertia * omega:
        return 1.0 / harvester.inertia
    if harvester.inertia > 0.0 and rate < _FAST * harvester.inertia * omega:
        raise InputError(f"harvester = {shown(harvester)}: loses energy without a load; leave it out")
    return 0.0


class _Motions(Equations):
    """Motions that begin at rest and turn back half a period later.  A point is (y, half period)."""

    tolerance = _CONVERGED
    easy, hard = 8, 12

    def __init__(self, structure: _Structure, amplitude_limit: float, longest: float) -> None:
        self.structure, self.amplitude_limit, self.longest = structure, amplitude_limit, longest

    def _half(self, point: _Array, columns: int) -> tuple[_Array, _Array, _Array]:
        if not 0.0 < point[-1] < 1e4 or not np.isfinite(point).all():
            raise OrbitNotFoundError("no half period is left")
        return self.structure.half(point[:-1], float(point[-1]), columns)

    def residual(self, y: _Array) -> _Array:
        """Velocity where the motion turns back, shape (n,)."""
        return self._half(y, 0)[1]

    def derivative(self, y: _Array) -> tuple[_Array, _Array, _Array]:
        """Velocity and state there, and the derivative of the velocity, shape (n, n + 1)."""
        n = self.structure.size
        turned, v, carried = self._half(y, n)
        return v, turned, np.column_stack([carried[n:], self.structure.acceleration(turned)])

    def prepare(self, last: Point, is_first: bool) -> _Array | None:
        """None: that of another motion serves for few steps."""
        return None

    def require_next(self, last: Point, point: Point) -> None:
        """Refuse a point around too sharp a bend."""
        if point.tangent @ last.tangent < 0.7:
            raise OrbitNotFoundError("the curve bends too sharply")

    def events(self, last: Point, point: Point, number: int) -> list[dict[str, Any]]:
        """Measures of a motion: they take as long as to find it, and the progress is that of both."""
        return [_measures(self.structure, point)]

    def end_at(self, last: Point, point: Point) -> tuple[str, bool] | None:
        """Reason why the curve ends: its limits, an equilibrium, or motions that were there before."""
        structure = self.structure
        before, after = last.came - last.y[:-1], point.came - point.y[:-1]
        part = _vanishing(before, after)
        if part is not None:
            met = ((1.0 - part) * last.y + part * point.y)[:-1]
            near = _NEAR_ZERO * np.linalg.norm(after - before)
            if np.linalg.norm(met) < near:
                return _AT_REST, False
            to_rest = lstsq(structure.slope(met), structure.acceleration(met))
            return (_OTHER_REST if np.linalg.norm(to_rest) < near else _RETRACED), False
        across = structure.well == "both"
        middle = 0.0 if across else structure.centre(np.zeros(structure.size))
        ends = structure.centre(point.y[:-1]), structure.centre(point.came)
        if max(abs(float(each - middle)) for each in ends) > self.amplitude_limit:
            return "amplitude_limit", True
        if point.y[-1] > self.longest:
            return "lowest_frequency_ratio", True
        return (_AT_REST, True) if not across and np.abs(point.y[:-1]).max() < 5e-4 else None

    def about_well(self, mode: int) -> Point:
        """A small motion of a linear mode, towards the other well."""
        structure = self.structure
        shape = structure.model.midspan_shape @ structure.shapes[: structure.model.modes, mode - 1]
        y, along = np.zeros((2, structure.size + 1))
        along[mode - 1] = 1.0 if shape * structure.centre(y[:-1]) < 0.0 else -1.0
        y[mode - 1] = 1e-3 * along[mode - 1]
        y[-1] = np.pi * structure.unit / float(structure.omega[mode - 1])
        return self.correct(y, along, along)

    def across(self) -> Point:
        """A motion across both wells with some times the energy of the barrier, towards greater energy."""
        from scipy.integrate import solve_ivp
        from scipy.optimize import brentq

        structure, potential = self.structure, self.structure.potential
        between = [each.equilibrium for each in potential.saddles if set(each.wells) == {0, 1}]
        saddle = between[0].amplitude if between else np.zeros(structure.model.modes)
        middle = np.append(saddle, np.zeros(len(structure.bodies)))
        way = np.linalg.solve(structure.back, middle - structure.rest)
        norm = float(way @ way)
        for times in (3.0, 6.0, 12.0):
            level = times * structure.energy(way)

            def above(s: float, level: float = level) -> float:
                return structure.energy(way * s) - level

            far = 2.0
            while above(far) < 0.0:
                far *= 1.5
            high = brentq(above, 1.0, far)

            def rate(_: float, z: _Array) -> list[float]:
                return [z[1], float(way @ structure.acceleration(way * z[0])) / norm]

            def turned(_: float, z: _Array) -> float:
                return z[1] if z[0] < 1.0 else -1.0

            turned.terminal = True  # type: ignore[attr-defined]
            done = solve_ivp(rate, (0.0, 200.0), [high, 0.0], method="DOP853", events=turned, rtol=1e-9, atol=1e-11)
            if done.t_events[0].size:
                along = np.append(way / np.sqrt(norm), 0.0)
                try:
                    return self.correct(np.append(way * high, done.t_events[0][0]), along, along)
                except OrbitNotFoundError:
                    continue
        raise OrbitNotFoundError(
            "no motion across both wells was found from the shape of the saddle; use fewer modes, or follow it from a model "
            "with one mode"
        )


def _vanishing(before: _Array, after: _Array) -> float | None:
    """Part of the way between two points of a curve at which a vector vanishes; None where its chord misses zero."""
    chord = after - before
    square = float(chord @ chord)
    if min(np.abs(before).max(), np.abs(after).max()) < _SAME_STATE or not 0.0 < -float(before @ chord) < square:
        return None
    part = -float(before @ chord) / square
    return part if np.linalg.norm(before + part * chord) < _NEAR_ZERO * np.sqrt(square) else None


def _measures(structure: _Structure, of: Point) -> dict[str, Any]:
    """Numbers of the dataset for one point."""
    point, n = of.y, structure.size
    y, v = structure.waveform(point[:-1], float(point[-1]))
    centre, kinetic = structure.centre(y), np.trapezoid(v**2, axis=0)
    # over a whole period, from the tangents of half of one: the motion retraces itself
    _, _, half = structure.half(point[:-1], float(point[-1]), 2 * n)
    mirror = np.diag([1.0] * n + [-1.0] * n)
    multipliers = np.linalg.eigvals(mirror @ np.linalg.solve(half, mirror @ half))
    multipliers = multipliers[np.argsort(-np.abs(multipliers))]
    others = np.delete(multipliers, np.argsort(np.abs(multipliers - 1.0))[:2])
    return {
        "frequency": structure.unit / (2.0 * point[-1]),
        "energy": structure.energy(point[:-1]),
        "low": float(centre.min()),
        "high": float(centre.max()),
        "share": kinetic / kinetic.sum(),
        "size": np.abs(multipliers),
        "angle": np.angle(multipliers),
        "unstable": int((np.abs(others) > 1.0 + _STABLE).sum()),
        "begun": structure.rest + structure.back @ point[:-1],
    }


def _dataset(structure: _Structure, points: list[dict[str, Any]], end: str) -> xr.Dataset:
    model, n = structure.model, structure.model.modes
    rows = {name: np.array([point[name] for point in points]) for name in points[0]}
    unit = "1" if model.beam is None else "m^0.5"
    words = "amplitude of a buckling mode where the motion turns back"
    variables: dict[str, tuple[Any, Any, Any]] = {
        "frequency": ("point", rows["frequency"], in_unit("Hz", "frequency of the free motion")),
        "frequency_ratio": (
            "point", rows["frequency"] / model.reference_frequency, "frequency over the first natural frequency"
        ),
        "energy": ("point", rows["energy"], in_unit("J", "energy above the well")),
        "min_midspan": ("point", rows["low"], "minimum displacement of mid-span, over the length scale"),
        "max_midspan": ("point", rows["high"], "maximum displacement of mid-span, over the length scale"),
        "stable": ("point", rows["unstable"] == 0, "whether no Floquet multiplier is outside the unit circle"),
        "unstable_multipliers": ("point", rows["unstable"], "Floquet multipliers outside the unit circle"),
        "participation": (("point", "mode"), rows["share"], "fraction of a linear mode in the mean kinetic energy"),
        "initial_amplitude": (("point", "buckling_mode"), rows["begun"][:, :n], in_unit(unit, words)),
        "multiplier_size": (("point", "multiplier"), rows["size"], "size of a Floquet multiplier"),
        "multiplier_angle": (("point", "multiplier"), rows["angle"], in_unit("rad", "angle of a Floquet multiplier")),
    }  # fmt: skip
    coords: dict[str, Any] = {"mode": np.arange(1, structure.size + 1), "buckling_mode": np.arange(1, n + 1)}
    if structure.bodies:
        words = "displacement of a striker where the motion turns back"
        variables["initial_shift"] = (("point", "striker"), rows["begun"][:, n:], in_unit("m", words))
        coords["striker"] = [i + 1 for i in structure.bodies]
    attrs = {
        "title": "backbone curve", "well": structure.well, "end": end, "modes": n,
        "reference_frequency": model.reference_frequency, "length_scale": model.length_scale,
        "natural_frequencies": (structure.omega / (2.0 * np.pi)).tolist(), **beam_attributes(model),
        "amplitude_scale": float(amplitude_scale(model)), "system": canonical_json(System(model).to_mapping()),
    }  # fmt: skip
    return labelled(variables, coords, attrs)
