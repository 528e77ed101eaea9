"""Sections 4.1 and 4.2: how transient responses end, and which of them outlast 1000 cycles."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from snapbeam.paper.claims.claim_result import ClaimResult, Quantity, above, found
from snapbeam.paper.claims.topics.classes import is_kind, share_of, transient
from snapbeam.paper.claims.uncertainty import combined, share
from snapbeam.sweeps.threshold import interwell_threshold, is_interwell
from snapbeam.util.status_codes import ResponseClass

if TYPE_CHECKING:
    import xarray as xr

    from snapbeam.paper.recipe import Results

_NEAR = 0.15
"""Amplitudes within this share of the threshold are near it."""


def _late(results: Results, which: int) -> tuple[xr.Dataset, xr.Dataset]:
    maps = list(results["transients"].values())
    return maps[2 * which], maps[2 * which + 1]


def outlasts(results: Results) -> ClaimResult:
    """32a: points still change class after 1000 cycles."""
    pairs = [[ds.response_class.values for ds in _late(results, which)] for which in (0, 1)]
    one, many = (share(before != after) for before, after in pairs)
    cycles = [int(ds.attrs["cycles"]) for ds in _late(results, 1)]
    return found(
        above(many, 0.005) & above(one, 0.005), above(many, 0.0) | above(one, 0.0), many=many, one=one,
        before=cycles[0], after=cycles[1],
    )  # fmt: skip


def outlasts_near_threshold(results: Results) -> ClaimResult:
    """32b: particularly near the threshold, with many modes."""
    before, after = _late(results, 1)
    changed = before.response_class.values != after.response_class.values
    threshold = interwell_threshold(before)[:, None]
    drive = before.velocity_amplitude.values[None, :]
    close = np.abs(drive / threshold - 1.0) <= _NEAR
    near_it, elsewhere = share(changed[close]), share(changed[~close])
    excess = Quantity(near_it.value - elsewhere.value, combined(near_it.uncertainty, elsewhere.uncertainty))
    return found(
        above(excess, 0.0) & above(near_it, 2.0 * elsewhere.value), above(excess.value, 0.0), excess=excess,
        near_it=near_it, elsewhere=elsewhere,
    )  # fmt: skip


def outlasts_first_well(results: Results) -> ClaimResult:
    """32c: and of transient interwell 1."""
    before, after = _late(results, 1)
    changed = before.response_class.values != after.response_class.values
    first = before.response_class.values == ResponseClass.TRANSIENT_1
    value = share(changed[first])
    rest = share(changed[is_interwell(before.response_class.values) & ~first])
    return found(above(value, 2.0 * rest.value) & above(value, 0.0), share=value, rest=rest, points=int(first.sum()))


def ends_in_second_well(results: Results) -> ClaimResult:
    """24a: transient responses mostly end about the second well."""
    value = share_of(results, "fig6", 1, is_kind(ResponseClass.TRANSIENT_2), transient)
    late = share_of(results, "fig7", 1, is_kind(ResponseClass.TRANSIENT_2), transient)
    return found(above(value, 0.5) & above(late, 0.5), above(late, 0.5), share=value, late=late)


def ends_in_first_well(results: Results) -> ClaimResult:
    """24b: some end about the first."""
    value = share_of(results, "fig6", 1, is_kind(ResponseClass.TRANSIENT_1), transient)
    return found(above(value, 0.001), above(value, 0.0), share=value)


def snaps_once(results: Results) -> ClaimResult:
    """24c: whether transient responses mostly snap through only once."""
    value = share_of(
        results, "fig6", 1, lambda ds: np.asarray(ds.zero_crossings.values == 1),
        lambda ds: np.asarray(ds.response_class.values == ResponseClass.TRANSIENT_2),
    )  # fmt: skip
    ds = list(results["fig6"].values())[1]
    crossings = ds.zero_crossings.values[ds.response_class.values == ResponseClass.TRANSIENT_2]
    return found(
        above(value, 0.5), above(value, 0.1), share=value, up_to_three=float((crossings <= 3).mean()),
        middle=float(np.median(crossings)) if crossings.size else float("nan"),
    )  # fmt: skip


def decays(results: Results) -> ClaimResult:
    """24d: transient interwell 2 has settled, below the barrier, at the end."""
    value = share_of(
        results, "fig6", 1, lambda ds: np.asarray(ds.final_well_proven.values.astype(bool)),
        lambda ds: np.asarray(ds.response_class.values == ResponseClass.TRANSIENT_2),
    )  # fmt: skip
    return found(above(value, 0.9), above(value, 0.5), share=value)


ROWS = {
    "24a": ends_in_second_well,
    "24b": ends_in_first_well,
    "24c": snaps_once,
    "24d": decays,
    "32a": outlasts,
    "32b": outlasts_near_threshold,
    "32c": outlasts_first_well,
}
