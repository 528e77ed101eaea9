"""How rough the borders between outcomes are, and how safe the inside is: measures of any array of labels."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import ndimage, stats

from snapbeam.core.kinds import checked
from snapbeam.core.validate import InputError, InputTypeError, integer, shown

__all__ = [
    "BasinEntropy",
    "Integrity",
    "UncertaintyExponent",
    "basin_entropy",
    "dynamical_integrity",
    "uncertainty_exponent",
]

_Array = NDArray[np.float64]
_SIGMAS = 3.0


class BasinEntropy(NamedTuple):
    """How uncertain the outcome is in boxes of a grid."""

    basin: float
    """Mean over all boxes of the entropy of the labels within, S_b."""
    boundary: float
    """Mean over the boxes that hold more than one label, S_bb; NaN where none does."""
    boxes: int
    boundary_boxes: int
    basin_error: float
    """Standard error of S_b from counting, as if boxes were independent; moving or refining the grid moves it too."""
    boundary_error: float
    """The same of S_bb; NaN with fewer than two boxes."""

    @property
    def is_fractal(self) -> bool:
        """Whether S_bb > ln 2 by three standard errors: enough, and not needed, for a fractal border."""
        return bool(self.boundary - _SIGMAS * self.boundary_error > np.log(2.0))


def _labels(labels: ArrayLike) -> NDArray[np.int64]:
    try:
        array = np.asarray(labels)
    except ValueError:
        raise InputError("labels: must be an array, not a list of unequal lengths") from None
    except Exception as error:  # of an object that cannot be one
        raise InputTypeError(f"labels = {shown(labels)}: must be an array of labels ({error})") from None
    if array.dtype.kind not in "iub":
        raise InputTypeError(f"labels of {array.dtype}: must be whole numbers")
    if array.ndim < 1 or array.size < 2:
        raise InputError(f"labels of shape {array.shape}: must be a grid of at least two points")
    return array.astype(np.int64)


@checked
def basin_entropy(labels: ArrayLike, box: int = 5) -> BasinEntropy:
    """Basin entropy and boundary basin entropy (Daza et al., Sci. Rep. 6 (2016) 31416).

    The grid is cut into boxes of *box* points a side; in each, with shares p_j of the labels, the entropy is
    S = -sum p_j ln p_j.  S_b is its mean over all boxes, S_bb over those that hold a border.

    Parameters
    ----------
    labels : array_like of int
        A grid of any dimension, such as basins or the classes of a map.
    box : int
        Points along a side; what does not fill a box is left out.
    """
    grid = _labels(labels)
    side = integer("box", box, 2, min(grid.shape))
    cut = grid[tuple(slice(0, n - n % side) for n in grid.shape)]
    shape = [part for n in cut.shape for part in (n // side, side)]
    boxes = cut.reshape(shape).transpose(*range(0, 2 * cut.ndim, 2), *range(1, 2 * cut.ndim, 2))
    boxes = boxes.reshape(-1, side**cut.ndim)
    entropy, kinds = np.zeros(len(boxes)), np.zeros(len(boxes), dtype=int)
    for label in np.unique(boxes):
        share = (boxes == label).mean(axis=1)
        kinds += share > 0.0
        entropy -= np.where(share > 0.0, share * np.log(np.where(share > 0.0, share, 1.0)), 0.0)
    mixed = kinds > 1
    (basin, basin_error), (boundary, boundary_error) = _mean(entropy), _mean(entropy[mixed])
    return BasinEntropy(basin, boundary, len(boxes), int(mixed.sum()), basin_error, boundary_error)


def _mean(values: _Array) -> tuple[float, float]:
    """Mean and its standard error; NaN where there is none."""
    if values.size < 2:
        return (float(values[0]) if values.size else float("nan")), float("nan")
    return float(values.mean()), float(values.std(ddof=1) / np.sqrt(values.size))


class UncertaintyExponent(NamedTuple):
    """How the share of uncertain points goes with the error of a start, f ~ epsilon^alpha."""

    exponent: float
    """alpha; the dimension of the border is that of the grid less alpha."""
    error: float
    """Standard error of the straight line; NaN with two sizes."""
    size: _Array
    """epsilon, in cells."""
    share: _Array
    """f(epsilon)."""


@checked
def uncertainty_exponent(labels: ArrayLike, sizes: ArrayLike | None = None) -> UncertaintyExponent:
    """The uncertainty exponent of the borders on a grid (Grebogi et al., Phys. Lett. A 99 (1983) 415).

    A point is uncertain at epsilon if a point that many cells away along an axis has another label.

    Parameters
    ----------
    labels : array_like of int
    sizes : array_like of int, optional
        epsilon in cells; powers of two up to an eighth of the shortest side by default.

    Raises
    ------
    InputError
        For a grid that is too small, and one without borders.
    """
    grid = _labels(labels)
    most = min(grid.shape) // 2 if grid.ndim else 0
    if sizes is None:
        sizes = [2**i for i in range(20) if 2**i <= max(min(grid.shape) // 8, 2)]
    steps = [integer("sizes", size, 1, most) for size in np.atleast_1d(sizes).tolist()]
    if len(set(steps)) < 2:
        raise InputError(f"sizes = {steps}: must be at least two different ones")
    shares = np.array([_uncertain(grid, step) for step in steps])
    if not (shares > 0.0).all():
        raise InputError("labels: no border is met at some of the sizes, so that there is no exponent")
    line = stats.linregress(np.log(steps), np.log(shares))
    error = float(line.stderr) if len(steps) > 2 else float("nan")
    return UncertaintyExponent(float(line.slope), error, np.array(steps, dtype=float), shares)


def _uncertain(grid: NDArray[np.int64], step: int) -> float:
    """Share of the points, that far from the rim, that have another label that far away."""
    inner = grid[tuple(slice(step, n - step) for n in grid.shape)]
    other = np.zeros(inner.shape, dtype=bool)
    for along in range(grid.ndim):
        for shift in (-step, step):
            window = [slice(step, n - step) for n in grid.shape]
            window[along] = slice(step + shift, grid.shape[along] - step + shift)
            other |= grid[tuple(window)] != inner
    return float(other.mean())


class Integrity(NamedTuple):
    """How safe a basin is in a window; lengths in units of the grid's axes as they are weighed."""

    global_measure: float
    """GIM: share of the window that it fills."""
    local_measure: float
    """LIM: distance from the attractor to the nearest other point or rim; NaN if no attractor is given."""
    factor: float
    """IF: radius of the largest circle within it."""
    center: tuple[int, ...]
    """Of that circle."""


@checked
def dynamical_integrity(
    labels: ArrayLike, label: int, attractor: tuple[int, ...] | None = None, spacing: ArrayLike | None = None
) -> Integrity:
    """Global and local integrity measure and integrity factor of one basin in a window.

    As of Soliman and Thompson (J. Sound Vib. 135 (1989) 453) and Rega and Lenci (Nonlinear Anal. 63 (2005) 902).  The
    rim of the window counts as a border: what lies beyond is not known.

    Parameters
    ----------
    labels : array_like of int
    label : int
        The basin.
    attractor : tuple of int, optional
        Indices of the grid point nearest to its attractor.
    spacing : array_like, optional
        Distance between points along each axis; 1 by default.
    """
    grid = _labels(labels)
    inside = np.pad(grid == integer("label", label, -(2**31), 2**31), 1)
    steps = np.ones(grid.ndim) if spacing is None else np.asarray(spacing, dtype=float)
    if steps.shape != (grid.ndim,) or not (steps > 0.0).all():
        raise InputError(
            f"spacing = {shown(spacing)}: must be a number greater than 0 for each of {grid.ndim} axes"
        )
    away = ndimage.distance_transform_edt(inside, sampling=steps)
    away = away[(slice(1, -1),) * grid.ndim]
    center = tuple(int(i) for i in np.unravel_index(int(np.argmax(away)), grid.shape))
    local = float("nan")
    if attractor is not None:
        if len(attractor) != grid.ndim or any(
            not 0 <= i < n for i, n in zip(attractor, grid.shape, strict=True)
        ):
            raise InputError(
                f"attractor = {shown(attractor)}: must be indices of a point of the grid {grid.shape}"
            )
        local = float(away[tuple(attractor)])
    return Integrity(float((grid == int(label)).mean()), local, float(away.max()), center)
