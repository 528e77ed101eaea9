"""Contact stiffness from the durations of impacts: covered by its error, and refused where Hertz's law is not met."""

import numpy as np
import pytest
import xarray as xr

from snapbeam import InputError
from snapbeam.lab import stiffness_from_impacts
from snapbeam.uncertainty.measurements import HERTZ_TIME

STIFFNESS, MASS = 4e8, 0.02


def collisions(seed=0, count=12, power=-0.2, frames=20.0, noise=0.03, speeds=(0.02, 0.3)):
    """Durations of impacts over their closing speeds, as tracking gives them."""
    rng = np.random.default_rng(seed)
    speed = np.exp(rng.uniform(*np.log(speeds), count))
    constant = HERTZ_TIME * (1.25 * MASS / STIFFNESS) ** 0.4
    duration = constant * speed**power
    error = noise * duration
    return xr.Dataset(
        {
            "duration": ("impact", duration + error * rng.standard_normal(count)),
            "duration_stderr": ("impact", error),
            "closing_speed": ("impact", speed),
            "frames": ("impact", np.full(count, frames)),
            "bounded": ("impact", np.ones(count, dtype=np.int8)),
        }
    )


def test_the_error_covers_the_truth():
    results = [stiffness_from_impacts(collisions(seed), MASS) for seed in range(300)]
    ratio = np.array([(one.stiffness - STIFFNESS) / one.stiffness_se for one in results])
    assert np.mean(np.abs(ratio) < 2.0) > 0.9
    assert np.mean(np.abs(ratio) < 4.0) > 0.995
    assert np.mean([bool(one.diagnostics) for one in results]) < 0.02
    assert results[0].impacts == 12


@pytest.mark.parametrize(
    ("changes", "code"),
    [
        ({"power": 0.1}, "contact.exponent"),
        ({"frames": 3.0}, "contact.coarse"),
        ({"speeds": (0.1, 0.15)}, "contact.few"),
    ],
)
def test_impacts_that_tell_no_stiffness_say_so(changes, code):
    assert code in {diagnostic.code for diagnostic in stiffness_from_impacts(collisions(**changes), MASS).diagnostics}


def test_too_few_impacts_are_refused():
    with pytest.raises(InputError, match="2 of 2 seen from end to end: must be at least 3"):
        stiffness_from_impacts(collisions(count=2), MASS)
