"""Parameter files: what is read, what is refused and in which words, and that what is written reads back."""

from __future__ import annotations

import numpy as np
import pytest

from snapbeam.model.default_values import BEAM, CONTACT
from snapbeam.model.integration import Integration
from snapbeam.model.parameter_axes import from_physical, parse_axis, to_physical
from snapbeam.model.parameter_file import DEFAULT_AXES, Config, config_from_mapping, dump_config, load_config, override
from snapbeam.model.parameters import PHYSICAL
from snapbeam.model.system import System
from snapbeam.sweeps.points import points_of
from snapbeam.util.validation import InputError


def test_nothing_given_is_the_paper():
    config = Config()
    system = config.system
    assert system.model.beam == BEAM
    assert system.contact_law == CONTACT
    assert system.model.modes == config.model.modes == 32
    assert system.model.damping_ratio.tolist() == [0.005] * 32
    assert system.get("contact.location") == pytest.approx(1.0 / 2.1)
    assert system.get("contact.side") == "below"
    axes = config.axes(DEFAULT_AXES)
    assert list(axes) == ["drive.frequency_ratio", "drive.velocity_amplitude"]
    assert axes["drive.frequency_ratio"].shape == (64,)
    assert axes["drive.velocity_amplitude"][[0, -1]] == pytest.approx([0.01, 0.65])
    assert config.axes() == {}
    assert config.integration == Integration()
    assert config.defaulted == ()


REFUSALS = [
    ({"beam": {"lenght": 0.1}}, "[beam] lenght: unknown key; did you mean 'length'?"),
    ({"beam": {"length_mm": 161.0}}, "[beam] length_mm: unknown key; did you mean 'length'?"),
    ({"beam": {"E": 200e9}}, "[beam] E: unknown key; did you mean 'young_modulus'?"),
    ({"model": {"zeta": 0.005}}, "[model] zeta: unknown key; did you mean 'damping_ratio'?"),
    ({"model": {"qqq": 1}}, "[model] qqq: unknown key; must be one of modes, damping_ratio"),
    ({"baem": {}}, "[baem]: unknown section; did you mean 'beam'?"),
    ({"beam": 3}, "beam = 3: must be a section [beam]"),
    ({"beam": {"thickness": "0.4 ms"}}, "[beam] thickness = '0.4 ms': the unit 'ms' does not fit; must be in m"),
    ({"beam": {"length": True}}, "[beam] length = True: must be a number in m"),
    ({"beam": {"length": float("nan")}}, "[beam] length = nan: must be a finite number in m"),
    ({"beam": {"density": float("inf")}}, "[beam] density = inf: must be a finite number in kg/m^3"),
    ({"beam": {"length": -1.0}}, "[beam] length = -1.0: must be a finite number greater than 0 m"),
    ({"beam": {"length": 161.0}}, "is it given in mm?"),
    ({"beam": {"thickness": 0.4}}, "[beam] thickness = 0.4 m: must be less than length = 0.161 m; is it given in mm?"),
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
    ({"contact": {"location": 1.2}}, "[contact] location = 1.2: must be a number in (0, 1)"),
    ({"contact": {"side": "left"}}, "side = 'left': must be one of 'below', 'above'"),
    ({"sweep": {"frequency_ratio": "0.1:4"}}, "or start:stop:count, such as 0.1:4:64"),
    ({"sweep": {"frequency_ratio": "4:0.1:64"}}, "start must be less than stop"),
    ({"sweep": {"frequency_ratio": "0.1:4:many"}}, "the count 'many' must be a whole number"),
    ({"sweep": {"frequency_ratio": [1.0, 0.5]}}, "must be strictly increasing"),
    ({"sweep": {"frequency_ratio": "0:4:64"}}, "[sweep] frequency_ratio = 0.0: must be a finite number greater than 0"),
    (
        {"sweep": {"velocity_amplitude": [-0.1, 0.1]}},
        "[sweep] velocity_amplitude = -0.1: must be a finite number of at least 0",
    ),
    ({"sweep": {"location": "0.1:1:5"}}, "[sweep] location = 1.0: must be a number in (0, 1)"),
    ({"sweep": {"location": []}}, "location = []: must hold at least one point"),
    ({"sweep": {"location": True}}, "[sweep] location = True: must be a number"),
    ({"integration": {"cycles": 0}}, "[integration] cycles = 0: must be an integer in [1, 10000000]"),
    ({"map": {"frequency_ratio": "0.1:4:64"}}, "[map]: unknown section"),
    ({"integration": {"reference_frequency": 80.0}}, "[integration] reference_frequency: unknown key"),
    ({"integration": {"step": "fast"}}, "[integration] step = 'fast': must be a number in s"),
    ({"integration": {"step": 0.0}}, "step = 0.0: must be a finite number greater than 0 s"),
    ({"integration": {"tolerance": 1e-3, "step": 1e-5}}, "[integration] tolerance = 0.001 with step = 1e-05"),
    ({"integration": {"engine": "gpu"}}, "[integration] engine = 'gpu': must be one of 'auto', 'native', 'python'"),
    ({"integration": {"early_termination": 1}}, "[integration] early_termination = 1: must be True or False"),
    ({"model": {"damping_ratio": [0.1, 0.2]}}, "[model] damping_ratio of shape (2,): must have the shape (32,)"),
    ({"beam": {"buckling_level": 0.0}}, "[beam] buckling_level = 0.0: must be a finite number greater than 0 m"),
    (
        {"contact": {"type": "spring"}},
        "[contact] type = 'spring': must be one of 'elastic_plastic', 'hertz', 'hunt_crossley'",
    ),
    ({"contact": {"type": "restitution"}}, "[contact] coefficient: missing for type = 'restitution'"),
    (
        {"contact": {"coefficient": 0.5, "stiffness": 1e8}},
        "[contact] give stiffness, of Hertz's law, or coefficient, of Newton's, not both",
    ),
    ({"drive": {"type": "triangle"}}, "[drive] type = 'triangle': must be one of 'burst', 'chirp'"),
    (
        {"drive": {"type": "recorded_motion"}},
        "[drive] displacement, velocity, sampling_frequency, frequency: missing for type = 'recorded_motion'",
    ),
    (
        {"drive": {"frequency_hz": -100.0}},
        "[drive] frequency_hz = -100 Hz: is frequency_ratio = -1.2217, which must be a finite number greater than 0",
    ),
    (
        {"drive": {"frequency_hz": "100 rad/s"}},
        "[drive] frequency_hz = '100 rad/s': the unit 'rad/s' does not fit; must be in Hz",
    ),
    ({"drive": {"velocity_m_s": -1.0}}, "[drive] velocity_m_s = -1 m/s: is velocity_amplitude = -5.80416, which must"),
    (
        {"drive": {"frequency_hz": 100.0, "frequency_ratio": 1.0}},
        "[drive] give frequency_ratio or frequency_hz, not both",
    ),
    (
        {"contact": {"location_m": 0.2}},
        "[contact] location_m = 0.2 m: is location = 1.24224, which must be a number in (0, 1)",
    ),
    ({"contact": {"location_m": 0.05, "location": 0.3}}, "[contact] give location or location_m, not both"),
    ({"contact": {"gap": "1 mm^2"}}, "[contact] gap = '1 mm^2': the unit 'mm^2' does not fit; must be in m"),
    ({"shaker": {"frequency_ratio": 1.0}, "drive": {"frequency_ratio": 2.0}}, "[shaker]: unknown section"),
    ({"initial_state": {"amplitude[1]": "much"}}, "[initial_state] amplitude[1] = 'much': must be a number"),
    (
        {"initial_state": {"amplitude[0]": 1.0}},
        "[initial_state] amplitude[0]: unknown key; must be initial_well, amplitude[i], velocity[i]",
    ),
    (
        {"initial_state": {"amplitude[40]": 1.0}},
        "initial_state.amplitude[40]: mode = 40: must be an integer in [1, 32]",
    ),
    (
        {"sweep": {"beam.thicknes": "1e-4:2e-4:3"}},
        "[sweep] beam.thicknes: is not a parameter; did you mean 'beam.thickness'",
    ),
    (
        {"sweep": {"beam.thickness": "0.4:0.5:3"}},
        "[sweep] thickness = 0.5 m: must be less than length = 0.161 m; is it given in mm?",
    ),
    (
        {"sweep": {"beam.density": "7.5:8:3"}},
        "[sweep] density = 7.5: must be 10 to 30000 kg/m^3; is it given in g/cm^3?",
    ),
    ({"sweep": {"modes": "1,x"}}, "[sweep] modes = '1,x': must be a whole number, whole numbers separated by commas"),
    ({"sweep": {"model.modes": "1:32:3"}}, "[sweep] modes = 16.5: must be an integer in [1, 256]"),
    ({"sweep": {"contact.side": "below,left"}}, "[sweep] side = 'left': must be one of 'below', 'above'"),
    (
        {"sweep": {"velocity_m_s": "-0.1:0.2:4"}},
        "[sweep] drive.velocity_m_s = -0.1 m/s: is velocity_amplitude = -0.580416, which must",
    ),
    (
        {"sweep": {"frequency_ratio": "0.1:2:3", "frequency_hz": "10:200:3"}},
        "[sweep] frequency_hz: the same axis is given as drive.frequency_ratio",
    ),
]


@pytest.mark.parametrize(("sections", "message"), REFUSALS, ids=[str(case[0]) for case in REFUSALS])
def test_refusal(sections, message):
    with pytest.raises(InputError) as refusal:
        config_from_mapping({"extends": "paper"} | sections, "beam.toml")
    assert message in str(refusal.value)
    assert str(refusal.value).startswith("beam.toml: ")
    assert "\n" not in str(refusal.value)


def test_every_fault_is_named():
    with pytest.raises(InputError) as refusal:
        config_from_mapping({"integration": {"cycles": 1.5, "step": "fast"}, "model": {"modes": "32"}})
    assert len(str(refusal.value).splitlines()) == 3


OWN = (
    "[beam]\nlength = 0.1\nwidth = 0.01\nthickness = 3e-4\ndensity = 7850\nyoung_modulus = 2e11\n"
    "buckling_level = 5e-4\n[model]\nmodes = 2\ndamping_ratio = 0.01\n[contact]\nstiffness = 1e8\n"
    "location = 0.4\n[drive]\nfrequency_hz = 20\nvelocity_amplitude = 0.1\n"
)


def test_round_trip(tmp_path):
    config = config_from_mapping(
        {
            "extends": "paper",
            "beam": {"axial_load": 30.0, "length": 0.2},
            "model": {"modes": 8},
            "contact": {"radius": 0.005, "young_modulus": [3.5e9, 2e11], "poisson_ratio": [0.36, 0.3]},
            "sweep": {"frequency_ratio": "0.1:4:3", "location": [0.25, 0.5]},
            "integration": {"early_termination": True},
        }
    )
    path = tmp_path / "beam.toml"
    dump_config(config, path, comment="fitted to a sweep\nof four frequencies")
    text = path.read_text(encoding="utf-8")
    start = "# fitted to a sweep\n# of four frequencies\n# what this file leaves out is as in the paper\n"
    assert text.startswith(start + 'extends = "paper"\n\n[beam]\n')
    assert "# distance between the clamps, m\nlength = 0.2\n" in text
    assert load_config(path) == config
    assert [file.name for file in tmp_path.iterdir()] == ["beam.toml"]


def test_override_replaces_what_it_contradicts():
    config = config_from_mapping({"extends": "paper", "beam": {"axial_load": 30.0, "length": 0.2}})
    changed = override(config, {"beam": {"buckling_level": 3e-4, "length": None}, "contact": {"stiffness": 1e8}})
    beam = changed.system.model.beam
    assert beam.buckling_level == 3e-4
    assert beam.length == 0.2
    assert changed.system.contact_law.stiffness == 1e8
    with pytest.raises(InputError, match="give exactly one"):
        override(changed, {"beam": {"buckling_level": 3e-4, "axial_load": 30.0}})


def test_an_option_takes_a_contradicting_value_or_axis_away():
    """Given in a file, overridden on a command line: never both, and never the file's in silence."""
    config = config_from_mapping(
        {
            "extends": "paper",
            "sweep": {"frequency_ratio": "0.1:2:3", "modes": [1, 2]},
            "drive": {"velocity_m_s": 0.05},
            "contact": {"stiffness": 1e8, "location_m": 0.05},
            "model": {"reference_frequency": 80.0},
        }
    )

    def after(sections):
        return override(config, sections).to_mapping()

    assert after({"drive": {"velocity_amplitude": 0.3}})["drive"] == {"velocity_amplitude": 0.3}
    assert after({"contact": {"location": 0.3}})["contact"] == {"stiffness": 1e8, "location": 0.3}
    assert after({"model": {"modes": 3}})["sweep"] == {"drive.frequency_ratio": "0.1:2:3"}
    for value in ({"frequency_ratio": 1.2}, {"frequency_hz": 99.0}):
        changed = after({"drive": value})
        assert changed["sweep"] == {"model.modes": [1, 2]}
        assert value.items() <= changed["drive"].items()
    assert after({"sweep": {"frequency_hz": "50:100:3"}})["sweep"] == {
        "model.modes": [1, 2],
        "drive.frequency_hz": "50:100:3",
    }
    assert after({"contact": {"coefficient": 0.3}, "model": {"modes": 1}})["contact"] == {
        "coefficient": 0.3,
        "location_m": 0.05,
    }


def test_an_axis_gives_a_required_parameter():
    """A load resistance and a base frequency that only an axis gives, and a drive whose length only an axis gives."""
    base = {"type": "acceleration_sine", "acceleration_amplitude": 0.5}
    patch = {"type": "piezo", "moment_per_volt": 1e-5, "capacitance": 2e-8}
    axes = {"harvester.resistance": [1e3, 1e6], "base_excitation.frequency_ratio": "0.2:0.5:4"}
    paper = {"extends": "paper"}
    config = config_from_mapping(paper | {"base_excitation": base, "harvester": patch, "sweep": axes})
    assert config.system.get("harvester.resistance") == 1e3
    assert config.system.get("base_excitation.frequency_ratio") == 0.2
    assert config.axes()["harvester.resistance"].tolist() == [1e3, 1e6]
    assert config_from_mapping(config.whole().to_mapping()).system == config.system
    burst = {"type": "burst", "frequency_ratio": 1.2, "velocity_amplitude": 0.2}
    config = config_from_mapping(paper | {"drive": burst, "sweep": {"drive.duration_cycles": [10.0, 20.0]}})
    assert config.system.get("drive.duration_cycles") == 10.0
    with pytest.raises(InputError, match="resistance: missing"):
        config_from_mapping(paper | {"base_excitation": base | {"frequency_ratio": 1.0}, "harvester": patch})


def test_one_file_for_every_command(tmp_path):
    """Sections that only other commands read are left to them; a misspelt section is still refused."""
    path = tmp_path / "switch.toml"
    text = "extends = 'paper'\n[model]\nmodes = 2\n[uncertainty.of.'beam.thickness']\nuniform = 0.05\n[probability]\nruns = 8\n[design]\nx = 1\n"
    path.write_text(text)
    assert load_config(path).to_mapping() == {"model": {"modes": 2}}
    path.write_text(text.replace("[design]", "[desing]"))
    with pytest.raises(InputError, match=r"\[desing\]: unknown section"):
        load_config(path)


def test_any_command_reads_the_file_of_another(tmp_path):
    """System.load converts units and leaves out runs, axes and questions; an unknown section gets a suggestion."""
    path = tmp_path / "own.toml"
    path.write_text(OWN + "[sweep]\nlocation = [0.3, 0.4]\n[integration]\ncycles = 3\n[probability]\nruns = 8\n")
    system = System.load(path)
    assert system == load_config(path).system
    assert system.get("drive.frequency_ratio") == pytest.approx(20.0 / system.model.reference_frequency)
    system.save(tmp_path / "saved.toml")
    assert System.load(tmp_path / "saved.toml") == system
    path.write_text(OWN + "[integraton]\ncycles = 3\n")
    with pytest.raises(InputError, match=r"own.toml: \[integraton\]: unknown section; did you mean 'integration'"):
        System.load(path)


def test_nothing_of_the_paper_is_added_unasked(tmp_path):
    """A file of another beam is complete, or says that the paper completes it; one without a system is the paper's."""
    path = tmp_path / "own.toml"
    path.write_text(OWN)
    assert load_config(path).system.model.beam.length == 0.1
    for line, words in (("density = 7850\n", "density"), ("damping_ratio = 0.01\n", "damping_ratio"),
                        ("stiffness = 1e8\n", "stiffness")):  # fmt: skip
        path.write_text(OWN.replace(line, ""))
        with pytest.raises(InputError, match=rf"{words}: missing; .*extends = \"paper\""):
            load_config(path)
        path.write_text('extends = "paper"\n' + OWN.replace(line, ""))
        assert load_config(path).system.model.beam.length == 0.1
    beam = OWN.partition("[contact]")[0]
    path.write_text(beam)
    assert load_config(path).system.striker is None
    path.write_text(beam.replace("damping_ratio = 0.01\n", ""))
    assert load_config(path).model.beam.length == 0.1  # statics need no damping
    path.write_text("[integration]\ncycles = 3\n")
    assert load_config(path).system == Config().system
    path.write_text('extends = "mine"\n' + OWN)
    with pytest.raises(InputError, match="extends = 'mine': must be"):
        load_config(path)


def test_physical_units_are_ratios_of_the_system():
    """100 Hz and 31 mm/s at 40 mm from the clamp, given as values and as axes."""
    config = config_from_mapping(
        {"extends": "paper", "drive": {"frequency_hz": 100.0, "velocity_m_s": 0.031}, "contact": {"location_m": 0.04}}
    )
    system = config.system
    freq, level = system.model.reference_frequency, BEAM.buckling_level
    assert system.get("drive.frequency_ratio") == pytest.approx(100.0 / freq, rel=1e-14)
    assert system.get("drive.velocity_amplitude") == pytest.approx(0.031 / (2.0 * np.pi * freq * level), rel=1e-14)
    assert system.get("contact.location") == pytest.approx(0.04 / 0.161, rel=1e-14)
    given = config_from_mapping(
        {"sweep": {"frequency_hz": "50:100:3", "velocity_m_s": [0.01, 0.03], "location_m": "0.02:0.08:4"}}
    )
    assert list(given.axes()) == ["drive.frequency_hz", "drive.velocity_m_s", "contact.location_m"]
    axes = points_of(given.axes(), given.system).axes
    assert list(axes) == ["drive.frequency_ratio", "drive.velocity_amplitude", "contact.location"]
    np.testing.assert_allclose(axes["drive.frequency_ratio"] * freq, [50.0, 75.0, 100.0], rtol=1e-14)
    np.testing.assert_allclose(axes["contact.location"] * 0.161, [0.02, 0.04, 0.06, 0.08], rtol=1e-14)
    for name in PHYSICAL:
        assert [row.parameter for row in PHYSICAL.values()].count(PHYSICAL[name].parameter) == 1
        np.testing.assert_allclose(
            to_physical(system, name, from_physical(system, name, [0.1, 2.0])), [0.1, 2.0], rtol=1e-14
        )
    # the frequency that is normalised by is given, so that no number of modes changes it
    fixed = config_from_mapping(
        {
            "extends": "paper",
            "sweep": {"modes": [1, 8]},
            "drive": {"frequency_hz": 100.0},
            "model": {"reference_frequency": 80.0},
        }
    )
    assert fixed.system.get("drive.frequency_ratio") == 1.25


def test_a_base_in_hz_and_g():
    """35 Hz and 0.3 g of a base, and an axis in Hz that alone gives its frequency."""
    base = {"type": "acceleration_sine", "frequency_hz": 35.0, "amplitude_g": 0.3}
    config = config_from_mapping({"extends": "paper", "base_excitation": base})
    system = config.system
    motion, freq = system.base_excitation.motion, system.model.reference_frequency
    assert motion.frequency_ratio * freq == pytest.approx(35.0, rel=1e-14)
    peak = motion.acceleration_amplitude * BEAM.buckling_level * (2.0 * np.pi * freq) ** 2
    assert peak == pytest.approx(0.3 * 9.80665, rel=1e-14)
    del base["frequency_hz"]
    for extends in ({"extends": "paper"}, _given("beam", "model")):
        config = config_from_mapping(
            extends | {"base_excitation": base, "sweep": {"base_excitation.frequency_hz": [30.0, 40.0]}}
        )
        axes = points_of(config.axes(), config.system).axes
        hertz = axes["base_excitation.frequency_ratio"] * config.system.model.reference_frequency
        np.testing.assert_allclose(hertz, [30.0, 40.0], rtol=1e-14)
    both = {"type": "acceleration_sine", "frequency_hz": 35.0, "frequency_ratio": 0.4, "amplitude_g": 0.3}
    with pytest.raises(InputError, match="give frequency_ratio or frequency_hz, not both"):
        config_from_mapping({"extends": "paper", "base_excitation": both})


def _given(*sections):
    import tomllib

    return {name: tomllib.loads(OWN)[name] for name in sections}


def test_a_start_by_name():
    config = config_from_mapping(
        {
            "extends": "paper",
            "model": {"modes": 3},
            "initial_state": {"amplitude[1]": -1.0, "velocity[2]": 0.1, "striker_position": 1e-3},
        }
    )
    model, start = config.system.model, config.system.initial_state
    np.testing.assert_allclose(start.amplitude, model.well_amplitude, rtol=1e-15)
    well = abs(model.well_amplitude[0])
    np.testing.assert_allclose(start.velocity, [0.0, 0.1 * well * model.omega[0], 0.0], rtol=1e-12)
    assert float(start.striker_position) == 1e-3


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(InputError, match="cannot be read, No such file"):
        load_config(tmp_path / "none.toml")
    bad = tmp_path / "bad.toml"
    bad.write_text("[beam]\nlength = 0.1 m\n", encoding="utf-8")
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
