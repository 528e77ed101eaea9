"""Backbone curves: families of free periodic motions without damping, over their energy."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.drive.fixed_stop import FixedStop
from snapbeam.model.equilibria import tangent_stiffness
from snapbeam.model.reduced_model import ReducedModel
from snapbeam.model.system import System
from snapbeam.util.diagnostics import counting
from snapbeam.util.singular_values import lstsq, svd
from snapbeam.util.validation import (
    InputError,
    InputTypeError,
    checked,
    choice,
    integer,
    positive,
    shown,
    within,
)

if TYPE_CHECKING:
    import xarray as xr

_Array = NDArray[np.float64]

_WELLS = ("lower", "upper", "both")
_RTOL, _ATOL = 1e-11, 1e-13
"""Tolerances of the integration, in units of the well's amplitude and of 1/omega_1."""
_CONVERGED = 1e-10
"""Velocity at the turning point, in the same units."""
_FIRST, _SHORTEST = 0.02, 1e-5
"""Arc lengths between two points: the first, if it is not above the maximum, and the minimum."""
_SAME_STATE = 1e-6
"""Difference of the two turning points, in units of the well's amplitude, up to which a motion has only one."""
_NEAR_ZERO = 0.1
"""Distance of a chord from zero, over its length, up to which the curve passes through zero."""
_AT_REST, _OTHER_REST = "back at the equilibrium", "at another equilibrium"
_RETRACED = (
    "the turning points meet: the curve goes on through the same motions from their other turning points"
)
_SAMPLES = 64
"""Instants of half a period from which means are taken."""
_STABLE = 1e-4
"""Tolerance of the modulus of a Floquet multiplier of a stable orbit, for rounding."""


@checked
def backbone_curve(
    system: System | ReducedModel,
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

    Each motion begins and turns back at rest: a nonlinear normal mode.  About a well the curve begins at a
    natural frequency with a vanishing amplitude; across both wells it begins with three times the energy of the
    barrier and is followed in both directions.  The equations are integrated with DOP853 of SciPy over half a
    period, with tangents; Newton's method and steps of arc length follow the curve.  Floquet multipliers
    determine the stability.

    Parameters
    ----------
    system : System or ReducedModel
        Damping is ignored.  A system may have one stationary striker, a :class:`~snapbeam.FixedStop` under an
        elastic contact law; nothing else may act on the beam.
    well : {"lower", "upper", "both"}
        Motion about a well, or across both.
    mode : int
        Linear mode in which the motion about a well begins, 1 for the lowest; not used across both wells.
    amplitude_limit : float
        The curve ends where the centre of the beam is this many length scales away from its middle position.
    lowest_frequency_ratio : float
        The curve ends where the frequency is this many first natural frequencies: in a well, the period grows without bound
        towards the barrier.
    max_points : int
        Maximum number of points of the curve.
    max_step : float
        Maximum arc length between two points, in length scales and in half periods over pi/omega_1.  Near an internal
        resonance the curve has a narrow tongue; a short step follows it, a long one passes it.
    progress : callable or bool, optional
        Called as ``progress(done, total)`` with points; True writes a line to standard error.

    Returns
    -------
    xarray.Dataset
        Over ``point``: ``frequency`` (Hz), ``frequency_ratio``, ``energy`` (J, above the well), ``min_midspan``
        and ``max_midspan`` (over the length scale), ``stable``, ``unstable_multipliers``; over ``point`` and
        ``mode`` ``initial_amplitude`` (of the buckling modes, at rest) and ``participation``, the share of each
        linear mode in the mean kinetic energy; over ``point`` and ``multiplier`` their size and angle.  The
        attribute ``end`` gives the reason why the curve ends: among others at an equilibrium or where the two
        turning points meet, since from there on the same motions would follow again.

    Raises
    ------
    InputError
        For a system with an excitation, a lossy contact, or a beam without two wells if both are requested.
    RuntimeError
        If no motion is found where the curve begins.

    Notes
    -----
    With one mode the frequencies are those of elliptic integrals: for U = -k x^2/2 + g x^4/4 and the mass m the period
    about a well is 2 K(1 - x_1^2/x_0^2) / (x_0 sqrt(g/2m)), with turning points x_1 < x_0 (Kovacic and Brennan, The Duffing
    Equation, Wiley, 2011, chapter 4).  The cost grows with the square of the number of modes and with the highest
    frequency; use up to about 12.

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> model = sb.ReducedModel.from_beam(paper.BEAM, modes=1)
    >>> curve = sb.dynamics.backbone_curve(model, amplitude_limit=0.3)
    >>> bool(curve.frequency[0] > curve.frequency[-1])  # the motion about a well softens
    True
    """
    choice("well", well, _WELLS)
    within("lowest_frequency_ratio", lowest_frequency_ratio, 0.0, 1.0)
    positive("amplitude_limit", amplitude_limit)
    within("max_step", max_step, 1e-4, 1.0)
    integer("max_points", max_points, 3, 100_000)
    structure = _Structure(system, well)
    integer("mode", mode, 1, structure.size)
    report = counting(progress, "backbone curve", "points")
    start = structure.start_about_well(mode) if well != "both" else structure.start_across()
    limits = amplitude_limit, np.pi / lowest_frequency_ratio, max_step
    if well == "both":
        back, _ = _follow(structure, start, -1.0, limits, max_points // 2, report, 0, max_points)
        ahead, end = _follow(
            structure, start, 1.0, limits, max_points - len(back), report, len(back), max_points
        )
        points = [*reversed(back[1:]), *ahead]
    else:
        points, end = _follow(structure, start, 1.0, limits, max_points, report, 0, max_points)
    return _dataset(structure, points, end)


class _Structure:
    """Equations of free motion in the linear modes about a well, in units of its amplitude and of 1/omega_1."""

    def __init__(self, system: System | ReducedModel, well: str) -> None:
        if isinstance(system, ReducedModel):
            model, stop = system, None
        elif isinstance(system, System):
            model, stop = system.model, _stop_of(system)
        else:
            raise InputTypeError(f"system = {shown(system)}: must be a System or a ReducedModel")
        if well != "lower":
            model.require_bistable(f"a backbone curve with well = {well!r}")
        if model.length_scale is None:
            raise InputError(
                "system: a straight beam has no length scale; give a buckled beam or a length_scale"
            )
        self.model, self.well, self.size = model, well, model.modes
        self.rest = _rest(model, "upper" if well == "upper" else "lower")
        tangent = tangent_stiffness(
            model.stiffness, model.nonlinear_stiffness, self.rest, model.elongation_matrix
        )
        from scipy.linalg import eigh

        squares, self.shapes = eigh(tangent, model.mass)
        if squares[0] <= 0.0:
            raise InputError("system: its equilibrium is not stable; a backbone curve needs a well")
        self.omega = np.sqrt(squares)
        self.unit = float(self.omega[0])
        self.scale = model.length_scale / float(np.abs(model.midspan_shape @ self.shapes).max())
        """Length of a coordinate of 1: it moves mid-span by about the length scale."""
        self.back = self.shapes * self.scale
        """Amplitudes of the buckling modes for each coordinate."""
        self.squares = squares / self.unit**2
        self.tension = self.shapes.T @ model.pulled(self.shapes)
        self.pull_at_rest = self.shapes.T @ model.pulled(self.rest) / self.scale
        self.strength = model.nonlinear_stiffness * self.scale**2 / self.unit**2
        self.stop: tuple[Any, _Array, float] | None = None
        if stop is not None:
            self._add_stop(*stop)

    def _add_stop(self, law: Any, location: float, gap: float, side: float) -> None:
        """A stop at a gap from the beam at rest: below it in the lower well (side 1), or above it in the upper one (-1)."""
        shape = np.asarray(self.model.shape_at(location))
        facing = _rest(self.model, "lower" if side > 0.0 else "upper")
        begin = -gap - side * float(shape @ (self.rest - facing))
        if begin > 0.0:
            raise InputError("system: the stop presses on the beam at rest; give a gap of 0 or more")
        self.stop = law, -side * (shape @ self.back), begin

    # ------------------------------------------------------------------ forces

    def acceleration(self, y: _Array) -> _Array:
        """y'' of coordinates about the well, per omega_1^2, with the tension in the form of the linear modes."""
        pulled = self.tension @ y
        square = float(y @ pulled)
        along = 2.0 * float(self.pull_at_rest @ y) + square
        total: _Array = -self.squares * y - self.strength * (square * self.pull_at_rest + along * pulled)
        if self.stop is not None:
            law, row, begin = self.stop
            depth = begin + float(row @ y)
            if depth > 0.0:
                total = total - row * (type(law).force(law, depth) / (self.scale * self.unit) ** 2)
        return total

    def slope(self, y: _Array) -> _Array:
        """Derivative of the acceleration."""
        pulled = self.tension @ y
        both = self.pull_at_rest + pulled
        along = 2.0 * float(self.pull_at_rest @ y) + float(y @ pulled)
        matrix = 2.0 * (np.outer(self.pull_at_rest, pulled) + np.outer(pulled, both)) + along * self.tension
        matrix *= -self.strength
        matrix.flat[:: self.size + 1] -= self.squares
        if self.stop is not None:
            law, row, begin = self.stop
            depth = begin + float(row @ y)
            if depth > 0.0:
                matrix -= np.outer(row, row) * (type(law).slope(law, depth) / (self.scale * self.unit) ** 2)
        return matrix

    def energy(self, y: _Array) -> float:
        """Potential energy above the well, J."""
        found = float(
            self.model.potential_energy(self.rest + self.back @ y) - self.model.potential_energy(self.rest)
        )
        if self.stop is not None:
            law, row, begin = self.stop
            depth = begin + float(row @ y)
            found += float(type(law).energy(law, depth)) if depth > 0.0 else 0.0
        return found

    def centre(self, y: _Array) -> _Array:
        """Displacement of the centre over the length scale, for coordinates of shape (..., N)."""
        found: _Array = (self.rest + y @ self.back.T) @ self.model.midspan_shape / self.model.length_scale
        return found

    # ------------------------------------------------------------------ half a period

    def half(self, y: _Array, time: float, columns: int) -> tuple[_Array, _Array, _Array]:
        """State after half a period from rest, and its derivative by the first *columns* of the initial state."""
        from scipy.integrate import solve_ivp

        n = self.size

        def rate(_: float, z: _Array) -> _Array:
            y, v = z[:n], z[n : 2 * n]
            carried = z[2 * n :].reshape(2 * n, columns)
            bent = self.slope(y) @ carried[:n]
            return np.concatenate((v, self.acceleration(y), carried[n:].ravel(), bent.ravel()))

        begun = np.concatenate((y, np.zeros(n), np.eye(2 * n)[:, :columns].ravel()))
        done = solve_ivp(rate, (0.0, time), begun, method="DOP853", rtol=_RTOL, atol=_ATOL)
        last = done.y[:, -1]
        return last[:n], last[n : 2 * n], last[2 * n :].reshape(2 * n, columns)

    def waveform(self, y: _Array, time: float) -> tuple[_Array, _Array]:
        """Coordinates and velocities at even instants of half a period, each of shape (instants, N)."""
        from scipy.integrate import solve_ivp

        n = self.size
        times = np.linspace(0.0, time, _SAMPLES + 1)
        done = solve_ivp(
            lambda _, z: np.concatenate((z[n:], self.acceleration(z[:n]))),
            (0.0, time), np.concatenate((y, np.zeros(n))), method="DOP853", t_eval=times, rtol=_RTOL, atol=_ATOL,
        )  # fmt: skip
        return done.y[:n].T, done.y[n:].T

    # ------------------------------------------------------------------ where curves begin

    def start_about_well(self, mode: int) -> tuple[_Array, _Array]:
        """A small motion of a linear mode, and the direction of the curve there."""
        y = np.zeros(self.size + 1)
        sign = (
            1.0 if self.model.midspan_shape @ self.shapes[:, mode - 1] * self.centre(y[:-1]) < 0.0 else -1.0
        )
        y[mode - 1] = 1e-3 * sign  # towards the other well
        y[-1] = np.pi * self.unit / float(self.omega[mode - 1])
        direction = np.zeros(self.size + 1)
        direction[mode - 1] = sign
        return y, direction

    def start_across(self) -> tuple[_Array, _Array]:
        """A motion across both wells with some times the energy of the barrier, and a direction of greater energy."""
        from scipy.integrate import solve_ivp
        from scipy.optimize import brentq

        model = self.model
        barrier = float(model.saddle_energy - model.potential_energy(self.rest))
        saddle = None if model.landscape is None else model.landscape.saddle
        middle = np.zeros(self.size) if saddle is None else saddle.amplitude
        way = np.linalg.solve(self.back, middle - self.rest)
        for times in (3.0, 6.0, 12.0):
            level = times * barrier

            def above(s: float, level: float = level) -> float:
                return self.energy(way * s) - level

            far = 2.0
            while above(far) < 0.0:
                far *= 1.5
            high = brentq(above, 1.0, far)
            norm = float(way @ way)

            def rate(_: float, z: _Array, norm: float = norm) -> list[float]:
                return [z[1], float(way @ self.acceleration(way * z[0])) / norm]

            def turned(_: float, z: _Array) -> float:
                return z[1] if z[0] < 1.0 else -1.0

            turned.terminal = True  # type: ignore[attr-defined]
            done = solve_ivp(
                rate, (0.0, 200.0), [high, 0.0], method="DOP853", events=turned, rtol=1e-9, atol=1e-11
            )
            if not done.t_events[0].size:
                continue
            guess = np.append(way * high, done.t_events[0][0])
            direction = np.append(way / np.sqrt(norm), 0.0)
            if _corrected(self, guess, direction, guess) is not None:
                return guess, direction
        raise RuntimeError(
            "no motion across both wells was found from the shape of the saddle; use fewer modes, or follow it from a model "
            "with one mode"
        )


def _rest(model: ReducedModel, well: str) -> _Array:
    """Amplitudes at rest in a well, or in the only one."""
    if not model.is_bistable:
        return np.asarray(model.well_amplitude, dtype=np.float64)
    sign = 1.0 if well == "upper" else -1.0
    return next(
        each.amplitude
        for each in model.equilibria
        if each.is_stable and sign * float(model.midspan_shape @ each.amplitude) > 0.0
    )


def _stop_of(system: System) -> tuple[Any, float, float, float] | None:
    """Law, location, gap and side of the one stop of a system.

    Raises
    ------
    InputError
        If anything else acts on the beam.
    """
    acting = [
        name for name in ("base_excitation", "axial_load", "forces", "harvesters") if getattr(system, name)
    ]
    acting += ["more than one striker"] if system.contacts[1:] else []
    if acting:
        raise InputError(
            f"system with {', '.join(acting)}: a backbone curve is of free motion; leave {'it' if len(acting) == 1 else 'them'} out"
        )
    striker, law = system.striker, system.contact_law
    if striker is None or law is None:
        return None
    if not isinstance(striker.drive, FixedStop) or striker.mass is not None:
        raise InputError(
            "system: its striker moves; a backbone curve is of free motion: give system.model alone, or a striker with a "
            "FixedStop and without a mass"
        )
    if law.is_dissipative or law.impulsive:
        raise InputError(f"contact = {shown(law)}: loses energy; use a HertzContact or a PowerLaw")
    gap = 0.0 if striker.gap is None else float(striker.gap)
    return law, striker.location, gap, 1.0 if striker.side == "below" else -1.0


# Newton's method and steps of arc length.  A point is (y, half period): a motion that begins at rest and turns back.


def _corrected(
    structure: _Structure, guess: _Array, direction: _Array, anchor: _Array
) -> tuple[_Array, _Array, _Array, int] | None:
    """The motion in the plane across *direction*, the direction of the curve there, where it turns back, the iterations."""
    n, point = structure.size, guess.copy()
    for iteration in range(12):
        if not 0.0 < point[-1] < 1e4 or not np.isfinite(point).all():
            return None
        y, v, carried = structure.half(point[:-1], float(point[-1]), n)
        matrix = np.zeros((n + 1, n + 1))
        matrix[:n, :n], matrix[:n, n] = carried[n:], structure.acceleration(y)
        matrix[n] = direction
        residual = np.append(v, direction @ (point - anchor))
        if np.abs(residual).max() < _CONVERGED and iteration:
            along = svd(matrix[:n])[2][-1]
            return point, along * np.sign(along @ direction or 1.0), y, iteration
        try:
            step = np.linalg.solve(matrix, residual)
        except np.linalg.LinAlgError:
            return None
        size = float(np.abs(step[:-1]).max())
        point = point - step * min(1.0, 0.5 / max(size, 1e-300))
    return None


def _vanishing(before: _Array, after: _Array) -> float | None:
    """Part of the way between two points of a curve at which a vector vanishes; None where its chord misses zero."""
    chord = after - before
    square = float(chord @ chord)
    if (
        min(np.abs(before).max(), np.abs(after).max()) < _SAME_STATE
        or not 0.0 < -float(before @ chord) < square
    ):
        return None
    part = -float(before @ chord) / square
    return part if np.linalg.norm(before + part * chord) < _NEAR_ZERO * np.sqrt(square) else None


def _follow(
    structure: _Structure,
    start: tuple[_Array, _Array],
    way: float,
    limits: tuple[float, float, float],
    max_points: int,
    report: Callable[[int, int], object] | None,
    before: int,
    total: int,
) -> tuple[list[dict[str, Any]], str]:
    """Measures of the points of a curve from its start in one direction, and why it ends.

    A point is measured when it is found, which takes as long as to find it: the progress is that of both.  The *limits* are the maximum displacement of the centre, half period and arc length between two points.
    """
    found = _corrected(structure, start[0], start[1], start[0])
    if found is None:
        raise RuntimeError("no motion was found where the curve begins; choose another mode")
    point, along, turned, _ = found
    apart = turned - point[:-1]
    last, direction, length = point, way * along, min(_FIRST, limits[2])
    points = [_measures(structure, point)]
    while len(points) < max_points:
        if report is not None:
            report(before + len(points), total)
        guess = last + length * direction
        found = _corrected(structure, guess, direction, guess)
        if found is None or found[1] @ direction < 0.7:  # lost, or around too sharp a bend
            length *= 0.5
            if length < _SHORTEST:
                return points, "Newton's method no longer converges"
            continue
        point, direction, turned, iterations = found
        last_apart, apart = apart, turned - point[:-1]
        part = _vanishing(last_apart, apart)
        if part is not None:
            met = ((1.0 - part) * last + part * point)[:-1]
            near = _NEAR_ZERO * np.linalg.norm(apart - last_apart)
            if np.linalg.norm(met) < near:
                return points, _AT_REST
            to_rest = lstsq(structure.slope(met), structure.acceleration(met))
            return points, _OTHER_REST if np.linalg.norm(to_rest) < near else _RETRACED
        points.append(_measures(structure, point))
        last = point
        if iterations <= 3:
            length = min(1.4 * length, limits[2])
        ends = structure.centre(point[:-1]), structure.centre(turned)
        middle = 0.0 if structure.well == "both" else structure.centre(np.zeros(structure.size))
        if max(abs(each - middle) for each in ends) > limits[0]:
            return points, "amplitude_limit"
        if point[-1] > limits[1]:
            return points, "lowest_frequency_ratio"
        if structure.well != "both" and np.abs(point[:-1]).max() < 5e-4:
            return points, _AT_REST
    return points, "max_points"


def _multipliers(structure: _Structure, point: _Array) -> NDArray[np.complex128]:
    """Floquet multipliers over a whole period, from the tangents of half of one: the motion retraces itself."""
    n = structure.size
    _, _, half = structure.half(point[:-1], float(point[-1]), 2 * n)
    mirror = np.diag([1.0] * n + [-1.0] * n)
    found: NDArray[np.complex128] = np.linalg.eigvals(mirror @ np.linalg.solve(half, mirror @ half))
    return found[np.argsort(-np.abs(found))]


def _measures(structure: _Structure, point: _Array) -> dict[str, Any]:
    """Numbers of the dataset for one point."""
    y, v = structure.waveform(point[:-1], float(point[-1]))
    centre, kinetic = structure.centre(y), np.trapezoid(v**2, axis=0)
    multipliers = _multipliers(structure, point)
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
    from snapbeam.util.datasets import xr

    model, n = structure.model, structure.size
    rows = {name: [point[name] for point in points] for name in points[0]}
    frequency = np.array(rows["frequency"])
    reference = model.reference_frequency
    unstable = np.array(rows["unstable"])
    variables: dict[str, tuple[Any, Any, str, str]] = {
        "frequency": ("point", frequency, "Hz", "frequency of the free motion"),
        "frequency_ratio": ("point", frequency / reference, "1", "frequency over the first natural frequency"),
        "energy": ("point", rows["energy"], "J", "energy above the well"),
        "min_midspan": ("point", rows["low"], "1", "minimum displacement of mid-span, over the length scale"),
        "max_midspan": ("point", rows["high"], "1", "maximum displacement of mid-span, over the length scale"),
        "stable": ("point", unstable == 0, "1", "whether no Floquet multiplier is outside the unit circle"),
        "unstable_multipliers": ("point", unstable, "1", "Floquet multipliers outside the unit circle"),
        "participation": (("point", "mode"), rows["share"], "1", "fraction of a linear mode in the mean kinetic energy"),
        "initial_amplitude": (
            ("point", "mode"), rows["begun"], "1" if model.beam is None else "m^0.5",
            "amplitude of a buckling mode where the motion turns back",
        ),
        "multiplier_size": (("point", "multiplier"), rows["size"], "1", "size of a Floquet multiplier"),
        "multiplier_angle": (("point", "multiplier"), rows["angle"], "rad", "angle of a Floquet multiplier"),
    }  # fmt: skip
    dataset = xr.Dataset(
        coords={"mode": np.arange(1, n + 1)},
        attrs={
            "title": "backbone curve",
            "well": structure.well,
            "end": end,
            "modes": n,
            "reference_frequency": reference,
            "length_scale": model.length_scale,
            "natural_frequencies": (structure.omega / (2.0 * np.pi)).tolist(),
        },
    )
    for name, (dims, values, unit, words) in variables.items():
        dataset[name] = (dims, np.asarray(values), {"units": unit, "long_name": words})
    return dataset
