"""Sums of drives: the motion is that of the terms, begins without a jump, and a run is that of an oracle."""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest
from oracle import LEVEL, PaperBeam
from several_oracle import Tip, solve_several

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.solver.excitation import motion_of

SINE = sb.Sine(frequency_ratio=1.21, velocity_amplitude=0.1, phase=0.4)
BURST = sb.Burst(frequency_ratio=2.3, velocity_amplitude=0.08, duration_cycles=3.0)
KICK = sb.HalfSine(displacement_amplitude=0.05, duration=0.4)


def test_motion_is_the_sum_and_begins_at_zero() -> None:
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=1)
    total = SINE + BURST + KICK
    system = sb.System(model, contacts=[sb.Contact(default_values.CONTACT, sb.Striker(drive=total))])
    scale = system.scale
    times = np.linspace(0.0, 6.0, 61) * 2.0 * math.pi / scale.omega
    whole, *parts = (motion_of(drive, scale, times[-1]) for drive in (total, SINE, BURST, KICK))
    for t in times:
        w, v, a = whole(t)
        terms = [part(t) for part in parts]
        assert w == pytest.approx(sum(term[0] for term in terms) - parts[0](0.0)[0], abs=1e-11 * LEVEL)
        assert v == pytest.approx(sum(term[1] for term in terms), abs=1e-9 * LEVEL * scale.omega)
        assert a == pytest.approx(sum(term[2] for term in terms), abs=1e-9 * LEVEL * scale.omega**2)
    assert whole(0.0)[0] == pytest.approx(0.0, abs=1e-18)


def test_kept_and_told() -> None:
    """A file, another process and a dotted name know it."""
    total = sb.SumDrive.of(SINE, BURST)
    assert pickle.loads(pickle.dumps(total)) == total
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=1)
    system = sb.System(model, contacts=[sb.Contact(default_values.CONTACT, sb.Striker(drive=total))])
    assert sb.System.from_mapping(system.to_mapping()) == system
    assert system.to_mapping()["drive"]["type"] == "sine+burst"
    assert system.replace(**{"drive.duration_cycles_2": 4.0}).get("drive.duration_cycles_2") == 4.0
    with pytest.raises(sb.InputError, match="its own time axis"):
        SINE + sb.FixedStop()
    with pytest.raises(sb.InputError, match="2 to 4 terms"):
        SINE + BURST + KICK + SINE + BURST


@pytest.mark.slow
def test_terms_that_have_samples() -> None:
    """Two noises with a sine between them, on a base that shakes by a third: as the record of their sum."""

    def noise(seed: int) -> sb.BandLimitedNoise:
        return sb.BandLimitedNoise(low_ratio=0.6, high_ratio=2.2, velocity_rms=0.05, seed=seed)

    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=2)
    base, total = sb.BaseExcitation(motion=noise(3)), noise(1) + SINE + noise(2)

    def struck_by(drive: sb.Drive) -> sb.System:
        contact = sb.Contact(default_values.CONTACT, sb.Striker(drive=drive))
        return sb.System(model, contacts=[contact], base_excitation=base)

    scale = struck_by(total).scale
    cycle = 2.0 * math.pi / (1.4 * scale.omega)
    instants = np.arange(0.0, 5.0 * cycle, 1e-5)
    moved, speed, _ = motion_of(total, scale, instants[-1])(instants)
    record = sb.RecordedMotion(displacement=moved, velocity=speed, sampling_frequency=1e5, frequency=1.0 / cycle)
    times = np.linspace(0.0, 4.0 * cycle, 101) * (1.0 - 1e-13)
    one, other = (
        sb.simulate(struck_by(drive), sb.Integration(cycles=4, accuracy="reference"), sample_times=times)
        for drive in (total, record)
    )
    assert one.summary.impacts > 1
    np.testing.assert_allclose(
        one.dataset.displacement_at_striker, other.dataset.displacement_at_striker, rtol=0.0, atol=1e-6
    )


@pytest.mark.slow
@pytest.mark.parametrize(("modes", "cycles"), [(1, 4), (3, 2)])
def test_against_an_independent_solution(modes: int, cycles: int) -> None:
    """A sine and a burst over it: 1e-3 b at level *standard*, 1e-7 b at level *reference*."""
    first = float(PaperBeam(modes).omega[0])

    def motion(t: float) -> tuple[float, float]:
        rate = 1.21 * first
        reach = 0.1 * LEVEL / 1.21
        w, v = reach * (math.sin(rate * t + 0.4) - math.sin(0.4)), reach * rate * math.cos(rate * t + 0.4)
        rate = 2.3 * first
        cycles, reach, per = rate * t / (2.0 * math.pi), 0.08 * LEVEL / 2.3, rate / (2.0 * math.pi)
        x, way = (cycles, 1.0) if cycles < 1.0 else (3.0 - cycles, -1.0)
        x = min(max(x, 0.0), 1.0)
        e, slope = x**3 * (10.0 + x * (6.0 * x - 15.0)), way * 30.0 * x * x * (1.0 - x) ** 2 * per
        return (
            w + reach * e * math.sin(rate * t),
            v + reach * (slope * math.sin(rate * t) + e * rate * math.cos(rate * t)),
        )

    times = np.linspace(0.0, cycles * 2.0 * math.pi / (1.21 * first), 301) * (1.0 - 1e-13)
    truth = solve_several(PaperBeam(modes), [Tip(motion)], times)
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=modes)
    system = sb.System(model, contacts=[sb.Contact(default_values.CONTACT, sb.Striker(drive=SINE + BURST))])
    for accuracy, bound in (("standard", 1e-3), ("reference", 1e-7)):
        run = sb.simulate(system, sb.Integration(cycles=cycles, accuracy=accuracy), sample_times=times)
        np.testing.assert_allclose(run.dataset.displacement_at_striker, truth.displacement, rtol=0.0, atol=bound)
        np.testing.assert_allclose(run.dataset.striker_displacement, truth.tip[:, 0], rtol=0.0, atol=bound)
        assert abs(run.dataset.attrs["energy_error"]) < 1e-4
    assert run.summary.impacts > 1
