"""Section 3.2 and 3.3: two laws of contact as modes are added, the contact stiffness, and what impacts are like."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from snapbeam.model.default_values import BEAM, CONTACT, LOCATION
from snapbeam.paper.claims.claim_result import ClaimResult, Quantity, above, below, found, near
from snapbeam.paper.claims.uncertainty import part, resampled
from snapbeam.paper.recipes.sensitivity import tip_contact
from snapbeam.paper.system import paper_model, paper_run
from snapbeam.util.singular_values import polyfit

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from snapbeam.paper.recipe import Results

_RESTITUTION = 0.7  # any value above 0 gives the same trend
_DRIVE = (1.21, 0.18)
_TIP_RADIUS = 2.5e-3
_STRENGTH = (50e6, 60e6, 70e6)
"""Yield stress of polylactic acid, low, middle and high among common grades, Pa."""
_ONSET = 1.6
"""Maximum Hertzian pressure at the onset of yield over the yield stress (Johnson, Contact Mechanics, 1985, 4.2)."""
_SHORT = 0.1


def _counts(results: Results) -> tuple[int, ...]:
    return tuple(results.pick((4, 8, 16), (16, 32, 64, 128, 256)))


def restitution(results: Results) -> ClaimResult:
    """12a: the impulse of the first impact by the law of restitution, (1 + e) M v."""
    counts = _counts(results)
    speed = _DRIVE[1] * BEAM.buckling_level * 2.0 * math.pi * paper_model(32).reference_frequency
    mass = np.array([paper_model(modes).contact_mass(LOCATION) for modes in counts])
    impulse = (1.0 + _RESTITUTION) * mass * speed
    (slope, _), covariance = polyfit(np.log(counts), np.log(impulse), 1, cov="unscaled")
    left = np.log(impulse) - np.polyval(polyfit(np.log(counts), np.log(impulse), 1), np.log(counts))
    error = 1.96 * math.sqrt(float(covariance[0, 0]) * float(np.sum(left**2)) / max(len(counts) - 2, 1))
    value = Quantity(float(slope), error)
    return found(
        below(value, -0.7), below(value, -0.1), slope=value, first_count=counts[0], last_count=counts[-1],
        first_mass=1e3 * float(mass[0]), last_mass=1e3 * float(mass[-1]),
    )  # fmt: skip


def hertz(results: Results) -> ClaimResult:
    """12b: the impulse over the first half cycle by Hertz's law."""
    counts, (omega, drive) = _counts(results), _DRIVE
    reference, impulse = paper_model(32).reference_frequency, []
    for modes in counts:
        run = paper_run(modes, omega, drive, 1, reference_frequency=reference, sample_times=[0.0])
        first = run.impacts.onset.values < 0.5 / (omega * reference)
        impulse.append(float(run.impacts.impulse.values[first].sum()))
    changes = np.abs(np.diff(impulse) / np.array(impulse[1:]))
    # what is left beyond the last number of modes, if the changes go on falling as they do
    ratio = min(float(changes[-1] / changes[-2]), 0.9) if changes[-2] > 0.0 else 0.0
    change = Quantity(float(changes[-1]), float(changes[-1]) * ratio / (1.0 - ratio))
    falling = below(float(changes[-1]), float(changes[0]))
    return found(below(change, 0.01) & falling, below(change, 0.05), change=change, before=counts[-2], after=counts[-1])


def stiffness(results: Results) -> ClaimResult:
    """16: the contact stiffness from the stated materials."""
    from scipy.optimize import brentq

    softest, stiffest = (tip_contact(modulus).stiffness for modulus in (3e9, 4e9))
    computed = Quantity(tip_contact().stiffness, 0.5 * (stiffest - softest))
    needed = float(brentq(lambda modulus: tip_contact(modulus).stiffness - CONTACT.stiffness, 1e9, 20e9))
    return found(
        near(CONTACT.stiffness, computed.value, computed.uncertainty),
        near(CONTACT.stiffness, computed.value, 0.1 * CONTACT.stiffness + computed.uncertainty),
        computed=computed, needed=needed / 1e9, as_radius=tip_contact(radius=5e-3).stiffness,
    )  # fmt: skip


def _over_runs(results: Results, of: Callable[[NDArray[np.int64]], float]) -> Quantity:
    """A number read off the impacts of the given places, resampled run by run."""
    table = part(results, "waveforms", "impacts")
    run = table.run.values.astype(int)
    groups = [np.flatnonzero(run == at) for at in np.unique(run)]

    def statistic(which: NDArray[np.int64]) -> float:
        return of(np.concatenate([groups[i] for i in which]))

    return resampled(statistic, len(groups))


def impulse_like(results: Results) -> ClaimResult:
    """22a: how much of the impulse comes in impacts that are short for the beam and for the drive."""
    runs, table = part(results, "waveforms", "runs"), part(results, "waveforms", "impacts")
    ratio = runs.frequency_ratio.values[table.run.values.astype(int)]
    length = table.duration.values * float(table.attrs["reference_frequency"]) * np.maximum(1.0, ratio)
    impulse = table.impulse.values
    carried = _over_runs(results, lambda at: float(impulse[at][length[at] < _SHORT].sum() / impulse[at].sum()))
    return found(
        above(carried, 0.9), above(carried, 0.5), carried=carried, short=float((length < _SHORT).mean()),
        middle=1e6 * float(np.median(table.duration.values)), impacts=int(table.sizes["impact"]),
    )  # fmt: skip


def shallow(results: Results) -> ClaimResult:
    """22b: penetration against the radius of the tip."""
    depth = (part(results, "waveforms", "impacts").peak_force.values / CONTACT.stiffness) ** (2.0 / 3.0)
    deep = _over_runs(results, lambda at: float(np.quantile(depth[at], 0.99)) / _TIP_RADIUS)
    in_b = depth / BEAM.buckling_level
    return found(below(deep, 0.01), below(deep, 0.05), deep=deep, middle=float(np.median(in_b)), most=float(in_b.max()))


def elastic(results: Results) -> ClaimResult:
    """22c: the maximum contact pressure against the onset of yield of the tip."""
    force = part(results, "waveforms", "impacts").peak_force.values
    # E* from the printed stiffness, k_c = 4/3 E* sqrt(R), which is what the model has
    modulus = 0.75 * CONTACT.stiffness / math.sqrt(_TIP_RADIUS)
    pressure = (6.0 * force * modulus**2 / (math.pi**3 * _TIP_RADIUS**2)) ** (1.0 / 3.0)

    def beyond(strength: float) -> float:
        return float((pressure > _ONSET * strength).mean())

    low, middle, high = (beyond(strength) for strength in _STRENGTH)
    share = Quantity(middle, 0.5 * abs(low - high))
    return found(
        below(share, 0.01), below(share, 0.1), share=share, most=1e-6 * float(pressure.max()),
        onset=1e-6 * _ONSET * _STRENGTH[1],
    )  # fmt: skip


ROWS = {"12a": restitution, "12b": hertz, "16": stiffness, "22a": impulse_like, "22b": shallow, "22c": elastic}
