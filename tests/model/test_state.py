"""States, and starts named in numbers that people use."""

from __future__ import annotations

import math

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.model.state import amplitude_scale, rest_state, started
from snapbeam.util.validation import InputError, InputTypeError

MODEL = sb.ReducedModel.from_beam(default_values.BEAM, modes=3)
BELOW, ABOVE = (
    sb.Shaker(frequency_ratio=1.2, velocity_amplitude=0.1, side=side).striker() for side in ("below", "above")
)


def test_what_is_not_given() -> None:
    state = sb.State(amplitude=[1.0, 2.0])
    assert (state.modes, state.batch) == (2, ())
    np.testing.assert_array_equal(state.velocity, [0.0, 0.0])
    assert math.isnan(state.phase) and math.isnan(state.striker_position)
    assert state.contact_time.shape == (1,) and np.isnan(state.contact_time).all()
    with pytest.raises(ValueError):
        state.amplitude[0] = 3.0


def test_a_batch_and_its_states() -> None:
    amplitude = np.arange(24.0).reshape(2, 4, 3)
    batch = sb.State(amplitude=amplitude, phase=[0.0, 1.0, 2.0, 3.0], striker_position=1e-4)
    assert (batch.batch, batch.modes) == ((2, 4), 3)
    one = batch[1, 2]
    assert one.batch == ()
    np.testing.assert_array_equal(one.amplitude, amplitude[1, 2])
    assert (float(one.phase), float(one.striker_position)) == (2.0, 1e-4)
    assert batch[0].batch == (4,)
    flat = batch.flat
    assert flat.batch == (8,)
    np.testing.assert_array_equal(flat.amplitude, amplitude.reshape(8, 3))
    np.testing.assert_array_equal(flat.phase, [0.0, 1.0, 2.0, 3.0] * 2)
    assert one.flat.batch == (1,)
    with pytest.raises(InputError, match=r"state\[0\]: this is one state, not a batch"):
        one[0]


@pytest.mark.parametrize(
    ("given", "error", "message"),
    [
        ({"amplitude": 1.0}, InputError, r"state amplitude = 1: must be an array of shape \(\.\.\., modes\)"),
        ({"amplitude": [1.0, np.nan]}, InputError, r"state amplitude\[1\] = .*nan.*: must be finite"),
        ({"amplitude": ["a"]}, InputTypeError, "state amplitude = .*must be an array of numbers"),
        (
            {"amplitude": [1.0, 2.0], "velocity": [1.0]},
            InputError,
            r"state velocity of shape \(1,\): must have shape \(2,\)",
        ),
        ({"amplitude": [1.0], "phase": np.inf}, InputError, "state phase = inf: must be finite numbers, or NaN"),
        ({"amplitude": [1.0], "phase": "late"}, InputError, "state phase = 'late': must be finite numbers"),
        (
            {"amplitude": [1.0], "contact_time": [0.1, np.nan]},
            InputError,
            "state contact_time = .*: must be given for every striker, or be NaN for all of them",
        ),
        ({"amplitude": [1.0], "contact_time": []}, InputError, "must have one number for each striker"),
        (
            {"amplitude": np.zeros((4, 1)), "phase": [0.0, 1.0]},
            InputError,
            r"state phase of shape \(2,\): must have the shape \(4,\) of the batch",
        ),
    ],
)
def test_refusals(given, error, message) -> None:
    with pytest.raises(error, match=message):
        sb.State(**given)


def test_more_modes_are_still_and_none_that_moves_is_lost() -> None:
    state = sb.State(amplitude=[[1.0, 0.5, 0.0]], velocity=[[0.0, 0.0, 0.0]], phase=0.3, striker_position=1e-4)
    more = state.with_modes(5)
    np.testing.assert_array_equal(more.amplitude, [[1.0, 0.5, 0.0, 0.0, 0.0]])
    assert float(more.phase[0]) == 0.3 and float(more.striker_position[0]) == 1e-4
    np.testing.assert_array_equal(more.with_modes(2).amplitude, [[1.0, 0.5]])
    with pytest.raises(InputError, match="modes = 1: a state of 5 modes cannot be cut to fewer without loss"):
        more.with_modes(1)


def test_contact_times_of_several_strikers() -> None:
    """One for each striker, along the last dimension; a number alone is that of a single striker."""
    one = sb.State(amplitude=np.zeros((4, 2)), contact_time=0.1)
    np.testing.assert_array_equal(one.contact_time, np.full((4, 1), 0.1))
    two = sb.State(amplitude=np.zeros((4, 2)), contact_time=[[0.1, -1.0]])
    assert two.contact_time.shape == (4, 2) and two.flat.contact_time.shape == (4, 2)
    np.testing.assert_array_equal(two[2].contact_time, [0.1, -1.0])
    np.testing.assert_array_equal(two.contact_times(2), two.contact_time)
    np.testing.assert_array_equal(two.with_modes(3).contact_time, two.contact_time)
    assert np.isnan(sb.State(amplitude=[0.0]).contact_times(3)).all()
    with pytest.raises(InputError, match=r"state contact_time of 2 strikers: must have one number for each of the 3"):
        two.contact_times(3)


# ---------------------------------------------------------------------- starts


def test_rest_is_in_the_well_that_the_striker_pushes_away_from() -> None:
    np.testing.assert_array_equal(rest_state(MODEL, BELOW).amplitude, MODEL.well_amplitude)
    np.testing.assert_array_equal(rest_state(MODEL, ABOVE).amplitude, -MODEL.well_amplitude)
    np.testing.assert_array_equal(rest_state(MODEL).amplitude, MODEL.well_amplitude)


@pytest.mark.parametrize(("rise", "well"), [(13e-6, "upper"), (-13e-6, "lower")])
def test_rest_without_a_striker_is_in_the_fabricated_well(rise: float, well: str) -> None:
    """The well of an arch that normalises is the deepest one, which is the as-fabricated one."""
    beam = sb.Beam(length=5e-4, thickness=2e-6, width=2e-5, density=2330, young_modulus=160e9, axial_load=0.0)
    arch = sb.ReducedModel.from_beam(beam, modes=2, imperfection=sb.Imperfection(midspan_amplitude=rise))
    start = rest_state(arch).amplitude
    assert float(arch.midspan_shape @ start) == pytest.approx(rise, rel=1e-9)
    assert arch.as_fabricated_well == arch.reference_well == arch.side_of(start) == well
    assert arch.side_of(rest_state(arch, ABOVE).amplitude) == "upper"
    # a load may make the other well the deeper one; a run still begins where the beam was fabricated
    bent = beam.replace(axial_load=0.02)
    pushed = sb.Imperfection(midspan_amplitude=0.01 * rise, uniform_load=math.copysign(0.1, -rise))
    loaded = sb.ReducedModel.from_beam(bent, modes=2, imperfection=pushed)
    assert loaded.as_fabricated_well == loaded.side_of(rest_state(loaded).amplitude) == well
    assert loaded.reference_well == ({"upper", "lower"} - {well}).pop()
    lowest = loaded.well_frequencies[0 if loaded.reference_well == "lower" else 1, 0]
    assert loaded.reference_frequency == lowest


def test_amplitudes_are_counted_in_that_of_the_well() -> None:
    scale = amplitude_scale(MODEL)
    assert scale == pytest.approx(abs(MODEL.well_amplitude[0]), rel=1e-14)
    state = started(
        MODEL, rest_state(MODEL, BELOW), {"amplitude[1]": 0.5, "velocity[2]": 0.1, "striker_position": 2e-4}
    )
    np.testing.assert_allclose(state.amplitude, [0.5 * scale, 0.0, 0.0], rtol=1e-14)
    np.testing.assert_allclose(state.velocity, [0.0, 0.1 * scale * MODEL.omega[0], 0.0], rtol=1e-12)
    assert float(state.striker_position) == 2e-4
    # the centre of the upper well: amplitude[1] = 1 is b up
    up = started(MODEL, rest_state(MODEL, BELOW), {"amplitude[1]": 1.0})
    assert float(MODEL.midspan_shape @ up.amplitude) == pytest.approx(default_values.BEAM.buckling_level, rel=1e-12)
    # of a structure with one well: what moves the centre by the length scale
    spring = sb.ReducedModel.from_matrices([[1.0]], [1.0], contact_shape=[2.0], length_scale=3.0)
    assert amplitude_scale(spring) == 1.5


def test_a_start_changes_only_what_is_named() -> None:
    given = sb.State(amplitude=[1e-3, 2e-3, 3e-3], velocity=[0.1, 0.2, 0.3], phase=0.4)
    state = started(MODEL, given, {"velocity[3]": [0.0, 1.0]})
    assert state.batch == (2,)
    np.testing.assert_array_equal(state.amplitude, [[1e-3, 2e-3, 3e-3]] * 2)
    np.testing.assert_array_equal(state.velocity[:, :2], [[0.1, 0.2]] * 2)
    assert state.velocity[0, 2] == 0.0 and state.velocity[1, 2] > 0.0
    np.testing.assert_array_equal(state.phase, [0.4, 0.4])


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("amplitude[4]", r"initial_state\.amplitude\[4\]: mode = 4: must be an integer in \[1, 3\]"),
        ("amplitude[0]", r"initial_state\.amplitude\[0\]: not a parameter of an initial state; must be amplitude\[i\]"),
        ("position", r"initial_state\.position: not a parameter of an initial state"),
    ],
)
def test_starts_that_are_none(name: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        started(MODEL, rest_state(MODEL, BELOW), {name: 1.0})
