"""Units of numbers: those of pint, exact prefixes, and what is no factor refused."""

from __future__ import annotations

import math

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model.parameter_file import config_from_mapping
from snapbeam.model.parameters import parameters
from snapbeam.util.units import conversion_factor, number_in_unit
from snapbeam.util.validation import InputError


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("12 um", "m", 12e-6),
        ("1.9µm", "m", 1.9e-6),
        ("2 mN/um", "N/m", 2000.0),
        ("0.5 g", "m/s^2", 0.5 * 9.80665),
        ("5 g", "kg", 5e-3),
        ("2.33 g/cm^3", "kg/m^3", 2330.0),
        ("3 deg", "rad", math.radians(3.0)),
        ("20kHz", "Hz", 20e3),
        ("1 MΩ", "ohm", 1e6),
        ("160 GPa", "Pa", 160e9),
        ("1/2 mm", "m", 5e-4),
        ("-9e-3 mm", "m", -9e-6),
        ("25 %", "1", 0.25),
        ("3", "m", 3.0),
        ("0.02 N m/rad", "N m/rad", 0.02),
        ("20 mN m", "N m/rad", 0.02),
    ],
)
def test_numbers_with_units(text, unit, value):
    assert number_in_unit(text, unit) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("1 rad/s", "Hz"),
        ("600 rpm", "Hz"),
        ("20 degC", "K"),
        ("3 dB", "1"),
        ("1 m", "s"),
        ("1 mm", "1"),
        ("1 __import__('os')", "m"),
    ],
)
def test_units_that_do_not_fit(text, unit):
    with pytest.raises(InputError, match="does not fit"):
        number_in_unit(text, unit)


@pytest.mark.parametrize("text", ["", "um", "1/0 m", "nan", "1e m m", "--1"])
def test_what_is_no_number(text):
    try:
        assert number_in_unit(text, "m") is None
    except InputError as error:
        assert "does not fit" in str(error)


def test_the_unit_of_every_parameter_is_known():
    """A number in a multiple of each fits."""
    for name, row in parameters().items():
        if row.quantity.kind is float and row.quantity.unit not in ("1", "b"):
            unit = row.quantity.unit
            assert conversion_factor(f"{unit} * km / m", unit) == 1000.0, name


def test_a_parameter_file_with_units_is_that_in_si():
    plain = {
        "beam": {"length": 161e-3, "width": 5e-3, "thickness": 4e-4, "density": 7800.0, "young_modulus": 2.1e11,
                 "buckling_level": 3.35e-4},
        "contact": {"stiffness": 4e8},
        "drive": {"frequency_hz": 100.0},
        "force": {"type": "local_spring", "stiffness": 2000.0, "location": 0.5},
    }  # fmt: skip
    texts = {
        "beam": {"length": "161 mm", "width": "0.5cm", "thickness": "400 um", "density": "7.8 g/cm^3",
                 "young_modulus": "210 GPa", "buckling_level": "335um"},
        "contact": {"stiffness": 4e8},
        "drive": {"frequency_hz": "0.1 kHz"},
        "force": {"type": "local_spring", "stiffness": "2 mN/um", "location": "50 %"},
    }  # fmt: skip
    one, other = (config_from_mapping({"extends": "paper"} | each, "x.toml") for each in (plain, texts))
    for section, values in one.given.items():
        for name, value in values.items():
            if isinstance(value, float):
                assert other.given[section][name] == pytest.approx(value, rel=1e-14), name
    with pytest.raises(sb.InputError, match=r"\[beam\] length = '161 ms': the unit 'ms' does not fit; must be in m"):
        config_from_mapping(plain | {"beam": plain["beam"] | {"length": "161 ms"}}, "x.toml")


@pytest.mark.parametrize(
    ("text", "value"),
    [("10 um", 1e-5), ("5. um", 5e-6), ("0.7665 um", 7.665e-7), ("1e999999999 um", np.inf), ("1e-999999999 um", 0.0)],
)
def test_the_nearest_number_whatever_the_exponent(text, value):
    """To the last digit; an exponent beyond all numbers is infinite or zero at once, as without a unit."""
    assert number_in_unit(text, "m") == value


def test_a_product_beyond_all_numbers_is_infinite():
    assert number_in_unit("1e308 GPa", "Pa") == np.inf


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [("2330 kg/m3", "kg/m^3", 2330.0), ("2.33 g/cm3", "kg/m^3", 2330.0), ("3 mm2", "m^2", 3e-6),
     ("4 km/s^2", "g", 4000.0 / 9.80665), ("9.80665 m/s2", "g", 1.0), ("50 mg", "g", 0.05)],
)  # fmt: skip
def test_a_power_without_a_sign_and_an_acceleration_where_g_is_wanted(text: str, unit: str, value: float) -> None:
    assert number_in_unit(text, unit) == pytest.approx(value, rel=1e-14)


def test_an_exponent_of_no_whole_number_is_not_split() -> None:
    with pytest.raises(InputError, match="does not fit"):
        number_in_unit("3 m/s2.5", "m/s^2")
