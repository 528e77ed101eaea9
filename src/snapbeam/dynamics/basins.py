"""Basins of attraction on a plane of states: which certified attractor each state goes to, or undecided."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.core.kinds import checked
from snapbeam.core.validate import InputError, InputTypeError, axis, finite_array, integer, shown
from snapbeam.dynamics.attractors import UNDECIDED, Attractors
from snapbeam.dynamics.capture import Cloud
from snapbeam.dynamics.flow import Flow, Stroboscope
from snapbeam.model.state import State

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["basins_of_attraction"]

_Array = NDArray[np.float64]
_AMONG = 8
"""Looks in a row at which a state must lie among the points of a chaotic attractor."""


@checked
def basins_of_attraction(
    attractors: Attractors,
    grid: Mapping[str, ArrayLike],
    *,
    fixed_coordinates: State | ArrayLike | None = None,
    periods: int = 200,
    every: int = 10,
    progress: Callable[[int, int], object] | None = None,
) -> xr.Dataset:
    """Which attractor each state of a plane goes to.

    A state goes to a periodic attractor once it is in a ball about one of its points in which the flow contracts (see
    :class:`~snapbeam.dynamics.capture.Ball`), and to a chaotic one if it lies among its points at eight looks in a row
    and at the end.  One that does neither within *periods* is undecided, -1.  The tip's mid-position is fixed in space.

    Parameters
    ----------
    attractors : Attractors
        Of :func:`attractors`.
    grid : mapping of str to array_like
        Two coordinates with their values, such as ``{"amplitude[1]": ..., "velocity[1]": ...}``, strictly increasing.
    fixed_coordinates : State or array_like of shape (d,), optional
        The other coordinates; a beam at rest in the well that a run starts in by default.
    periods : int
        Of the drive, at most.
    every : int
        Periods between two looks.
    progress : callable, optional
        Called as ``progress(done, total)`` with periods.

    Returns
    -------
    xarray.Dataset
        ``basin`` over the two coordinates, the number of the attractor; ``captured_after``, in periods.

    Raises
    ------
    InputError
        For bad input.
    """
    if not isinstance(attractors, Attractors):
        raise InputTypeError(f"found = {shown(attractors)}: must be Attractors, as sb.attractors gives")
    flow = attractors.flow
    total, step = integer("periods", periods, 1, 10**6), integer("every", every, 1, 10**4)
    names, columns, rows = _plane(flow, grid, fixed_coordinates)
    label, after = _labelled(attractors, flow, rows, total, step, progress)
    return _dataset(attractors, names, columns, label, after, total)


def _plane(
    flow: Flow, plane: Mapping[str, ArrayLike], rest: State | ArrayLike | None
) -> tuple[list[str], list[_Array], _Array]:
    known = list(getattr(flow, "names", tuple(f"x[{i + 1}]" for i in range(flow.dimension))))
    if not isinstance(plane, Mapping) or len(plane) != 2:
        raise InputTypeError(f"plane = {shown(plane)}: must map two coordinates to their values")
    for name in plane:
        if name not in known:
            raise InputError(f"plane {name}: no coordinate; must be one of {', '.join(known[:4])}, ...")
    names = list(plane)
    columns = [axis(name, plane[name], -np.inf, np.inf) for name in names]
    if isinstance(rest, State) or (rest is None and isinstance(flow, Stroboscope)):
        assert isinstance(flow, Stroboscope)
        base = flow.coordinates(rest)[0]
    else:
        base = np.zeros(flow.dimension) if rest is None else finite_array("fixed_coordinates", rest)
    if base.shape != (flow.dimension,):
        raise InputError(f"rest of shape {base.shape}: must have the shape ({flow.dimension},)")
    first, second = np.meshgrid(*columns, indexing="ij")
    rows = np.repeat(base[None], first.size, axis=0)
    rows[:, known.index(names[0])] = first.ravel()
    rows[:, known.index(names[1])] = second.ravel()
    return names, columns, rows


def _labelled(
    found: Attractors,
    flow: Flow,
    rows: _Array,
    total: int,
    step: int,
    progress: Callable[[int, int], object] | None,
) -> tuple[NDArray[np.int64], _Array]:
    label, after = np.full(len(rows), UNDECIDED), np.full(len(rows), np.nan)
    among = np.zeros((len(found.attractors), len(rows)), dtype=np.int64)
    open_, x, done = np.arange(len(rows)), rows, 0
    while done < total and open_.size:
        ahead = min(step, total - done)
        x = flow.march(x, ahead).states
        done += ahead
        taken = np.zeros(open_.size, dtype=bool)
        for number, each in enumerate(found.attractors):
            captures = each.trapping_region
            if isinstance(captures, Cloud):
                inside = captures.holds(x)
                among[number, open_] = np.where(inside, among[number, open_] + 1, 0)
                if done < total:
                    continue
                inside &= among[number, open_] >= _AMONG
            else:
                inside = np.zeros(open_.size, dtype=bool)
                for ball in captures:
                    if ball.radius > 0.0:
                        inside |= ball.holds(x)
            inside &= ~taken
            label[open_[inside]], after[open_[inside]] = number, done
            taken |= inside
        lost = ~np.isfinite(x).all(axis=1)
        open_, x = open_[~taken & ~lost], x[~taken & ~lost]
        if progress is not None:
            progress(done, total)
    return label, after


def _dataset(
    found: Attractors,
    names: list[str],
    columns: list[_Array],
    label: NDArray[np.int64],
    after: _Array,
    total: int,
) -> xr.Dataset:
    import xarray as xr

    shape = tuple(column.size for column in columns)
    words = {"units": "1", "long_name": "number of the attractor that a state goes to; -1: undecided"}
    meanings = [
        "undecided",
        *(f"period_{each.period}" if each.orbit else "chaotic" for each in found.attractors),
    ]
    words |= {"flag_values": np.arange(-1, len(found.attractors)), "flag_meanings": " ".join(meanings)}  # type: ignore[dict-item]
    of: dict[str, Any] = {
        name: (name, column, {"units": "1", "long_name": _long_name(name)})
        for name, column in zip(names, columns, strict=True)
    }
    return xr.Dataset(
        {
            "basin": (names, label.reshape(shape), words),
            "captured_after": (names, after.reshape(shape), {"units": "1", "long_name": "periods until certain"}),
            "attractor_points": (
                ("attractor", "point", "grid"), _shown(found, names), {"units": "1", "long_name": "attractors there"}
            ),
        },
        of,
        {"title": "basins of attraction", "periods": total, "undecided": float((label == UNDECIDED).mean())},
    )  # fmt: skip


def _shown(found: Attractors, names: list[str]) -> _Array:
    """The two coordinates of the points of every attractor."""
    known = list(getattr(found.flow, "names", tuple(f"x[{i + 1}]" for i in range(found.flow.dimension))))
    at = [known.index(name) for name in names]
    size = max((len(each.points) for each in found.attractors), default=1)
    table = np.full((len(found.attractors), size, 2), np.nan)
    for i, each in enumerate(found.attractors):
        table[i, : len(each.points)] = each.points[:, at]
    return table


def _long_name(name: str) -> str:
    if name.startswith("amplitude"):
        return f"amplitude of buckling mode {name[10:-1]} over that of the well"
    if name.startswith("velocity"):
        return f"velocity of buckling mode {name[9:-1]} over omega_1 times the amplitude of the well"
    return name
