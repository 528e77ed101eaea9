"""Parameter files: what is read, what is refused and in which words, and that what is written reads back."""

from __future__ import annotations

import numpy as np
import pytest

from snapbeam.config import Config, config_from_mapping, dump_config, load_config, override, parse_axis
from snapbeam.core.validate import InputError
from snapbeam.model.paper_values import BEAM, CONTACT


def test_nothing_given_is_the_paper():
    config = Config()
    assert config.beam.build() == BEAM
    assert config.contact.build() == CONTACT
    assert config.model.modes == 32
    axes = config.map.axes()
    assert axes["frequency_ratio"].shape == (64,)
    assert axes["velocity_amplitude"][[0, -1]] == pytest.approx([0.01, 0.65])
    assert axes["location"] == pytest.approx(1.0 / 2.1)


REFUSALS = [
    ({"beam": {"lenght": 0.1}}, "[beam] lenght: unknown key; did you mean 'length'?"),
    ({"beam": {"length_mm": 161.0}}, "[beam] length_mm: unknown key; did you mean 'length'?"),
    ({"beam": {"E": 200e9}}, "[beam] E: unknown key; did you mean 'young_modulus'?"),
    ({"model": {"zeta": 0.005}}, "[model] zeta: unknown key; did you mean 'damping_ratio'?"),
    ({"model": {"qqq": 1}}, "[model] qqq: unknown key; must be one of modes, damping_ratio"),
    ({"baem": {}}, "[baem]: unknown section; did you mean 'beam'?"),
    ({"beam": 3}, "beam = 3: must be a section [beam]"),
    ({"beam": {"thickness": "0.4 mm"}}, "[beam] thickness = '0.4 mm': must be a number in m"),
    ({"beam": {"length": True}}, "[beam] length = True: must be a number in m"),
    ({"beam": {"length": float("nan")}}, "[beam] length = nan: must be a finite number in m"),
    ({"beam": {"density": float("inf")}}, "[beam] density = inf: must be a finite number in kg/m^3"),
    ({"beam": {"length": -1.0}}, "[beam] length = -1.0: must be a finite number greater than 0 m"),
    ({"beam": {"length": 161.0}}, "is it given in mm?"),
    (
        {"beam": {"thickness": 0.4}},
        "[beam] thickness = 0.4 m: must be less than length = 0.161 m; is it given in mm?",
    ),
    ({"beam": {"young_modulus": 200}}, "is it given in GPa?"),
    ({"beam": {"density": 7.8}}, "is it given in g/cm^3?"),
    ({"beam": {"buckling_level": 3e-4, "axial_load": 3.0}}, "give exactly one of the two"),
    ({"model": {"modes": 3.5}}, "[model] modes = 3.5: must be a whole number"),
    ({"model": {"modes": 0}}, "modes = 0: must be an integer in [1, 256]"),
    ({"model": {"modes": 10000}}, "modes = 10000: must be an integer in [1, 256]"),
    ({"model": {"damping_ratio": -0.1}}, "damping_ratio = -0.1: must be a number in [0, 1)"),
    ({"model": {"damping_ratio": 5.0}}, "is it given in percent?"),
    ({"contact": {"radius": 0.0025}}, "belong together; one is missing"),
    ({"contact": {"radius": 0.0025, "stiffness": 4e8}}, "not both"),
    ({"contact": {"radius": 2e-3, "young_modulus": [3.5, 200.0], "poisson_ratio": [0.3, 0.3]}}, "in GPa?"),
    ({"shaker": {"location": 1.2}}, "[shaker] location = 1.2: must be 0 to 1"),
    ({"shaker": {"side": "left"}}, "side = 'left': must be one of 'below', 'above'"),
    ({"map": {"frequency_ratio": "0.1:4"}}, "or start:stop:count, such as 0.1:4:64"),
    ({"map": {"frequency_ratio": "4:0.1:64"}}, "start must be less than stop"),
    ({"map": {"frequency_ratio": "0.1:4:many"}}, "the count 'many' must be a whole number"),
    ({"map": {"frequency_ratio": [1.0, 0.5]}}, "must be strictly increasing"),
    ({"map": {"frequency_ratio": "0:4:64"}}, "frequency_ratio = 0.0: must be a number in (0, inf)"),
    ({"map": {"velocity_amplitude": [-0.1, 0.1]}}, "velocity_amplitude = -0.1: must be a number in [0, inf)"),
    ({"map": {"location": "0.1:1:5"}}, "[map] location = 1.0: must be a number in (0, 1)"),
    ({"map": {"location": []}}, "location = []: must hold at least one point"),
    ({"map": {"location": True}}, "[map] location = True: must be a number"),
    ({"run": {"cycles": 0}}, "cycles = 0: must be an integer of at least 1"),
    ({"run": {"step": "fast"}}, "[run] step = 'fast': must be a number in s"),
    ({"run": {"step": 0.0}}, "step = 0.0: must be a finite number greater than 0 s"),
]


@pytest.mark.parametrize(("sections", "message"), REFUSALS, ids=[str(case[0]) for case in REFUSALS])
def test_refusal(sections, message):
    with pytest.raises(InputError) as refusal:
        config_from_mapping(sections, "beam.toml")
    assert message in str(refusal.value)
    assert str(refusal.value).startswith("beam.toml: ")
    assert "\n" not in str(refusal.value)


def test_every_fault_is_named():
    with pytest.raises(InputError) as refusal:
        config_from_mapping({"run": {"cycles": 1.5, "step": "fast"}, "model": {"modes": "32"}})
    assert len(str(refusal.value).splitlines()) == 3


def test_round_trip(tmp_path):
    config = config_from_mapping(
        {
            "beam": {"axial_load": 30.0, "length": 0.2},
            "model": {"modes": 8},
            "contact": {"radius": 0.005, "young_modulus": [3.5e9, 2e11], "poisson_ratio": [0.36, 0.3]},
            "map": {"frequency_ratio": "0.1:4:3", "location": [0.25, 0.5]},
            "run": {"early_decision": True},
        }
    )
    path = tmp_path / "beam.toml"
    dump_config(config, path, comment="fitted to a sweep\nof four frequencies")
    text = path.read_text()
    assert text.startswith("# fitted to a sweep\n# of four frequencies\n\n[beam]\n")
    assert "# distance between the clamps, m\nlength = 0.2\n" in text
    assert load_config(path) == config
    assert [file.name for file in tmp_path.iterdir()] == ["beam.toml"]


def test_override_replaces_what_it_contradicts():
    config = config_from_mapping({"beam": {"axial_load": 30.0, "length": 0.2}})
    changed = override(
        config, {"beam": {"buckling_level": 3e-4, "length": None}, "contact": {"stiffness": 1e8}}
    )
    beam = changed.beam.build()
    assert beam.buckling_level == 3e-4
    assert beam.length == 0.2
    assert changed.contact.build().stiffness == 1e8
    with pytest.raises(InputError, match="give exactly one"):
        override(changed, {"beam": {"buckling_level": 3e-4, "axial_load": 30.0}})


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(InputError, match="cannot be read, No such file"):
        load_config(tmp_path / "none.toml")
    bad = tmp_path / "bad.toml"
    bad.write_text("[beam]\nlength = 0.1 m\n")
    with pytest.raises(InputError, match=r"is no TOML.*line 2"):
        load_config(bad)
    with pytest.raises(InputError, match=r"must end in \.toml"):
        dump_config(Config(), tmp_path / "beam.txt")


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("0.18", 0.18),
        ("1/2.1", 1.0 / 2.1),
        (" 2 ", 2.0),
        (3, 3.0),
        ("0.1,0.2,0.5", [0.1, 0.2, 0.5]),
        ("0:1:3", [0.0, 0.5, 1.0]),
        ([0.1, 0.4], [0.1, 0.4]),
    ],
)
def test_axis_forms(text, value):
    parsed = parse_axis("location", text)
    assert isinstance(parsed, float) == isinstance(value, float)
    np.testing.assert_allclose(parsed, value, rtol=1e-15)


@pytest.mark.parametrize("text", ["", "a", "1/0", "nan", "1:2", "1:2:3:4", "0.2,0.1", "inf:1:3", None, True])
def test_axis_refusals(text):
    with pytest.raises(InputError, match="location"):
        parse_axis("location", text)
