"""One point of a map: the system and the integration that it was computed with, to the last bit."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from snapbeam import InputError, Integration, RunSummary, System
from snapbeam.config import lookup

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Point", "compared", "integration_of", "system_of"]


@dataclass(frozen=True, eq=False)
class Point:
    """A point that is asked for.

    Attributes
    ----------
    values : dict
        Exact values by dotted name, of what the map sweeps.
    expected : dict
        What the map holds of it, by name of the statistic; empty if nothing.
    """

    values: dict[str, Any]
    expected: dict[str, Any] = field(default_factory=dict)

    def system(self, base: System, integration: Integration) -> tuple[System, Integration]:
        """What is run at this point."""
        of_run = {name[4:]: value for name, value in self.values.items() if name.startswith("run.")}
        of_system = {name: value for name, value in self.values.items() if not name.startswith("run.")}
        return base.replace(**of_system), integration.replace(**of_run) if of_run else integration

    def words(self) -> str:
        """The point for a person, in few digits."""
        return ", ".join(
            f"{lookup(name).short.replace('_', ' ')} {_brief(value)}" for name, value in self.values.items()
        )


def _brief(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def system_of(attrs: Mapping[str, Any], name: str) -> System:
    """The system that a map says it was computed of.

    Raises
    ------
    InputError
        If it does not say it, or it was driven by a record, which is too long to be kept in a file.
    """
    text = attrs.get("system")
    if not isinstance(text, str):
        raise InputError(f"{name}: does not hold the system that it was computed of")
    sections = _parsed(text, name)
    if any(isinstance(value, dict) for values in sections.values() for value in values.values()):
        raise InputError(f"{name}: was driven by a record, which is too long to be kept in it")
    arrays = {
        section: {key: np.array(value) if isinstance(value, list) else value for key, value in values.items()}
        for section, values in sections.items()
    }
    return System.from_mapping(arrays)


def _parsed(text: str, name: str) -> dict[str, Any]:
    try:
        found = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{name}: its description is damaged ({error})") from None
    if not isinstance(found, dict):
        raise InputError(f"{name}: its description is damaged")
    return found


def integration_of(attrs: Mapping[str, Any]) -> Integration:
    """How a map says that it was integrated; one run is always the processor's work."""
    found = _parsed(str(attrs.get("integration", "{}")), "integration")
    known = {item: value for item, value in found.items() if value is not None and item != "engine"}
    return Integration(**known)


def parameter_of(skeleton: xr.Dataset, name: str) -> str:
    """The dotted name of an axis."""
    attrs = skeleton[name].attrs if name in skeleton.coords else {}
    return lookup(str(attrs.get("parameter", name))).name


def compared(expected: Mapping[str, Any], outcome: RunSummary, engine: str) -> tuple[bool, str]:
    """Whether a run is what a map holds of it, bit for bit, and words for it."""
    expected = {name: value for name, value in expected.items() if name in outcome}
    if not expected:
        return True, ""
    differing = []
    for name, value in expected.items():
        found = outcome[name]
        found = int(found) if name in ("response_class", "status") else found
        same = found == value or (_is_nan(found) and _is_nan(value))
        if not same and name not in ("steps",):
            differing.append(name)
    if not differing:
        return True, f"bit for bit what the map holds ({len(expected)} numbers)"
    if "response_class" in differing:
        return False, "another class than the map's" + _why(expected, engine)
    return True, f"the map's class; differs in {', '.join(differing[:4])}" + _why(expected, engine)


def _why(expected: Mapping[str, Any], engine: str) -> str:
    if int(expected.get("status", 0)) == 6:
        return ": the map inferred it from its neighbours"
    if engine == "cuda":
        return ": the map was computed by another engine"
    return ": the map was computed by another version, on another processor, or of a system that has changed"


def _is_nan(value: Any) -> bool:
    return isinstance(value, float) and math.isnan(value)
