"""The full-size data of the documentation: complete, small, and traceable to what made them."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
import studies  # noqa: F401  their data are kept too

from snapbeam import paper
from snapbeam.paper.store import load_results
from snapbeam.util.status_codes import ResponseClass

DATA = Path(__file__).parents[2] / "docs" / "data"


@cache
def loaded(name):
    """The results of a figure, read once; tests do not change them."""
    return load_results(DATA / f"{name}.nc", "full")


KEPT = [name for name in paper.FIGURES if (DATA / f"{name}.nc").exists()]


def test_data_are_kept():
    assert set(paper.FIGURES) == set(KEPT)


@pytest.mark.sampled(5)
@pytest.mark.parametrize("name", KEPT)
def test_says_what_made_it(name):
    for dataset in loaded(name).values():
        if "response_class" in dataset:
            assert not (dataset.response_class == ResponseClass.UNKNOWN).any() or name == "low_frequency"
            # the low-frequency data are joined from several maps, made at different times
            for attribute in (
                ("modes",)
                if name == "low_frequency"
                else ("snapbeam_version", "command", "created", "modes", "cycles", "reference_frequency")
            ):
                assert attribute in dataset.attrs
            assert "/" not in dataset.attrs["command"].replace("docs/data", "")


@pytest.mark.parametrize("modes", [1, 32])
def test_no_class_changes_that_cannot(modes):
    """A beam that has snapped through has: what is interwell after 200 cycles is after 1000."""
    before = loaded("fig6")[f"modes_{modes}"].response_class
    after = loaded("fig7")[f"modes_{modes}"].response_class
    assert ((before != ResponseClass.INTRAWELL) & (after == ResponseClass.INTRAWELL)).sum() == 0


def test_is_small():
    assert sum(file.stat().st_size for file in DATA.iterdir()) < 8e6
    assert {file.suffix for file in DATA.iterdir()} <= {".nc", ".md", ".csv", ".json"}


@pytest.mark.parametrize(
    ("name", "cycles"), [(name, cycles) for name, cycles in (("fig6", 200), ("fig7", 1000)) if name in KEPT]
)
def test_frequency_maps_are_of_full_size(name, cycles):
    maps = loaded(name)
    assert [int(ds.attrs["modes"]) for ds in maps.values()] == [1, 32]
    for ds in maps.values():
        assert ds.response_class.shape == (160, 66) and ds.attrs["cycles"] == cycles
        assert float(ds.frequency_ratio[-1]) == 4.0 and float(ds.velocity_amplitude[-1]) == 0.65


@pytest.mark.parametrize("name", [name for name in ("fig8",) if name in KEPT])
def test_location_maps_are_of_full_size(name):
    maps = loaded(name)
    assert len(maps) == 6
    for ds in maps.values():
        assert min(ds.response_class.shape) >= 60 and ds.attrs["cycles"] == 200


def test_a_point_of_the_map_is_computed_again():
    """A regular response, far from any border, comes out as it is stored."""
    from snapbeam.paper.system import class_map, paper_model

    stored = loaded("fig6")["modes_1"]
    part = stored.isel(frequency_ratio=[100, 101], velocity_amplitude=[2, 3])
    again = class_map(
        paper.Results(), "again", paper_model(1), cycles=200,
        frequency_ratio=part.frequency_ratio.values, velocity_amplitude=part.velocity_amplitude.values,
    )  # fmt: skip
    np.testing.assert_array_equal(again.response_class.values, part.response_class.values)


@pytest.mark.sampled(4)
@pytest.mark.parametrize(
    "name", [name for name in ("fig2", "fig6", "fig7", "fig8", "figA9", "figB10", "si5", "two_tips") if name in KEPT]
)
def test_draws(name):
    figure = paper.FIGURES[name]("full", data=DATA)
    assert figure.axes
    plt.close(figure)
