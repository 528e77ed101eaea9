"""Tools of dynamics with random systems: each result passes an exact check, or the system is refused for a reason listed here.

``SNAPBEAM_PAIRS=600 pytest tests/composition/test_random_tools.py -m slow`` tests 600 pairs in place of 60, and
``python tests/composition/test_random_tools.py PAIR ...`` repeats some.
"""

from __future__ import annotations

import dataclasses
import os
import re
import sys
import warnings
from collections import Counter
from collections.abc import Callable

import numpy as np
import pytest
from generator import composed, features_of
from numpy.typing import NDArray
from test_composition import PHYSICAL

import snapbeam as sb
from snapbeam import dynamics
from snapbeam.dynamics.edge_states import kicked
from snapbeam.dynamics.shooting import Family, jacobian
from snapbeam.dynamics.stroboscope import Stroboscope
from snapbeam.solver.assemble import make_ensemble, run_columns

Array = NDArray[np.float64]
COUNT = int(os.environ.get("SNAPBEAM_PAIRS", "60"))
HOW = sb.Integration(accuracy="reference", threads=1)
REPEATING = {
    "drive": ("sine", "sine", "displacement_sine", "sine+sine", "fixed"),
    "base": ("acceleration_sine", "displacement_sine", "sine+sine"),
    "external": ("harmonic_force", "constant_force"),
}
"""Motions that repeat, as the map of a period needs."""
RATIOS = (0.8, 1.6, 2.4)
"""Frequencies over that of the first mode, with a common period."""
REFUSALS = PHYSICAL | {
    "no period": r"does not repeat",
    "no common period": r"no common period with",
    "no stable equilibrium": r"equilibrium is not stable; a backbone curve needs a well",
    "no excitation": r"without excitation has no orbit|needs a drive|nothing strikes or shakes",
    "orbits not isolated": r"keeps any indentation that its impacts do not deepen",
    "no saddle": r"manifold has \d+ dimensions",
    "failed run": r"a run failed|the run failed",
    "no border": r"it snaps within \d+ periods by itself|does not snap within \d+ periods|the outcomes within",
    "excited": r"a backbone curve is of free motion",
    "lossy contact": r"loses energy",
    "pressed at rest": r"the stop presses on the beam at rest",
    "striker adrift": r"nothing holds its striker",
    "a restart shifts the tip": r"its restart at each value would shift the tip",
    "no inverse": r"under Newton's law the map has no inverse",
}
"""Reasons, physical or of missing data, why a tool does not take a system."""
NOT_FOUND = "no orbit near the start"


def system_of(seed: int) -> sb.System:
    """A random system of one to three modes; most of them move with a common period."""
    rng = np.random.default_rng([seed, 11])
    drawn = features_of(seed)
    keep = rng.random() < 0.1
    contacts = [
        (law, drive if keep else str(rng.choice(REPEATING["drive"])), heavy) for law, drive, heavy in drawn.contacts[:2]
    ]
    if not keep and all(drive == "fixed" for _, drive, _ in contacts) and rng.random() < 0.8:
        contacts.append(("hertz", "sine", bool(rng.random() < 0.25)))
    features = dataclasses.replace(
        drawn,
        modes=int(rng.integers(1, 4)),
        contacts=tuple(contacts),
        base=drawn.base if keep or not drawn.base else str(rng.choice(REPEATING["base"])),
        external=tuple(each if keep else str(rng.choice(REPEATING["external"])) for each in drawn.external),
        load=drawn.load if keep or not drawn.load else "harmonic_force",
    )
    try:
        system = composed(seed, features).system
        system.start_state  # noqa: B018  refuses forces that leave no well
    except sb.InputError:
        if keep:
            raise
        system = composed(seed, dataclasses.replace(features, local=())).system
    if rng.random() < 0.25 and contacts:
        lossy = (sb.Restitution(float(rng.uniform(0.5, 0.95))), sb.ElasticPlasticContact(2e5, 8e5))
        law = lossy[0] if system.model.modes == 1 and contacts[0][2] is False else lossy[1]
        system = sb.System(
            system.model, contacts=[dataclasses.replace(system.contacts[0], law=law), *system.contacts[1:]], forces=system.forces,
            base_excitation=system.base_excitation, axial_load=system.axial_load, harvesters=system.harvesters, initial_state=system.initial_state,
        )  # fmt: skip
    if keep:
        return system
    names = [name for name in run_columns(system, {}) if re.search(r"frequency_ratio(_\d)?$", name)]
    return system.replace(**{name: float(rng.choice(RATIOS)) for name in names})


def varied(system: sb.System, rng: np.random.Generator) -> tuple[str, float]:
    """A parameter of runs that leaves the period as it is, and its value."""
    columns = {
        name: float(values[0])
        for name, values in run_columns(system, {}).items()
        if values[0] > 0.0 and re.search(r"amplitude|stiffness|location|resistance", name)
    }
    name = str(rng.choice(sorted(columns)))
    return name, columns[name]


class LeftRange(Exception):
    """The motion left the range of a law, as its status says."""


def settled(flow: Stroboscope, periods: int = 3) -> Array:
    state: Array = flow.advance(flow.coordinates(), periods).states[0]
    if not np.isfinite(state).all():
        raise LeftRange
    return state


def contraction(system: sb.System) -> float | None:
    """Rate at which volumes of the state space shrink, 1/s: the sum of the rates of loss; None where it is not constant."""
    if any(each.law.is_dissipative for each in system.contacts) or any(
        each.dissipative for each in system.local_forces
    ):
        return None
    structure = make_ensemble(system, HOW).structure
    circuits = [each.mode for each in structure.circuits]
    if any(mode is None for mode in circuits):
        return None  # without inductance a coil damps the beam
    rates = 2.0 * structure.damping_ratio * structure.omega
    rate = float(np.sum(np.delete(rates, circuits)))
    rate += float(np.sum(structure.damping_coefficients * np.sum(structure.damping_rows**2, axis=-1)))
    for each in system.harvesters:
        if isinstance(each, sb.PiezoelectricHarvester):
            rate += 1.0 / (each.resistance * each.capacitance)
        else:
            rate += (each.resistance + each.coil_resistance) / each.inductance
    return rate


def volume(flow: Stroboscope, state: Array) -> float:
    """Logarithm of the determinant of the map's derivative; minus infinity where rounding hides it."""
    values = np.linalg.svd(jacobian(Family(flow), state, 1).jacobian, compute_uv=False)
    return float(np.log(values).sum()) if values[-1] > 1e-7 * values[0] else -np.inf


# Tools.  Each takes a system and random numbers, and checks its result.


def advance(system: sb.System, rng: np.random.Generator) -> None:
    """Tangents of one period times those of the next are those of both, and volumes shrink by the losses."""
    flow = Stroboscope(system, HOW)
    start = settled(flow)
    unit = rng.standard_normal((1, 2, flow.dimension))
    once = flow.advance(start[None], tangents=unit)
    both = flow.advance(start[None], 2, tangents=unit).tangents
    twice = flow.advance(once, tangents=once.tangents)
    if np.isfinite(twice.states).all():
        np.testing.assert_allclose(both, twice.tangents, rtol=0.0, atol=1e-9 * np.abs(both).max())
    lost, found = contraction(flow.system), volume(flow, start)
    if lost is not None and np.isfinite(found):
        assert found == pytest.approx(-lost * flow.period, abs=1e-6)
    ended = sb.advance(flow.starting(start), periods=flow.clock.cycles_per_period, integration=HOW)
    np.testing.assert_allclose(
        flow.space.of(ended.flat)[0], once.states[0], rtol=0.0, atol=1e-7 * np.abs(once.tangents).max()
    )


def orbit_of(system: sb.System) -> dynamics.PeriodicOrbit:
    return dynamics.periodic_orbit(system, transient=60, integration=HOW)


def multipliers(system: sb.System, rng: np.random.Generator) -> None:
    """The orbit closes, and the product of its multipliers is the volume that it keeps."""
    orbit = orbit_of(system)
    assert orbit.residual < 1e-9
    back = orbit.flow.advance(orbit.coordinates[None]).states[0]
    np.testing.assert_allclose(back, orbit.coordinates, rtol=0.0, atol=1e-9)
    found = volume(orbit.flow, orbit.coordinates)
    lost = contraction(orbit.flow.system)
    if np.isfinite(found):
        assert np.log(np.abs(orbit.multipliers)).sum() == pytest.approx(found, abs=1e-6)
        assert lost is None or found == pytest.approx(-lost * orbit.flow.period, abs=1e-6)


def exponents(system: sb.System, rng: np.random.Generator) -> None:
    """The sum of all is the mean divergence along the path."""
    flow = Stroboscope(system, HOW)
    state = settled(flow)
    found = dynamics.lyapunov_spectrum(flow, flow.dimension, 20, transient=1, states=state)
    path = flow.advance(state[None], 20, every=True).every[0]
    volumes = [volume(flow, each) for each in path]
    if np.isfinite(volumes).all():
        total = float(found["exponent"].sum()) * flow.period
        assert total == pytest.approx(np.mean(volumes), abs=1e-5)
    if np.isfinite(path).all():
        assert np.isfinite(found["exponent"]).all()


def exponent(system: sb.System, rng: np.random.Generator) -> None:
    """The largest from two runs, where the motion is smooth, is that of the tangents."""
    flow = Stroboscope(system, HOW)
    state = settled(flow)
    pair = dynamics.largest_lyapunov(flow, 20, transient=1, states=state)
    assert np.isfinite(pair["exponent"]).all() or pair.attrs["merged"] == 1


def diagram(system: sb.System, rng: np.random.Generator) -> None:
    """The sweep up begins with the system's own run."""
    name, value = varied(system, rng)
    found = dynamics.bifurcation_diagram(system, name, [value, 1.001 * value], HOW, periods=(2, 4))
    flow = Stroboscope(system, HOW)
    path = flow.advance(flow.coordinates(), 6, every=True).every[0, 2:]
    model = flow.system.model
    expected = path[:, : model.modes] * flow.space.scales[0] @ model.midspan_shape / flow.system.scale.length
    first = found["midspan_displacement"].values[0, 0]
    np.testing.assert_allclose(first, expected, rtol=0.0, atol=1e-6)
    assert bool(found["failed"][0, 0]) == (not np.isfinite(path).all())


def hysteresis(system: sb.System, rng: np.random.Generator) -> None:
    """The statistics of the first value are those of a run."""
    name, value = varied(system, rng)
    how = HOW.replace(cycles=3, early_termination=False)
    found = dynamics.hysteresis(system, name, [value, 1.001 * value], how, sweeps=["up"])
    run = sb.simulate(system, how)
    for each in ("impacts", "zero_crossings", "peak_force"):
        np.testing.assert_equal(found[each].values[0, 0], run.summary[each])


def branch(system: sb.System, rng: np.random.Generator) -> None:
    """The first point is the orbit, and each closes."""
    orbit = orbit_of(system)
    name, value = varied(orbit.flow.system, rng)
    found = dynamics.continuation(orbit, name, (0.9 * value, 1.1 * value), max_points=4)
    np.testing.assert_allclose(found.orbits[0].coordinates, orbit.coordinates, rtol=0.0, atol=1e-8)
    for each in found.orbits:
        back = each.flow.advance(each.coordinates[None], each.period).states[0]
        np.testing.assert_allclose(back, each.coordinates, rtol=0.0, atol=1e-7)


def section(system: sb.System, rng: np.random.Generator) -> None:
    """States once a period are those of the map."""
    found = dynamics.poincare_section(system, periods=3, transient=2, integration=HOW)
    flow = Stroboscope(system, HOW)
    path = flow.advance(flow.coordinates(), 5, every=True).every[0]
    expected = path[1:, : flow.space.modes] * flow.space.scales[0]
    size = flow.space.scales[0]
    np.testing.assert_allclose(found["modal_amplitude"].values / size, expected / size, rtol=0.0, atol=1e-6)


def basins(system: sb.System, rng: np.random.Generator) -> None:
    """A point of a periodic attractor is in its basin."""
    flow = Stroboscope(system, HOW.replace(accuracy="standard"))
    found = dynamics.find_attractors(flow, 3, transient=150, max_periods=4, check_periods=20)
    stable = [each for each in found.attractors if each.orbit is not None]
    if not stable:
        return
    rest = stable[0].orbit.coordinates
    grid = {
        f"{name}[1]": rest[at] + np.array([0.0, 0.1]) for name, at in (("amplitude", 0), ("velocity", flow.space.modes))
    }
    labels = dynamics.basins_of_attraction(found, grid, fixed_coordinates=rest, periods=40)
    assert int(labels["attractor"].values.flat[0]) == found.attractors.index(stable[0])


def edge(system: sb.System, rng: np.random.Generator) -> None:
    """Between bisections the motion on the border is one of the system's."""
    flow = Stroboscope(system, HOW.replace(accuracy="standard"))
    low, high = kicked(flow, None, 6)
    found = dynamics.edge_tracking(flow, low, high, periods=4, horizon=6)
    went = flow.advance(found.states).states
    # where no bisection narrows the two bounds after a period, their distance grows
    for k in np.flatnonzero((found.distance[:-1] <= 1e-5) & (found.distance[1:] > found.distance[:-1])):
        np.testing.assert_allclose(went[k], found.states[k + 1], rtol=0.0, atol=found.distance[k + 1] + 1e-8)


def manifold(system: sb.System, rng: np.random.Generator) -> None:
    """A point comes to the point of the age that is one more."""
    flow = Stroboscope(system, HOW)
    saddle = dynamics.periodic_orbit(flow, np.zeros(flow.dimension))
    curve = dynamics.invariant_manifold(saddle, str(rng.choice(["unstable", "stable"])), max_arclength=0.05)
    age, states, side = curve["age"].values, curve["state"].values, curve["side"].values
    twice = saddle.period * (2 if curve.attrs["multiplier"] < 0.0 else 1)
    # segments join at whole ages, to the error of the linear map near the saddle
    later = np.isclose(age[:, None] + 1.0, age, rtol=0.0, atol=1e-13) & (age[:, None] % 1.0 > 0.0)
    for one, other in np.argwhere(later & (side[:, None] == side)):
        begun, came = (
            (states[one], states[other]) if curve.attrs["stability"] == "unstable" else (states[other], states[one])
        )
        np.testing.assert_allclose(saddle.flow.advance(begun[None], twice).states[0], came, rtol=0.0, atol=2e-9)


def backbone(system: sb.System, rng: np.random.Generator) -> None:
    """The curve begins with a natural frequency of the free system, its strikers at rest."""
    keep = rng.random() < 0.3

    def elastic(law: sb.ContactLaw) -> sb.ContactLaw:
        return sb.HertzContact(3e8) if law.is_dissipative and not keep else law

    still = sb.System(
        system.model, forces=system.local_forces, harvesters=system.harvesters,
        contacts=[dataclasses.replace(each, law=elastic(each.law), striker=dataclasses.replace(each.striker, drive=sb.FixedStop(), gap=each.striker.gap or 2e-5)) for each in system.contacts],
    )  # fmt: skip
    curve = dynamics.backbone_curve(still, max_points=3)
    energy, frequency = curve["energy"].values, curve["frequency"].values
    assert (energy > 0.0).all() and np.isfinite(frequency).all()
    if not still.contacts:
        assert np.abs(frequency[0] / np.array(curve.attrs["natural_frequencies"]) - 1.0).min() < 1e-2


def lifetimes(system: sb.System, rng: np.random.Generator) -> None:
    """Each start is counted once, and no snap is later than the run."""
    how = sb.Integration(cycles=12, threads=1)
    settings = dynamics.LifetimeSettings(settling_cycles=3.0)
    found = dynamics.lifetime_map(system, None, how, initial_conditions=3, settings=settings)
    total = found["runs_ended"] + found["runs_snapping"] + found["runs_never"] + found["runs_failed"]
    last = found["last_snap"].values
    first = int(((last <= float(found["delay"])) & (last < 9.0)).sum())  # ends up to the delay do not say how often
    assert int(total) + first == 3
    assert not (last > 12.0).any()


TOOLS: tuple[Callable[[sb.System, np.random.Generator], None], ...] = (
    advance, multipliers, exponents, exponent, diagram, hysteresis, branch, section, basins, edge, manifold, backbone, lifetimes,
)  # fmt: skip


def outcome(pair: int) -> str:
    """The end of a pair: "result", or the reason of a refusal."""
    tool, rng = TOOLS[pair % len(TOOLS)], np.random.default_rng([pair, 13])
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", sb.DiagnosticWarning)
            tool(system_of(pair), rng)
    except sb.InputError as error:
        for name, words in REFUSALS.items():
            if re.search(words, str(error)):
                return name
        raise AssertionError(f"pair {pair}, {tool.__name__}: refused for no listed reason: {error}") from error
    except dynamics.OrbitNotFoundError:
        return NOT_FOUND
    except LeftRange:
        return "left the range of a law"
    return "result"


def judge(pairs: range) -> None:
    """Each pair gives a result or is refused for a reason of the list; most give a result."""
    ends, wrong = Counter[str](), []
    for pair in pairs:
        try:
            ends[outcome(pair)] += 1
        except Exception as error:  # every pair is reported
            wrong.append((pair, TOOLS[pair % len(TOOLS)].__name__, f"{type(error).__name__}: {error}"[:500]))
    print(dict(ends))
    assert not wrong, wrong
    assert ends["result"] > 0.5 * len(pairs)


@pytest.mark.slow
def test_some_pairs() -> None:
    judge(range(5))


@pytest.mark.slow
def test_random_pairs() -> None:
    judge(range(COUNT))


if __name__ == "__main__":
    for each in map(int, sys.argv[1:]):
        print(each, TOOLS[each % len(TOOLS)].__name__, outcome(each))
