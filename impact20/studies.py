"""Problems that consist of many runs: a threshold by bisection and the statistics of replicas.

`solve_many(cases)` gives the outputs at the output times; who cannot run many cases at once runs one after the other.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import sqrt
from typing import Any

import numpy as np

from impact20 import Array, Case

SolveMany = Callable[[Sequence[Case]], Sequence[Array]]
SNAPPED = 1.0
"""Output above which the beam has snapped through: the height of the well."""


def with_amplitude(case: Case, velocity: float) -> Case:
    """The case with the velocity amplitude V: the tip's displacement has the amplitude V/Omega."""
    tip = case.tips[0]
    return replace(case, tips=(replace(tip, amplitude=velocity / tip.frequency),))


def velocity_of(case: Case) -> float:
    """The velocity amplitude of a case."""
    return case.tips[0].amplitude * case.tips[0].frequency


def threshold(case: Case, study: dict[str, Any], solve_many: SolveMany, ahead: int = 1) -> float:
    """Middle of the last bracket of the bisection; *ahead* halvings at a time, with every middle that they may need."""
    low, high, left = study["low"], study["high"], study["halvings"]
    while left:
        depth = min(ahead, left)
        brackets, middles = [(low, high)], []
        for _ in range(depth):
            middles += [(a + b) / 2 for a, b in brackets]
            brackets = [half for a, b in brackets for half in ((a, (a + b) / 2), ((a + b) / 2, b))]
        outputs = solve_many([with_amplitude(case, middle) for middle in middles])
        over = dict(zip(middles, snapped(outputs), strict=True))
        for _ in range(depth):
            middle = (low + high) / 2
            low, high = (low, middle) if over[middle] else (middle, high)
        left -= depth
    return float((low + high) / 2)


def replicas_of(case: Case, study: dict[str, Any]) -> list[Case]:
    """The replicas: amplitudes by the golden ratio's fractions, which any code can repeat."""
    golden = (1 + sqrt(5)) / 2
    base = velocity_of(case)
    return [
        with_amplitude(case, base * (1 + study["spread"] * (2 * ((i / golden) % 1.0) - 1)))
        for i in range(study["count"])
    ]


def snapped(values: Sequence[Array]) -> Array:
    """Tell of each run whether it snapped through."""
    return np.array([np.max(v) > SNAPPED for v in values])


def coverage(found: Array, blocks: int) -> int:
    """Blocks whose 95 % Wilson interval contains the share of all.

    With the share p of n the interval is (p + z^2/(2n) +- z sqrt(p (1 - p)/n + z^2/(4 n^2)))/(1 + z^2/n), z = 1.959964.
    """
    z, truth, inside = 1.959964, found.mean(), 0
    for part in np.split(found, blocks):
        n, p = part.size, part.mean()
        centre, half = p + z * z / (2 * n), z * sqrt(p * (1 - p) / n + z * z / (4 * n * n))
        inside += (centre - half) / (1 + z * z / n) <= truth <= (centre + half) / (1 + z * z / n)
    return int(inside)
