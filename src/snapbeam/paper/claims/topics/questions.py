"""Properties that the paper does not specify, and their influence compared with that of chaos alone."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from snapbeam.model.default_values import CONTACT
from snapbeam.paper.claims.claim_result import Check, ClaimResult, Number, Quantity, above, measured
from snapbeam.paper.claims.topics.classes import transient
from snapbeam.paper.claims.uncertainty import chaos, combined, part, resampled, share
from snapbeam.paper.recipes.sensitivity import buckling_mode_damping
from snapbeam.paper.system import paper_model
from snapbeam.sweeps.threshold import compare_maps, interwell_threshold, is_interwell

if TYPE_CHECKING:
    import xarray as xr

    from snapbeam.paper.recipe import Results


def _threshold_ratio(first: xr.Dataset, second: xr.Dataset) -> Quantity:
    """Mean threshold of the second map over that of the first, the frequencies resampled."""
    a, b = interwell_threshold(first), interwell_threshold(second)
    both = np.isfinite(a) & np.isfinite(b)
    a, b = a[both], b[both]
    return resampled(lambda at: float(b[at].mean() / a[at].mean()), a.size)


def _beyond(value: Quantity, floor: Quantity) -> Quantity:
    return Quantity(value.value - floor.value, combined(value.uncertainty, floor.uncertainty))


def _compare(results: Results, base: str, variant: str, nudged: str) -> tuple[Check, dict[str, Quantity | Number]]:
    """A variant of a map against what a change of 1e-9 does to that map."""
    first, second, floor = (part(results, "sensitivity", name) for name in (base, variant, nudged))
    a, b, c = (ds.response_class.values for ds in (first, second, floor))
    changed, alone = share(a != b), share(a != c)
    snapped, snapped_alone = (share(is_interwell(a) != is_interwell(other)) for other in (b, c))
    # the thresholds of two models on one grid of V; the base may have another coordinate by 1e-9
    times, times_alone = _threshold_ratio(first, second), _threshold_ratio(first, floor)
    matters = above(_beyond(changed, alone), 0.0) | above(_beyond(snapped, snapped_alone), 0.0)
    moved, moved_alone = (Quantity(abs(q.value - 1.0), q.uncertainty) for q in (times, times_alone))
    matters |= above(_beyond(moved, moved_alone), 0.0)
    return matters, {
        "changed": changed, "alone": alone, "snapped": snapped, "snapped_alone": snapped_alone,
        "times": times, "times_alone": times_alone,
    }  # fmt: skip


def reference_frequency(results: Results) -> ClaimResult:
    """A: which omega_1 normalises one mode."""
    matters, named = _compare(results, "one_mode", "one_mode_reference", "one_mode_perturbed")
    own, other = (
        float(part(results, "sensitivity", name).attrs["reference_frequency"])
        for name in ("one_mode", "one_mode_reference")
    )
    return measured(matters, **named, own=own, other=other, scale=other / own)


def contact_stiffness(results: Results) -> ClaimResult:
    """B: the contact stiffness, against what a common modulus of the stated material gives."""
    matters, named = _compare(results, "base", "soft_contact", "perturbed")
    soft = float(part(results, "sensitivity", "soft_contact").attrs["contact_stiffness"])
    return measured(matters, **named, soft=soft, printed=CONTACT.stiffness)


def damping(results: Results) -> ClaimResult:
    """C: damping of the linear modes or of the buckling modes."""
    matters, named = _compare(results, "base", "buckling_damping", "perturbed")
    model = paper_model(int(part(results, "sensitivity", "base").attrs["modes"]))
    projected, exact = buckling_mode_damping(model)
    return measured(
        matters, **named, first=tuple(float(value) for value in projected[:3]), most=float(projected.max()),
        error=float(np.abs(projected / exact - 1.0).max()),
    )  # fmt: skip


def end_rule(results: Results) -> ClaimResult:
    """D: transient runs whose end is not final, so that the well they end in depends on the instant."""
    values = []
    for ds in results["fig6"].values():

        def unsettled(other: xr.Dataset) -> float:
            inside = transient(other)
            return float((~other.final_well_proven.values.astype(bool))[inside].mean()) if inside.any() else 0.0

        moved = chaos(results, unsettled, int(ds.attrs["modes"]))
        values.append(share((~ds.final_well_proven.values.astype(bool))[transient(ds)], moved))
    one, many = values
    return measured(above(many, 0.01) | above(one, 0.01), many=many, one=one)


def step(results: Results) -> ClaimResult:
    """E: half the step of the integrator."""
    matters, named = _compare(results, "base", "half_step", "perturbed")
    base, half = part(results, "sensitivity", "base"), part(results, "sensitivity", "half_step")
    changed = base.response_class.values != half.response_class.values
    inside = is_interwell(base.response_class.values)[changed]
    border = compare_maps(base, half).at_border
    return measured(matters, **named, border=border, interwell=float(inside.mean()) if changed.any() else float("nan"))


ROWS = {"A": reference_frequency, "B": contact_stiffness, "C": damping, "D": end_rule, "E": step}
