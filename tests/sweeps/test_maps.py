"""Maps: many runs as one labelled dataset, each point the run that it names."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from small_map import swept

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.solver.statistics import STATISTICS

RATIO, VELOCITY, LOCATION = [0.8, 1.21, 1.6], [0.05, 0.18, 0.3, 0.5], [0.35, 0.5]


@cache
def model_of(modes: int) -> sb.ReducedModel:
    return sb.ReducedModel.from_beam(default_values.BEAM, modes)


def make(modes: int = 1, **changes: Any):
    given: dict[str, Any] = {"frequency_ratio": RATIO, "velocity_amplitude": VELOCITY, "cycles": 6}
    model = model_of(modes)
    if "reference_frequency" in changes:
        model = replace(model, given_reference_frequency=changes.pop("reference_frequency"))
    return swept(model, default_values.CONTACT, **(given | changes))


def assert_equal(one, other) -> None:
    for name in STATISTICS:
        np.testing.assert_array_equal(one[name].values, other[name].values, err_msg=name)


def test_dataset() -> None:
    ds = make(location=LOCATION)
    assert ds.response_class.dims == ("frequency_ratio", "velocity_amplitude", "location")
    assert ds.response_class.shape == (3, 4, 2)
    assert ds.response_class.dtype == np.int8
    assert set(ds.data_vars) == set(STATISTICS)
    for name, row in STATISTICS.items():
        assert ds[name].dtype == np.dtype(row.dtype)
        assert (ds[name].attrs["units"], ds[name].attrs["long_name"]) == (row.unit, row.long_name)
    np.testing.assert_array_equal(ds.velocity_amplitude, VELOCITY)
    system = {"modes", "damping_ratio", "contact_stiffness", "beam_length", "beam_thickness", "side"}
    made = {"cycles", "reference_frequency", "step", "engine", "snapbeam_version", "title", "created", "command"}
    assert system | made <= set(ds.attrs)
    assert all(np.ndim(value) == 0 for value in ds.attrs.values())
    assert ds.response_class.attrs["flag_values"].tolist() == [-1, 0, 1, 2, 3]


def test_numbers_are_no_dimensions() -> None:
    ds = make(frequency_ratio=1.21, location=0.4)
    assert ds.response_class.dims == ("velocity_amplitude",)
    assert float(ds.frequency_ratio) == 1.21
    assert ds.attrs["location"] == 0.4
    point = make(frequency_ratio=1.21, velocity_amplitude=0.3)
    assert point.response_class.dims == ()
    np.testing.assert_array_equal(make(frequency_ratio=[1.21]).response_class.dims, make().response_class.dims)


@pytest.mark.parametrize("modes", [1, 8])
def test_every_point_is_its_run(modes: int) -> None:
    """Class and statistics of simulate() at the same point, bit for bit."""
    ds = make(modes, cycles=4)
    for i, ratio in enumerate(RATIO):
        for j in (0, 2):
            shaker = sb.Shaker(frequency_ratio=ratio, velocity_amplitude=VELOCITY[j])
            response = sb.simulate(
                sb.System(model_of(modes), contacts=[sb.Contact(default_values.CONTACT, shaker)]),
                sb.Integration(cycles=4),
            ).summary
            point = {name: ds[name].values[i, j].item() for name in STATISTICS}
            np.testing.assert_equal(point, dict(response))


def test_parts_and_threads() -> None:
    whole = make(threads=1)
    assert_equal(make(threads=3), whole)
    assert_equal(make(frequency_ratio=RATIO[1:]), whole.isel(frequency_ratio=slice(1, None)))
    assert_equal(make(velocity_amplitude=VELOCITY[2]), whole.isel(velocity_amplitude=2))


def test_a_point_does_not_depend_on_the_other_locations() -> None:
    both = make(location=[0.1, 0.45])
    assert_equal(both.isel(location=1), make(location=0.45))


def test_mirror_image() -> None:
    below, above = make(2), make(2, side="above")
    np.testing.assert_array_equal(below.response_class, above.response_class)
    np.testing.assert_array_equal(below.final_well, -above.final_well)
    np.testing.assert_array_equal(below.min_displacement, -above.max_displacement)


def test_reference_frequency() -> None:
    """Omega and V mean another frequency and velocity: half of omega_1, twice the ratios; with equal steps."""
    step = 5e-5
    freq = model_of(1).reference_frequency
    half = make(
        reference_frequency=0.5 * freq,
        frequency_ratio=2.0 * np.array(RATIO),
        velocity_amplitude=2.0 * np.array(VELOCITY),
        step=step,
    )
    whole = make(step=step)
    assert half.attrs["reference_frequency"] == 0.5 * freq
    np.testing.assert_array_equal(half.response_class, whole.response_class)
    np.testing.assert_allclose(half.peak_force, whole.peak_force, rtol=1e-6)


def test_early_termination_keeps_the_classes() -> None:
    ratio, velocity = np.linspace(0.4, 3.5, 16), np.linspace(0.05, 0.6, 12)
    full, early = (
        make(frequency_ratio=ratio, velocity_amplitude=velocity, cycles=24, early_termination=flag)
        for flag in (False, True)
    )
    np.testing.assert_array_equal(full.response_class, early.response_class)
    assert np.isfinite(early.early_stop_time).any()
    assert not np.isfinite(full.early_stop_time).any()


def test_progress_and_interruption() -> None:
    seen: list[tuple[int, int]] = []
    make(progress=lambda done, total: seen.append((done, total)))
    assert seen[-1] == (12, 12)
    assert [done for done, _ in seen] == sorted(done for done, _ in seen)

    def stop(done: int, total: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        make(progress=stop)


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        ({"frequency_ratio": []}, sb.InputError, r"frequency_ratio = \[\]: must hold at least one point"),
        ({"frequency_ratio": [1.2, 1.1]}, sb.InputError, r"frequency_ratio\[0\] = 1.2, .* must be strictly increasing"),
        ({"frequency_ratio": [1.0, 1.0]}, sb.InputError, "must be strictly increasing"),
        ({"frequency_ratio": 0.0}, sb.InputError, r"frequency_ratio = 0.0: must be a finite number greater than 0"),
        ({"frequency_ratio": [-1.0, 1.0]}, sb.InputError, "frequency_ratio = -1.0: must be a number in"),
        ({"frequency_ratio": [1.0, math.nan]}, sb.InputError, r"frequency_ratio\[1\] = .*nan.*: must be finite"),
        (
            {"frequency_ratio": math.inf},
            sb.InputError,
            r"frequency_ratio = inf: must be a finite number greater than 0",
        ),
        (
            {"frequency_ratio": "1.2"},
            sb.InputTypeError,
            "frequency_ratio = '1.2': must be a finite number greater than 0",
        ),
        ({"frequency_ratio": [[1.0]]}, sb.InputError, r"frequency_ratio of shape \(1, 1\): must be a number or"),
        ({"velocity_amplitude": [-0.1, 0.1]}, sb.InputError, r"velocity_amplitude = -0.1: must be .* \[0, inf\)"),
        (
            {"velocity_amplitude": None},
            sb.InputTypeError,
            "velocity_amplitude = None: must be a finite number of at least 0",
        ),
        ({"location": [0.5, 1.0]}, sb.InputError, r"location = 1.0: must be a number in \(0, 1\)"),
        ({"location": 0.0}, sb.InputError, r"location = 0.0: must be a number in \(0, 1\)"),
        ({"cycles": 0}, sb.InputError, r"cycles = 0: must be an integer in \[1,"),
        ({"cycles": "ten"}, sb.InputTypeError, "cycles = 'ten': must be an integer .* not str"),
        ({"step": -1e-6}, sb.InputError, "step = -1e-06: must be a finite number greater than 0 s"),
        ({"accuracy": "fine"}, sb.InputError, "accuracy = 'fine': must be one of"),
        ({"engine": "abacus"}, sb.InputError, "engine = 'abacus': must be one of"),
        ({"side": "left"}, sb.InputError, "side = 'left': must be one of 'below', 'above'"),
        ({"threads": 0}, sb.InputError, r"threads = 0: must be an integer in \[1, "),
    ],
)
def test_refusals(changes: dict[str, Any], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        make(**changes)


def test_refuses_what_is_no_system() -> None:
    axes = {"frequency_ratio": 1.0, "velocity_amplitude": 0.1, "cycles": 1}
    with pytest.raises(sb.InputError, match="needs a buckled beam: axial_load = 0 N must exceed"):
        swept(sb.ReducedModel.from_beam(default_values.STRAIGHT_BEAM, 2), default_values.CONTACT, **axes)
    with pytest.raises(sb.InputError, match="law = None: must be a law of contact, such as HertzContact"):
        swept(model_of(1), None, **axes)  # type: ignore[arg-type]
    with pytest.raises(sb.InputTypeError, match="model = 'beam': must be a ReducedModel"):
        swept("beam", default_values.CONTACT, **axes)  # type: ignore[arg-type]
