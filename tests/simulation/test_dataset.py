"""The labelled dataset of a run, simulated or measured."""

from __future__ import annotations

import numpy as np
import pytest

from snapbeam.simulation.dataset import SCHEMA, check_trajectory, trajectory_dataset
from snapbeam.util.validation import InputError

TIME = np.linspace(0.0, 1.0, 5)


def test_labels():
    run = trajectory_dataset(
        TIME, 3.0 * TIME, displacement_at_striker=TIME, modal_amplitude=np.zeros((5, 3)), attrs={"modes": 3}
    )
    assert run["displacement_at_striker"].attrs == {
        "units": "1",
        "long_name": "beam displacement at the striker, over b",
    }
    assert run["time"].attrs["units"] == "s"
    assert run["modal_amplitude"].dims == ("time", "mode")
    assert list(run["mode"].values) == [1, 2, 3]
    assert run.attrs == {"modes": 3}
    for name in run.variables:
        assert run[name].attrs["units"] == SCHEMA[name].unit


@pytest.mark.parametrize(
    ("variables", "message"),
    [
        (
            {"displacement_at_striker": TIME[:3]},
            "displacement_at_striker of shape (3,): must have dimensions ('time',)",
        ),
        ({"modal_amplitude": TIME}, "modal_amplitude of shape (5,)"),
        ({"displacment": TIME}, "displacment: is not a variable of a run"),
        ({"mode": TIME}, "mode: is not a variable of a run"),
        ({"displacement_at_striker": TIME * np.nan}, "displacement_at_striker[0] = nan: must be finite"),
        ({"displacement_at_striker": ["a"] * 5}, "must be an array of numbers"),
    ],
)
def test_refusals(variables, message):
    with pytest.raises(InputError) as refusal:
        trajectory_dataset(TIME, **variables)
    assert message in str(refusal.value)


def test_times_increase():
    with pytest.raises(InputError, match="must be strictly increasing"):
        trajectory_dataset(TIME[::-1])
    run = trajectory_dataset(TIME, displacement_at_striker=TIME)
    run["time"] = ("time", np.array([0.0, 0.25, 0.25, 0.75, 1.0]), run["time"].attrs)
    with pytest.raises(InputError, match=r"time\[2\] = 0.25: must be later"):
        check_trajectory(run)


def test_dropouts_of_a_measured_run():
    measured = np.array([0.0, np.nan, 0.2, 0.3, 0.4])
    run = trajectory_dataset(TIME, displacement_at_striker=measured, valid=np.array([1, 0, 1, 1, 1], dtype=np.int8))
    assert check_trajectory(run) is run
    with pytest.raises(InputError, match=r"displacement_at_striker\[1\] = nan"):
        trajectory_dataset(TIME, displacement_at_striker=measured, valid=np.ones(5, dtype=np.int8))


def test_check_says_what_is_wrong():
    run = trajectory_dataset(TIME, displacement_at_striker=TIME)
    with pytest.raises(InputError, match="run without contact_force, penetration_normalised"):
        check_trajectory(run, require=("contact_force", "penetration_normalised"))
    run["displacement_at_striker"].attrs["units"] = "mm"
    with pytest.raises(InputError, match="displacement_at_striker in units 'mm': must be in '1'"):
        check_trajectory(run)
    with pytest.raises(InputError, match=r"must be an xarray\.Dataset, not dict"):
        check_trajectory({})
    with pytest.raises(InputError, match=r"with dimensions \('t',\)"):
        check_trajectory(
            trajectory_dataset(TIME, displacement_at_striker=TIME).assign(penetration_normalised=("t", TIME))
        )
