"""Sections 3.2, 3.3 and Appendix A: the natural frequencies of the beam."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache, partial, reduce
from operator import and_
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

import snapbeam as sb
from snapbeam.model.default_values import BEAM, MODES, STRAIGHT_BEAM
from snapbeam.paper.claims.claim_result import Check, ClaimResult, Quantity, above, below, found, near
from snapbeam.paper.system import paper_model

if TYPE_CHECKING:
    from snapbeam.paper.recipe import Results

_Array = NDArray[np.float64]
_MOST = 3000.0
"""Frequency up to which Fig. A.9 shows the modes, Hz."""


def _rounding(of: Callable[[sb.Beam], ArrayLike], beam: sb.Beam) -> _Array:
    """Change of results within the rounding of the printed length and buckling level."""
    changes = [("length", 5e-4)] + ([("buckling_level", 5e-7)] if beam.is_buckled else [])
    moved = np.zeros_like(np.asarray(of(beam), dtype=float))
    for name, half in changes:
        low, high = (np.asarray(of(beam.replace(**{name: getattr(beam, name) + by}))) for by in (-half, half))
        moved += 0.5 * np.abs(high - low)
    return moved


def _with_rounding(of: Callable[[sb.Beam], ArrayLike], beam: sb.Beam) -> list[Quantity]:
    pairs = zip(np.ravel(of(beam)), np.ravel(_rounding(of, beam)), strict=True)
    return [Quantity(float(value), float(half)) for value, half in pairs]


@cache
def _freq(beam: sb.Beam) -> _Array:
    return sb.ReducedModel.from_beam(beam, modes=MODES).natural_frequencies


def _agree(values: list[Quantity], printed: tuple[float, ...], digits: tuple[float, ...]) -> Check:
    """Check that each value agrees with the printed one within half of its last digit and the uncertainty."""
    checks = [
        near(value.value, target, 0.5 * digit + value.uncertainty)
        for value, target, digit in zip(values, printed, digits, strict=True)
    ]
    return reduce(and_, checks)


def _printed(results: Results, beam: sb.Beam, printed: tuple[float, ...], digits: tuple[float, ...]) -> ClaimResult:
    """Natural frequencies against printed ones, each given to a last digit."""
    values = _with_rounding(lambda other: _freq(other)[: len(printed)], beam)
    named = dict(zip(("first", "second", "third"), values, strict=False))
    off = max(abs(value.value / target - 1.0) for value, target in zip(values, printed, strict=True))
    return found(_agree(values, printed, digits), off=off, **named)


def misprint(results: Results) -> ClaimResult:
    """1c: the factor 2 of Eq. (A.2)."""
    import scipy.linalg

    def freq(beam: sb.Beam) -> _Array:
        model = sb.ReducedModel.from_beam(beam, modes=MODES)
        square = model.nonlinear_stiffness * float(model.well_amplitude[0] ** 2)
        tangent = model.stiffness + 2.0 * square
        tangent[0] = model.stiffness[0] + 3.0 * square
        return np.asarray(np.sqrt(scipy.linalg.eigvalsh(np.diag(tangent), model.mass)[:3]) / (2.0 * math.pi))

    first, second, third = values = _with_rounding(freq, BEAM)
    agrees = _agree(values, (81.8, 159.0, 380.0), (0.1, 1.0, 1.0))
    return found(agrees, second=second, first=first, third=third)


def greatest_frequency(results: Results) -> ClaimResult:
    """1d: the end of the frequency axis in Hz."""
    (value,) = _with_rounding(lambda beam: 4.0 * _freq(beam)[:1], BEAM)
    return found(near(value.value, 325.0, 0.5 + value.uncertainty), greatest=value)


def measured_frequency(results: Results) -> ClaimResult:
    """1e: the fitted first frequency against those measured in both wells."""
    mean = 0.5 * (81.3 + 80.5)
    off = Quantity(float(_freq(BEAM)[0]) / mean - 1.0, 0.5 * (81.3 - 80.5) / mean)
    return found(below(off, 0.01), below(off, 0.02), off=off, model=float(_freq(BEAM)[0]), mean=mean)


def _crossing() -> float:
    """Buckling level, m, at which the first symmetric and the first antisymmetric frequency are equal."""
    from scipy.optimize import brentq

    def lead(level: float) -> float:
        model = sb.ReducedModel.from_beam(BEAM.replace(buckling_level=level), modes=MODES)
        first = [float(model.natural_frequencies[np.flatnonzero(model.parity == parity)[0]]) for parity in (1, -1)]
        return first[0] - first[1]

    return float(brentq(lead, 0.2e-3, 2e-3, xtol=1e-9))


def first_is_symmetric(results: Results) -> ClaimResult:
    """21a: at the level of the paper the first dynamic mode is the first symmetric one."""
    level = Quantity(1e3 * BEAM.buckling_level, 5e-4)
    parity = int(paper_model(MODES).parity[0])
    return found(below(level, 1e3 * _crossing()) & above(parity, 0.0), level=level, crossing=1e3 * _crossing())


def order_changes(results: Results) -> ClaimResult:
    """21b: at higher levels it is the second."""
    crossing = _crossing()
    beyond = sb.ReducedModel.from_beam(BEAM.replace(buckling_level=1.2 * crossing), modes=MODES)
    swapped = below(int(beyond.parity[0]), -1.0) & above(int(beyond.parity[1]), 0.0)
    ratio = crossing / BEAM.radius_of_gyration
    return found(swapped, crossing=Quantity(1e3 * crossing, 1e-3), ratio=ratio)


def convergence(results: Results) -> ClaimResult:
    """11: the first ten frequencies with 32 modes."""

    def worst(beam: sb.Beam) -> float:
        return float(np.abs(_freq(beam)[:10] / sb.model.exact_natural_frequencies(beam, 10) - 1.0).max())

    (error,) = _with_rounding(worst, BEAM)
    stored = results["figA9"]["error"].error.sel(modes=MODES).values
    return found(below(error, 7e-4), error=error, mode=int(np.nanargmax(stored)) + 1)


def below_three_kilohertz(results: Results) -> ClaimResult:
    """11b: how many natural frequencies lie below 3 kHz."""

    def count(beam: sb.Beam) -> float:
        return float((sb.model.exact_natural_frequencies(beam, 14) < _MOST).sum())

    (number,) = _with_rounding(count, BEAM)
    tenth = float(sb.model.exact_natural_frequencies(BEAM, 10)[-1])
    return found(near(number, 10.0, 0.0), below(number, 10.0), number=number, tenth=tenth)


ROWS = {
    "1a": partial(_printed, beam=STRAIGHT_BEAM, printed=(80.0, 221.0), digits=(1.0, 1.0)),
    "1b": partial(_printed, beam=BEAM, printed=(81.8, 159.0, 380.0), digits=(0.1, 1.0, 1.0)),
    "1c": misprint,
    "1d": greatest_frequency,
    "1e": measured_frequency,
    "11": convergence,
    "11b": below_three_kilohertz,
    "21a": first_is_symmetric,
    "21b": order_changes,
}
