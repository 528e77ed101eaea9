"""A branch of periodic orbits, and the events on it, labelled."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.findings import to_json
from snapbeam.dynamics.flow import Stroboscope
from snapbeam.dynamics.orbits.orbit import PeriodicOrbit

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["EVENTS", "Branch", "SpecialPoint"]

EVENTS = ("fold", "flip", "Neimark-Sacker", "branch point", "grazing")


@dataclass(frozen=True, eq=False)
class SpecialPoint:
    """Something that happens on a branch."""

    kind: str
    """One of :data:`EVENTS`."""
    orbit: PeriodicOrbit
    value: float
    """Of the parameter."""
    index: int
    """Number of the orbit of the branch that it comes after."""
    error: float = math.nan
    """By how much the value may be off at these steps; NaN: not known."""

    def __repr__(self) -> str:
        off = "" if math.isnan(self.error) else f" ± {self.error:.1g}"
        return f"<{self.kind} at {self.value:.8g}{off}>"


@dataclass(frozen=True, eq=False)
class Branch:
    """Orbits that follow each other along a parameter."""

    name: str
    """The parameter."""
    orbits: list[PeriodicOrbit]
    special_points: list[SpecialPoint]
    termination_reason: str
    """Why it ends."""
    impacts: list[int]
    """Of each orbit within its period."""
    tangents: list[NDArray[np.float64]]

    def __repr__(self) -> str:
        low, high = self.values.min(), self.values.max()
        text = f"{len(self.orbits)} orbits of period {self.orbits[0].period}, {self.name} from {low:.6g} to {high:.6g}"
        return f"<Branch: {text}, {len(self.special_points)} events, end: {self.termination_reason}>"

    @cached_property
    def values(self) -> NDArray[np.float64]:
        """Of the parameter along the branch."""
        return np.array([orbit.flow.value(self.name) for orbit in self.orbits])

    @cached_property
    def is_stable(self) -> NDArray[np.bool_]:
        """Of each orbit."""
        return np.array([orbit.is_stable for orbit in self.orbits])

    def to_dataset(self) -> xr.Dataset:
        """The branch labelled: over ``orbit`` the parameter, the state, the multipliers, stability, impacts and
        the centre's displacement, that at every ``return`` too; over ``event`` what happens where."""
        import xarray as xr

        from snapbeam.config.parameters import lookup

        first = self.orbits[0]
        names = getattr(first.flow, "names", tuple(f"x[{i + 1}]" for i in range(first.coordinates.size)))
        values = np.array([orbit.multipliers for orbit in self.orbits])
        short, unit, words = self.name, "1", self.name
        if isinstance(first.flow, Stroboscope):
            row = lookup(self.name)
            short, unit, words = row.short, row.quantity.unit, row.quantity.long_name
        states = np.array([orbit.coordinates for orbit in self.orbits])
        steps = np.linalg.norm(np.diff(states, axis=0), axis=1)
        dataset = xr.Dataset(
            {
                "state": (
                    ("orbit", "coordinate"),
                    states,
                    _labels("state of the orbit at the phase it is seen at"),
                ),
                "multiplier_real": (("orbit", "multiplier"), values.real, _labels("Floquet multiplier")),
                "multiplier_imag": (("orbit", "multiplier"), values.imag, _labels("its imaginary part")),
                "stable": (
                    "orbit",
                    self.is_stable,
                    _labels("whether every multiplier is inside the unit circle"),
                ),
                "impacts": (
                    "orbit",
                    np.array(self.impacts, dtype=np.int32),
                    _labels("impacts within the period"),
                ),
                "arclength": (
                    "orbit",
                    np.append(0.0, np.cumsum(steps)),
                    _labels("length of the branch in states"),
                ),
                "residual": ("orbit", [orbit.residual for orbit in self.orbits], _labels("of the return")),
                "event_kind": (
                    "event",
                    [event.kind for event in self.special_points],
                    {"long_name": "what happens"},
                ),
                "event_after": (
                    "event",
                    [event.index for event in self.special_points],
                    _labels("orbit before it"),
                ),
                "event_value": (
                    "event",
                    [event.value for event in self.special_points],
                    {"units": unit, "long_name": words},
                ),
                "event_error": (
                    "event",
                    np.array([event.error for event in self.special_points], dtype=np.float64),
                    {"units": unit, "long_name": f"by how much it may be off at these steps: {words}"},
                ),
                "event_state": (
                    ("event", "coordinate"),
                    np.array([event.orbit.coordinates for event in self.special_points]).reshape(
                        -1, states.shape[1]
                    ),
                    _labels("state of the orbit there"),
                ),
            },
            {
                "coordinate": list(names),
                short: ("orbit", self.values, {"units": unit, "long_name": words, "parameter": self.name}),
            },
            {
                "title": "branch of periodic orbits",
                "along": short,
                "period": first.period,
                "termination_reason": self.termination_reason,
                "diagnostics": to_json(first.diagnostics),
            },
        )
        if isinstance(first.flow, Stroboscope):
            centers = np.array([_centers(orbit) for orbit in self.orbits])
            dataset["midspan_displacement"] = (
                "orbit",
                centers[:, 0],
                _labels("centre displacement there, over b"),
            )
            dataset["center_returns"] = (
                ("orbit", "return"),
                centers,
                _labels("centre displacement once a period of the drive, over b"),
            )
        return dataset


def _centers(orbit: PeriodicOrbit) -> NDArray[np.float64]:
    """Centre displacement over b, once a period of the drive."""
    flow = orbit.flow
    assert isinstance(flow, Stroboscope)
    states = orbit.coordinates[np.newaxis]
    if orbit.period > 1:
        later = flow.march(states, orbit.period - 1, every=True).every
        assert later is not None
        states = np.concatenate([states, later[0]])
    amplitudes = states[:, : flow.modes] * flow.scales[: flow.modes]
    return np.asarray(amplitudes @ flow.system.model.midspan_shape / flow.system.scale.length)


def _labels(words: str) -> dict[str, str]:
    return {"units": "1", "long_name": words}
