"""Every unit in every result is one that UDUNITS knows; two powers that are none are named here."""

from __future__ import annotations

import re

import numpy as np
import pytest
import xarray as xr

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.model.parameters import PHYSICAL, parameters
from snapbeam.simulation.dataset import SCHEMA
from snapbeam.solver.statistics import STATISTICS

SYMBOLS = {"s", "m", "kg", "N", "Pa", "J", "W", "Hz", "rad", "K", "A", "V", "F", "H", "ohm", "g"}
PREFIXES = {"", "k", "M", "G", "m", "u", "n"}
BROKEN_POWERS = {"m^0.5", "m^0.5/s", "N/m^1.5"}
"""Of modal amplitudes, their velocities and Hertz's stiffness: UDUNITS has no broken powers."""
_FACTOR = re.compile(r"([A-Za-z]+)(\^-?\d+|-?\d+)?")


def is_unit(text: str) -> bool:
    """Whether *text* is a product of symbols with whole powers, divided by such ones, or the number 1."""
    if text == "1":
        return True
    parts = text.split("/")
    for part in parts:
        factors = re.split(r"[ .*]", part)
        for factor in factors:
            if factor == "1" and part is parts[0] and len(factors) == 1:
                continue
            found = _FACTOR.fullmatch(factor)
            if found is None:
                return False
            name = found[1]
            if not any(name == prefix + symbol for prefix in PREFIXES for symbol in SYMBOLS):
                return False
    return True


@pytest.mark.parametrize(
    "text", ["1", "s", "m/s", "m/s^2", "kg/m^3", "N s", "N.s", "1/s", "mm", "Hz", "m2", "J", "um/s"]
)
def test_parser_takes(text: str) -> None:
    assert is_unit(text)


@pytest.mark.parametrize("text", ["", "b", "b omega_1", "m^0.5", "m//s", "%", "cycles", "/s", "m^", "N/m^1.5", "m s/"])
def test_parser_refuses(text: str) -> None:
    assert not is_unit(text)


def check(dataset: xr.Dataset) -> int:
    """Every variable says a unit, and it is one."""
    for name, variable in dataset.variables.items():
        units = variable.attrs.get("units")
        assert units is not None, name
        assert is_unit(units) or units in BROKEN_POWERS, (name, units)
        assert variable.attrs.get("long_name"), name
    return len(dataset.variables)


SYSTEM = sb.System(
    sb.ReducedModel.from_beam(default_values.BEAM, modes=2),
    contacts=[sb.Contact(default_values.CONTACT, sb.Shaker(frequency_ratio=1.21, velocity_amplitude=0.18))],
)
ASKED = sb.Integration(cycles=2)


OF_OTHERS = {
    "local_force_work",
    "valid", "energy_striker", "energy_lost_contact", "base_displacement", "base_velocity", "base_work", "external_force",
    "force_work", "load_change",
    "load_work", "voltage", "power_load", "energy_harvested", "energy_circuit", "harvester", "voltages", "striker", "striker_displacements",
    "striker_penetrations", "striker_forces", "force", "external_forces",
}  # fmt: skip
"""What runs have with dropouts, strikers with a mass or several, contacts with loss, bases, loads, forces, harvesters only."""


def test_runs(tmp_path) -> None:
    run = sb.simulate(SYSTEM, ASKED)
    assert check(run.dataset) == len(SCHEMA) - len(OF_OTHERS)
    assert check(run.impacts) == 5
    run.save(tmp_path / "run.nc")
    assert check(xr.load_dataset(tmp_path / "run.nc", engine="h5netcdf", group="summary")) == len(STATISTICS)
    check(sb.perturbation_growth(SYSTEM, sb.Integration(cycles=1)))


@pytest.mark.slow
def test_a_run_of_several_strikers(tmp_path) -> None:
    """What is told of each striker has units too, as it stands and as it comes back from the file."""
    stop = sb.Striker(drive=sb.FixedStop(), location=0.3, side="above", gap=2e-5)
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=3)
    run = sb.simulate(
        sb.System(
            model,
            contacts=[sb.Contact(default_values.CONTACT, SYSTEM.striker), sb.Contact(default_values.CONTACT, stop)],
        ),
        ASKED,
    )
    told = {"striker", "striker_displacements", "striker_penetrations", "striker_forces"}
    assert told <= set(run.dataset.variables)
    assert check(run.dataset) == len(SCHEMA) - len(OF_OTHERS - told)
    run.save(tmp_path / "run.nc")
    check(xr.load_dataset(tmp_path / "run.nc", engine="h5netcdf"))


AXES = {
    "structure and run": {"beam.buckling_level": [3e-4, 3.5e-4], "frequency_ratio": [1.0, 1.2]},
    "contact": {"contact.stiffness": [1e8, 4e8], "contact.gap": [0.0, 1e-5]},
    "initial_state": {"initial_state.amplitude[1]": [-1.0, 1.0], "initial_state.striker_position": [-4e-4, -3.5e-4]},
    "words": {"contact.side": ["below", "above"], "integration.cycles": [2, 3]},
}


@pytest.mark.parametrize("name", AXES)
def test_maps(name: str, tmp_path) -> None:
    check(sb.sweep(SYSTEM, AXES[name], ASKED))
    stored = sb.sweep(
        SYSTEM, AXES[name], ASKED, checkpoint=tmp_path / "store", output=tmp_path / "map.nc", replicates=1
    )
    assert check(stored) > len(STATISTICS)


def test_lists_and_thresholds() -> None:
    points = xr.Dataset({"beam_thickness": ("point", [4e-4, 4.1e-4]), "location": ("point", [0.4, 0.5])})
    check(sb.sweep(SYSTEM, points, ASKED))
    check(sb.threshold(SYSTEM, "velocity_amplitude", np.linspace(0.1, 0.6, 6), {"location": [0.4, 0.5]}, ASKED))
    check(sb.sweep(SYSTEM, {"frequency_ratio": [1.0, 1.1, 1.3]}, ASKED, refine_levels=1))


def test_tables() -> None:
    for table in (
        {name: row.quantity.unit for name, row in parameters().items()},
        {name: row.unit for name, row in STATISTICS.items()},
        {name: row.unit for name, row in SCHEMA.items()},
        {name: row.unit for name, row in PHYSICAL.items()},
    ):
        for name, unit in table.items():
            assert is_unit(unit) or unit in BROKEN_POWERS, (name, unit)
