"""Section 4.2: which classes of response there are, after 200 and after 1000 cycles."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

import snapbeam as sb
from snapbeam.model.default_values import LOCATION
from snapbeam.paper.claims.claim_result import Check, ClaimResult, Quantity, above, below, found
from snapbeam.paper.claims.uncertainty import chaos, chaos_of_pairs, share
from snapbeam.sweeps.threshold import is_interwell
from snapbeam.util.status_codes import ResponseClass

if TYPE_CHECKING:
    from collections.abc import Callable

    import xarray as xr

    from snapbeam.paper.recipe import Results

_Mask = NDArray[np.bool_]
_CUTS = (1.0, 2.0, 3.0, 4.0)
"""V/Omega above which responses should have settled in the second well, over that of the dashed line of Fig. 7."""


def is_transient(response: NDArray[np.int8]) -> _Mask:
    """Which responses snap through and settle."""
    return np.asarray((response == ResponseClass.TRANSIENT_1) | (response == ResponseClass.TRANSIENT_2))


def _map(results: Results, name: str, which: int) -> xr.Dataset:
    return list(results[name].values())[which]


def share_of(
    results: Results, name: str, which: int, hits: Callable[[xr.Dataset], _Mask], among: Callable[[xr.Dataset], _Mask]
) -> Quantity:
    """A share of the points of a map, with what sampling and chaos leave open."""
    ds = _map(results, name, which)

    def number(other: xr.Dataset) -> float:
        inside = among(other)
        return float(hits(other)[inside].mean()) if inside.any() else float("nan")

    moved = chaos(results, number, int(ds.attrs["modes"]), long=name == "fig7")
    return share(hits(ds)[among(ds)], moved)


def is_kind(kind: ResponseClass) -> Callable[[xr.Dataset], _Mask]:
    """Return a function that selects the points of the response type *kind*."""
    return lambda ds: np.asarray(ds.response_class.values == kind)


def _interwell(ds: xr.Dataset) -> _Mask:
    return is_interwell(ds.response_class.values)


def transient(ds: xr.Dataset) -> _Mask:
    """Select the points with a transient response."""
    return is_transient(ds.response_class.values)


def _beyond(cut: float) -> Callable[[xr.Dataset], _Mask]:
    """Points with V above *cut* times the threshold of a slow shaker, the dashed line of Fig. 7."""
    static = cut * float(sb.model.quasi_static_threshold(LOCATION, 1.0))

    def where(ds: xr.Dataset) -> _Mask:
        return np.asarray(ds.velocity_amplitude.values[None, :] > static * ds.frequency_ratio.values[:, None])

    return where


def settled(results: Results) -> ClaimResult:
    """4a: many modes, 1000 cycles, high V/Omega: all transient interwell 2."""
    second = is_kind(ResponseClass.TRANSIENT_2)
    shares = [share_of(results, "fig7", 1, second, _beyond(cut)) for cut in _CUTS]
    every: Check = above(shares[0], 0.99)
    most: Check = above(shares[0], 0.9)
    for value in shares[1:]:
        every, most = every & above(value, 0.99), most & above(value, 0.9)
    ds = _map(results, "fig7", 1)
    rest = ds.response_class.values[_beyond(1.0)(ds)]
    return found(
        every, most, share=shares[0], second=shares[1], third=shares[2], fourth=shares[3],
        continuous=float((rest == ResponseClass.CONTINUOUS).mean()),
    )  # fmt: skip


def continuous_one_mode(results: Results) -> ClaimResult:
    """4b: many interwell responses of one mode stay continuous."""
    shares = [share_of(results, "fig7", which, is_kind(ResponseClass.CONTINUOUS), _interwell) for which in (0, 1)]
    one, many = shares
    return found(above(one, 0.25) & above(one, many.value), above(one, 0.1), share=one, many=many)


def first_well_disappears(results: Results) -> ClaimResult:
    """4c: transient interwell 1 of one mode all but disappears from 200 to 1000 cycles."""
    first = is_kind(ResponseClass.TRANSIENT_1)
    before = share_of(results, "fig6", 0, first, _interwell)
    after = share_of(results, "fig7", 0, first, _interwell)
    rare = below(after, 0.01)
    gone = below(Quantity(after.value / max(before.value, 1e-12), after.uncertainty / max(before.value, 1e-12)), 0.25)
    points = [
        int((_map(results, name, 0).response_class == ResponseClass.TRANSIENT_1).sum()) for name in ("fig6", "fig7")
    ]
    return found(
        rare & gone & above(before, 0.01), rare, after=after, before=before,
        points_before=points[0], points_after=points[1],
    )  # fmt: skip


def _changed(first: xr.Dataset, second: xr.Dataset) -> float:
    return float((first.response_class.values != second.response_class.values).mean())


def changes(results: Results) -> ClaimResult:
    """4d: how many points change class between 200 and 1000 cycles."""
    values = []
    for which in (0, 1):
        pair = [_map(results, name, which) for name in ("fig6", "fig7")]
        moved = chaos_of_pairs(results, _changed, int(pair[0].attrs["modes"]))
        values.append(share(pair[0].response_class.values != pair[1].response_class.values, moved))
    one, many = values
    return found(above(one, 0.1) & above(many, 0.1), above(one, 0.1) | above(many, 0.1), many=many, one=one)


def mostly_transient(results: Results) -> ClaimResult:
    """4e: most snap-throughs of many modes end in a transient response."""
    value = share_of(results, "fig7", 1, transient, _interwell)
    return found(above(value, 0.5), share=value)


def every_kind(results: Results) -> ClaimResult:
    """19: all four classes, by frequency and amplitude and by location."""
    kinds = [kind for kind in ResponseClass if kind is not ResponseClass.UNKNOWN]
    values = [share_of(results, "fig6", 1, is_kind(kind), _everywhere) for kind in kinds]
    least = min(values, key=lambda value: value.value)
    ds = [ds for ds in results["fig8"].values() if int(ds.attrs["modes"]) > 1][-1]
    response = ds.response_class.transpose("relative_amplitude", "location").values
    by_location = max(len(set(row.tolist())) for row in response)
    return found(
        above(least, 0.005) & above(by_location, 2), above(least, 0.0), least=least,
        listed=tuple(100.0 * value.value for value in values), by_location=by_location,
    )  # fmt: skip


def _everywhere(ds: xr.Dataset) -> _Mask:
    return np.ones(ds.response_class.shape, dtype=bool)


ROWS = {
    "4a": settled,
    "4b": continuous_one_mode,
    "4c": first_well_disappears,
    "4d": changes,
    "4e": mostly_transient,
    "19": every_kind,
}
