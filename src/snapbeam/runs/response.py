"""From the statistics of a run to the class of its response."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.codes import ResponseClass, RunStatus, classify
from snapbeam.engines.columns import Counts, Numbers, Reals

if TYPE_CHECKING:
    from snapbeam.engines.ensemble import Ensemble

__all__ = ["STATISTICS", "Response", "statistics_of"]

STATISTICS: dict[str, tuple[str, str, str]] = {
    "response": ("int8", "1", "response class"),
    "status": ("int8", "1", "status of the run"),
    "crossings": ("int32", "1", "zero crossings of the centre displacement"),
    "crossings_last_quarter": ("int32", "1", "zero crossings in the last quarter"),
    "last_crossing": ("float64", "s", "time of the last zero crossing"),
    "final_well": ("int8", "1", "sign of the centre displacement at the end"),
    "end_is_final": ("bool", "1", "energy at the end below the barrier"),
    "min_displacement": ("float64", "b", "least beam displacement at the shaker"),
    "max_displacement": ("float64", "b", "greatest beam displacement at the shaker"),
    "min_center_displacement": ("float64", "b", "least centre displacement"),
    "max_center_displacement": ("float64", "b", "greatest centre displacement"),
    "peak_force": ("float64", "N", "peak contact force"),
    "impacts": ("int32", "1", "impacts"),
    "contact_share": ("float64", "1", "share of time in contact"),
    "decided_at": ("float64", "s", "time at which the class became certain"),
}
"""Variables of a map and fields of a :class:`Response`: kind, unit, name in words."""


@dataclass(frozen=True)
class Response:
    """What one run did, in a few numbers (displacements in units of b).

    A run that failed has ``response`` UNKNOWN and a ``status`` whose ``advice`` says why.  A run decided
    early (``decided_at`` in seconds, NaN otherwise) has the certain class, but extremes and counts that stop
    there.
    ``end_is_final`` says whether the energy at the end is below the barrier; ``final_well`` is the sign of
    w(1/2) at the end.
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

    @classmethod
    def from_statistics(cls, statistics: dict[str, NDArray[np.generic]], index: int = 0) -> Response:
        """One run of what :func:`statistics_of` returns."""
        values = {name: array[index].item() for name, array in statistics.items()}
        values["response"] = ResponseClass(values["response"])
        values["status"] = RunStatus(values["status"])
        return cls(**values)


def statistics_of(
    ensemble: Ensemble, counts: NDArray[np.int64], numbers: NDArray[np.float64], cycles: float
) -> dict[str, NDArray[np.generic]]:
    """What an engine counted, in the units and signs of a map; arrays of shape (runs,) by name."""
    model, sign = ensemble.packed.model, ensemble.packed.sign
    scale = model.length_scale
    assert scale is not None
    status = counts[:, Counts.STATUS]
    good = (status == RunStatus.OK) | (status == RunStatus.DECIDED)
    crossings, last = counts[:, Counts.CROSSINGS], counts[:, Counts.CROSSINGS_LAST_QUARTER]
    response = classify(crossings, last, cycles, -ensemble.first_side * counts[:, Counts.SIDE])
    duration = counts[:, Counts.TIME] * ensemble.reals[:, Reals.TICK]
    barrier = model.barrier_energy - model.well_energy if model.is_bistable else np.inf

    def seen(column: int) -> NDArray[np.float64]:
        return np.where(good, numbers[:, column], np.nan)

    def normalised(column: int) -> NDArray[np.float64]:
        return sign * seen(column) / scale + 0.0

    low, high = normalised(Numbers.MIN_DISPLACEMENT), normalised(Numbers.MAX_DISPLACEMENT)
    low_center, high_center = normalised(Numbers.MIN_CENTER), normalised(Numbers.MAX_CENTER)
    if sign < 0.0:
        low, high, low_center, high_center = high, low, high_center, low_center
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.where(duration > 0.0, numbers[:, Numbers.CONTACT_TIME] / duration, np.nan)
    columns = {
        "response": np.where(good, response, ResponseClass.UNKNOWN),
        "status": status,
        "crossings": crossings,
        "crossings_last_quarter": last,
        "last_crossing": numbers[:, Numbers.LAST_CROSSING],
        "final_well": sign * counts[:, Counts.SIDE],
        "end_is_final": good & (numbers[:, Numbers.ENERGY] < barrier),
        "min_displacement": low,
        "max_displacement": high,
        "min_center_displacement": low_center,
        "max_center_displacement": high_center,
        "peak_force": seen(Numbers.PEAK_FORCE),
        "impacts": counts[:, Counts.IMPACTS],
        "contact_share": np.where(good, share, np.nan),
        "decided_at": numbers[:, Numbers.DECIDED_AT],
    }
    return {name: columns[name].astype(kind) for name, (kind, _, _) in STATISTICS.items()}
