"""A saved system keeps the units in which its values were given, and is read back equal."""

from __future__ import annotations

import pickle

import pytest

import snapbeam as sb

FILE = """
[beam]
length = "300 mm"
thickness = "0.4 mm"
width = "2 cm * 0.5"
density = "7.85 g/cm^3"
young_modulus = "200 GPa"
buckling_level = 7e-4
[model]
modes = 2
damping_ratio = "2 %"
[[contact]]
label = "left tip"
stiffness = 1e8
location_m = "90 mm"
[contact.drive]
type = "sine"
frequency_hz = "38 Hz"
velocity_m_s = 0.12
[[contact]]
label = "stop"
stiffness = "1e8"
location = 0.6
gap = "30 um"
[contact.drive]
type = "fixed"
"""


@pytest.fixture
def system(tmp_path) -> sb.System:
    (tmp_path / "given.toml").write_text(FILE)
    return sb.System.load(tmp_path / "given.toml")


def saved(system: sb.System, folder) -> str:
    system.save(folder / "again.toml")
    assert sb.System.load(folder / "again.toml") == system
    return (folder / "again.toml").read_text()


def test_units_are_kept(system, tmp_path) -> None:
    text = saved(system, tmp_path)
    for line in (
        'length = "300 mm"', 'density = "7.85 g/cm^3"', 'location_m = "90 mm"', 'frequency_hz = "38 Hz"', "velocity_m_s = 0.12",
        'gap = "30 um"', 'width = "2 cm * 0.5"', "buckling_level = 0.0007",
    ):  # fmt: skip
        assert line in text
    assert "ratio = 0." not in text.replace('damping_ratio = "2 %"', "") and "velocity_amplitude" not in text
    again = sb.System.load(tmp_path / "again.toml")
    assert saved(pickle.loads(pickle.dumps(again)), tmp_path) == text


def test_what_is_replaced_has_no_unit_of_before(system, tmp_path) -> None:
    """A new value in SI units, a new value in Hz, and a frequency in Hz that a change of the beam makes another one."""
    text = saved(system.replace(**{"contact.stop.gap": 1e-4, "drive.frequency_hz": 41.0}), tmp_path)
    assert "gap = 0.0001" in text and "frequency_hz = 41.0" in text and 'length = "300 mm"' in text
    thicker = saved(system.replace(**{"beam.thickness": 5e-4}), tmp_path)
    assert "thickness = 0.0005" in thicker and "frequency_ratio = " in thicker and '"38 Hz"' not in thicker


def test_a_system_of_python_is_saved_as_it_is(system, tmp_path) -> None:
    made = sb.System.from_mapping(system.to_mapping())
    assert "frequency_ratio" in saved(made, tmp_path)
