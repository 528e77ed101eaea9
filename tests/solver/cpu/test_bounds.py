"""Bounds of speeds, for the interval in which a contact is not looked for: none is exceeded, none is NaN and trusted."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import pytest
from numba import njit
from scipy.integrate import solve_ivp

import snapbeam as sb
from snapbeam.solver.cpu.mode_lanes import speed_bound_with_terms
from snapbeam.solver.step_control import TRUST, safe_interval
from snapbeam.solver.terms.circuit import Circuit, ResistiveCircuit
from snapbeam.solver.terms.local_force import LocalForceTerm, greatest_change

OMEGA, ALONG, Q, P, K, COUPLING, CIRCUIT, FORCED, FORCE = range(0, 72, 8)
"""Rows of the memory of these tests: the circuit's state and the local force's state behind their rows."""
OWN, REST, STEP = 7, -1e-4, 2e-5
ATTRACTING = (sb.MagneticForce(strength=2e-7, gap=4e-4), sb.MagneticForce(strength=1e-7, gap=-5e-4))
REPELLING = sb.MagneticForce(strength=-1e-7, gap=-5e-4)
change = njit(lambda law, u, reach: greatest_change(law, u, reach))


class Layout(NamedTuple):
    """What the bound reads of the layout of a structure."""

    size: int
    omega: int
    terms: Any


@pytest.mark.parametrize("bad", [math.nan, math.inf])
@pytest.mark.parametrize("place", [1, 2, 3])
def test_a_bound_that_is_not_finite_is_unsafe(bad: float, place: int) -> None:
    given = [1e-3, 0.5, 0.1, 2.0, 1e-5]
    given[place] = bad
    assert safe_interval(*given) == 0.0


def test_a_finite_bound_gives_the_time_to_the_gap() -> None:
    """At most the horizon; none for a gap that is closed; the horizon for what does not move."""
    horizon = TRUST * 1e-3
    assert safe_interval(1.0, 0.1, 0.0, 0.0, 1e-3) == horizon
    assert safe_interval(1e-4, 0.8, 1.0, 0.0, 1e-3) == pytest.approx(1e-4 / 2.0)
    assert safe_interval(1e-4, 0.8, 1.0, -250.0, 1e-3) == pytest.approx(1e-4 / 4.0)
    assert safe_interval(-1e-9, 0.8, 1.0, 0.0, 1e-3) < 0.0
    assert safe_interval(0.0, 0.0, 0.0, 0.0, 1e-3) == horizon


@pytest.mark.parametrize("magnet", [*ATTRACTING, REPELLING])
def test_change_of_a_force(magnet: sb.MagneticForce) -> None:
    """No less than the force changes within the reach; NaN if the reach leaves the range of the law."""
    law = magnet.numbers
    for u, reach in ((0.0, 1e-4), (1e-4, 2.9e-4), (-2e-4, 1e-5)):
        within = [magnet.force_at(at) - magnet.force_at(u) for at in np.linspace(u - reach, u + reach, 41)]
        assert np.abs(within).max() <= change(law, u, reach) < 2.1 * np.abs(within).max()
    assert math.isnan(change(law, 0.0, 1.01 * abs(magnet.gap)))


def bounds_of(term: Any) -> Any:
    """The bound of a circuit and a magnet, as a function of the memory and the magnet."""

    def bound(memory: Any, law: Any) -> Any:
        layout = Layout(8, OMEGA, (term, LocalForceTerm(FORCED, FORCE, REST, law)))
        return speed_bound_with_terms(memory, layout, None, ALONG, Q, P, K, STEP)

    return njit(bound)


@pytest.mark.parametrize("resistive", [False, True])
def test_no_motion_is_faster_than_its_bound(resistive: bool) -> None:
    """Two modes with a circuit and a magnet, integrated for as long as the bound is trusted, from rest and from anywhere.

    The energy of the magnets, about -0.3 mJ, exceeds that of the modes.
    """
    rng = np.random.default_rng(7)
    term: Any = Circuit(COUPLING, 0, 0, CIRCUIT, 0, OWN)
    if resistive:
        term = ResistiveCircuit(COUPLING, CIRCUIT, 0)
    bounds, horizon, omega = bounds_of(term), TRUST * STEP, np.array([300.0, 900.0])
    tightest = 0.0
    for case in range(60):
        magnet, memory = ATTRACTING[case % 2], np.zeros(72)
        along, coupling, shape = rng.uniform(-3.0, 3.0, (3, 2))
        coupling *= 100.0
        size = 0.0 if case == 0 else 10.0 ** rng.uniform(-3.0, 0.0)
        q, p = 1e-5 * size * rng.uniform(-1.0, 1.0, 2), 1e-2 * size * rng.uniform(-1.0, 1.0, 2)
        y, rate = 1e-2 * size * rng.uniform(-1.0, 1.0), 10.0 ** rng.uniform(-3.0, 2.0)
        memory[OMEGA : OMEGA + 2], memory[ALONG : ALONG + 2], memory[Q : Q + 2] = omega, along, q
        memory[P : P + 2], memory[COUPLING : COUPLING + 2], memory[FORCED : FORCED + 2] = p, coupling, shape
        memory[Q + OWN] = 0.0 if resistive else y + coupling @ q
        memory[CIRCUIT], memory[FORCE] = (1e-4 if resistive else 1.0) * rate, REST

        def force(x, shape=shape, magnet=magnet):
            return magnet.force_at(REST + float(shape @ x)) * shape

        def motion(t, z, coupling=coupling, rate=rate, force=force):
            x, v = z[:2], z[2:4]
            tapped = -1e-4 * rate * (coupling @ v) if resistive else z[4]
            pushed = -(omega**2) * x + tapped * coupling + force(x)
            return [*v, *pushed, -coupling @ v - rate * z[4]]

        memory[K : K + 2] = force(q) + (0.0 if resistive else y * coupling)
        bound = bounds(memory, magnet.numbers)
        assert math.isfinite(bound)
        found = solve_ivp(motion, (0.0, horizon), [*q, *p, y], rtol=1e-9, atol=1e-12, max_step=horizon / 20.0)
        reached = np.abs(along @ found.y[2:4]).max()
        allowed = 1.25 * bound + abs(along @ memory[K : K + 2]) * horizon
        assert reached <= allowed * (1.0 + 1e-6)
        tightest = max(tightest, reached / allowed)
    assert tightest > 0.1
