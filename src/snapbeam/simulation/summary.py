"""The summary of a run: its response class and its statistics, by name."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.solver.statistics import STATISTICS, name_in
from snapbeam.util.display import html_table
from snapbeam.util.status_codes import ResponseClass, RunStatus
from snapbeam.util.validation import InputError, integer, mapping


class RunSummary(Mapping[str, Any]):
    """Response class and statistics of one run: a mapping whose items are also attributes.

    Names, units and meanings are those of :data:`snapbeam.STATISTICS`; displacements are over b, velocities over b
    omega_1. A failed run has the ``response_class`` UNKNOWN and the reason in ``status.advice``. If a run ends early
    (``early_stop_time``, s, else NaN), its class is certain, but extremes and counts stop there. ``final_well`` is the
    sign of w(1/2) at the end; ``final_well_proven``: the run provably stays there. ``other_well_reached``: the centre
    came more than half of the way from the border of the wells to the other well (with one well, to the mirror image of
    its rest); with unequal wells, one well or without a striker, only such a run is interwell.

    See Also
    --------
    snapbeam.Run, snapbeam.Statistic

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> system = paper.struck_beam(frequency_ratio=1.2, velocity_amplitude=0.18)
    >>> summary = sb.simulate(system, sb.Integration(cycles=20)).summary
    >>> summary.impacts == summary["impacts"]
    True
    """

    response_class: ResponseClass
    status: RunStatus
    zero_crossings: int
    zero_crossings_last_quarter: int
    last_zero_crossing: float
    final_well: int
    other_well_reached: bool
    final_well_proven: bool
    min_displacement: float
    max_displacement: float
    min_midspan_displacement: float
    max_midspan_displacement: float
    peak_force: float
    impacts: int
    contact_time_fraction: float
    early_stop_time: float

    def __init__(self, values: Mapping[str, Any]) -> None:
        mapping("values", values)
        if missing := {"response_class", "status"} - set(values):
            raise InputError(f"values: must contain {', '.join(sorted(missing))}")
        found = {name: value.item() if isinstance(value, np.generic) else value for name, value in values.items()}
        found["response_class"], found["status"] = (ResponseClass(found["response_class"]), RunStatus(found["status"]))
        self._values = found

    @classmethod
    def from_statistics(cls, statistics: Mapping[str, NDArray[np.generic]], index: int = 0) -> RunSummary:
        """Summary of one run of the statistics that :func:`snapbeam.solver.statistics.statistics_of` returns."""
        mapping("statistics", statistics)
        index = integer("index", index, 0, max(0, min((np.size(each) for each in statistics.values()), default=1) - 1))
        return cls({name: np.atleast_1d(array)[index] for name, array in statistics.items()})

    def __getattr__(self, name: str) -> Any:
        values = self.__dict__.get("_values", {})
        if name_in(values, name) in values:
            return values[name_in(values, name)]
        raise AttributeError(f"{type(self).__name__} has no {name!r}; it has {', '.join(values)}")

    def __getitem__(self, name: str) -> Any:
        return self._values[name_in(self._values, name)]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._values]

    def __repr__(self) -> str:
        ended = "" if self.status is RunStatus.OK else f", {self.status.name}"
        counts = f"{self.zero_crossings} zero crossings, {self.impacts} impacts"
        return f"<RunSummary {self.response_class.label}{ended}, {counts}>"

    def _repr_html_(self) -> str:
        rows = [line.split(maxsplit=1) for line in self.to_text().splitlines()]
        return html_table(f"Run summary: {self.response_class.label}", rows)

    def to_text(self) -> str:
        """Table of the statistics as text: name, value, unit and meaning."""
        lines = []
        for name, value in self._values.items():
            row = STATISTICS.get(name)
            unit, words = ("", "") if row is None else (row.unit, row.long_name)
            shown = value.label if isinstance(value, ResponseClass) else getattr(value, "name", value)
            text = f"{shown:.6g}" if isinstance(shown, float) else str(shown)
            lines.append(f"{name:26s} {text:>16s} {'' if unit == '1' else unit:4s} {words}")
        return "\n".join(lines)
