"""Limits in which a part has no effect: the run is that of the system without the part."""

from __future__ import annotations

import numpy as np
import pytest
from oracle import LEVEL

import snapbeam as sb
from snapbeam.model import default_values

SHAKER = sb.Sine(frequency_ratio=1.21, velocity_amplitude=0.15)


def end(striker: sb.Striker | None = None, modes: int = 3, **parts) -> np.ndarray:
    """Amplitudes after one cycle at level reference, over the first one at rest."""
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=modes)
    striker = sb.Striker(drive=SHAKER) if striker is None else striker
    system = sb.System(model, contacts=[sb.Contact(parts.pop("contact", default_values.CONTACT), striker)], **parts)
    run = sb.simulate(system, sb.Integration(cycles=1, accuracy="reference"))
    return np.asarray(run.final_state.amplitude / abs(model.well_amplitude[0]))


@pytest.fixture(scope="module")
def plain() -> np.ndarray:
    return end()


def recedes(plain: np.ndarray, near, sizes: tuple[float, float, float], last: float) -> None:
    """The error falls in proportion to what is left of the part."""
    errors = [float(np.abs(near(size) - plain).max()) for size in sizes]
    assert errors[0] > 30.0 * errors[1] > 900.0 * errors[2] or errors[1] < last
    assert errors[2] < last


def test_a_gap_that_closes(plain) -> None:
    """From both sides; none at all is touching, to the bit."""
    for sign in (1.0, -1.0):
        recedes(
            plain,
            lambda gap, sign=sign: end(sb.Striker(drive=SHAKER, gap=sign * gap * LEVEL)),
            (1e-4, 1e-6, 1e-8),
            1e-6,
        )
    np.testing.assert_array_equal(end(sb.Striker(drive=SHAKER, gap=0.0)), plain)


@pytest.mark.slow
def test_a_long_start_is_none(plain) -> None:
    """A burst that rises at once and outlasts the run: the sine."""
    recedes(
        plain,
        lambda rise: end(
            sb.Striker(
                drive=sb.Burst(
                    frequency_ratio=1.21,
                    velocity_amplitude=0.15,
                    duration_cycles=1e4,
                    ramp_up_cycles=rise,
                    ramp_down_cycles=1.0,
                )
            )
        ),
        (1e-2, 1e-3, 1e-4),
        1e-3,
    )


@pytest.mark.slow
def test_a_base_and_a_load_that_hardly_move(plain) -> None:
    def base(size: float) -> np.ndarray:
        return end(
            base_excitation=sb.BaseExcitation(
                motion=sb.AccelerationSine(frequency_ratio=1.21, acceleration_amplitude=size)
            )
        )

    def load(size: float) -> np.ndarray:
        return end(axial_load=sb.AxialLoadModulation(motion=sb.HarmonicForce(frequency_ratio=2.0, amplitude=size)))

    recedes(plain, base, (1e-4, 1e-6, 1e-8), 1e-7)
    recedes(plain, load, (1e-2, 1e-4, 1e-6), 1e-6)


@pytest.mark.slow
def test_a_coil_without_a_magnet(plain) -> None:
    """K to 0: its force goes with K squared."""
    errors = [
        np.abs(end(harvesters=[sb.ElectromagneticHarvester(force_factor=constant, resistance=30.0)]) - plain).max()
        for constant in (0.1, 0.01, 0.0)
    ]
    assert errors[0] > 30.0 * errors[1]
    assert errors[2] < 1e-9
