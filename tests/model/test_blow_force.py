"""A half-sine force: free motion and the blow in closed form, units of a file, what is refused."""

from __future__ import annotations

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model.parameter_file import load_config


def struck(amplitude: float, duration: float) -> sb.System:
    model = sb.ReducedModel.from_matrices(
        [[2.0]], [2.0 * 9.0], contact_shape=[1.0], reference_frequency=3.0 / (2.0 * np.pi)
    )
    return sb.System(
        model, forces=[sb.ExternalForce(history=sb.model.HalfSineForce(peak=amplitude, duration=duration))]
    )


@pytest.mark.parametrize(("amplitude", "duration"), [(0.7, 0.3), (-2.0, 0.02), (1.0, 3.3)])
def test_an_oscillator_under_a_blow(amplitude: float, duration: float) -> None:
    """x'' + w^2 x = F/m sin(a t): F/m (sin(a t) - a/w sin(w t))/(w^2 - a^2), then free."""
    w, m, lasts = 3.0, 2.0, duration * 2.0 * np.pi / 3.0
    a = np.pi / lasts
    run = sb.simulate(struck(amplitude, duration), sb.Integration(cycles=5, accuracy="reference"))
    t, x = run.dataset.time.values, run.dataset.displacement_at_striker.values * run.system.model.length_scale

    def during(s):
        return amplitude / m * (np.sin(a * s) - a / w * np.sin(w * s)) / (w * w - a * a)

    def rate(s):
        return amplitude / m * a * (np.cos(a * s) - np.cos(w * s)) / (w * w - a * a)

    after = during(lasts) * np.cos(w * (t - lasts)) + rate(lasts) / w * np.sin(w * (t - lasts))
    np.testing.assert_allclose(x, np.where(t < lasts, during(t), after), atol=1e-8 * np.abs(after).max())


def test_of_a_file(tmp_path) -> None:
    file = tmp_path / "blow.toml"
    blow = 'type = "half_sine_force"\npeak = "5 mN"\nduration = 0.1\nlocation = 0.4\n'
    file.write_text('extends = "paper"\n[[force]]\n' + blow)
    (force,) = load_config(file).system.forces
    assert force.history == sb.model.HalfSineForce(peak=5e-3, duration=0.1)


def test_without_duration_it_is_refused() -> None:
    with pytest.raises(sb.InputError, match=r"duration = 0"):
        sb.model.HalfSineForce(peak=1.0, duration=0.0)
