"""Long series for a screen: the least and the greatest of each pixel's samples, so that no peak is lost."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["envelope", "round_trip"]

_Array = NDArray[np.float64]


def envelope(x: _Array, y: _Array, low: float, high: float, pixels: int = 1000) -> tuple[_Array, _Array]:
    """The samples from *low* to *high*, and one beyond on either side; of many, two a pixel.

    Parameters
    ----------
    x, y : array of shape (samples,)
        *x* ascending.
    """
    first = max(int(np.searchsorted(x, low)) - 1, 0)
    last = min(int(np.searchsorted(x, high, side="right")) + 1, x.size)
    x, y = x[first:last], y[first:last]
    if x.size <= 3 * pixels:
        return x, y
    borders = np.unique(np.searchsorted(x, np.linspace(x[0], x[-1], pixels + 1)[:-1]))
    lengths = np.diff(np.append(borders, x.size))
    group = np.repeat(np.arange(borders.size), lengths)
    order = np.lexsort((y, group))
    least, greatest = order[borders], order[borders + lengths - 1]
    kept = np.unique(np.concatenate((least, greatest, [0, x.size - 1])))
    return x[kept], y[kept]


def round_trip(value: float) -> str:
    """A number as text that gives the same number again."""
    return repr(float(value))
