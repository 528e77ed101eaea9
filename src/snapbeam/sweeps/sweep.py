"""What a map is made of: the system, the axes and how each run is integrated, checked once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.core.codes import ResponseClass
from snapbeam.core.provenance import made_by
from snapbeam.core.validate import InputError, axis, flag, integer, positive, within
from snapbeam.engines.ensemble import Start, make_ensemble
from snapbeam.engines.plan import Plan, plan_steps
from snapbeam.engines.registry import resolve
from snapbeam.model.contact import HertzContact, Restitution
from snapbeam.model.drive import Shaker
from snapbeam.model.reduction import ReducedModel
from snapbeam.runs.request import check_system
from snapbeam.runs.response import STATISTICS, statistics_of
from snapbeam.runs.simulate import describe_system

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["AXES", "Grid", "MapSetup", "Points", "Progress", "map_setup", "variable_attributes"]

_Array = NDArray[np.float64]
Points = dict[str, _Array]
"""Runs of a map: frequency ratio, velocity amplitude and location by name, each of shape (runs,)."""
Progress = Callable[[int, int], object]

AXES = {
    "frequency_ratio": ("1", "frequency ratio Omega"),
    "velocity_amplitude": ("1", "velocity amplitude V"),
    "location": ("1", "shaker location x_s"),
}
"""The dimensions of a map, in their order: unit and name in words."""

_LIMITS = {
    "frequency_ratio": (0.0, np.inf, "neither"),
    "velocity_amplitude": (0.0, np.inf, "left"),
    "location": (0.0, 1.0, "neither"),
}


@dataclass(frozen=True, eq=False)
class Grid:
    """The points of a map: axes that are dimensions, and numbers that hold throughout."""

    axes: dict[str, _Array]
    scalars: dict[str, float]

    @property
    def shape(self) -> tuple[int, ...]:
        """Points along each dimension."""
        return tuple(values.size for values in self.axes.values())

    @property
    def size(self) -> int:
        """Points in all."""
        return int(np.prod(self.shape, dtype=np.int64))

    def take(self, which: NDArray[np.int64]) -> Points:
        """The points of the given numbers, counted in the order of the dimensions."""
        at = np.unravel_index(which, self.shape) if self.axes else ()
        points = {name: values[i] for (name, values), i in zip(self.axes.items(), at, strict=True)}
        return {
            name: points[name] if name in points else np.full(which.size, self.scalars[name]) for name in AXES
        }

    def coordinates(self) -> dict[str, Any]:
        """Coordinates of a dataset: dimensions, values and labels by name."""
        coords: dict[str, Any] = {}
        for name, (units, words) in AXES.items():
            labels = {"units": units, "long_name": words}
            values: Any = ((name,), self.axes[name]) if name in self.axes else ((), self.scalars[name])
            coords[name] = (*values, labels)
        return coords


@dataclass(frozen=True, eq=False)
class MapSetup:
    """A map before it is computed.  The steps are planned once, so every part of it is stepped alike."""

    model: ReducedModel
    contact: HertzContact | Restitution
    plan: Plan
    grid: Grid
    cycles: int
    side: str
    reference_freq: float
    engine: str
    early_decision: bool

    def march(
        self,
        points: Points,
        threads: int | None = None,
        progress: Progress | None = None,
        *,
        start: Start | None = None,
        plan: Plan | None = None,
    ) -> dict[str, NDArray[Any]]:
        """Integrate runs and return their statistics, arrays of shape (runs,) by name.

        What a run gives depends on its own point alone, not on what it is marched with.
        """
        ensemble = make_ensemble(
            self.model,
            self.contact,
            self.plan if plan is None else plan,
            frequency_ratio=points["frequency_ratio"],
            velocity_amplitude=points["velocity_amplitude"],
            location=points["location"],
            side=self.side,
            cycles=self.cycles,
            reference_freq=self.reference_freq,
            early_decision=self.early_decision,
            start=start,
        )
        counts, numbers = resolve(self.engine)[1](ensemble, threads, progress)
        return statistics_of(ensemble, counts, numbers, self.cycles)

    def description(self) -> dict[str, Any]:
        """Every parameter but the axes, as attributes of a file."""
        attrs: dict[str, Any] = {"cycles": self.cycles, "engine": self.engine, "side": self.side}
        attrs["early_decision"] = int(self.early_decision)
        return attrs | describe_system(self.model, self.contact, self.plan, self.reference_freq)

    def attributes(self, title: str, more: dict[str, Any] | None = None) -> dict[str, Any]:
        """The attributes of a file: a title, every parameter, and what made it."""
        attrs = {"title": title} | self.description() | self.grid.scalars | (more or {})
        return attrs | made_by(attrs)

    def dataset(self, statistics: dict[str, NDArray[Any]]) -> xr.Dataset:
        """The statistics of every point of the grid as a labelled map."""
        import xarray as xr

        attrs = self.attributes("map of the response of a struck bistable beam")
        dataset = xr.Dataset(coords=self.grid.coordinates(), attrs=attrs)
        for name, values in statistics.items():
            dataset[name] = (
                tuple(self.grid.axes),
                values.reshape(self.grid.shape),
                variable_attributes(name),
            )
        return dataset


def map_setup(
    model: ReducedModel,
    contact: HertzContact | Restitution,
    *,
    frequency_ratio: ArrayLike,
    velocity_amplitude: ArrayLike,
    location: ArrayLike = 1.0 / 2.1,
    cycles: int = 200,
    side: str = "below",
    reference_freq: float | None = None,
    step: float | None = None,
    accuracy: str = "map",
    engine: str = "auto",
    early_decision: bool = False,
) -> MapSetup:
    """Check what is asked of a map; the parameters are those of :func:`snapbeam.response_map`."""
    check_system(model, contact)
    if contact is None:
        raise InputError("contact = None: must be a HertzContact or a Restitution")
    cycles = integer("cycles", cycles, 1, 10**7)
    grid = _grid(frequency_ratio=frequency_ratio, velocity_amplitude=velocity_amplitude, location=location)
    Shaker(frequency_ratio=1.0, velocity_amplitude=0.0, side=side)  # refuses a side that is none
    return MapSetup(
        model=model,
        contact=contact,
        plan=plan_steps(model, contact, step=step, accuracy=accuracy),
        grid=grid,
        cycles=cycles,
        side=side,
        reference_freq=model.reference_freq
        if reference_freq is None
        else positive("reference_freq", reference_freq, "Hz"),
        engine=resolve(
            engine,
            runs=grid.size,
            cycles=cycles,
            modes=model.modes,
            restitution=isinstance(contact, Restitution),
        )[0],
        early_decision=flag("early_decision", early_decision),
    )


def _grid(**given: ArrayLike) -> Grid:
    axes, scalars = {}, {}
    for name, value in given.items():
        low, high, closed = _LIMITS[name]
        if np.ndim(np.asarray(value)) == 0:
            scalars[name] = within(name, value, low, high, closed=closed)
        else:
            axes[name] = axis(name, value, low, high, closed=closed)
    return Grid(axes, scalars)


def variable_attributes(name: str) -> dict[str, Any]:
    """Unit and name in words of one variable of a map; for the response, the meaning of its codes."""
    _, units, words = STATISTICS[name]
    labels: dict[str, Any] = {"units": units, "long_name": words}
    if name == "response":
        labels |= response_flags()
    return labels


def response_flags() -> dict[str, Any]:
    """What the codes of a response class mean, as the attributes that the CF conventions give them."""
    return {
        "flag_values": np.array([int(c) for c in ResponseClass], dtype=np.int8),
        "flag_meanings": " ".join(c.label.replace(" ", "_") for c in ResponseClass),
    }
