"""The mirror image of a run is the run, negated, to the last bit."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from snapbeam.model.state import State

MIRRORED = {
    "min_displacement": "max_displacement",
    "min_midspan_displacement": "max_midspan_displacement",
    "final_well": "final_well",
}


def assert_mirrored(below, above) -> None:
    above.assert_is(below)
    first, second = below.statistics, above.statistics
    for name, values in first.items():
        other = MIRRORED.get(name) or {v: k for k, v in MIRRORED.items()}.get(name)
        expected = values if other is None else -first[other]
        np.testing.assert_array_equal(second[name], expected, err_msg=name)
    assert (first["zero_crossings"] > 0).any()


@pytest.mark.parametrize(("modes", "runs", "cycles"), [(1, 40, 20), (2, 20, 10), (8, 12, 6), (32, 8, 5)])
def test_shaker_from_the_other_side(integrate_ensemble, model_of, draw, modes, runs, cycles) -> None:
    given = draw(runs, modes)
    assert_mirrored(
        *(integrate_ensemble(model_of(modes), **given, side=side, cycles=cycles) for side in ("below", "above"))
    )


def test_every_law_and_drive_from_the_other_side(integrate_ensemble, model_of, draw, kind) -> None:
    """A record is given in the coordinates of space: its mirror image is the negated one."""
    model = model_of(kind.modes)
    below = kind.given(model, draw(12, kind.modes), 8)
    above = below | {"side": "above"}
    if "drive" in below:
        drive = below["drive"]
        above["drive"] = dataclasses.replace(drive, displacement=-drive.displacement, velocity=-drive.velocity)
    assert_mirrored(integrate_ensemble(model, **below), integrate_ensemble(model, **above))


@pytest.mark.parametrize("modes", [2, 32])
def test_negated_start(integrate_ensemble, model_of, draw, modes) -> None:
    model, given = model_of(modes), draw(6, 7)
    rng = np.random.default_rng(modes)
    alpha = model.well_amplitude + 0.02 * np.abs(model.well_amplitude[0]) * rng.standard_normal(modes) / np.arange(
        1, modes + 1
    )
    velocity = model.linear_modes[:, 0] * np.sqrt(1.5 * (model.saddle_energy - model.well_energy))
    below = integrate_ensemble(model, **given, cycles=4, start=State(amplitude=alpha, velocity=velocity))
    above = integrate_ensemble(
        model, **given, cycles=4, start=State(amplitude=-alpha, velocity=-velocity), side="above"
    )
    assert_mirrored(below, above)
