"""The compositions: consistent, symmetric, and of the order they are said to have."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import snapbeam as sb
from snapbeam import _core
from snapbeam.model import default_values
from snapbeam.solver.step_size import composition_of


@pytest.mark.parametrize("number", range(3))
def test_coefficients(number: int) -> None:
    flow, kick = (np.array(weights) for weights in _core.COMPOSITIONS[number])
    assert kick.size == flow.size + 1
    assert flow.sum() == pytest.approx(1.0, abs=1e-15)
    assert kick.sum() == pytest.approx(1.0, abs=1e-15)
    np.testing.assert_array_equal(flow, flow[::-1])
    np.testing.assert_array_equal(kick, kick[::-1])


def state_after(model: sb.ReducedModel, accuracy: str, steps: int) -> np.ndarray:
    """Displacement along two cycles of free flight below the barrier, damped."""
    energy = model.saddle_energy - model.well_energy
    velocity = model.linear_modes[:, 0] * math.sqrt(1.4 * energy)
    if model.modes > 1:
        velocity = velocity + model.linear_modes[:, 1] * math.sqrt(0.1 * energy)
    period = 1.0 / model.reference_frequency
    return sb.simulate(
        sb.System(model, initial_state=sb.State(amplitude=model.well_amplitude, velocity=velocity)),
        sb.Integration(cycles=2, accuracy=accuracy, step=period / steps),
        sample_times=np.linspace(0.0, 2.0 * period * (1.0 - 1e-12), 5)[1:],
    ).dataset.modal_amplitude.values


@pytest.mark.parametrize(("modes", "steps"), [(1, (8, 10, 12, 16)), (2, (8, 10, 12, 16)), (8, (48, 64, 96, 128))])
@pytest.mark.parametrize(("accuracy", "order"), [("standard", 4), ("reference", 6)])
def test_measured_order_in_free_flight(modes: int, steps: tuple[int, ...], accuracy: str, order: int) -> None:
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes)
    truth = state_after(model, "reference", 8 * max(steps))
    errors = [np.abs(state_after(model, accuracy, count) - truth).max() for count in steps]
    slope = -np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert slope > order - 0.3, (slope, errors)


@pytest.mark.parametrize(("modes", "pair"), [(1, (1.4, 0.02)), (1, (1.21, 0.05)), (2, (1.4, 0.02)), (32, (1.21, 0.05))])
def test_measured_order_with_contact(modes: int, pair: tuple[float, float]) -> None:
    """The mean over four halvings of the default step; measured 2.4 to 3.1.  The d^1.5 edge allows no more
    than about 2.5 in the end.
    """
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes)
    shaker = sb.Shaker(frequency_ratio=pair[0], velocity_amplitude=pair[1])
    end = 2.0 / (pair[0] * model.reference_frequency)
    times = np.linspace(0.0, end, 401)[1:] * (1.0 - 1e-12)
    system = sb.System(model, contacts=[sb.Contact(default_values.CONTACT, shaker)])

    def run(**options: Any) -> Any:
        return sb.simulate(system, sb.Integration(cycles=2, **options), sample_times=times).dataset

    step = run().attrs["step"]
    truth = run(accuracy="reference", step=step / 32).displacement_at_striker
    errors = []
    for halvings in range(5):
        fine = run(step=step / 2**halvings).displacement_at_striker
        errors.append(float(np.sqrt(((fine - truth) ** 2).mean())))
    assert math.log2(errors[0] / errors[-1]) / 4.0 > 2.2, errors
    slope = -np.polyfit(np.arange(5), np.log2(errors), 1)[0]
    assert slope > 2.2, errors


@pytest.mark.parametrize(("order", "counts"), [(4, (10, 20, 40)), (6, (6, 12, 24))])
def test_order_with_kicks_that_depend_on_velocity(order: int, counts: tuple[int, ...]) -> None:
    """q'' = -q - q^3 - 0.3 q', the last two terms in the kick, whose flow is exact at a fixed place."""
    flow, kick = _core.COMPOSITIONS[composition_of(order, general=True)]

    def end(count: int) -> float:
        h, q, p = 3.0 / count, 1.0, 0.3
        for _ in range(count):
            for i, weight in enumerate(kick):
                lost = np.exp(-0.3 * weight * h)
                p = p * lost - q**3 * (1.0 - lost) / 0.3
                if i < len(flow):
                    c, s = np.cos(flow[i] * h), np.sin(flow[i] * h)
                    q, p = q * c + p * s, p * c - q * s
        return float(q)

    best = end(2000)
    errors = [abs(end(count) - best) for count in counts]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.3)
    assert np.log2(errors[1] / errors[2]) == pytest.approx(order, abs=0.3)
