"""Bifurcation diagrams by brute force: states once a period over a parameter, swept or from many initial conditions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.dynamics.flow import (
    InitialConditions,
    Stroboscope,
    fixed_parameters,
    settling_periods,
    starts_of,
)
from snapbeam.dynamics.periodic_orbits import passage_of
from snapbeam.model.integration import Integration
from snapbeam.model.parameters import lookup
from snapbeam.model.system import System
from snapbeam.util.diagnostics import counting
from snapbeam.util.validation import InputError, InputTypeError, axis, checked, choice, flag, integer, shown

if TYPE_CHECKING:
    import xarray as xr

_Array = NDArray[np.float64]
SWEEPS = ("up", "down")
_SEEN = ("midspan_displacement", "displacement_at_striker", "midspan_velocity", "velocity_at_striker")
_PASSAGE = 4
"""Periods that approaches are looked at in."""


@checked
def bifurcation_diagram(
    system: System,
    name: str,
    values: ArrayLike,
    integration: Integration | None = None,
    *,
    sweeps: Sequence[str] = SWEEPS,
    initial_conditions: InitialConditions | int = 0,
    periods: tuple[int | None, int] = (None, 32),
    grazing: bool = False,
    progress: Callable[[int, int], object] | bool | None = None,
) -> xr.Dataset:
    """Compute a bifurcation diagram: states once a period over one parameter that is swept up and down.

    Each sweep continues from the last state.  The sweeps differ where attractors coexist (hysteresis); runs from many
    initial conditions show further attractors.

    Parameters
    ----------
    system : System
    name : str
        Parameter, by dotted name or the name in datasets.
    values : array_like
        Strictly increasing.
    integration : Integration, optional
    sweeps : sequence of {"up", "down"}
    initial_conditions : InitialConditions or int
        Initial conditions at every value, in addition to the sweeps; none by default.
    periods : pair of int
        Transient periods to discard at each value, and periods to record. None discards 16 time constants of
        the slowest mode, at least 200 and at most 20,000 periods.
    grazing : bool
        Sample every approach within four of the recorded periods densely: ``clearance``, ``min_penetration``.
    progress : callable, optional
        Called as ``progress(done, total)`` with values; True writes a line to standard error.

    Returns
    -------
    xarray.Dataset
        Over ``sweep``, the parameter and ``period``: displacements over b and velocities over b omega_1 of the
        centre and of the contact point at the phase of the start; over ``sweep`` and the parameter:
        ``impacts_per_period``, ``crossings_per_period`` and ``minimal_period`` (0: none seen).  Runs that
        failed are NaN, as are all that follow them in their sweep; ``failed`` marks them.

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> model = sb.ReducedModel.from_beam(paper.BEAM, modes=1, damping_ratio=0.05)
    >>> shaker = sb.Shaker(frequency_ratio=1.6, velocity_amplitude=0.03)
    >>> system = sb.System(model, contacts=[sb.Contact(paper.CONTACT, shaker)])
    >>> diagram = sb.dynamics.bifurcation_diagram(system, "velocity_amplitude", [0.02, 0.03, 0.04])
    >>> dict(diagram.sizes)
    {'sweep': 2, 'velocity_amplitude': 3, 'period': 32}
    """
    if not isinstance(system, System):
        raise InputTypeError(f"system = {shown(system)}: must be a System")
    row = system.parameter(name)
    if row.quantity.kind is not float:
        raise InputError(f"name = {shown(name)}: must be a parameter that is a number")
    points = axis(row.short, values, row.quantity.low, row.quantity.high, closed=row.quantity.closed)
    kinds = [choice("sweeps", kind, SWEEPS) for kind in sweeps]
    given, keep = _periods(periods)
    flag("grazing", grazing)
    many = (
        starts_of(initial_conditions)
        if isinstance(initial_conditions, InitialConditions) or initial_conditions
        else None
    )
    if not kinds and many is None:
        raise InputError("sweeps = (): must be at least one, or initial_conditions at least 1")
    flow = Stroboscope(system, Integration() if integration is None else integration)
    leave, rule = settling_periods(flow) if given is None else (given, "as given")
    diagram = _Diagram(flow, row.name, points, leave, keep)
    total = points.size * (bool(kinds) + (many.count if many is not None else 0))
    done, told = 0, counting(progress, "bifurcation diagram", "values")

    def report(steps: int) -> None:
        nonlocal done
        done += steps
        if told is not None:
            told(done, total)

    if kinds:
        diagram.carry(kinds, report)
    for number in range(0 if many is None else many.count):
        assert many is not None
        diagram.begin(f"start {number}", many, number, report)
    dataset = diagram.dataset(grazing)
    dataset.attrs["termination_reason"] = f"{leave} periods left out ({rule}) and {keep} kept at each value"
    return dataset


def _periods(periods: tuple[int | None, int]) -> tuple[int | None, int]:
    try:
        leave, keep = periods
    except (TypeError, ValueError):
        raise InputTypeError(
            f"periods = {shown(periods)}: must be a pair, periods to leave out and to keep"
        ) from None
    left = None if leave is None else integer("periods[0]", leave, 0, 10**7)
    return left, integer("periods[1]", keep, 2, 10**6)


def minimal_period(rows: _Array, tolerance: float = 1e-4) -> NDArray[np.int64]:
    """After how many periods states of shape (..., periods, d) repeat, at most half of them; 0 if they do not."""
    keep = rows.shape[-2]
    found = np.zeros(rows.shape[:-2], dtype=np.int64)
    for m in range(keep // 2, 0, -1):
        apart = np.abs(rows[..., m:, :] - rows[..., :-m, :]).max(axis=(-1, -2))
        found = np.where(apart < tolerance, m, found)
    return found


class _Diagram:
    """A diagram as it grows."""

    def __init__(self, flow: Stroboscope, name: str, values: _Array, leave: int, keep: int) -> None:
        self.flow, self.name, self.values, self.leave, self.keep = flow, name, values, leave, keep
        self.sweeps: list[str] = []
        self.rows: list[_Array] = []
        self.counts: list[_Array] = []

    def _go(self, x: _Array, at: NDArray[np.int64]) -> tuple[_Array, _Array]:
        """Recorded states of some runs, shape (runs, keep, d), and impacts and crossings a period."""
        values, periods = self.values[at], self.leave + self.keep
        if lookup(self.name).is_run:
            advanced = [self.flow.advance(x, periods, every=True, points={self.name: values})]
        else:
            advanced = [
                self.flow.neighbour(self.name, float(value)).advance(each[None], periods, every=True)
                for each, value in zip(x, values, strict=True)
            ]
        every = np.concatenate([each.every[:, self.leave :] for each in advanced if each.every is not None])
        counts = np.array(
            [
                np.concatenate([each.statistics[name] for each in advanced])
                for name in ("impacts", "zero_crossings")
            ]
        )
        return every, counts.T / periods

    def carry(self, kinds: list[str], report: Callable[[int], None]) -> None:
        """Sweep up and down side by side."""
        count = self.values.size
        x = np.repeat(self.flow.coordinates(), len(kinds), axis=0)
        rows = np.empty((len(kinds), count, self.keep, self.flow.dimension))
        counts = np.empty((len(kinds), count, 2))
        for step in range(count):
            at = np.array([step if kind == "up" else count - 1 - step for kind in kinds])
            kept, passed = self._go(x, at)
            for i, k in enumerate(at):
                rows[i, k], counts[i, k] = kept[i], passed[i]
            x = kept[:, -1]
            report(1)
        self.sweeps += kinds
        self.rows += list(rows)
        self.counts += list(counts)

    def begin(
        self, label: str, starts: InitialConditions, number: int, report: Callable[[int], None]
    ) -> None:
        """Every value from one start."""
        system = self.flow.system
        location = self.values if self.name == "contact.location" else None
        state = starts.state(system, number, system.start_state, location)
        rows = np.broadcast_to(self.flow.coordinates(state), (self.values.size, self.flow.dimension))
        kept, counts = self._go(rows, np.arange(self.values.size))
        self.sweeps.append(label)
        self.rows.append(kept)
        self.counts.append(counts)
        report(self.values.size)

    def dataset(self, grazing: bool) -> xr.Dataset:
        """The diagram, labelled."""
        from snapbeam.util.datasets import xr

        row, rows, counts = lookup(self.name), np.array(self.rows), np.array(self.counts)
        system, modes = self.flow.system, self.flow.modes
        model, scale = system.model, system.scale
        full = rows * self.flow.scales
        location = 0.5 if system.striker is None else system.striker.location
        shapes = {"midspan_{}": model.midspan_shape, "{}_at_striker": model.shape_at(location)}
        labels = {"units": row.quantity.unit, "long_name": row.quantity.long_name, "parameter": row.name}
        dataset = xr.Dataset(
            coords={"sweep": self.sweeps, row.short: (row.short, self.values, labels)},
            attrs=fixed_parameters(self.flow, row.short)
            | {"title": "bifurcation diagram", "parameter": row.short, "periods_left_out": self.leave}
            | {"system_hash": system.hash},
        )
        dims = ("sweep", row.short)
        for part, shape in shapes.items():
            words = "mid-span" if part.startswith("midspan") else "contact point's"
            of = {
                "displacement": (full[..., :modes], scale.length),
                "velocity": (full[..., modes : 2 * modes], scale.length * scale.omega),
            }
            for what, (values, unit) in of.items():
                over = "b" if what == "displacement" else "b omega_1"
                text = {"units": "1", "long_name": f"{words} {what} once a period, over {over}"}
                dataset[part.format(what)] = ((*dims, "period"), values @ shape / unit, text)
        known = np.asarray(np.isfinite(rows).all(axis=(-1, -2)))
        periods = minimal_period(np.where(np.isfinite(rows), rows, 0.0))
        table: dict[str, tuple[Any, str]] = {
            "impacts_per_period": (
                np.where(known, counts[..., 0], np.nan),
                "impacts per period of the drive",
            ),
            "crossings_per_period": (
                np.where(known, counts[..., 1], np.nan),
                "zero crossings of mid-span per period",
            ),
            "minimal_period": (np.where(known, periods, 0), "periods after which it repeats; 0: not seen to"),
            "failed": (~known, "whether a run failed there"),
        }
        if grazing and system.striker is not None:
            near = self._approaches(rows, known)
            table["clearance"] = (
                near[..., 0],
                "minimum gap at which the beam turns back without contact, over b",
            )
            table["min_penetration"] = near[..., 1], "penetration of the lightest impact, over b"
        for name, (values, about) in table.items():
            dataset[name] = (dims, values, {"units": "1", "long_name": about})
        return dataset

    def _approaches(self, rows: _Array, known: NDArray[np.bool_]) -> _Array:
        found = np.full((*known.shape, 2), np.nan)
        for at in np.ndindex(known.shape):
            if known[at]:
                flow = self.flow.neighbour(self.name, float(self.values[at[-1]]))
                passage = passage_of(flow, rows[at][-1], _PASSAGE)
                found[at] = passage.clearance, passage.min_penetration
        return found
