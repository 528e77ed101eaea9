"""The shaker's parameters and the quasi-static threshold."""

from __future__ import annotations

import math

import numpy as np
import pytest

from snapbeam.model.buckling_modes import BucklingModes
from snapbeam.model.default_values import BEAM, LOCATION
from snapbeam.model.quasi_static import quasi_static_threshold
from snapbeam.model.striker import Shaker
from snapbeam.util.validation import InputError, InputTypeError


def test_shaker() -> None:
    shaker = Shaker(frequency_ratio=1.21, velocity_amplitude=0.18)
    assert shaker == Shaker(frequency_ratio=1.21, velocity_amplitude=0.18, location=LOCATION, side="below")
    assert Shaker(frequency_ratio=1, velocity_amplitude=0, side="above").velocity_amplitude == 0.0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"frequency_ratio": 0.0}, r"frequency_ratio = 0.0: must be a finite number greater than 0"),
        ({"frequency_ratio": math.nan}, r"frequency_ratio = nan"),
        ({"velocity_amplitude": -0.1}, r"velocity_amplitude = -0.1: must be a finite number of at least 0"),
        ({"velocity_amplitude": math.inf}, r"velocity_amplitude = inf"),
        ({"location": 0.0}, r"location = 0.0: must be a number in \(0, 1\)"),
        ({"location": 1.0}, r"location = 1.0: must be a number in \(0, 1\)"),
        ({"side": "left"}, r"side = 'left': must be one of 'below', 'above'"),
    ],
)
def test_refusals(changes: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        Shaker(**{"frequency_ratio": 1.0, "velocity_amplitude": 0.1, **changes})


def test_refuses_text() -> None:
    with pytest.raises(InputTypeError, match=r"frequency_ratio = '1.2'.* not str"):
        Shaker(frequency_ratio="1.2", velocity_amplitude=0.1)  # type: ignore[arg-type]


def test_quasi_static_threshold() -> None:
    """Eq. (21): Omega phi_1(x_s)/phi_1(1/2), broadcast."""
    location = np.array([0.1, LOCATION, 0.5, 0.9])
    ratio = np.array([[0.05], [1.625]])
    first = BucklingModes(BEAM.length, 1)
    expected = ratio * first.shape(location * BEAM.length)[0] / first.shape(0.5 * BEAM.length)[0]
    np.testing.assert_allclose(quasi_static_threshold(location, ratio), expected, rtol=1e-13)
    assert float(quasi_static_threshold(0.5, 0.3)) == pytest.approx(0.3)
    with pytest.raises(InputError, match=r"location = 1.2: must lie in \(0, 1\)"):
        quasi_static_threshold([0.5, 1.2], 1.0)
    with pytest.raises(InputError, match="frequency_ratio = -1: must be greater than 0"):
        quasi_static_threshold(0.5, -1.0)
