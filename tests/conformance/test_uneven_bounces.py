"""Newton's law of impact on a beam with unequal wells: one mode, an event-driven solution by DOP853 between hits."""

from __future__ import annotations

import math

import numpy as np
import pytest
from oracle import LENGTH, LEVEL, LOCATION
from scipy.integrate import solve_ivp
from uneven_beam import UnevenBeam

import snapbeam as sb
from snapbeam.model import default_values

RISE, RATIO, VELOCITY, KEEPS, CYCLES = 3e-6, 1.21, 0.25, 0.8, 6


def bounced(times):
    """Displacement at the tip over b, and how often it was hit."""
    beam = UnevenBeam(1, rise=RISE)
    phi = float(beam.shape(LOCATION * LENGTH)[0])
    mass, damping = float(beam.mass[0, 0]), float(beam.damping[0, 0])
    first = deepest_omega(beam)
    rate, reach = RATIO * first, VELOCITY * LEVEL / RATIO
    start = phi * float(beam.rest[0])

    def flow(t, y):
        return [y[1], -float(beam.gradient(y[:1])[0]) / mass - damping * y[1]]

    def gap(t, y):
        return start + reach * math.sin(rate * t) - phi * y[0] if t > begun + 1e-9 else -1.0

    gap.terminal, gap.direction = True, 1.0  # type: ignore[attr-defined]
    t, y, hits, found = 0.0, [float(beam.rest[0]), 0.0], 0, np.empty(times.size)
    while t < times[-1]:
        closing = reach * rate * math.cos(rate * t) - phi * y[1]
        if closing > 0.0 and abs(start + reach * math.sin(rate * t) - phi * y[0]) < 1e-12:
            y, hits = [y[0], y[1] + (1.0 + KEEPS) * closing / phi], hits + 1
        begun = t
        part = solve_ivp(
            flow, (t, times[-1]), y, "DOP853", dense_output=True, rtol=1e-12, atol=1e-16, events=gap, max_step=5e-5
        )
        inside = (times >= t) & (times <= part.t[-1])
        found[inside] = phi * part.sol(times[inside])[0] / LEVEL
        t, y = float(part.t[-1]), list(part.y[:, -1])
    return found, hits


def deepest_omega(beam) -> float:
    """About the well of least energy."""
    wells = (beam.rest, beam.settled(-beam.first))
    least = min(wells, key=beam.energy)
    return math.sqrt(float(beam.tangent(least)[0, 0]) / float(beam.mass[0, 0]))


@pytest.mark.slow
def test_against_an_event_driven_solution() -> None:
    """1e-3 b at level *standard*, 1e-7 b at level *reference*, crossings to the other well on the way."""
    model = sb.ReducedModel.from_beam(
        default_values.BEAM, modes=1, imperfection=sb.Imperfection(midspan_amplitude=RISE)
    )
    striker = sb.Shaker(frequency_ratio=RATIO, velocity_amplitude=VELOCITY)
    system = sb.System(model, contacts=[sb.Contact(sb.Restitution(KEEPS), striker)])
    times = np.linspace(0.0, CYCLES / (RATIO * model.reference_frequency), 301) * (1.0 - 1e-13)
    truth, hits = bounced(times)
    assert hits > 3
    for accuracy, bound in (("standard", 1e-3), ("reference", 1e-7)):
        run = sb.simulate(system, sb.Integration(cycles=CYCLES, accuracy=accuracy), sample_times=times)
        np.testing.assert_allclose(run.dataset.displacement_at_striker, truth, rtol=0.0, atol=bound)
    assert run.summary.impacts == hits
