"""Parameter files that extend others, and numbers that are products with units."""

from __future__ import annotations

import itertools

import pytest
import tomli_w

import snapbeam as sb
from snapbeam.model.parameter_file import config_from_mapping, load_config
from snapbeam.util.units import number_in_unit

BEAM = {
    "length": "41 mm", "thickness": "2.6e-4", "width": 4e-3, "density": 2700.0, "young_modulus": "69 GPa", "buckling_level": 3e-4,
}  # fmt: skip
FIRST = {"beam": BEAM, "model": {"modes": 2, "damping_ratio": 0.03}}
STRUCK = {
    "contact": {"type": "hertz", "stiffness": 2e8, "location": 0.3},
    "drive": {"type": "sine", "frequency_ratio": 0.8, "velocity_amplitude": 0.2},
}


def write(folder, name, sections):
    folder.mkdir(exist_ok=True)
    (folder / name).write_text(tomli_w.dumps(sections))
    return folder / name


def test_own_values_lie_over_those_of_the_extended_file(tmp_path):
    write(tmp_path / "shared", "beam.toml", FIRST)
    write(tmp_path / "shared", "struck.toml", {"extends": "beam.toml"} | STRUCK)
    own = {"extends": "../shared/struck.toml", "beam": {"axial_load": 700.0}, "drive": {"velocity_amplitude": 0.3},
           "contact": {"type": "restitution", "coefficient": 0.6}, "model": {"modes": 1}}  # fmt: skip
    file = write(tmp_path / "mine", "system.toml", own)
    beam = {name: value for name, value in BEAM.items() if name != "buckling_level"} | {"axial_load": 700.0}
    whole = {
        "beam": beam,
        "model": {"modes": 1, "damping_ratio": 0.03},
        "contact": {"type": "restitution", "coefficient": 0.6, "location": 0.3},
        "drive": STRUCK["drive"] | {"velocity_amplitude": 0.3},
    }
    assert load_config(file).system == sb.System.load(file) == config_from_mapping(whole).system


def test_file_can_extend_one_that_extends_the_paper(tmp_path):
    write(tmp_path, "first.toml", {"extends": "paper", "model": {"modes": 2}})
    file = write(tmp_path, "second.toml", {"extends": "first.toml", "drive": {"frequency_ratio": 0.7}})
    given = {"extends": "paper", "model": {"modes": 2}, "drive": {"frequency_ratio": 0.7}}
    assert sb.System.load(file) == config_from_mapping(given).system


@pytest.mark.parametrize("count", [1, 2, 3])
def test_circles_are_refused(tmp_path, count):
    names = [f"part{i}.toml" for i in range(count)]
    for name, following in itertools.pairwise([*names, names[0]]):
        write(tmp_path, name, {"extends": following})
    with pytest.raises(sb.InputError, match=r"the files extend each other: part0\.toml"):
        sb.System.load(tmp_path / names[0])


def test_missing_files_and_other_words_are_refused(tmp_path):
    file = write(tmp_path, "mine.toml", {"extends": "none.toml"})
    with pytest.raises(sb.InputError, match=r"extends of mine.toml = .*none.toml': cannot be read"):
        sb.System.load(file)
    with pytest.raises(sb.InputError, match='must be "paper" or a parameter file'):
        config_from_mapping({"extends": "thesis"})


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("40 um * 7 mm", "m^2", 2.8e-7),
        ("9 N / 3 mm", "N/m", 3000.0),
        ("3 * 12 um", "m", 3.6e-5),
        ("-2*4", "m", -8.0),
        ("5 GPa * 2 um * 3 mm", "N", 30.0),
        ("7 m**2", "m^2", 7.0),
        ("1/2.5", "1", 0.4),
    ],
)
def test_products_have_units(text, unit, value):
    assert number_in_unit(text, unit) == pytest.approx(value, rel=1e-15)


def test_dimension_of_a_product_is_checked():
    with pytest.raises(sb.InputError, match=r"thickness = '200 um \* 30 um': .*does not fit; must be in m$"):
        config_from_mapping({"extends": "paper", "beam": {"thickness": "200 um * 30 um"}})
    thick = config_from_mapping({"extends": "paper", "beam": {"thickness": "13 * 30 um"}})
    assert thick.system.get("beam.thickness") == 3.9e-4
    assert number_in_unit("4 um / 0", "m") is None


def test_label_with_a_space_names_its_parameters_in_a_file():
    stop = {"gap": 1e-5, "label": "upper stop"}
    config = config_from_mapping(
        {"extends": "paper", "contact": stop, "sweep": {"contact.upper stop.gap": [1e-5, 2e-5]}}
    )
    assert config.system.get("contact.upper stop.gap") == 1e-5
    assert list(config.axes()) == ["contact.gap"]
