"""A saved system keeps the units in which its values were given, and is read back equal."""

from __future__ import annotations

import pickle

import pytest

import snapbeam as sb
from snapbeam.model.parameter_file import config_from_mapping

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


@pytest.mark.parametrize("section", ["drive", "base_excitation"])
def test_terms_of_a_sum_in_physical_units(section: str) -> None:
    """Frequencies and amplitudes of each term: in a file, by ``replace`` and read back, as the ratios they are made into."""
    terms = {"frequency_hz_1": 70.0, "frequency_ratio_2": 1.9, "frequency_hz_3": 210.0}
    amplitudes = {"velocity_m_s_1": 0.02, "velocity_amplitude_2": 0.05, "velocity_m_s_3": 0.01}
    sums = {"type": "sine+sine+sine", **terms, **amplitudes}
    given = {"model": {"modes": 1}, section: sums} | ({"contact": {}} if section == "drive" else {})
    system = config_from_mapping({"extends": "paper", **given}).system
    first, scale = system.model.reference_frequency, system.scale
    assert system.get(f"{section}.frequency_ratio_1") == pytest.approx(70.0 / first)
    assert system.get(f"{section}.frequency_ratio_2") == 1.9
    assert system.get(f"{section}.frequency_hz_3") == pytest.approx(210.0)
    assert system.get(f"{section}.velocity_amplitude_3") == pytest.approx(0.01 / (scale.length * scale.omega))
    other = system.replace(**{f"{section}.frequency_hz_2": 3.0 * first})
    assert other.get(f"{section}.frequency_ratio_2") == pytest.approx(3.0)
    with pytest.raises(sb.InputError, match="give frequency_ratio_1 or frequency_hz_1, not both"):
        config_from_mapping({"extends": "paper", **given, section: sums | {"frequency_ratio_1": 1.0}})
