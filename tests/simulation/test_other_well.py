"""Whether the other well was reached, beside the paper's rule and in its place without a striker."""

from __future__ import annotations

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model import default_values

MODEL = sb.ReducedModel.from_beam(default_values.BEAM, modes=3)


def started(first: float, third: float) -> sb.RunSummary:
    """A beam without a striker, let go with so much of modes 1 and 3 over the amplitude in the well."""
    amplitude = MODEL.well_amplitude * first
    amplitude[2] = third * MODEL.well_amplitude[0]
    system = sb.System(MODEL, initial_state=sb.State(amplitude=amplitude))
    return sb.simulate(system, sb.Integration(cycles=2), sample_times=[0.0]).summary


def test_a_centre_that_crosses_far_from_the_other_well_is_no_snap() -> None:
    found = [started(0.2, third) for third in (-0.6, -0.4)]
    crossed = [each for each in found if each.zero_crossings > 0 and not each.other_well_reached]
    assert crossed, "the third mode carries the centre across zero, and the beam stays in its well"
    for each in crossed:
        assert min(abs(each.min_midspan_displacement), abs(each.max_midspan_displacement)) < 0.5
        assert each.response_class is sb.ResponseClass.INTRAWELL


@pytest.mark.parametrize("side", ["below", "above"])
def test_a_striker_keeps_the_rule_of_the_paper(side: str) -> None:
    """In runs and sweeps: the class follows from the crossings alone."""
    drive = sb.Sine(frequency_ratio=1.0, velocity_amplitude=0.1)
    system = sb.System(MODEL, contacts=[sb.Contact(default_values.CONTACT, sb.Striker(drive=drive, side=side))])
    how = sb.Integration(cycles=8)
    data = sb.sweep(system, {"velocity_amplitude": [0.02, 0.6, 0.8]}, how)
    kinds = sb.classify(data.zero_crossings, data.zero_crossings_last_quarter, how.cycles, _ended(data, side))
    np.testing.assert_array_equal(data.response_class, kinds)
    far = data.max_midspan_displacement if side == "below" else -data.min_midspan_displacement
    np.testing.assert_array_equal(data.other_well_reached, far > 0.5)
    assert not data.other_well_reached[0] and data.other_well_reached[1:].any()


def _ended(data, side: str) -> np.ndarray:
    return data.final_well.values * (1 if side == "below" else -1)
