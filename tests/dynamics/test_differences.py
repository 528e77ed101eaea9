"""Derivatives of maps by central differences."""

from __future__ import annotations

import numpy as np
import pytest

from snapbeam.util.differences import differences


def test_a_smooth_map_is_exact_to_rounding() -> None:
    x = np.array([[0.3, -0.7], [1.1, 0.2]])
    directions = np.random.default_rng(3).normal(size=(2, 3, 2))

    def image(rows: np.ndarray, runs: np.ndarray) -> tuple[np.ndarray, None]:
        return np.stack((np.sin(rows[:, 0]) * rows[:, 1], np.exp(rows[:, 0])), axis=1), None

    found, error = differences(image, x, directions)
    a, b = x[:, None, 0], x[:, None, 1]
    along = directions[..., 0], directions[..., 1]
    expected = np.stack((np.cos(a) * b * along[0] + np.sin(a) * along[1], np.exp(a) * along[0]), axis=-1)
    np.testing.assert_allclose(found, expected, atol=1e-11)
    assert error.max() < 1e-9


@pytest.mark.parametrize("distance", [3e-4, 3e-5])
def test_a_root_beside_the_state_shortens_the_step(distance: float) -> None:
    """A light impact: the map goes on as the power 3/2 beyond a place that the first step passes."""

    def image(rows: np.ndarray, runs: np.ndarray) -> tuple[np.ndarray, None]:
        return np.maximum(rows, 0.0) ** 1.5, None

    found, error = differences(image, np.array([[distance]]), np.ones((1, 1, 1)))
    assert found[0, 0, 0] == pytest.approx(1.5 * np.sqrt(distance), rel=1e-6)
    assert error[0, 0] < 1e-6


def test_neighbours_with_other_impacts_have_no_derivative() -> None:
    def image(rows: np.ndarray, runs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return rows, (rows[:, 0] > 0.0).astype(int)

    _, error = differences(image, np.array([[0.0, 1.0]]), np.eye(2)[None])
    assert error[0].tolist() == [np.inf, pytest.approx(0.0, abs=1e-8)]
