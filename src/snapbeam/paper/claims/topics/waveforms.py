"""Sections 4.1 and 4.2: the snap-through of Fig. 5 and many more, and intrawell waveforms."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

import snapbeam as sb
from snapbeam.model.default_values import BEAM, LOCATION
from snapbeam.paper.claims.claim_result import ClaimResult, Quantity, above, below, found
from snapbeam.paper.claims.uncertainty import median_of, part, resampled, share
from snapbeam.paper.recipe import MissingResults
from snapbeam.paper.recipes.fig5 import snap_times
from snapbeam.paper.system import TOLERANCE
from snapbeam.util.status_codes import ResponseClass

if TYPE_CHECKING:
    import xarray as xr

    from snapbeam.paper.recipe import Results

_Array = NDArray[np.float64]
_PERIODIC = 0.1
"""A run repeats itself if the cycles that are alike differ by less than this share of what it moves."""


def amplitudes(results: Results) -> tuple[xr.Dataset, xr.Dataset, _Array]:
    """The run of Fig. 5, its shapes, and its amplitudes over the first at rest."""
    run, along = results["fig5"]["run"], results["fig5"]["shapes"]
    return run, along, run.modal_amplitude.values.astype(float) / abs(float(along.attrs["rest_amplitude"]))


def snaps_through(results: Results) -> ClaimResult:
    """10a: Fig. 5 snaps through."""
    run, _, alpha = amplitudes(results)
    period = float(run.time[-1] / run.cycle[-1])
    snaps = snap_times(run) / period
    # the run is within its tolerance, which its speed at the passage makes a time
    at = int(np.searchsorted(run.cycle.values, snaps[0])) if snaps.size else 0
    speed = abs(float(np.gradient(alpha[:, 0], run.cycle.values)[at]))
    error = float(run.attrs.get("accuracy_estimated_error", np.nan))
    if not np.isfinite(error):
        raise MissingResults("fig5: the stored run has no estimate of its error; compute it again")
    first = Quantity(float(snaps[0]) if snaps.size else float("nan"), max(error, TOLERANCE) / speed)
    return found(
        above(snaps.size, 0), first=first, times=int(snaps.size), cycles=float(run.cycle[-1]),
        listed=tuple(float(value) for value in snaps),
    )  # fmt: skip


def _dominance(results: Results, name: str, low: float, high: float) -> Quantity:
    """Share of the time with |alpha_1| in a range that other modes exceed it, over the runs of the study."""
    runs = part(results, "waveforms", "runs")
    inside = (runs.bin.values > low) & (runs.bin.values < high)
    total = runs.samples.values[:, inside].sum(axis=1).astype(float)
    hits = runs[name].values[:, inside].sum(axis=1).astype(float)
    return resampled(lambda at: float(hits[at].sum() / max(total[at].sum(), 1.0)), total.size)


def higher_modes_dominate(results: Results) -> ClaimResult:
    """10b: which modes lead while the beam passes the unstable equilibrium."""
    half, fifth, twentieth = (_dominance(results, "higher_exceed", 0.0, cut) for cut in (0.5, 0.2, 0.05))
    _, _, alpha = amplitudes(results)
    first, others = np.abs(alpha[:, 0]), np.sqrt(np.sum(alpha[:, 1:] ** 2, axis=1))
    own = tuple(float((others > first)[first < cut].mean()) for cut in (0.5, 0.2, 0.05))
    return found(
        above(half, 0.5), above(fifth, 0.5), half=half, fifth=fifth, twentieth=twentieth,
        own_half=own[0], own_fifth=own[1], own_twentieth=own[2],
    )  # fmt: skip


def antisymmetric_part(results: Results) -> ClaimResult:
    """26a: how large the antisymmetric part is where alpha_1 passes zero."""
    table = part(results, "waveforms", "snap_throughs")
    uneven, run = table.antisymmetric.values, table.run.values.astype(int)
    groups = [uneven[run == at] for at in np.unique(run)]
    large = resampled(lambda at: float((np.concatenate([groups[i] for i in at]) >= 0.1).mean()), len(groups))
    snaps = snap_times(results["fig5"]["run"])
    _, _, alpha = amplitudes(results)
    time = results["fig5"]["run"].time.values
    own = [np.sqrt(np.sum(alpha[int(np.argmin(np.abs(time - at))), 1::2] ** 2)) for at in snaps]
    return found(
        above(large, 0.5), above(large, 0.1), large=large, middle=float(np.median(uneven)),
        passages=int(uneven.size), own=tuple(float(value) for value in own),
    )  # fmt: skip


def slow_push(results: Results) -> ClaimResult:
    """26b: the antisymmetric part along the equilibria of a slow push at the shaker's place.

    With the contact held, (K0 + gamma s) alpha = force phi, s the sum of the squares of alpha, which falls from its
    value at rest to 0.
    """
    modes = results.pick(8, 32)

    def largest(beam: sb.Beam) -> float:
        model = sb.ReducedModel.from_beam(beam, modes=modes)
        rest = float(model.well_amplitude @ model.well_amplitude)
        square = rest * np.linspace(0.001, 0.999, 999)
        flexible = model.shape_at(LOCATION) / (model.stiffness + model.nonlinear_stiffness * square[:, None])
        alpha = flexible * np.sqrt(square / np.sum(flexible**2, axis=1))[:, None]
        return float(np.sqrt(np.sum(alpha[:, 1::2] ** 2, axis=1).max() / rest))

    levels = [BEAM.replace(buckling_level=BEAM.buckling_level + half) for half in (-5e-7, 5e-7)]
    value = Quantity(largest(BEAM), 0.5 * abs(largest(levels[1]) - largest(levels[0])))
    load = BEAM.axial_load / BEAM.second_critical_load
    return found(above(value, 0.1), above(value, 0.05), largest=value, load=load)


def first_mode_away(results: Results) -> ClaimResult:
    """27: away from the unstable equilibrium the first mode soon leads the antisymmetric ones."""
    exceeded = _dominance(results, "antisymmetric_exceed", 0.5, np.inf)
    table = part(results, "waveforms", "snap_throughs")
    run = table.run.values.astype(int)
    delay = table.delay.values * float(table.attrs["reference_frequency"])
    # a passage after which it does not come to that before the next is late
    delay = np.where(np.isfinite(delay), delay, np.inf)
    groups = [delay[run == at] for at in np.unique(run)]
    soon = resampled(lambda at: float(np.median(np.concatenate([groups[i] for i in at]))), len(groups))
    leads = Quantity(1.0 - exceeded.value, exceeded.uncertainty)
    return found(above(leads, 0.95) & below(soon, 0.25), above(leads, 0.95) | below(soon, 0.25), leads=leads, soon=soon)


def _repeats(record: _Array) -> bool:
    """Return whether a signal is periodic, or becomes so, with a period of at most 40 cycles."""
    size = float(record.std())

    def apart(half: _Array) -> float:
        most = min(40, len(half) // 2)
        return min(float(np.sqrt(np.mean((half[p:] - half[:-p]) ** 2))) for p in range(1, most + 1))

    middle = len(record) // 2
    before, after = apart(record[:middle]), apart(record[middle:])
    return after < _PERIODIC * size or after < 0.5 * before


def not_periodic(results: Results) -> ClaimResult:
    """23a: intrawell responses that do not repeat themselves."""
    record = part(results, "waveforms", "strobed").displacement.values.astype(float)
    periodic = np.array([_repeats(one) for one in record], dtype=bool)
    value = share(~periodic)
    return found(
        above(value, 0.5), above(value, 0.1), share=value, runs=len(record),
        cycles=int(part(results, "waveforms", "strobed").attrs["cycles"]),
    )  # fmt: skip


def similar_amplitude(results: Results) -> ClaimResult:
    """23b: the peaks of those are alike, not equal, and the beam stays about its first well."""
    record = part(results, "waveforms", "strobed").displacement.values.astype(float)
    wild = np.array([one for one in record if not _repeats(one)])
    if wild.size == 0:
        wild = record
    peak = wild.max(axis=2) + math.sin(math.pi * LOCATION) ** 2  # above the rest
    scatter = peak.std(axis=1) / peak.mean(axis=1)
    middle = median_of(scatter)
    highest = float(np.median(wild.max(axis=(1, 2))))
    return found(
        above(middle, 0.01) & below(middle, 0.5), above(middle, 0.01), scatter=middle, highest=highest,
        mean=float(wild.mean()),
    )  # fmt: skip


def in_order(results: Results) -> ClaimResult:
    """23c: intrawell, one snap-through, several, as the amplitude grows at one frequency."""
    searched = results["fig4"]["searched"]
    settled = searched.response_class.values == ResponseClass.TRANSIENT_2
    hits = []
    for kinds, crossings, second in zip(
        searched.response_class.values, searched.zero_crossings.values, settled, strict=True
    ):
        once, more = np.flatnonzero(second & (crossings == 1)), np.flatnonzero(second & (crossings >= 3))
        ordered = once.size > 0 and more.size > 0 and once[0] < more[-1]
        hits.append(bool(kinds[0] == ResponseClass.INTRAWELL and ordered))
    value = share(hits)
    return found(above(value.value, 0.0), share=value, frequencies=len(hits))


ROWS = {
    "10a": snaps_through,
    "10b": higher_modes_dominate,
    "23a": not_periodic,
    "23b": similar_amplitude,
    "23c": in_order,
    "26a": antisymmetric_part,
    "26b": slow_push,
    "27": first_mode_away,
}
