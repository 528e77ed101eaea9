"""Section 4.1 and 4.2: what start-up transients, initial conditions and higher modes at an impact change."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from snapbeam.paper.claims.claim_result import ClaimResult, Quantity, above, found
from snapbeam.paper.claims.uncertainty import combined, median_of, part, share
from snapbeam.paper.recipes.disturbances import EXCESS, OFFSET
from snapbeam.sweeps.threshold import is_interwell
from snapbeam.util.status_codes import ResponseClass

if TYPE_CHECKING:
    import xarray as xr

    from snapbeam.paper.recipe import Results


def _changed(classes: xr.Dataset, variant: str) -> NDArray[np.bool_]:
    response = classes.response_class
    return np.asarray(response.sel(variant=variant).values != response.sel(variant="base").values)


def _less(first: Quantity, second: Quantity) -> Quantity:
    return Quantity(first.value - second.value, combined(first.uncertainty, second.uncertainty))


def startup(results: Results) -> ClaimResult:
    """25a: a first cycle that is larger than the rest."""
    classes = part(results, "disturbances", "classes")
    value, floor = (share(_changed(classes, name)) for name in ("startup", "perturbed"))
    excess = _less(value, floor)
    base, other = (classes.response_class.sel(variant=name).values for name in ("base", "startup"))
    snapped = share(is_interwell(base) != is_interwell(other))
    return found(
        above(excess, 0.0) & above(value, 0.1), above(value, 0.1), share=value, floor=floor, excess=excess,
        snapped=snapped, larger=EXCESS, points=int(classes.sizes["point"]),
    )  # fmt: skip


def initial_conditions(results: Results) -> ClaimResult:
    """25b: a start slightly off the well."""
    classes = part(results, "disturbances", "classes")
    value = share(_changed(classes, "offset"))
    return found(above(value, 0.1), above(value, 0.02), share=value, offset=OFFSET)


def near_transitions(results: Results) -> ClaimResult:
    """25c: particularly near transitions between classes, and where the response is not periodic."""
    classes = part(results, "disturbances", "classes")
    changed, border = _changed(classes, "offset"), classes.at_border.values.astype(bool)
    beside, elsewhere = share(changed[border]), share(changed[~border])
    excess = _less(beside, elsewhere)
    calm = classes.response_class.sel(variant="base").values == ResponseClass.INTRAWELL
    return found(
        above(excess, 0.0) & above(beside, 2.0 * elsewhere.value), above(excess, 0.0), excess=excess,
        beside=beside, elsewhere=elsewhere, calm=share(changed[calm]),
    )  # fmt: skip


def impacts_need_all_modes(results: Results) -> ClaimResult:
    """29: the next impact from the whole state and from the first mode alone."""
    table = part(results, "disturbances", "impacts")
    first = float(table.attrs["reference_frequency"])

    def change(name: str) -> NDArray[np.float64]:
        return np.abs(table[f"{name}_alone"].values / table[name].values - 1.0)

    impulse, work = median_of(change("impulse")), median_of(change("work"))
    delay = median_of(np.abs(table.next_onset_alone.values - table.next_onset.values) * first)
    return found(
        above(impulse, 0.1) & above(work, 0.1) & above(delay, 0.05), above(impulse, 0.1) | above(work, 0.1),
        impulse=impulse, work=work, delay=delay, impacts=int(table.sizes["impact"]),
    )  # fmt: skip


ROWS = {"25a": startup, "25b": initial_conditions, "25c": near_transitions, "29": impacts_need_all_modes}
