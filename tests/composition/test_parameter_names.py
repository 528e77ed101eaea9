"""Every name and unit of a parameter that one tool accepts, through all others."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import snapbeam as sb
from snapbeam.cli.app import app
from snapbeam.model.parameter_file import Config, config_from_mapping
from snapbeam.model.parameters import PHYSICAL, lookup, physical_names, ratio_of
from snapbeam.model.quantity import split_name
from snapbeam.sweeps.points import points_of
from snapbeam.uncertainty.monte_carlo import trials_of
from snapbeam.uncertainty.optimization import Objective, problem_of

BEAM = {
    "length": 0.3, "thickness": 0.4e-3, "width": 0.02, "density": 7850.0, "young_modulus": 2e11, "buckling_level": 0.5e-3,
}  # fmt: skip
MODEL = {"modes": 1, "damping_ratio": 0.05}
CONTACT = {"stiffness": 1e8, "location": 0.45}
SINE = {"type": "sine", "frequency_ratio": 1.2, "velocity_amplitude": 0.1}
BASE = {"type": "acceleration_sine", "frequency_hz": 35.0, "amplitude_g": 0.4}
SYSTEMS = {
    "striker": {"contact": CONTACT, "drive": SINE},
    "two strikers": {
        "contact": [
            CONTACT | {"drive": SINE},
            CONTACT | {"side": "above", "location": 0.55, "drive": SINE | {"frequency_ratio": 0.8}},
        ]
    },
    "base and circuit": {
        "base_excitation": BASE,
        "harvester": {
            "type": "piezo", "moment_per_volt": -1e-4, "capacitance": 7e-7, "resistance": 1e4, "patch_end": 0.25,
        },
    },
    "chirp": {"contact": CONTACT, "drive": {
        "type": "chirp", "start_ratio": 0.5, "stop_ratio": 2.0, "velocity_amplitude": 0.1, "sweep_cycles": 20.0}},
    "shock and spring": {
        "base_excitation": {"type": "shock", "acceleration_g": 20.0, "duration_ms": 5.0},
        "force": {"type": "local_spring", "stiffness": 5.0, "location": 0.4},
    },
    "force and load": {
        "force": {"type": "harmonic_force", "frequency_ratio": 0.9, "amplitude": 0.01, "location": 0.5},
        "axial_load": {"type": "harmonic_force", "frequency_ratio": 1.9, "amplitude": 1.0},
    },
}  # fmt: skip


def config_of(name: str) -> Config:
    return config_from_mapping({"beam": BEAM, "model": MODEL, **SYSTEMS[name]})


def numbers_of(system: sb.System) -> list[str]:
    """The real numbers of a system, in their physical units too."""
    own = [name for name, value in system.parameters.items() if isinstance(value, float)]
    return [*own, *physical_names(own)]


@pytest.mark.parametrize("name", SYSTEMS)
def test_every_tool_finds_every_number(name: str) -> None:
    """By dotted name, by the name in datasets and by a last part that is unique: one row, one value, one axis."""
    config = config_of(name)
    system = config.system
    names = numbers_of(system)
    tails = [split_name(full)[1] for full in names]
    assert len(names) > 8
    for full in names:
        row, value = lookup(full), system.get(full)
        spellings = {full, row.short} | ({split_name(full)[1]} if tails.count(split_name(full)[1]) == 1 else set())
        for spelling in spellings:
            assert system.parameter(spelling).name == full, spelling
            assert system.get(spelling) == value, spelling
            if not full.startswith("initial_state"):
                assert config.full_name(spelling) == full, spelling
        same = system.replace(**{full: value})
        assert same.get(ratio_of(full)) == pytest.approx(system.get(ratio_of(full)), rel=1e-13)
        if value > 0.0:
            grid = points_of({full: [0.9 * value, value]}, system)
            assert grid.take(np.array([1]))[grid.names[0]] == pytest.approx(
                system.get(ratio_of(full)) if full not in grid.names else value, rel=1e-13
            )


@pytest.mark.sampled(3)
@pytest.mark.parametrize("name", SYSTEMS)
def test_every_number_can_be_uncertain_and_chosen(name: str) -> None:
    """Samples in Hz, g and m are those of the ratio; a design has each as a variable."""
    system = config_of(name).system
    for full in numbers_of(system):
        value = system.get(full)
        if value <= 0.0 or full.startswith("initial_state"):
            continue
        uncertainty = sb.uncertainty.ParameterUncertainty(of={full: sb.uncertainty.Normal(0.01, relative=True)})
        trials = trials_of(system, uncertainty, sb.Integration(cycles=3))
        columns = trials.columns({}, np.arange(64))
        drawn = columns[ratio_of(full)] / system.get(ratio_of(full))
        assert not columns.keys() & PHYSICAL.keys()
        assert 0.001 < drawn.std() < 0.02 and abs(drawn.mean() - 1.0) < 0.01, full
        problem = problem_of(trials, {full: (0.9 * value, value)}, [Objective(quantity="snap")], [], 8, 20)
        assert list(problem.bounds) == [full]


def text_of(config: dict) -> str:
    lines = []
    for section, values in config.items():
        lines.append(f"[{section}]")
        lines += [f"{key} = {value!r}".replace("'", '"') for key, value in values.items()]
    return "\n".join(lines)


@pytest.fixture
def harvester(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    file = tmp_path / "harvester.toml"
    whole = {"beam": BEAM, "model": MODEL, **SYSTEMS["base and circuit"], "integration": {"cycles": 5}}
    file.write_text(text_of(whole), encoding="utf-8")
    return file


COMMANDS = {
    "simulate": "simulate --set {name}={value}",
    "map": "map --sweep {name}={axis} -o out.nc",
    "threshold": "threshold --parameter {name} --values {axis} -o out.nc",
    "hysteresis": "dynamics hysteresis --parameter {name} --values {axis} -o out.nc",
    "bifurcation": "dynamics bifurcation-diagram --parameter {name} --values {axis} --periods 2 --transient 2 -o out.nc",
    "exponents": "dynamics lyapunov-spectrum --sweep {name}={axis} --periods 20 --transient 2 -o out.nc",
}


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize(
    ("names", "value", "axis"),
    [
        (("base_excitation.frequency_hz", "frequency_hz"), "35Hz", "30:35:2"),
        (("base_excitation.amplitude_g", "amplitude_g"), "0.4", "0.3:0.4:2"),
        (("harvester.resistance", "resistance"), "10kohm", "1kohm:10kohm:2:log"),
    ],
)
def test_every_command_takes_names_and_units(command, names, value, axis, harvester) -> None:
    for name in names:
        line = COMMANDS[command].format(name=name, value=value, axis=axis)
        words = line.split()
        at = 2 if words[0] == "dynamics" else 1
        result = CliRunner().invoke(app, [*words[:at], "--config", str(harvester), *words[at:]])
        assert result.exit_code == 0, f"{line}\n{result.output}"


def test_an_option_of_the_striker_is_that_of_the_base_without_one(harvester) -> None:
    """--frequency-hz of a shaken beam is the frequency of its base; an amplitude that it does not have is refused."""
    result = CliRunner().invoke(app, ["simulate", "--config", str(harvester), "--frequency-hz", "40", "--print-config"])
    assert result.exit_code == 0, result.output
    wanted = config_of("base and circuit").system.replace(**{"base_excitation.frequency_hz": 40.0})
    (harvester.parent / "printed.toml").write_text(result.output, encoding="utf-8")
    assert sb.System.load(harvester.parent / "printed.toml").get("base_excitation.frequency_hz") == (
        pytest.approx(wanted.get("base_excitation.frequency_hz"), rel=1e-12)
    )
    refused = CliRunner().invoke(app, ["simulate", "--config", str(harvester), "--velocity-amplitude", "0.1"])
    assert refused.exit_code == 2 and "there is no striker to drive" in refused.output


@pytest.mark.slow
def test_an_axis_keeps_its_unit(harvester) -> None:
    """In the dataset beside the ratio, exactly as it was given."""
    system = sb.System.load(harvester)
    hertz = [20.0, 33.3, 40.1]
    found = sb.sweep(system, {"frequency_hz": hertz}, sb.Integration(cycles=2))
    name = "base_excitation_frequency_hz"
    assert found[name].values.tolist() == hertz and found[name].attrs["units"] == "Hz"
    assert found[name].dims == ("base_excitation_frequency_ratio",)
    ratio = found["base_excitation_frequency_ratio"].values * system.model.reference_frequency
    np.testing.assert_allclose(ratio, hertz, rtol=1e-14)
    drawn = sb.plot.plot_statistic(found, "peak_midspan_displacement")
    assert "Hz" in drawn.get_xlabel()


def test_seeds_are_replicas() -> None:
    """An uncertain seed is another record for each sample."""
    base = {"type": "random_vibration", "psd": [[10.0, 0.01], [100.0, 0.01]], "duration_s": 0.2, "seed": 1}
    system = config_from_mapping({"beam": BEAM, "model": MODEL, "base_excitation": base}).system
    seeds = {"base_excitation.seed": sb.uncertainty.UniformRange(0, 1000)}
    uncertainty = sb.uncertainty.ParameterUncertainty(of=seeds)
    trials = trials_of(system, uncertainty, sb.Integration(cycles=2))
    drawn = trials.columns({}, np.arange(20))["base_excitation.seed"]
    assert drawn.dtype == np.int64 and len(set(drawn.tolist())) > 15 and 0 <= drawn.min() and drawn.max() < 1000
    with pytest.raises(sb.InputError, match="UniformRange"):
        sb.uncertainty.ParameterUncertainty(of={"base_excitation.seed": sb.uncertainty.Normal(1.0)})


@pytest.mark.slow
def test_a_sweep_in_hz_states_no_single_frequency(harvester) -> None:
    """The file of values swept up and down has the axis, not the ratio of one run among its fixed parameters."""
    system = sb.System.load(harvester)
    found = sb.dynamics.hysteresis(system, "frequency_hz", [30.0, 35.0], sb.Integration(cycles=3))
    assert found["base_excitation_frequency_hz"].values.tolist() == [30.0, 35.0]
    assert "base_excitation_frequency_ratio" not in found.attrs
    assert "base_excitation_acceleration_amplitude" in found.attrs


@pytest.mark.parametrize("name", SYSTEMS)
def test_a_file_takes_every_ratio_in_its_unit(name: str) -> None:
    """Each ratio of a file replaced by its value in Hz, m/s, g, um or m is the same system."""
    config = config_of(name)
    system = config.system
    for full in physical_names(system.parameters):
        section, ratio = split_name(ratio_of(full))
        given = {key: dict(values) for key, values in config.given.items()}
        if section not in given or ratio not in given[section]:
            continue
        del given[section][ratio]
        given[section][split_name(full)[1]] = system.get(full)
        made = config_from_mapping(given).system
        assert made.get(ratio_of(full)) == pytest.approx(system.get(ratio_of(full)), rel=1e-12), full
