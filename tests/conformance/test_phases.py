"""Phases of striker, base and axial load in the dynamics tools: against ``advance`` and an independent solution."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from around_oracle import Surroundings, live
from mixed_oracle import Around, MixedBeam, Tip, solve
from oracle import LEVEL, LOCATION, PaperBeam

import snapbeam as sb
from snapbeam.dynamics.stroboscope import Stroboscope
from snapbeam.model import default_values

SLOW = pytest.mark.slow
PERIODS = 3
MODEL = sb.ReducedModel.from_beam(default_values.BEAM, modes=2)
RATIO, VELOCITY, HARDEST = 1.2, 0.15, 0.2
PHASES = {"striker": 0.7, "base": -0.9, "load": 1.3}
MIXTURES = [
    pytest.param(names, marks=SLOW, id="+".join(names))
    for count in (1, 2, 3)
    for names in itertools.combinations(PHASES, count)
]


def load_amplitude() -> float:
    beam = PaperBeam(2)
    return 0.2 * float(beam.gamma * beam.rest[0] ** 2)


def system_of(names: tuple[str, ...], **phases: float) -> sb.System:
    at, parts = PHASES | phases, {}
    if "striker" in names:
        drive = sb.Sine(frequency_ratio=RATIO, velocity_amplitude=VELOCITY, phase=at["striker"])
        parts["contacts"] = [sb.Contact(default_values.CONTACT, sb.Striker(drive=drive, location=LOCATION))]
    if "base" in names:
        motion = sb.AccelerationSine(frequency_ratio=RATIO, acceleration_amplitude=HARDEST, phase=at["base"])
        parts["base_excitation"] = sb.BaseExcitation(motion=motion)
    if "load" in names:
        motion = sb.HarmonicForce(frequency_ratio=2.0 * RATIO, amplitude=load_amplitude(), phase=at["load"])
        parts["axial_load"] = sb.AxialLoadModulation(motion=motion)
    return sb.System(MODEL, **parts)


def advanced(system: sb.System, flow: Stroboscope, **how) -> np.ndarray:
    found = sb.advance(system, periods=PERIODS, save_every_period=True, **how)
    return np.concatenate([found.amplitude, found.velocity], axis=1) / flow.space.scales


@pytest.mark.parametrize("names", MIXTURES)
def test_the_map_is_advance(names) -> None:
    """The same to rounding, at once and period by period; other phases give other states."""
    system = system_of(names)
    flow = Stroboscope(system)
    wanted = advanced(system, flow)
    np.testing.assert_allclose(flow.advance(flow.coordinates(), PERIODS, every=True).every[0], wanted, atol=1e-12)
    here = flow.coordinates()
    for period in range(PERIODS):
        here = flow.advance(here, 1)
        np.testing.assert_allclose(here.states[0], wanted[period], atol=1e-9)
    again = sb.advance(system, flow.state(flow.coordinates()), periods=PERIODS)
    # rounding of the striker's position decides whether a contact at the very start lasts a step longer
    near = 1e-4 if "striker" in names else 1e-9
    np.testing.assert_allclose(flow.coordinates(again)[0], wanted[-1], atol=near)
    for name in names:
        other = Stroboscope(system_of(names, **{name: 0.0}))
        assert np.abs(other.advance(other.coordinates(), PERIODS).states[0] - wanted[-1]).max() > 1e-3


@pytest.mark.parametrize(
    "names",
    [pytest.param(("base",), marks=SLOW), pytest.param(("load",), marks=SLOW), pytest.param(tuple(PHASES), marks=SLOW)],
)
def test_against_an_independent_solution(names) -> None:
    first = float(PaperBeam(2).omega[0])
    omega, hardest, size = RATIO * first, HARDEST * LEVEL * first**2, load_amplitude()

    def base(t: float) -> tuple[float, float, float]:
        s, c = math.sin(omega * t + PHASES["base"]), math.cos(omega * t + PHASES["base"])
        return hardest / omega**2 * s, hardest / omega * c, -hardest * s

    def load(t: float) -> float:
        return size * math.sin(2.0 * omega * t + PHASES["load"])

    flow = Stroboscope(system_of(names), sb.Integration(accuracy="reference"))
    times = np.linspace(0.0, PERIODS * flow.period, 40 * PERIODS + 1)
    if "striker" in names:
        stroke = VELOCITY * LEVEL * first / omega

        def tip(t: float) -> tuple[float, float]:
            at = omega * t + PHASES["striker"]
            return stroke * (math.sin(at) - math.sin(PHASES["striker"])), stroke * omega * math.cos(at)

        tips = [Tip(tip, lambda d, _: 4e8 * max(d, 0.0) ** 1.5, LOCATION)]
        beam = MixedBeam(2, (None, None, None), {})
        truth = solve(beam, tips, Around(base=base, load=load), times)[:, 1]
    else:
        own = {name: motion for name, motion in (("base", base), ("load", load)) if name in names}
        truth = live(PaperBeam(2), Surroundings(**own), times).midspan_displacement
    every = flow.advance(flow.coordinates(), PERIODS, every=True).every[0] * flow.space.scales
    found = every[:, :2] @ MODEL.midspan_shape / MODEL.length_scale
    np.testing.assert_allclose(found, truth[40::40], rtol=0.0, atol=2e-6)


@pytest.mark.slow
def test_sections_orbits_and_diagrams_begin_at_the_phase() -> None:
    """Of a base alone: a section, the states on an orbit, and phases that differ between the runs."""
    system = system_of(("base",)).replace(**{"base_excitation.acceleration_amplitude": 0.02})
    exact = sb.Integration(accuracy="reference")
    flow = Stroboscope(system, exact)
    section = sb.dynamics.poincare_section(system, periods=PERIODS, transient=0, integration=exact)
    wanted = advanced(system, flow, integration=exact)[:, :2] * flow.space.scales[:2]
    size = float(np.abs(wanted).max())
    np.testing.assert_allclose(section.modal_amplitude[1:], wanted, rtol=0.0, atol=1e-6 * size)
    turned = (section.drive_phase.values - PHASES["base"] + 1.0) % (2.0 * math.pi)
    np.testing.assert_allclose(turned, 1.0, atol=1e-9)

    orbit = sb.dynamics.periodic_orbit(system, transient=300)
    back = sb.advance(orbit.system, periods=1, integration=exact)
    np.testing.assert_allclose(back.amplitude, orbit.state.amplitude, rtol=0.0, atol=1e-8 * size)

    phases = np.array([0.0, 0.7, 0.5 * math.pi])
    rows = np.repeat(flow.coordinates(), 3, axis=0)
    found = flow.advance(rows, PERIODS, points={"base_excitation.phase": phases}).states
    for phase, row in zip(phases, found, strict=True):
        one = flow.changed({"base_excitation.phase": float(phase)})
        np.testing.assert_allclose(one.advance(one.coordinates(), PERIODS).states[0], row, atol=1e-12)
    assert np.abs(np.diff(found, axis=0)).max(axis=1).min() > 1e-3


@pytest.mark.slow
def test_the_phase_of_a_start_counts() -> None:
    start = sb.State(amplitude=0.9 * MODEL.mirrored.well_amplitude, phase=0.4)
    system = system_of(("base",)).replace(initial_state=start)
    flow = Stroboscope(system)
    found = flow.advance(flow.coordinates(), PERIODS, every=True).every[0]
    np.testing.assert_allclose(found, advanced(system, flow), atol=1e-12)


def test_phases_that_would_be_ignored_are_refused() -> None:
    flow = Stroboscope(system_of(("striker",)), phase=1.0)
    with pytest.raises(sb.InputError, match=r"phase = 1: must not be given if drive.phase changes"):
        flow.changed({"drive.phase": 0.3})
    with pytest.raises(sb.InputError, match=r"state phase = .*: must be the phase at which the system is observed"):
        flow.coordinates(sb.State(amplitude=MODEL.well_amplitude, phase=0.3))
    flow.coordinates(sb.State(amplitude=MODEL.well_amplitude, phase=1.0 + 6.0 * math.pi))
    with pytest.raises(sb.InputError, match="state phase"):
        sb.dynamics.bifurcation_diagram(
            system_of(("striker",)), "velocity_amplitude", [0.1, 0.2], sweeps=(),
            initial_conditions=sb.dynamics.InitialConditions(count=2, phase=True), periods=(1, 2),
        )  # fmt: skip
