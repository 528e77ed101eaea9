"""Newton shooting: states that a flow brings back, and the derivative of the flow there."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.dynamics.flow import AdvancedStates, Flow
from snapbeam.dynamics.stroboscope import Stroboscope
from snapbeam.util.cores import usable_cores
from snapbeam.util.validation import InputError, within

_SPLIT = 16
"""Tangents from which on they are shared among threads."""
_LONGEST = 0.25
"""Longest step of Newton's method, in units of the well's amplitude."""
_ROUNDING = 1e-10
"""Residual below which Newton's method can only have stopped by rounding."""
LARGEST_TOLERANCE = 1e-3
"""Maximum tolerance of an orbit: with a larger one the guess itself would count as an orbit."""
_SLOW = 0.25
"""Factor by which a step must lessen the residual, or else the derivative is computed again."""
_Array = NDArray[np.float64]


class OrbitNotFoundError(RuntimeError):
    """Error if no orbit was found; the message states the cause and a remedy.

    See Also
    --------
    snapbeam.dynamics.periodic_orbit

    Examples
    --------
    >>> import snapbeam as sb
    >>> system = sb.paper.struck_beam(frequency_ratio=1.6, velocity_amplitude=0.03, damping_ratio=0.05)
    >>> try:
    ...     sb.dynamics.periodic_orbit(system, [5.0, 3.0], iterations=2)
    ... except sb.dynamics.OrbitNotFoundError as error:
    ...     print(type(error).__name__)
    OrbitNotFoundError
    """


class Shot(NamedTuple):
    """Result of Newton's method."""

    x: _Array
    residual: float
    iterations: int


class Family:
    """A flow over the parameters *names*, at any values of them; without one it stays as it is."""

    def __init__(self, flow: Flow, *names: str) -> None:
        self.flow, self.names = flow, names
        self._beside = not isinstance(flow, Stroboscope) or all(flow.system.parameter(name).is_run for name in names)

    def advance(
        self, x: _Array, periods: int, values: ArrayLike = (), tangents: _Array | None = None
    ) -> AdvancedStates:
        """Take states of shape (runs, d) some periods on, at values of the parameters, shape (k,) or (runs, k)."""
        if not self.names:
            return self.flow.advance(x, periods, tangents=tangents)
        if not self._beside:
            return self.at(values).advance(x, periods, tangents=tangents)
        table = np.broadcast_to(values, (len(x), len(self.names)))
        points = {name: np.ascontiguousarray(table[:, k]) for k, name in enumerate(self.names)}
        return self.flow.advance(x, periods, tangents=tangents, points=points)

    def at(self, values: ArrayLike) -> Flow:
        """The flow at values of the parameters, shape (k,)."""
        return self.flow.changed(dict(zip(self.names, np.asarray(values).tolist(), strict=True)))

    def slope(self, x: _Array, periods: int, values: _Array, step: _Array) -> _Array:
        """Derivative by the parameters of where the flow brings one state, shape (d, k), with the *step* of each."""
        if self._beside and isinstance(self.flow, Stroboscope):
            given = dict(zip(self.names, values.tolist(), strict=True))
            flow, steps = self.flow, zip(self.names, step.tolist(), strict=True)
            return np.stack([flow.slope(x, periods, given, name, own) for name, own in steps], axis=1)
        above, below = (
            np.stack([self.advance(x[None], periods, each).states[0] for each in values + sign * np.diag(step)])
            for sign in (1.0, -1.0)
        )
        return np.asarray((above - below).T / (2.0 * step))


class Return(NamedTuple):
    """Image of a state under the return map, with the derivative by the state."""

    x: _Array
    jacobian: _Array
    """Shape (d, d)."""
    impacts: int
    """Impacts on the way; -1 if unknown."""


def jacobian(family: Family, x: _Array, periods: int, values: ArrayLike = ()) -> Return:
    """One state some periods on, with the derivative of where it comes to."""
    size = x.size
    shares = min(usable_cores(), max(1, size // _SPLIT))
    shares = next(count for count in range(shares, 0, -1) if size % count == 0)
    tangents = np.eye(size).reshape(shares, size // shares, size)
    advanced = family.advance(np.repeat(x[None], shares, axis=0), periods, values, tangents)
    assert advanced.tangents is not None
    return Return(advanced.states[0], advanced.tangents.reshape(size, size).T, int(impacts_of(advanced)[0]))


def impacts_of(advanced: AdvancedStates) -> NDArray[np.int64]:
    """Impacts of each run; -1 if unknown."""
    return np.asarray(advanced.statistics.get("impacts", np.full(len(advanced.states), -1)))


def require_isolated_orbits(flow: Flow) -> None:
    """Refuse a system whose periodic orbits form a continuum."""
    if isinstance(flow, Stroboscope) and any(each.law.memory for each in flow.system.contacts):
        raise InputError(
            "contact: a periodic motion keeps any indentation that its impacts do not deepen, so that orbits and attractors are not "
            "isolated; follow the motion by sb.dynamics.poincare_section or sb.advance"
        )


def newton(
    residual: Callable[[_Array], _Array],
    derivative: Callable[[_Array], tuple[_Array, _Array]],
    x: _Array,
    tolerance: float,
    iterations: int,
    first: _Array | None = None,
    deflate: tuple[_Array, ...] = (),
) -> Shot:
    """A root by Newton's method, its derivative (at first *first*) kept by Broyden's updates as long as steps gain.

    It avoids the roots *deflate* (Farrell, Birkisson and Funke, SIAM J. Sci. Comput. 37 (2015) A2026).
    """
    fresh = first is None
    if first is None:
        r, slope = derivative(x)
    else:
        r, slope = residual(x), first
    size = float(np.abs(r).max())
    for count in range(iterations + 1):
        if not np.isfinite(size):
            raise OrbitNotFoundError("a run failed on the way; begin nearer to the orbit")
        if size <= tolerance and not any(float(np.abs(x - other).max()) < 1e-6 for other in deflate):
            return Shot(x, size, count)
        if count == iterations:
            break
        try:
            step: NDArray[Any] = np.linalg.solve(slope, -r)
        except np.linalg.LinAlgError:
            raise OrbitNotFoundError(
                "the derivative is singular, as it is at a fold; change the parameter a little"
            ) from None
        step = _deflated(x, step, deflate)
        reach = float(np.abs(step).max())
        if reach > _LONGEST:
            step *= _LONGEST / reach
        found = residual(x + step)
        new = float(np.abs(found).max())
        if not new < size * (_SLOW if not fresh else 1.0) and new > tolerance:
            if not fresh:
                # the kept derivative no longer serves
                r, slope = derivative(x)
                size, fresh = float(np.abs(r).max()), True
                continue
            for _ in range(6):
                if deflate or new < size:
                    break
                step *= 0.5
                found = residual(x + step)
                new = float(np.abs(found).max())
            else:
                raise OrbitNotFoundError(
                    f"Newton's method stopped after {count + 1} iterations, since no step reduces the residual of "
                    f"{size:.2g}, in units of the well's amplitude; {_advice(size, tolerance)}"
                )
        slope = slope + np.outer(found - r - slope @ step, step) / float(step @ step)
        x, r, size, fresh = x + step, found, new, False
    raise OrbitNotFoundError(
        f"no convergence in {iterations} iterations, the residual is {size:.2g} in units of the well's amplitude; "
        f"{_advice(size, tolerance)}, or more iterations"
    )


def _advice(residual: float, tolerance: float) -> str:
    if residual <= _ROUNDING:
        return f"this is rounding: increase tolerance = {tolerance:g} above the residual"
    return "begin nearer to the orbit (a longer transient), try another period"


def orbit_tolerance(value: float) -> float:
    """The tolerance of an orbit."""
    return within("tolerance", value, 0.0, LARGEST_TOLERANCE, closed="right")


def _deflated(x: _Array, step: _Array, known: tuple[_Array, ...]) -> _Array:
    """Newton's step of the residual times a product of (1 + 1/|x - root|^2)."""
    along = 0.0
    for other in known:
        away = x - other
        square = float(away @ away)
        if square == 0.0:
            raise OrbitNotFoundError("the guess is an orbit that is to be left out; begin elsewhere")
        along += -2.0 * float(away @ step) / (square * (square + 1.0))
    return step if along == 1.0 else step / (1.0 - along)
