"""Section 4.2: high-frequency oscillations in flight, and which modes a strike excites."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from snapbeam.paper.claims.claim_result import ClaimResult, Quantity, above, below, found
from snapbeam.paper.claims.topics.waveforms import amplitudes
from snapbeam.paper.claims.uncertainty import mean_of, part, resampled
from snapbeam.paper.system import paper_model, paper_run

if TYPE_CHECKING:
    from snapbeam.paper.recipe import Results

_Array = NDArray[np.float64]
_VISIBLE = 0.005
"""Root mean square of a ripple, b, from which it is counted: 1.7 um, or the width of a line in Fig. 5."""


def _ripple(results: Results) -> tuple[_Array, NDArray[np.bool_], _Array]:
    """Per mode, the part of the centre displacement that modes from the third on make, b; flight; cycle."""
    run, along, alpha = amplitudes(results)
    shapes, scale = along["shape"].values, float(along.attrs["length_scale"])
    centre = shapes[shapes.shape[0] // 2] * abs(float(along.attrs["rest_amplitude"])) / scale
    parts = alpha * centre
    parts[:, :2] = 0.0
    return parts, run.contact_force.values == 0.0, run.cycle.values


def ripples(results: Results) -> ClaimResult:
    """10c: high-frequency oscillations of the centre in every cycle."""
    parts, flight, cycle = _ripple(results)
    run = results["fig5"]["run"]
    whole = parts.sum(axis=1)
    size = []
    for k in range(int(cycle[-1])):
        inside = flight & (cycle >= k) & (cycle < k + 1)
        size.append(float(whole[inside].std()))
    heights = np.array(size)
    unsure = float((np.abs(heights / _VISIBLE - 1.0) < 0.1).mean())
    rippled = Quantity(float((heights >= _VISIBLE).mean()), unsure)
    window = np.hanning(whole.size)
    spectrum = np.abs(np.fft.rfft((whole - whole.mean()) * window))
    strongest = float(np.fft.rfftfreq(whole.size, run.time.values[1])[np.argmax(spectrum)])
    first = float(run.attrs["reference_frequency"])
    high = above(strongest, 2.0 * first)
    return found(
        above(rippled, 0.999) & high, above(rippled, 0.5) & high, rippled=rippled, cycles=heights.size,
        least=float(heights.min()), middle=float(np.median(heights)), strongest=strongest, times=strongest / first,
    )  # fmt: skip


def odd_ripples(results: Results) -> ClaimResult:
    """10d: the ripple of the centre comes from the odd modes."""
    _, along, alpha = amplitudes(results)
    shapes = along["shape"].values
    centre = shapes[shapes.shape[0] // 2]
    even, odd = (float(np.std(alpha[:, first::2] @ centre[first::2])) for first in (1, 2))
    return found(below(even / odd, 0.01), even=Quantity(even / odd, 1e-7))


def few_modes(results: Results) -> ClaimResult:
    """10e: how much of the ripple the first few modes make."""
    parts, flight, cycle = _ripple(results)
    whole = parts.sum(axis=1)

    def left(last: int, inside: NDArray[np.bool_]) -> float:
        few = parts[:, :last].sum(axis=1)[inside]
        return 1.0 - float(np.var(whole[inside] - few) / np.var(whole[inside]))

    cycles = [flight & (cycle >= k) & (cycle < k + 1) for k in range(int(cycle[-1]))]
    by_cycle = np.array([left(7, inside) for inside in cycles])
    share_of = mean_of(by_cycle)
    return found(
        above(share_of, 0.5), few=share_of,
        listed=tuple((last, 100.0 * left(last, flight)) for last in (5, 9, 13)),
    )  # fmt: skip


def central_shaker(results: Results) -> ClaimResult:
    """14: a shaker at the centre excites no antisymmetric mode."""
    modes, cycles = results.pick(8, 32), results.pick(10, 50)
    alpha = paper_run(modes, 1.21, 0.3, cycles, location=0.5).dataset.modal_amplitude.values
    even = float(np.abs(alpha[:, 1::2]).max() / abs(paper_model(modes).well_amplitude[0]))
    return found(below(even, 0.0), even=Quantity(even, 0.0), cycles=cycles)


def all_modes_excited(results: Results) -> ClaimResult:
    """28: off the centre every mode is excited."""
    peak = part(results, "waveforms", "runs").peak_amplitude.values
    least = resampled(lambda at: float(np.median(peak[at], axis=0).min()), peak.shape[0])
    return found(
        above(least, 1e-6), least=least, least_of_all=float(peak.min()),
        second=float(np.median(peak[:, 1])), modes=int(peak.shape[1]),
    )  # fmt: skip


ROWS = {"10c": ripples, "10d": odd_ripples, "10e": few_modes, "14": central_shaker, "28": all_modes_excited}
