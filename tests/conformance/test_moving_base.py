"""A base that moves: an independent solution, the ledger, the mirror image, going on, and what is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest
from around_oracle import Surroundings, live
from oracle import LEVEL, LOCATION, PaperBeam

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.util.validation import InputError

SLOW = pytest.mark.slow


def model(modes: int) -> sb.ReducedModel:
    return sb.ReducedModel.from_beam(default_values.BEAM, modes=modes)


def ledger(run: sb.Run) -> float:
    """What the ledger misses at its worst, over the gross work."""
    data = run.dataset
    stored = sum(data[name] for name in ("energy_beam", "energy_contact", "energy_striker") if name in data)
    given = sum(data[name] for name in ("striker_work", "base_work", "load_work", "force_work") if name in data)
    taken = sum(data[name] for name in ("energy_dissipated", "energy_harvested", "energy_circuit") if name in data)
    return float(np.ptp((stored + taken - given).values)) / data.attrs["gross_work"]


@pytest.mark.slow
@pytest.mark.parametrize(("modes", "cycles"), [(1, 4), (3, 3), (8, 2)])
@pytest.mark.parametrize("stop", ["none", "carried", "in space"])
def test_against_an_independent_solution(modes, cycles, stop) -> None:
    ratio, strength, gap = 0.9, 0.25, 0.05 * LEVEL
    first = float(PaperBeam(modes).omega[0])
    omega, hardest = ratio * first, strength * LEVEL * first**2

    def base(t: float) -> tuple[float, float, float]:
        s, c = math.sin(omega * t), math.cos(omega * t)
        return hardest / omega**2 * s, hardest / omega * c, -hardest * s

    around = Surroundings(base, gap=None if stop == "none" else gap, striker_on_base=stop != "in space")
    times = np.linspace(0.0, cycles * 2.0 * math.pi / omega, 801) * (1.0 - 1e-13)
    truth = live(PaperBeam(modes), around, times)
    motion = sb.AccelerationSine(frequency_ratio=ratio, acceleration_amplitude=strength)
    own = {"base_excitation": sb.BaseExcitation(motion=motion, striker_on_base=stop != "in space")}
    if stop != "none":
        striker = sb.Striker(drive=sb.FixedStop(), gap=gap, location=LOCATION)
        own["contacts"] = [sb.Contact(default_values.CONTACT, striker)]
    system = sb.System(model(modes), **own)
    for accuracy, bound in (("standard", 1e-3), ("reference", 1e-7)):
        run = sb.simulate(system, sb.Integration(cycles=cycles, accuracy=accuracy), sample_times=times)
        data = run.dataset
        name = "displacement_at_striker" if stop != "none" else "midspan_displacement"
        np.testing.assert_allclose(data[name], getattr(truth, name.removesuffix("_at_striker")), rtol=0.0, atol=bound)
        np.testing.assert_allclose(data.midspan_displacement, truth.midspan_displacement, rtol=0.0, atol=bound)
        size = float(np.abs(truth.base_work).max())
        np.testing.assert_allclose(data.base_work, truth.base_work, rtol=0.0, atol=max(bound, 1e-6) * size)
        assert ledger(run) < 1e-4
    if stop != "none":
        assert run.summary.impacts > 1


@pytest.mark.slow
@pytest.mark.parametrize("side", ["below", "above"])
def test_beside_two_forces(side) -> None:
    """Against an independent solution: displacements, the works of base and forces, and the mirrored system."""
    ratio, strength, gap, sign = 0.9, 0.15, 0.05 * LEVEL, 1.0 if side == "below" else -1.0
    first = float(PaperBeam(3).omega[0])
    omega, hardest = ratio * first, strength * LEVEL * first**2

    def base(t: float) -> tuple[float, float, float]:
        s, c = math.sin(omega * t), math.cos(omega * t)
        return hardest / omega**2 * s, hardest / omega * c, -hardest * s

    pushes = ((0.3, 1.7, 0.02, 0.4), (0.62, 2.3, 0.015, -1.0))
    forces = tuple(
        (place, lambda t, a=amplitude, r=rate, at=at: a * math.sin(r * first * t + at))
        for place, rate, amplitude, at in pushes
    )
    times = np.linspace(0.0, 3 * 2.0 * math.pi / omega, 801) * (1.0 - 1e-13)
    truth = live(PaperBeam(3), Surroundings(base, gap=gap, striker_on_base=False, forces=forces), times)
    striker = sb.Striker(drive=sb.FixedStop(), gap=gap, location=LOCATION, side=side)
    system = sb.System(
        model(3),
        contacts=[sb.Contact(default_values.CONTACT, striker)],
        base_excitation=sb.BaseExcitation(
            motion=sb.AccelerationSine(frequency_ratio=ratio, acceleration_amplitude=strength),
            striker_on_base=False,
            direction="up" if side == "below" else "down",
        ),
        forces=[
            sb.ExternalForce(
                history=sb.HarmonicForce(
                    frequency_ratio=rate, amplitude=amplitude, phase=at if side == "below" else at + math.pi
                ),
                location=place,
            )
            for place, rate, amplitude, at in pushes
        ],
    )
    for accuracy, bound in (("standard", 1e-3), ("reference", 1e-7)):
        run = sb.simulate(system, sb.Integration(cycles=3, accuracy=accuracy), sample_times=times)
        data = run.dataset
        for name in ("displacement_at_striker", "midspan_displacement"):
            expected = sign * getattr(truth, name.removesuffix("_at_striker"))
            np.testing.assert_allclose(data[name], expected, rtol=0.0, atol=bound)
        for name in ("base_work", "force_work"):
            expected = getattr(truth, name)
            size = float(np.abs(expected).max())
            np.testing.assert_allclose(data[name], expected, rtol=0.0, atol=max(bound, 1e-6) * size)
        assert ledger(run) < 1e-4
    assert run.summary.impacts > 1
    expected = sign * np.array([[force(t) for _, force in forces] for t in times])
    np.testing.assert_allclose(data.external_forces, expected, rtol=0.0, atol=1e-12)


@pytest.mark.slow
def test_mirrored_and_going_on() -> None:
    """The mirrored system's mirrored run, and three periods in one go and one by one, bit for bit."""
    motion = sb.AccelerationSine(frequency_ratio=0.9, acceleration_amplitude=0.3)

    def system(side: str, direction: str) -> sb.System:
        striker = sb.Striker(drive=sb.FixedStop(), gap=0.05 * LEVEL, side=side)
        return sb.System(
            model(3),
            contacts=[sb.Contact(default_values.CONTACT, striker)],
            base_excitation=sb.BaseExcitation(motion=motion, direction=direction),
        )

    once, mirrored = (sb.advance(system("below", "up"), periods=3), sb.advance(system("above", "down"), periods=3))
    np.testing.assert_array_equal(mirrored.amplitude, -once.amplitude)
    np.testing.assert_array_equal(mirrored.velocity, -once.velocity)
    below = system("below", "up")
    step = sb.advance(below, sb.advance(below, periods=2))
    np.testing.assert_array_equal(step.amplitude, once.amplitude)


@pytest.mark.slow
def test_small_motions_follow_the_linear_response() -> None:
    """Gently shaken, the first mode rings at |H| = Omega^2 m_1/sqrt((1 - Omega^2)^2 + (2 zeta Omega)^2)."""
    beam, ratio, strength = model(8), 0.5, 1e-6
    system = sb.System(
        beam,
        base_excitation=sb.BaseExcitation(
            motion=sb.AccelerationSine(frequency_ratio=ratio, acceleration_amplitude=strength)
        ),
    )
    run = sb.simulate(system, sb.Integration(cycles=400, accuracy="reference"))
    data = run.dataset.isel(time=run.dataset.cycle.values > 395)
    swing = float(np.ptp(data.midspan_displacement.values)) / 2.0
    from snapbeam.model.base_excitation import rigid_mass

    omega = beam.omega
    rows = (beam.linear_modes.T @ rigid_mass(beam)) * (beam.linear_modes.T @ beam.midspan_shape)
    at = ratio * omega[0]
    gain = np.abs(np.sum(rows / (omega**2 - at**2 + 2j * beam.damping_ratio * omega * at)))
    assert swing == pytest.approx(strength * omega[0] ** 2 * gain, rel=2e-3)


@pytest.mark.slow
def test_never_ended_early_by_energy() -> None:
    """A shaken beam may cross at any time: nothing is final, and only a continuous response is certain early."""
    system = sb.System(
        model(1),
        base_excitation=sb.BaseExcitation(motion=sb.AccelerationSine(frequency_ratio=0.9, acceleration_amplitude=0.3)),
    )
    early, whole = (
        sb.sweep(
            system,
            {"base_excitation.acceleration_amplitude": np.geomspace(0.002, 0.6, 24)},
            sb.Integration(cycles=60, early_termination=decided),
        )
        for decided in (True, False)
    )
    assert not early.final_well_proven.any() and not whole.final_well_proven.any()
    np.testing.assert_array_equal(early.response_class, whole.response_class)
    assert (early.early_stop_time.notnull() <= (early.response_class == int(sb.ResponseClass.CONTINUOUS))).all()
    assert len(np.unique(whole.response_class)) > 1


def test_refusals_and_the_way_there_and_back() -> None:
    motion = sb.AccelerationSine(frequency_ratio=1.0, acceleration_amplitude=0.2)
    base = sb.BaseExcitation(motion=motion)
    striker = sb.Striker(drive=sb.FixedStop(), gap=0.0)
    with pytest.raises(InputError, match="a base needs a motion with a known bound"):
        sb.BaseExcitation(motion=sb.HalfSine(displacement_amplitude=0.1, duration=0.5))
    with pytest.raises(InputError, match="direction = 'left'"):
        sb.BaseExcitation(motion=motion, direction="left")
    plain = sb.ReducedModel.from_matrices(
        [[1.0]], [-1.0], contact_shape=[1.0], nonlinear_stiffness=1.0, well_amplitude=[-1.0]
    )
    with pytest.raises(InputError, match="give base_shape to"):
        sb.System(plain, base_excitation=base)
    system = sb.System(model(2), contacts=[sb.Contact(default_values.CONTACT, striker)], base_excitation=base)
    assert sb.System.from_mapping(system.to_mapping()) == system
    changed = system.replace(**{"base_excitation.acceleration_amplitude": 0.3, "base_excitation.direction": "down"})
    assert (
        changed.get("base_excitation.acceleration_amplitude") == 0.3
        and changed.get("base_excitation.direction") == "down"
    )
    assert changed != system
