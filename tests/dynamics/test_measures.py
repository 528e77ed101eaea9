"""Measures of borders: known maps, smooth and fractal borders, shapes whose integrity is known."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from doubles import grebogi

import snapbeam as sb


def grebogi_basins(points: int):
    """Basins on the window that the map was first looked at in, points x points starts."""
    flow = grebogi()
    states = np.array([[0.1, -0.3], [math.pi - 0.1, 0.3], [0.3, 0.2], [2.0, -0.1]])
    found = sb.dynamics.find_attractors(flow, states, transient=400)
    assert [each.kind for each in found.attractors] == ["periodic", "periodic"]
    plane = {"x[1]": np.linspace(0.0, 2.0 * math.pi, points), "x[2]": np.linspace(-0.5, 0.5, points)}
    ds = sb.dynamics.basins_of_attraction(found, plane, periods=2000)
    assert ds.attrs["undecided"] == 0.0
    return ds["basin"].values


def test_grebogis_map() -> None:
    """The values that Attractors.jl tests with its grid of 300 x 300 starts and boxes of 6.

    Other grids of like size give 0.597 to 0.603: half of the interval is no more than two standard errors.
    """
    entropy = sb.dynamics.basin_entropy(grebogi_basins(300), 6)
    assert entropy.boxes == 2500 and 1600 < entropy.boundary_boxes < 1750
    assert 0.40 <= entropy.basin <= 0.42
    assert 0.60 <= entropy.boundary <= 0.61
    assert 0.002 < entropy.boundary_error < 0.004
    shifted = sb.dynamics.basin_entropy(grebogi_basins(302), 6)
    assert shifted.boundary == pytest.approx(entropy.boundary, abs=4.0 * entropy.boundary_error)


@pytest.mark.slow
def test_the_exponent_of_grebogis_map() -> None:
    """0.2 (Grebogi et al. 1983), the dimension of the border being 1.8."""
    found = sb.dynamics.uncertainty_exponent(grebogi_basins(900))
    assert found.exponent == pytest.approx(0.2, abs=0.02)
    assert 0.2 <= sb.dynamics.uncertainty_exponent(grebogi_basins(251)).exponent <= 0.3


def test_a_smooth_border_has_dimension_one() -> None:
    x, y = np.meshgrid(*[np.linspace(-1.0, 1.0, 601)] * 2)
    disc = (x * x + y * y < 0.4).astype(int)
    found = sb.dynamics.uncertainty_exponent(disc, [1, 2, 4, 8])
    assert found.exponent == pytest.approx(1.0, abs=0.03)
    assert not sb.dynamics.basin_entropy(disc).is_fractal


def test_random_labels_have_all_the_entropy() -> None:
    labels = np.random.default_rng(0).integers(0, 3, (300, 300))
    entropy = sb.dynamics.basin_entropy(labels, 10)
    assert entropy.boundary == pytest.approx(math.log(3.0), abs=0.02) and entropy.is_fractal
    assert entropy.boxes == entropy.boundary_boxes == 900
    assert sb.dynamics.uncertainty_exponent(labels).exponent == pytest.approx(0.0, abs=0.01)


def test_a_cantor_border_has_its_dimension() -> None:
    """Gaps of the middle-thirds Cantor set, in two labels by turns: alpha = 1 - ln 2/ln 3."""
    number = np.arange(3**13)
    grid = np.zeros(number.size, dtype=int)
    for level in range(13):
        digit = number // 3 ** (12 - level) % 3
        grid = np.where((digit == 1) & (grid == 0), 1 + level % 2, grid)
    found = sb.dynamics.uncertainty_exponent(grid, [3**k for k in range(4, 9)])
    assert found.exponent == pytest.approx(1.0 - math.log(2.0) / math.log(3.0), abs=0.05)


def test_integrity_of_known_shapes() -> None:
    x, y = np.meshgrid(np.arange(201), np.arange(201), indexing="ij")
    disc = ((x - 100) ** 2 + (y - 100) ** 2 < 60**2).astype(int)
    found = sb.dynamics.dynamical_integrity(disc, 1, attractor=(110, 100))
    assert found.global_measure == pytest.approx(math.pi * 60**2 / 201**2, rel=5e-3)
    assert found.factor == pytest.approx(60.0, abs=1.0) and found.center == (100, 100)
    assert found.local_measure == pytest.approx(50.0, abs=1.0)
    stretched = sb.dynamics.dynamical_integrity(disc, 1, spacing=[0.5, 0.5])
    assert stretched.factor == pytest.approx(0.5 * found.factor)
    rim = sb.dynamics.dynamical_integrity(np.ones((11, 11), dtype=int), 1)
    assert rim.factor == pytest.approx(6.0), "the rim of the window is a border"


def test_undecided_points_are_left_out_with_bounds() -> None:
    """The true value lies within the bounds wherever labels are taken away, and nothing is computed over -1."""
    draw = np.random.default_rng(5)
    x, y = np.meshgrid(np.arange(120), np.arange(120))
    truth = ((np.sin(0.11 * x) + np.sin(0.07 * y + 0.02 * x)) > 0.1).astype(int) + (x + y > 170)
    whole, slope = sb.dynamics.basin_entropy(truth, 6), sb.dynamics.uncertainty_exponent(truth)
    assert whole.undecided == 0.0 and slope.bounds == pytest.approx((slope.exponent, slope.exponent))
    assert whole.basin_bounds == pytest.approx((whole.basin, whole.basin))
    assert whole.boundary_bounds == pytest.approx((whole.boundary, whole.boundary))
    for share in (0.02, 0.3, 0.87):
        holes = np.where(draw.random(truth.shape) < share, -1, truth)
        found, line = sb.dynamics.basin_entropy(holes, 6), sb.dynamics.uncertainty_exponent(holes)
        assert found.undecided == pytest.approx(share, abs=0.02) == line.undecided
        for bounds, value in (
            (found.basin_bounds, whole.basin), (found.boundary_bounds, whole.boundary), (line.bounds, slope.exponent)
        ):  # fmt: skip
            assert bounds[0] <= value <= bounds[1], (share, bounds, value)
    uniform = np.where(draw.random((60, 60)) < 0.5, -1, 2)
    one = sb.dynamics.basin_entropy(uniform, 5)
    assert one.basin == 0.0 and one.boundary_boxes == 0, "undecided is not a label"
    none = sb.dynamics.basin_entropy(np.full((20, 20), -1), 5)
    assert math.isnan(none.basin) and none.boxes == 0 and none.undecided == 1.0 and not none.is_fractal
    with pytest.raises(sb.InputError, match="no border"):
        sb.dynamics.uncertainty_exponent(uniform)
    assert sb.dynamics.dynamical_integrity(uniform, 2).undecided == pytest.approx(0.5, abs=0.05)


def test_bounds_of_small_boxes_are_exact() -> None:
    """Against all 3^u assignments of u undecided points of a box."""
    draw = np.random.default_rng(9)
    for _ in range(60):
        grid = draw.integers(0, 3, (4, 6))
        grid[0, :3] = (0, 1, 2)  # every label is present
        holes = grid.copy()
        holes.flat[draw.choice(np.arange(3, 24), 4, replace=False)] = -1
        at = np.flatnonzero(holes.ravel() < 0)
        found = sb.dynamics.basin_entropy(holes, 2)
        values = []
        for labels in itertools.product(range(3), repeat=4):
            filled = holes.copy()
            filled.flat[at] = labels
            values.append(sb.dynamics.basin_entropy(filled, 2)[:2])
        basin, border = np.array(values).T
        assert found.basin_bounds[0] == pytest.approx(basin.min()) and found.basin_bounds[1] >= basin.max() - 1e-12
        assert found.boundary_bounds[0] <= border.min() + 1e-12 and found.boundary_bounds[1] >= border.max() - 1e-12


def test_classes_of_a_map_are_labels_too() -> None:
    kinds = np.zeros((40, 40), dtype=np.int8)
    kinds[:, 20:] = 3
    assert sb.dynamics.basin_entropy(kinds, 5).boundary_boxes == 0
    assert sb.dynamics.basin_entropy(kinds, 8).boundary_boxes == 5


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: sb.dynamics.basin_entropy(np.zeros((4, 4))), "must be whole numbers"),
        (lambda: sb.dynamics.basin_entropy(np.zeros((4, 4), dtype=int), 5), "box = 5"),
        (lambda: sb.dynamics.uncertainty_exponent(np.zeros((40, 40), dtype=int)), "no border is met"),
        (
            lambda: sb.dynamics.dynamical_integrity(np.zeros((4, 4), dtype=int), 0, attractor=(9, 0)),
            "attractor = (9, 0)",
        ),
        (lambda: sb.dynamics.dynamical_integrity(np.zeros((4, 4), dtype=int), 0, spacing=[0.0, 1.0]), "spacing"),
    ],
)
def test_refusals(call, words: str) -> None:
    with pytest.raises(sb.InputError) as error:
        call()
    assert words in str(error.value)
