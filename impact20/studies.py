"""Problems that consist of many runs: a threshold by bisection and the statistics of replicas.

`solve_one(case)` gives the output at the output times; whoever can run many cases at once passes `solve_many`.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import sqrt
from typing import Any

import numpy as np

from impact20 import Array, Case

Solve = Callable[[Case], Array]
SNAPPED = 1.0
"""Output above which the beam has snapped through: the height of the well."""


def with_amplitude(case: Case, velocity: float) -> Case:
    """The case with the velocity amplitude V: the tip's displacement has the amplitude V/Omega."""
    tip = case.tips[0]
    return replace(case, tips=(replace(tip, amplitude=velocity / tip.frequency),))


def velocity_of(case: Case) -> float:
    """The velocity amplitude of a case."""
    return case.tips[0].amplitude * case.tips[0].frequency


def threshold(case: Case, study: dict[str, Any], solve_one: Solve) -> float:
    """Middle of the last bracket of the bisection."""
    low, high = study["low"], study["high"]
    for _ in range(study["halvings"]):
        middle = (low + high) / 2
        if np.max(solve_one(with_amplitude(case, middle))) > SNAPPED:
            high = middle
        else:
            low = middle
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
