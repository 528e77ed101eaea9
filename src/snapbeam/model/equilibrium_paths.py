"""Equilibrium paths of any potential over a point force or another parameter, by continuation in arc length.

The equilibria of a system under the force F on the row c solve dU/dalpha = F c, those over a parameter p of the system
dU(alpha; p)/dalpha = 0.  Every path through an equilibrium without the force, or at one of some values of p, is followed to both sides by steps along its tangent and Newton's method on the plane across it
(Keller 1977), and so is every path that branches off.  Where a law of a local force has no closed form, nothing else is
possible; a closed path that has no equilibrium without the force, and meets no other path, is not found then.  Of a
structure without local forces, whose equilibria are known in closed form, it is, by its equilibria under many forces.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.potential import Potential
from snapbeam.util.diagnostics import Diagnostic, tell
from snapbeam.util.singular_values import lstsq, svd
from snapbeam.util.validation import InputError

_Array = NDArray[np.float64]

_STEP = 1.0 / 80.0
"""Longest step; displacement and amplitudes over those of the wells, the force over that which moves a well as far."""
_SHORTEST = 1e-7
_STEPS = 20_000
"""Maximum number of steps of a path."""
_TURN = 0.15
"""Angle between the tangents of two points, rad."""
_LARGEST = 100.0
"""Force up to which a path is followed where a local force may grow without bound, in its unit."""
_NEWTON = 12
_LEAST_NORM = 40
"""Steps of minimum norm, whose convergence is linear at a singular point."""
_CONVERGED = 1e-12
_BALANCED = 1e-15
"""Residual over the forces of the structure, up to which it is rounding."""
_STALE = 1e-3
"""Step of Newton's method, scaled, up to which the derivative by the parameter is kept."""
_UNCOUPLED = 1e-6
"""Share of the row of the force in the direction that loses its stiffness, up to which a path branches off there."""
_ASIDE = 4e-3
"""First step on a path that branches off."""
_FORCES = 40
"""Forces, between the largest ones of singular points, under which closed paths are looked for."""
_VALUES = 5
"""Values of a parameter, over its range, whose equilibria are starting points."""
_DIFFERENCE = 1e-5
"""Half the distance of the values of a derivative by the parameter, over the range."""
_KNOWN = 256
"""Cached potentials, by the value of the parameter."""
_BESIDE = 0.02
"""Distance from the end of the range of a law, over that of the end from the straight beam."""
_SAME = 1e-3
"""Distance from a path, up to which a point lies on it."""


class Singular(NamedTuple):
    """A point where the tangent stiffness is singular: "limit", where the force turns round, or "bifurcation"."""

    place: int
    """Number of the point of the path."""
    kind: str


@dataclass
class EquilibriumPath:
    """A path: its points in order, force (N) or parameter, amplitudes, and the number of unstable directions."""

    value: _Array
    amplitude: _Array
    unstable: NDArray[np.int_]
    singular: tuple[Singular, ...]
    secondary: bool
    """True if the path branches off from another one."""
    closed: bool
    complete: bool
    """True if the path was followed to its ends: the range, another path, or the end of the range of a law."""


class _Point(NamedTuple):
    """A point in scaled coordinates y, amplitudes and force, with the unit tangent and the eigenvalues of the stiffness."""

    y: _Array
    tangent: _Array
    eigenvalues: _Array

    @property
    def unstable(self) -> int:
        return int((self.eigenvalues < 0.0).sum())


@dataclass
class _UnderForce:
    """The equilibria of a potential under a force on a row: the parameter is the force."""

    potential: Potential
    row: _Array
    asked: int = 0
    name, unit, ends_at_range = "location", "N", False

    @property
    def first(self) -> tuple[float, _Array]:
        """An equilibrium, by the force."""
        return 0.0, self.potential.equilibria[0].amplitude

    def at(self, value: float) -> Potential:
        """The force does not change the stiffness."""
        return self.potential

    def loaded(self, value: float) -> Potential:
        """The potential with the force."""
        return dataclasses.replace(self.potential, constant=self.potential.constant + value * self.row)

    def residual(self, alpha: _Array, value: float) -> _Array:
        return self.potential._gradient(alpha) - value * self.row

    def push(self, alpha: _Array, value: float) -> _Array:
        """Minus the derivative of the residual by the force."""
        return self.row

    def scale(self, stiffness: _Array, length: float) -> tuple[float, float]:
        """Origin and unit: the force that moves a well as far as the displacement of the wells."""
        reach = length * float(np.abs(self.row).max())
        return 0.0, reach / max(abs(float(self.row @ np.linalg.solve(stiffness, self.row))), 1e-300)

    def place(self, alpha: _Array, value: float) -> float:
        """Displacement of the point of the force."""
        return float(self.row @ alpha)

    def along(self, size: int) -> _Array:
        return np.append(self.row, 0.0)

    def values(self, singular: list[float]) -> list[float]:
        """Forces whose equilibria are starting points: none, and then many between those of the singular points."""
        self.asked += 1
        if self.asked == 1:
            return [0.0]
        if self.asked == 2 and not self.potential.local_forces:
            return list((np.linspace(-1.0, 1.0, _FORCES) * max(map(abs, singular), default=0.0)).tolist())
        return []


@dataclass
class _OverParameter:
    """The equilibria of a system over one of its parameters."""

    name: str
    unit: str
    of: Callable[[float], Potential]
    low: float
    high: float
    known: dict[float, Potential] = field(default_factory=dict)
    asked: int = 0
    ends_at_range = True

    @property
    def first(self) -> tuple[float, _Array]:
        """An equilibrium, by the parameter."""
        for value in np.linspace(self.low, self.high, _VALUES).tolist():
            if self.at(value).equilibria:
                return value, self.at(value).equilibria[0].amplitude
        raise InputError(
            f"{self.name}: there is no equilibrium at any of {_VALUES} values from {self.low:g} to {self.high:g} "
            f"{self.unit}; use another range"
        )

    def at(self, value: float) -> Potential:
        """The potential at a value."""
        if value not in self.known:
            if len(self.known) > _KNOWN:
                self.known.clear()
            self.known[value] = self.of(value)
        return self.known[value]

    loaded = at

    def residual(self, alpha: _Array, value: float) -> _Array:
        return self.at(value)._gradient(alpha)

    def push(self, alpha: _Array, value: float) -> _Array:
        """Minus the derivative of the gradient by the parameter, by differences within the range."""
        h = _DIFFERENCE * (self.high - self.low)
        ends = [min(max(end, self.low), self.high) for end in (value - h, value + h)]
        one, other = (self.at(end)._gradient(alpha) for end in ends)
        return (one - other) / (ends[1] - ends[0]) if ends[0] < ends[1] else np.zeros_like(alpha)

    def scale(self, stiffness: _Array, length: float) -> tuple[float, float]:
        """Origin and unit: the range."""
        return self.low, self.high - self.low

    def place(self, alpha: _Array, value: float) -> float:
        return value

    def along(self, size: int) -> _Array:
        return np.append(np.zeros(size - 1), 1.0)

    def values(self, singular: list[float]) -> list[float]:
        """Values whose equilibria are starting points: some over the range, once."""
        self.asked += 1
        return list(np.linspace(self.low, self.high, _VALUES).tolist()) if self.asked == 1 else []


@dataclass
class _Tracer:
    """Continuation of the equilibria of a family of potentials, between two places."""

    family: _UnderForce | _OverParameter
    low: float
    high: float
    paths: list[EquilibriumPath] = field(default_factory=list)
    lost: bool = False
    """True if the current path ended because the maximum number of steps was reached."""
    progress: Callable[[int, int], object] | None = None
    """Called with the equilibria from which paths were followed, and their number."""

    def __post_init__(self) -> None:
        value, first = self.family.first
        potential = self.family.at(value)
        self.length = float(np.abs(potential.size).max())
        stiffness = potential._tangent(first)
        self.origin, self.unit = self.family.scale(stiffness, self.length)
        self.balance = 1.0 / np.maximum(np.abs(stiffness).max(axis=1) * self.length, 1e-300)

    def amplitude(self, y: _Array) -> _Array:
        return self.length * y[:-1]

    def value(self, y: _Array) -> float:
        """The force or the parameter."""
        return self.origin + self.unit * float(y[-1])

    def potential(self, y: _Array) -> Potential:
        """The potential that gives the stiffness at a point."""
        return self.family.at(self.value(y))

    def _jacobian(self, y: _Array, push: _Array | None = None) -> _Array:
        """Derivatives of the scaled residual, shape (N, N + 1), that by the value from *push* if it is given."""
        stiffness = self.length * self.potential(y)._tangent(self.amplitude(y))
        if push is None:
            push = self.family.push(self.amplitude(y), self.value(y))
        return np.column_stack((stiffness, -self.unit * push)) * self.balance[:, None]

    def point(self, y: _Array, along: _Array) -> _Point:
        """The point with the tangent on the side of *along*."""
        tangent = svd(self._jacobian(y))[2][-1]
        potential = self.potential(y)
        stiffness = potential._in_modes(potential._tangent(self.amplitude(y)))
        tangent = math.copysign(1.0, float(tangent @ along)) * tangent
        return _Point(y, np.asarray(tangent), np.asarray(np.linalg.eigvalsh(stiffness)))

    def correct(self, guess: _Array, normal: _Array | None) -> _Array | None:
        """The point of the path on the plane across *normal* through *guess*; None if there is none near.

        Without *normal*, by steps of minimum norm: at a singular point no plane is across all paths.
        """
        y, push, moved = guess, None, math.inf
        for _ in range(_NEWTON if normal is not None else _LEAST_NORM):
            try:
                if not self.potential(y)._holds(self.amplitude(y)):
                    return None
                residual = self.family.residual(self.amplitude(y), self.value(y)) * self.balance
                if normal is None and np.abs(residual).max() <= _BALANCED:
                    return y  # at a singular point rounding moves it for ever
                if push is None or moved > _STALE:
                    push = self.family.push(self.amplitude(y), self.value(y))
                jacobian = self._jacobian(y, push)
                if normal is None:
                    step = lstsq(jacobian, residual, rcond=1e-9)
                else:
                    system = np.vstack((jacobian, normal))
                    step = np.linalg.solve(system, np.append(residual, normal @ (y - guess)))
            except (np.linalg.LinAlgError, InputError):
                return None
            y, moved = y - step, float(np.abs(step).max())
            if moved <= _CONVERGED * max(1.0, float(np.abs(y).max())):
                return y if self.potential(y)._holds(self.amplitude(y)) else None
        return y if normal is None else None

    def between(self, a: _Point, b: _Point, value: Callable[[_Point], float]) -> _Point:
        """The point between two points at which a *value* changes its sign."""
        from scipy.optimize import brentq

        away = b.y - a.y
        found = {0.0: a, 1.0: b}

        def at(share: float) -> float:
            if share not in found:
                y = self.correct(a.y + share * away, None)
                found[share] = self.point(a.y + share * away if y is None else y, away)
            return value(found[share])

        share = float(brentq(at, 0.0, 1.0, xtol=1e-13, rtol=1e-13))
        at(share)
        return found[share]

    def _at_value(self, value: float, a: _Point, b: _Point) -> _Point:
        """The point between two points at a force or value of the parameter."""
        return self.between(a, b, lambda point: self.value(point.y) - value)

    def singular_between(self, a: _Point, b: _Point) -> tuple[_Point, str] | None:
        """The singular point between two neighbours, and its kind; None without one.

        Where the path keeps its unstable directions and the force turns round, it is one that branches off there.
        """
        if abs(a.unstable - b.unstable) > 1:
            raise InputError(
                f"{self.family.name}: {abs(a.unstable - b.unstable)} directions lose their stiffness at the same value, "
                f"{self.value(a.y):.6g} {self.family.unit}, whose branches cannot be told apart; change the structure a little"
            )
        if a.unstable == b.unstable:
            if a.tangent[-1] * b.tangent[-1] >= 0.0:
                return None
            return self.between(a, b, lambda point: float(point.tangent[-1])), "origin"
        lost = min(a.unstable, b.unstable)
        found = self.between(a, b, lambda point: float(point.eigenvalues[lost]))
        direction = self.null_direction(found)
        push = self.family.push(self.amplitude(found.y), self.value(found.y))
        size = float(np.linalg.norm(push) * np.linalg.norm(direction))
        part = abs(float(push @ direction)) / size if size > 0.0 else 0.0
        return found, "limit" if part > _UNCOUPLED else "bifurcation"

    def null_direction(self, point: _Point) -> _Array:
        """Amplitudes of the direction without stiffness."""
        potential = self.potential(point.y)
        values, axes = np.linalg.eigh(potential._in_modes(potential._tangent(self.amplitude(point.y))))
        return np.asarray(potential.model.linear_modes @ axes[:, int(np.abs(values).argmin())])

    def is_known(self, y: _Array) -> bool:
        """Return whether a point is on a path that was already followed."""
        for path in self.paths:
            points = np.column_stack((path.amplitude / self.length, (path.value - self.origin) / self.unit))
            begin, away = points[:-1], np.diff(points, axis=0)
            along = np.clip(((y - begin) * away).sum(1) / np.maximum((away * away).sum(1), 1e-300), 0.0, 1.0)
            if np.sqrt((((begin + along[:, None] * away) - y) ** 2).sum(1).min()) < _SAME:
                return True
        return False

    def follow(self, start: _Point) -> tuple[list[_Point], dict[int, str], bool]:
        """Points after *start* in the direction of its tangent, the kinds of the singular ones, and whether it closed.

        A path ends where it meets another one.
        """
        points, singular, step = [start], dict[int, str](), _STEP / 4.0
        for _ in range(_STEPS):
            here = points[-1]
            y = self.correct(here.y + step * here.tangent, here.tangent)
            new = None if y is None else self.point(y, here.tangent)
            if new is not None:
                turned = math.acos(min(1.0, float(new.tangent @ here.tangent)))
                jumped = np.linalg.norm(new.y - here.y) > 2.0 * step
                crossed = abs(new.unstable - here.unstable) > 1 and step > 1e3 * _SHORTEST
                if turned > _TURN or jumped or crossed:
                    new = None
            if new is None:
                step *= 0.5
                if step < _SHORTEST:
                    self.lost |= not self._is_at_end_of_a_law(here.y)
                    return points, singular, False
                continue
            between = self.singular_between(here, new)
            if between is not None:
                points.append(between[0])
                if between[1] != "limit" and self.is_known(between[0].y):
                    return points, singular, False
                singular[len(points) - 1] = between[1]
                if between[1] == "origin":
                    return points, singular, False
            closes = np.linalg.norm(new.y - start.y) < 0.75 * step and float(new.tangent @ start.tangent) > 0.9
            if len(points) > 8 and closes:
                return [*points, start], singular, True
            points.append(new)
            place, before = (self.family.place(self.amplitude(each), self.value(each)) for each in (new.y, here.y))
            end = self.high if place > self.high and place > before else self.low
            if (place > self.high and place > before) or (place < self.low and place < before):
                if self.family.ends_at_range:
                    points.pop()
                    if before != end:
                        points.append(self._at_value(end, here, new))
                return points, singular, False
            if self.potential(new.y).local_forces and abs(new.y[-1]) > _LARGEST:
                return points, singular, False
            step = min(_STEP * max(1.0, abs(float(new.y[-1]))), 1.5 * step)
        self.lost = True
        return points, singular, False

    def _is_at_end_of_a_law(self, y: _Array) -> bool:
        """Return whether a local force is next to the end of the range of its law, which the path cannot pass."""
        potential = self.potential(y)
        for row, law in zip(potential.rows, potential.local_forces, strict=True):
            u = float(row @ self.amplitude(y))
            if any(abs(end - u) <= _BESIDE * abs(end) for end in law.displacement_range(law.numbers)):
                return True
        return False

    def add(self, start: _Point, secondary: bool) -> None:
        """Follow the path through a point to both sides, and then those that branch off from it.

        A path that turns out to branch off itself is left, for the one that it branches off from.
        """
        self.lost = False
        forth, special, closed = self.follow(start)
        back: list[_Point] = []
        turned: dict[int, str] = {}
        if not closed:
            back, turned, _ = self.follow(start._replace(tangent=-start.tangent))
        points = [*back[:0:-1], *forth]
        shift = max(len(back) - 1, 0)
        kinds = {shift - at: kind for at, kind in turned.items()}
        kinds |= {shift + at: kind for at, kind in special.items()}
        for at, kind in kinds.items():
            if kind == "origin":
                self._add_beside(points[at], svd(self._jacobian(points[at].y))[2][-2:], False)
                return
        unstable = np.array([point.unstable for point in points])
        for at in kinds:
            unstable[at] = unstable[[at - 1, (at + 1) % len(points)]].min()
        if not closed:
            unstable[[0, -1]] = unstable[[1, -2]]  # a singular point, where the path meets another one
        self.paths.append(
            EquilibriumPath(
                value=np.array([self.value(point.y) for point in points]),
                amplitude=np.array([self.amplitude(point.y) for point in points]),
                unstable=unstable,
                singular=tuple(Singular(at, kinds[at]) for at in sorted(kinds)),
                secondary=secondary,
                closed=closed,
                complete=not self.lost,
            )
        )
        forks = [points[at] for at, kind in kinds.items() if kind == "bifurcation"]
        forks.sort(key=self._mode_of)
        for fork in forks:
            direction = np.append(self.null_direction(fork), 0.0)
            self._add_beside(fork, direction[None] / np.linalg.norm(direction), True)

    def _mode_of(self, fork: _Point) -> int:
        """The number of the mode in which a path branches off."""
        modes = self.potential(fork.y).model.linear_modes
        return int(np.abs(np.linalg.solve(modes, self.null_direction(fork))).argmax())

    def _add_beside(self, fork: _Point, space: _Array, secondary: bool) -> None:
        """Follow the paths through a bifurcation in the direction of a line, or of the part of a plane across its tangent."""
        away = space[0]
        if len(space) > 1:
            part = space @ fork.tangent
            away = part[1] * space[0] - part[0] * space[1]
            away /= np.linalg.norm(away)
        for sign in (1.0, -1.0):
            y = self.correct(fork.y + sign * _ASIDE * away, away)
            if y is not None and not self.is_known(y):
                self.add(self.point(y, sign * away), secondary)

    def run(self) -> list[EquilibriumPath]:
        """All paths: through the equilibria at the family's values, those that branch off, and closed ones between."""
        values = self.family.values([])
        while len(values):
            starts = [
                (value, each.amplitude)
                for value in values
                for each in self.family.loaded(value).equilibria
                if self.low <= self.family.place(each.amplitude, value) <= self.high
            ]
            for done, (value, alpha) in enumerate(starts):
                if self.progress is not None:
                    self.progress(done, len(starts))
                y = np.append(alpha / self.length, (value - self.origin) / self.unit)
                if not self.is_known(y):
                    self.add(self.point(y, self.family.along(len(y))), False)
            if self.progress is not None:
                self.progress(len(starts), len(starts))
            values = self.family.values([float(path.value[at]) for path in self.paths for at, _ in path.singular])
        return self.paths


def equilibrium_paths(potential: Potential, row: _Array, between: tuple[float, float]) -> list[EquilibriumPath]:
    """Paths of the equilibria of a potential under a force on *row*, a little beyond two displacements of its point."""
    return _Tracer(_UnderForce(potential, row), *between).run()


def paths_over_parameter(
    name: str,
    unit: str,
    of: Callable[[float], Potential],
    between: tuple[float, float],
    progress: Callable[[int, int], object] | None = None,
) -> list[EquilibriumPath]:
    """Paths of the equilibria of the potentials *of* the values of a parameter, between two values."""
    return _Tracer(_OverParameter(name, unit, of, *between), *between, progress=progress).run()


def attributes(unit: str, words: str) -> dict[str, str]:
    """Attributes of a variable."""
    return {"units": unit, "long_name": words}


def critical_points(paths: list[EquilibriumPath]) -> tuple[list[tuple[float, _Array, int]], dict[str, Any]]:
    """Value, amplitudes and unstable directions at each singular point, and the variables of their kinds and branches."""
    special = [(number, *each) for number, path in enumerate(paths) for each in path.singular]
    points = [
        (float(paths[number].value[at]), paths[number].amplitude[at], int(paths[number].unstable[at]))
        for number, at, _ in special
    ]
    kinds = np.array([kind for _, _, kind in special], dtype="<U11")
    numbers = np.array([number for number, _, _ in special], dtype=np.int64)
    return points, {
        "critical_kind": ("critical_point", kinds, {"long_name": "kind of the critical point"}),
        "critical_branch": ("critical_point", numbers, attributes("1", "branch of the critical point")),
    }


def count_incomplete(paths: list[EquilibriumPath]) -> int:
    """Number of paths that end for want of steps, about which a diagnostic is given."""
    lost = sum(not each.complete for each in paths)
    if lost:
        message = f"{lost} of {len(paths)} branches end for want of steps, and those beyond are missing"
        tell([Diagnostic("incomplete-curve", message, {"incomplete_branches": float(lost)})])
    return lost


def stable_parts(path: EquilibriumPath) -> list[tuple[int, int]]:
    """First and last points of the stable parts of a path, singular points at their ends included."""
    ends = [0, *(each.place for each in path.singular), len(path.value) - 1]
    return [(a, b) for a, b in pairwise(ends) if b > a + 1 and not path.unstable[(a + b) // 2]]
