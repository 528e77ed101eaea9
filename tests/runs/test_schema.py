"""The labelled dataset of a run, simulated or measured."""

from __future__ import annotations

import numpy as np
import pytest

from snapbeam.simulation.dataset import SCHEMA, check_trajectory, trajectory_dataset
from snapbeam.util.validation import InputError

TIME = np.linspace(0.0, 1.0, 5)


def test_labels():
    run = trajectory_dataset(
        TIME, 3.0 * TIME, displacement=TIME, modal_amplitude=np.zeros((5, 3)), attrs={"modes": 3}
    )
    assert run["displacement"].attrs == {
        "units": "1",
        "long_name": "beam displacement at the striker, over b",
    }
    assert run["time"].attrs["units"] == "s"
    assert run["modal_amplitude"].dims == ("time", "mode")
    assert list(run["mode"].values) == [1, 2, 3]
    assert run.attrs == {"modes": 3}
    for name in run.variables:
        assert run[name].attrs["units"] == SCHEMA[name].units


@pytest.mark.parametrize(
    ("variables", "message"),
    [
        ({"displacement": TIME[:3]}, "displacement of shape (3,): must have dimensions ('time',)"),
        ({"modal_amplitude": TIME}, "modal_amplitude of shape (5,)"),
        ({"displacment": TIME}, "displacment: not a variable of a run"),
        ({"mode": TIME}, "mode: not a variable of a run"),
        ({"displacement": TIME * np.nan}, "displacement[0] = nan: must be finite"),
        ({"displacement": ["a"] * 5}, "must be an array of numbers"),
    ],
)
def test_refusals(variables, message):
    with pytest.raises(InputError) as refusal:
        trajectory_dataset(TIME, **variables)
    assert message in str(refusal.value)


def test_times_increase():
    with pytest.raises(InputError, match="must be strictly increasing"):
        trajectory_dataset(TIME[::-1])
    run = trajectory_dataset(TIME, displacement=TIME)
    run["time"] = ("time", np.array([0.0, 0.25, 0.25, 0.75, 1.0]), run["time"].attrs)
    with pytest.raises(InputError, match=r"time\[2\] = 0.25: must be later"):
        check_trajectory(run)


def test_dropouts_of_a_measured_run():
    measured = np.array([0.0, np.nan, 0.2, 0.3, 0.4])
    run = trajectory_dataset(TIME, displacement=measured, valid=np.array([1, 0, 1, 1, 1], dtype=np.int8))
    assert check_trajectory(run) is run
    with pytest.raises(InputError, match=r"displacement\[1\] = nan"):
        trajectory_dataset(TIME, displacement=measured, valid=np.ones(5, dtype=np.int8))


def test_check_says_what_is_wrong():
    run = trajectory_dataset(TIME, displacement=TIME)
    with pytest.raises(InputError, match="run without contact_force, penetration"):
        check_trajectory(run, require=("contact_force", "penetration"))
    run["displacement"].attrs["units"] = "mm"
    with pytest.raises(InputError, match="displacement in units 'mm': must be in '1'"):
        check_trajectory(run)
    with pytest.raises(InputError, match=r"must be an xarray\.Dataset, not dict"):
        check_trajectory({})
    with pytest.raises(InputError, match=r"with dimensions \('t',\)"):
        check_trajectory(trajectory_dataset(TIME, displacement=TIME).assign(penetration=("t", TIME)))


def test_files_of_version_0_1_are_read():
    """They gave numbers over b the unit "b", which is none."""
    run = trajectory_dataset(TIME, displacement=TIME, penetration=TIME)
    for name in ("displacement", "penetration"):
        run[name].attrs["units"] = "b"
    assert check_trajectory(run) is run
