"""Bounds of speeds, for the interval in which a contact is not looked for: none is exceeded, none is NaN and trusted."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import pytest
from numba import njit
from scipy.integrate import solve_ivp

import snapbeam as sb
from snapbeam.model.quantity import quantity
from snapbeam.solver.cpu.mode_lanes import speed_bound_with_terms
from snapbeam.solver.step_control import TRUST, safe_interval
from snapbeam.solver.terms.circuit import Circuit, ResistiveCircuit
from snapbeam.solver.terms.local_force import LocalForceTerm, greatest_change

OMEGA, ALONG, Q, P, K, COUPLING, CIRCUIT, FORCED, FORCE, EXTREMA = range(0, 80, 8)
"""Rows of the memory of these tests: the circuit's state and the local force's state behind their rows."""
OWN, REST, STEP = 7, -1e-4, 2e-5
ATTRACTING = (sb.MagneticForce(strength=2e-7, gap=4e-4), sb.MagneticForce(strength=1e-7, gap=-5e-4))
REPELLING = sb.MagneticForce(strength=-1e-7, gap=-5e-4)
change = njit(lambda memory, count, law, u, reach: greatest_change(memory, 0, count, law, u, reach))


def change_of(law: sb.LocalForce, largest: float, u: float, reach: float) -> float:
    """The bound of a law whose extrema are sought as for a motion up to *largest*."""
    places, ends = law.extrema(largest)
    memory = np.concatenate((ends, np.column_stack((places, law.force_at(places))).ravel()))
    return float(change(memory, places.size, law.numbers, u, reach))


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
    for u, reach in ((0.0, 1e-4), (1e-4, 2.9e-4), (-2e-4, 1e-5)):
        within = [magnet.force_at(at) - magnet.force_at(u) for at in np.linspace(u - reach, u + reach, 41)]
        assert np.abs(within).max() <= change_of(magnet, 2e-4, u, reach) < 2.1 * np.abs(within).max()
    assert math.isnan(change_of(magnet, 2e-4, 0.0, 1.01 * abs(magnet.gap)))


@dataclass(frozen=True, kw_only=True)
class _Waves(sb.LocalForce):
    """F = -a sin(u/w) beyond u = s, a law whose range excludes the straight beam where s > 0."""

    size: float = quantity("N", "size of the force", symbol="a")
    width: float = quantity("m", "width of a wave", low=0.0, symbol="w")
    begin: float = quantity("m", "beginning of the range", symbol="s")

    @staticmethod
    def force(law: Any, displacement: float) -> float:
        return -law.size * math.sin(displacement / law.width)

    @staticmethod
    def energy(law: Any, displacement: float) -> float:
        return -law.size * law.width * math.cos(displacement / law.width)

    @staticmethod
    def displacement_range(law: Any) -> tuple[float, float]:
        return law.begin, math.inf


@dataclass(frozen=True, kw_only=True)
class _Hole(sb.LocalForce):
    """F = -k sqrt(u^2 - s^2) u, which is not finite next to u = 0."""

    stiffness: float = quantity("N/m^2", "stiffness", symbol="k")
    hole: float = quantity("m", "half of the width of the hole", symbol="s")

    @staticmethod
    def force(law: Any, displacement: float) -> float:
        square = displacement * displacement - law.hole * law.hole
        return -law.stiffness * displacement * math.sqrt(square) if square >= 0.0 else math.nan

    @staticmethod
    def energy(law: Any, displacement: float) -> float:
        square = displacement * displacement - law.hole * law.hole
        return law.stiffness / 3.0 * square * math.sqrt(square) if square >= 0.0 else math.nan


@pytest.mark.parametrize(
    ("law", "at"),
    [
        (sb.LocalSpring(stiffness=30.0, cubic_stiffness=-30.0 / 4e-4**2), [-1.0, 1.0]),
        (_Waves(size=2.0, width=5e-5, begin=-2.0), None),
        (_Waves(size=2.0, width=9e-5, begin=6e-4), None),
    ],
)
def test_change_of_a_force_with_extrema(law: sb.LocalForce, at: list[float] | None) -> None:
    """The bound of any interval is no less than the change within it, and at most twice that."""
    rng, largest = np.random.default_rng(3), 7e-4
    places, (low, high) = law.extrema(largest)
    if at is not None:
        assert places == pytest.approx(4e-4 / math.sqrt(3.0) * np.array(at), rel=1e-6)
    assert low < high
    for _ in range(60):
        u, other = np.sort(rng.uniform(max(low, -1.5e-3), min(high, 1.5e-3), 2))
        reach = float(rng.choice([other - u, 0.999 * min(u - low, high - u)]))
        within = law.force_at(np.linspace(u - reach, u + reach, 801)) - law.force_at(u)
        found = change_of(law, largest, float(u), reach)
        if low <= u - reach and u + reach <= high:
            assert np.abs(within).max() * (1.0 - 1e-4) <= found <= 2.1 * np.abs(within).max()
        else:
            assert math.isnan(found)


def test_both_extrema_of_a_softening_spring_within_the_reach() -> None:
    """From the middle to both ends of the range the force changes by nothing, and by 2 k s/3^1.5 in between."""
    law = sb.LocalSpring(stiffness=30.0, cubic_stiffness=-30.0 / 4e-4**2)
    most = 2.0 * 30.0 * 4e-4 / 3.0**1.5
    assert change_of(law, 7e-4, 0.0, 3.999e-4) == pytest.approx(most, rel=1e-9)


def test_a_force_that_is_not_finite_somewhere_is_not_known_there() -> None:
    law = _Hole(stiffness=3e4, hole=1e-5)
    assert math.isfinite(change_of(law, 7e-4, 3e-4, 1e-4))
    assert math.isnan(change_of(law, 7e-4, 3e-4, 3.2e-4))
    assert math.isnan(change_of(law, 7e-4, 3e-4, 5e-4))


def test_beyond_the_displacements_where_extrema_were_sought_nothing_is_known() -> None:
    law = sb.LocalSpring(stiffness=30.0, cubic_stiffness=1e6)
    assert law.extrema(1e-3)[1] == pytest.approx((-16e-3, 16e-3), rel=1e-5)
    assert math.isnan(change_of(law, 1e-3, 0.0, 17e-3))


@pytest.mark.parametrize("begin", [-2.0, 6e-4, 5e-2])
def test_stiffness_of_a_law_whose_range_excludes_the_straight_beam(begin: float) -> None:
    """The maximum of (a/w) cos(u/w), within the range alone; a law that reads its constants outside of it is not asked."""
    law, largest = _Waves(size=2.0, width=9e-5, begin=begin), 9e-4
    at = law.displacements(largest, 401)
    assert at.min() > begin
    assert np.ptp(at) > 0.25 * largest
    assert law.greatest_stiffness(largest) == pytest.approx(2.0 / 9e-5, rel=1e-2)


def bounds_of(term: Any) -> Any:
    """The bound of a circuit and a magnet, as a function of the memory and the magnet."""

    def bound(memory: Any, law: Any) -> Any:
        layout = Layout(8, OMEGA, (term, LocalForceTerm(FORCED, EXTREMA, FORCE, 0, REST, law)))
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
        magnet, memory = ATTRACTING[case % 2], np.zeros(80)
        along, coupling, shape = rng.uniform(-3.0, 3.0, (3, 2))
        coupling *= 100.0
        size = 0.0 if case == 0 else 10.0 ** rng.uniform(-3.0, 0.0)
        q, p = 1e-5 * size * rng.uniform(-1.0, 1.0, 2), 1e-2 * size * rng.uniform(-1.0, 1.0, 2)
        y, rate = 1e-2 * size * rng.uniform(-1.0, 1.0), 10.0 ** rng.uniform(-3.0, 2.0)
        memory[OMEGA : OMEGA + 2], memory[ALONG : ALONG + 2], memory[Q : Q + 2] = omega, along, q
        memory[P : P + 2], memory[COUPLING : COUPLING + 2], memory[FORCED : FORCED + 2] = p, coupling, shape
        memory[Q + OWN] = 0.0 if resistive else y + coupling @ q
        memory[EXTREMA : EXTREMA + 2] = magnet.extrema(1e-3)[1]
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


def test_onset_behind_both_extrema_of_a_softening_spring() -> None:
    """No contact is excluded for longer than until its onset.

    The spring joins a moving mode to one at rest, at which the contact is.  At both ends of the reach its force is as small as
    here, where it is 0: without the extrema between them the contact would be excluded for the whole horizon.
    """
    end, stiffness, shape = 4e-4, 60.0, np.array([1.0, -1.0])
    law = sb.LocalSpring(stiffness=stiffness, cubic_stiffness=-stiffness / end**2)
    places, ends = law.extrema(end)
    assert places.size == 2
    bounds, horizon = softening_bound(), TRUST * STEP
    speed = 0.999 * end / horizon
    assert abs(law.force_at(speed * horizon)) < 0.01 * np.abs(law.force_at(places)).max()

    def motion(t, z):
        return [*z[2:], *(law.force_at(float(shape @ z[:2])) * shape)]

    memory = np.zeros(80)
    memory[P], memory[ALONG + 1], memory[FORCED : FORCED + 2] = speed, 1.0, shape
    memory[EXTREMA : EXTREMA + 6] = [*ends, *np.column_stack((places, law.force_at(places))).ravel()]
    found = solve_ivp(
        motion, (0.0, horizon), [0.0, 0.0, speed, 0.0], rtol=1e-10, atol=1e-16, dense_output=True
    )
    bound = bounds(memory, law.numbers)
    for share in (0.2, 0.5, 0.9):
        gap = float(found.sol(share * horizon)[1])
        assert 0.0 < safe_interval(gap, bound, 0.0, 0.0, STEP) < share * horizon


def softening_bound() -> Any:
    """The bound of one local force with two extrema, as a function of the memory and the force."""

    def bound(memory: Any, law: Any) -> Any:
        layout = Layout(8, OMEGA, (LocalForceTerm(FORCED, EXTREMA, FORCE, 2, 0.0, law),))
        return speed_bound_with_terms(memory, layout, None, ALONG, Q, P, K, STEP)

    return njit(bound)
