"""Derivatives of maps by central differences, and what is said where there is none."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from tests.dynamics.doubles import henon

import snapbeam as sb
from snapbeam.simulation.advance import differences


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


class Grazing:
    """A map that says that its tangents are not known in some runs."""

    def __init__(self, error: float) -> None:
        self._map, self._error = henon(), error
        self.smooth, self.dimension, self.period = True, 2, 1.0

    def advance(self, states, periods=1, *, tangents=None, every=False, points=None):
        found = self._map.advance(states, periods, tangents=tangents, every=every, points=points)
        found.statistics["tangent_error"] = np.full(len(found.states), self._error)
        return found

    def neighbour(self, name, value):
        return self

    def value(self, name):
        return 0.0


def test_exponents_tell_of_grazing_periods() -> None:
    with pytest.warns(UserWarning, match="impacts graze in 100.0 % of the periods"):
        found = sb.dynamics.lyapunov_spectrum(Grazing(np.inf), 2, 40, transient=10, states=[[0.1, 0.1]])
    assert "dynamics.grazing_periods" in found.attrs["diagnostics"]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = sb.dynamics.lyapunov_spectrum(Grazing(1e-8), 2, 40, transient=10, states=[[0.1, 0.1]])
    assert found.attrs["diagnostics"] == "[]"
