"""Newton shooting: states that a flow brings back, and the derivative of the flow there."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.config.parameters import lookup
from snapbeam.dynamics.flow import Flow, Marched, Stroboscope
from snapbeam.engines.cpu.driver import usable_cores

__all__ = ["Family", "OrbitNotFoundError", "Return", "Shot", "jacobian", "newton"]

_Array = NDArray[np.float64]
_STENCIL = ((1, 3.0 / 4.0), (2, -3.0 / 20.0), (3, 1.0 / 60.0))
_STEP = 2e-4
"""Of the differences of order six that stand for the tangent flow where the force jumps."""
_SHRINKINGS = 7
"""Times that it is quartered where states beside each other meet the tip unequally often."""
_SPLIT = 16
"""Tangents from which on they are shared among threads."""
_LONGEST = 0.25
"""Longest step of Newton's method, in units of the well's amplitude."""
_SLOW = 0.25
"""Factor by which a step must lessen the residual, or else the derivative is taken anew."""


class OrbitNotFoundError(RuntimeError):
    """No orbit was found: the message says why, and what to try."""


class Shot(NamedTuple):
    """What Newton's method came to."""

    x: _Array
    jacobian: _Array
    """Of the return map there, or near it."""
    residual: float
    iterations: int
    exact: bool
    """Whether the derivative was taken at *x* itself."""


class Family:
    """A flow over one parameter, at any value of it.

    Parameters
    ----------
    flow : Flow
    name : str, optional
        Parameter that may be changed; without one the flow stays as it is.
    """

    def __init__(self, flow: Flow, name: str | None = None) -> None:
        self.flow = flow
        self.name = name
        self._beside = name is not None and (not isinstance(flow, Stroboscope) or lookup(name).is_run)

    def march(
        self, x: _Array, periods: int, value: float | None = None, tangents: _Array | None = None
    ) -> Marched:
        """Take states of shape (runs, d) some periods on, at one value of the parameter."""
        if value is None or self.name is None:
            return self.flow.march(x, periods, tangents=tangents)
        if self._beside:
            points = {self.name: np.full(len(x), value)}
            return self.flow.march(x, periods, tangents=tangents, points=points)
        return self.at(value).march(x, periods, tangents=tangents)

    def at(self, value: float) -> Flow:
        """The flow at a value of the parameter."""
        assert self.name is not None
        return self.flow.neighbour(self.name, value)

    def slope(self, x: _Array, periods: int, value: float, step: float) -> _Array:
        """Derivative by the parameter of where the flow brings one state, shape (d,)."""
        if not self._beside or self.name is None:
            above, below = (
                self.march(x[None], periods, value + sign * step).states[0] for sign in (1.0, -1.0)
            )
        else:
            points = {self.name: np.array([value + step, value - step])}
            above, below = self.flow.march(np.repeat(x[None], 2, axis=0), periods, points=points).states
        change: _Array = (above - below) / (2.0 * step)
        return change


class Return(NamedTuple):
    """Where the flow brings one state, and the derivative of that by the state."""

    x: _Array
    jacobian: _Array
    """Shape (d, d)."""
    impacts: int
    """On the way; -1 where it is not told."""


def jacobian(family: Family, x: _Array, periods: int, value: float | None = None) -> Return:
    """One state some periods on, with the derivative of where it comes to."""
    size = x.size
    if not family.flow.smooth:
        return _by_differences(family, x, periods, value)
    shares = min(usable_cores(), max(1, size // _SPLIT))
    shares = next(count for count in range(shares, 0, -1) if size % count == 0)
    tangents = np.eye(size).reshape(shares, size // shares, size)
    marched = family.march(np.repeat(x[None], shares, axis=0), periods, value, tangents)
    assert marched.tangents is not None
    return Return(marched.states[0], marched.tangents.reshape(size, size).T, _impacts(marched))


def _by_differences(family: Family, x: _Array, periods: int, value: float | None) -> Return:
    """As :func:`jacobian`, from states beside it that meet the tip as often as it does."""
    size, step = x.size, _STEP
    weights = np.array([weight for _, weight in _STENCIL])
    for _ in range(_SHRINKINGS):
        moves = np.concatenate([sign * k * step * np.eye(size) for k, _ in _STENCIL for sign in (1.0, -1.0)])
        marched = family.march(np.concatenate([x[None], x + moves]), periods, value)
        contact_event = marched.statistics.get("impacts")
        if contact_event is None or (contact_event == contact_event[0]).all():
            break
        step *= 0.25
    table = marched.states[1:].reshape(len(_STENCIL), 2, size, size)
    slopes = np.einsum("k,kij->ij", weights, table[:, 0] - table[:, 1]) / step
    return Return(marched.states[0], slopes.T, _impacts(marched))


def _impacts(marched: Marched) -> int:
    return int(marched.statistics["impacts"][0]) if "impacts" in marched.statistics else -1


def newton(
    residual: Callable[[_Array], _Array],
    derivative: Callable[[_Array], tuple[_Array, _Array]],
    x: _Array,
    tolerance: float,
    iterations: int,
    first: _Array | None = None,
    deflate: tuple[_Array, ...] = (),
) -> Shot:
    """A root of *residual* by Newton's method, its derivative kept by Broyden's updates as long as steps gain by it.

    Parameters
    ----------
    residual, derivative : callable
        r(x), and r(x) with its derivative.
    first : array, optional
        A derivative to begin with.
    deflate : tuple of arrays
        Roots to stay away from (Farrell, Birkisson and Funke, SIAM J. Sci. Comput. 37 (2015) A2026).

    Raises
    ------
    OrbitNotFoundError
    """
    fresh = first is None
    if first is None:
        r, slope = derivative(x)
    else:
        r, slope = residual(x), first
    size = float(np.abs(r).max())
    for count in range(iterations):
        if not np.isfinite(size):
            raise OrbitNotFoundError(
                "a run failed on the way; begin nearer to the orbit, or with accuracy = 'reference'"
            )
        if size <= tolerance and not (deflate and _near(x, deflate)):
            return Shot(x, slope, size, count, fresh)
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
                    f"Newton's method stands still at a residual of {size:.2g}, in units of the well's amplitude; "
                    "begin nearer to the orbit (transient=..., another period), or with accuracy = 'reference'"
                )
        slope = slope + np.outer(found - r - slope @ step, step) / float(step @ step)
        x, r, size, fresh = x + step, found, new, False
    raise OrbitNotFoundError(
        f"no convergence in {iterations} iterations, the residual is {size:.2g} in units of the well's amplitude; "
        "begin nearer to the orbit (transient=...), try another period, or more iterations"
    )


def _near(x: _Array, known: tuple[_Array, ...]) -> bool:
    return any(float(np.abs(x - other).max()) < 1e-6 for other in known)


def _deflated(x: _Array, step: _Array, known: tuple[_Array, ...]) -> _Array:
    """Newton's step of the residual times a product of (1 + 1/|x - root|^2)."""
    along = 0.0
    for other in known:
        away = x - other
        square = float(away @ away)
        if square == 0.0:
            raise OrbitNotFoundError("the guess is an orbit that is to be left out; begin elsewhere")
        along += -2.0 * float(away @ step) / (square * (square + 1.0))
    if along == 1.0:
        return step
    return step / (1.0 - along)
