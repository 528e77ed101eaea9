"""Text that no file takes is refused where it is given, before anything is computed."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.model.parameter_file import config_text
from snapbeam.simulation.dataset import trajectory_dataset
from snapbeam.util.validation import checked, require_texts

LONE = ["\ud800", "b\udfff", "stop \udcff"]
MODEL = sb.ReducedModel.from_beam(default_values.BEAM, modes=1, damping_ratio=0.01)
SYSTEM = sb.System(
    MODEL, contacts=[sb.Contact(default_values.CONTACT, sb.Shaker(frequency_ratio=1.2, velocity_amplitude=0.1))]
)


@checked
def never(words: str = "", items: list[str] | None = None, attrs: object = None, **more: object) -> None:
    raise AssertionError("was called")


@pytest.mark.parametrize("lone", LONE)
def test_every_checked_function_refuses_them_wherever_they_are(lone):
    for given in (
        {"words": lone}, {"items": ["a", lone]}, {"attrs": {"a": {"b": (1, lone)}}}, {"attrs": {lone: 1}},
        {"attrs": np.array(["a", lone])}, {"title": lone},
    ):  # fmt: skip
        with pytest.raises(sb.InputError, match="must be text that UTF-8 can encode") as told:
            never(**given)
        told.value.args[0].encode()  # the message can be printed
    with pytest.raises(AssertionError, match="was called"):
        never("müde", ["µm", 3.0], attrs={"a": [1.0, "größer"]})


@pytest.mark.parametrize("lone", LONE)
def test_texts_that_end_in_files_and_figures(lone):
    time = np.linspace(0.0, 1.0, 5)
    points = xr.Dataset({"frequency_ratio": ("point", [1.0, 1.1]), "sample": ("point", ["a", lone])})

    def row(**texts):
        given = {"name": "own", "dtype": "float64", "unit": "N", "long_name": "force"} | texts
        return sb.Statistic(**given, value=lambda reading: reading.duration)

    calls = {
        "title": lambda: SYSTEM.plot(title=lone),
        "labels": lambda: sb.plot.plot_backbone(xr.Dataset(), labels=[lone]),
        "sample": lambda: sb.sweep(SYSTEM, points, sb.Integration(cycles=1)),
        "attrs": lambda: trajectory_dataset(time, {}, attrs={"operator": lone}),
        "comment": lambda: row(comment=lone),
        "long_name": lambda: row(long_name=lone),
        "unit": lambda: sb.quantity(lone, "gap"),
        "label": lambda: sb.Contact(default_values.CONTACT, sb.Striker(drive=sb.FixedStop()), label=lone),
    }
    for name, call in calls.items():
        with pytest.raises(sb.InputError, match=name):
            call()


def test_values_of_a_file(tmp_path):
    data = xr.Dataset({"sample": ("n", np.array(["a", "\ud800"], dtype=object))})
    with pytest.raises(sb.InputError, match="sample"):
        sb.write_netcdf(data, tmp_path / "a.nc")
    assert list(tmp_path.iterdir()) == []


def test_a_text_that_holds_itself_is_no_endless_loop():
    held: list[object] = []
    held.append(held)
    require_texts("items", held)


def test_comment_of_a_parameter_file():
    from snapbeam.model.parameter_file import config_from_mapping

    with pytest.raises(sb.InputError, match="comment"):
        config_text(config_from_mapping({"integration": {"cycles": 3}}), "\ud900")
