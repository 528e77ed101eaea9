"""Values of axes that are no arrays."""

from __future__ import annotations

import pytest
import xarray as xr

import snapbeam as sb
from snapbeam.model import default_values


class Broken:
    def __array__(self, *_, **__):
        raise RuntimeError("no array")


@pytest.mark.parametrize("name", ["drive.velocity_amplitude", "contact.side"])
@pytest.mark.parametrize(
    "values", [xr.Dataset({"a": ("x", [1.0, 2.0])}), Broken(), object(), {1.0, 2.0}, iter([1.0])], ids=type
)
def test_values_that_are_no_array(name, values):
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=1)
    shaker = sb.Shaker(frequency_ratio=1.0, velocity_amplitude=0.1)
    system = sb.System(model, contacts=[sb.Contact(default_values.CONTACT, shaker)])
    with pytest.raises(sb.InputError, match=rf"^{name} = "):
        sb.sweep(system, {name: values}, sb.Integration(cycles=1))


def test_two_well_limits_of_a_model_without_an_imperfection():
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=1)
    with pytest.raises(sb.InputError, match="this model has two wells"):
        _ = model.two_well_limits
    straight = sb.ReducedModel.from_beam(default_values.BEAM.replace(axial_load=0.0), modes=1)
    with pytest.raises(sb.InputError, match="this model has no imperfection"):
        _ = straight.two_well_limits


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("ratio", [1e308, 1e300, 1e-320])
def test_frequencies_whose_periods_are_not_numbers(ratio):
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=1)
    shaker = sb.Shaker(frequency_ratio=ratio, velocity_amplitude=0.1)
    system = sb.System(model, contacts=[sb.Contact(default_values.CONTACT, shaker)])
    with pytest.raises(sb.InputError, match=r"drive: a period of .* s: must be at least 1e-300 s and finite"):
        sb.simulate(system, sb.Integration(cycles=1))
    with pytest.raises(sb.InputError, match=r"a period of|must be a number"):
        sb.sweep(system, {"drive.frequency_ratio": [ratio / 2.0, ratio]}, sb.Integration(cycles=1))
