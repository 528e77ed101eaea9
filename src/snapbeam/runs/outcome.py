"""The outcome of a run: its class and its statistics, by name."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.codes import ResponseClass, RunStatus
from snapbeam.core.showing import html_table
from snapbeam.core.validate import InputError, integer, mapping
from snapbeam.engines.outcomes import STATISTICS

__all__ = ["Outcome"]


class Outcome(Mapping[str, Any]):
    """What one run did, in a few numbers: a mapping, and the same as attributes.

    The names, units and meanings are those of :data:`snapbeam.STATISTICS`; displacements are over b, velocities
    over b omega_1.  A run that failed has ``response`` UNKNOWN and a ``status`` whose ``advice`` says why.  A run
    decided early (``decided_at`` in seconds, NaN otherwise) has the certain class, but extremes and counts that
    stop there.  ``end_is_final`` says whether the run provably stays in the well it ended in; ``final_well`` is the
    sign of w(1/2) at the end.
    """

    response: ResponseClass
    status: RunStatus
    crossings: int
    crossings_last_quarter: int
    last_crossing: float
    final_well: int
    end_is_final: bool
    min_displacement: float
    max_displacement: float
    min_center_displacement: float
    max_center_displacement: float
    peak_force: float
    impacts: int
    contact_share: float
    decided_at: float

    def __init__(self, values: Mapping[str, Any]) -> None:
        mapping("values", values)
        if missing := {"response", "status"} - set(values):
            raise InputError(f"values: without {', '.join(sorted(missing))}")
        found = {
            name: value.item() if isinstance(value, np.generic) else value for name, value in values.items()
        }
        found["response"], found["status"] = ResponseClass(found["response"]), RunStatus(found["status"])
        self._values = found

    @classmethod
    def from_statistics(cls, statistics: Mapping[str, NDArray[np.generic]], index: int = 0) -> Outcome:
        """One run of what :func:`snapbeam.engines.answer.statistics_of` returns."""
        mapping("statistics", statistics)
        index = integer(
            "index", index, 0, max(0, min((np.size(each) for each in statistics.values()), default=1) - 1)
        )
        return cls({name: array[index] for name, array in statistics.items()})

    def __getattr__(self, name: str) -> Any:
        values = self.__dict__.get("_values", {})
        if name in values:
            return values[name]
        raise AttributeError(f"{type(self).__name__} has no {name!r}; it has {', '.join(values)}")

    def __getitem__(self, name: str) -> Any:
        return self._values[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._values]

    def __repr__(self) -> str:
        ended = "" if self.status is RunStatus.OK else f", {self.status.name}"
        return f"<Outcome {self.response.label}{ended}, {self.crossings} crossings, {self.impacts} impacts>"

    def _repr_html_(self) -> str:
        rows = [line.split(maxsplit=1) for line in self.table().splitlines()]
        return html_table(f"Outcome: {self.response.label}", rows)

    def table(self) -> str:
        """Every statistic with its unit and its meaning, a line each."""
        lines = []
        for name, value in self._values.items():
            row = STATISTICS.get(name)
            unit, words = ("", "") if row is None else (row.unit, row.words)
            shown = value.label if isinstance(value, ResponseClass) else getattr(value, "name", value)
            text = f"{shown:.6g}" if isinstance(shown, float) else str(shown)
            lines.append(f"{name:26s} {text:>16s} {'' if unit == '1' else unit:4s} {words}")
        return "\n".join(lines)
