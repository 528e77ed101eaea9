"""Suggested commands run, and a program can read the printed JSON."""

from __future__ import annotations

import inspect
import json
import re
import shlex
import tomllib
from importlib import import_module

import numpy as np
import pytest
import typer.main
import xarray as xr
from typer.testing import CliRunner

import snapbeam as sb
from snapbeam.cli.app import _COMMANDS, app
from snapbeam.cli.short_help import ShortHelpCommand
from snapbeam.model.parameter_file import Config, load_config

RUNNER = CliRunner()
SMALL = ["--modes", "1", "--cycles", "12"]
MAPS = {
    "the paper's axes": [*SMALL, "--frequency-ratio", "0.6:1.8:5", "--velocity-amplitude", "0.05:0.6:7"],
    "over location": [*SMALL, "--location", "0.2:0.5:4", "--velocity-amplitude", "0.1:0.6:5", "--frequency-ratio",
                      "1.3"],
    "one axis": [*SMALL, "--velocity-amplitude", "0.1:0.6:6", "--frequency-ratio", "1.3"],
    "one point": [*SMALL, "--velocity-amplitude", "0.5", "--frequency-ratio", "1.3"],
    "any axes": ["--cycles", "12", "--modes", "2", "--sweep", "beam.thickness=3.8e-4:4.2e-4:3", "--sweep",
                 "velocity_amplitude=0.1:0.6:4", "--side", "above"],
    "numbers of modes": ["--modes", "1,2", "--cycles", "12", "--frequency-ratio", "1:1.5:2", "--velocity-amplitude",
                         "0.1:0.6:4"],
    "a beam of its own": [*SMALL, "--length", "0.1", "--thickness", "3e-4", "--buckling-level", "2e-4",
                          "--contact-stiffness", "1e8", "--damping-ratio", "0.01", "--frequency-ratio", "0.6:1.8:4",
                          "--velocity-amplitude", "0.05:0.6:4"],
    "refined, repeated": [*SMALL, "--frequency-ratio", "0.6:1.8:3", "--velocity-amplitude", "0.1:0.6:3", "--refine-levels",
                          "1", "--replicates", "2"],
}  # fmt: skip


def run(*words: str) -> str:
    result = RUNNER.invoke(app, [str(word) for word in words])
    assert result.exit_code == 0, f"{' '.join(map(str, words))}\n{result.output}"
    return result.stdout


def suggested(said: str) -> list[list[str]]:
    """The commands below "Next:"."""
    lines = said.partition("Next:\n")[2].splitlines()
    found = [re.split(r"\s{3,}", line.strip(), maxsplit=1)[1] for line in lines if line.startswith("  ")]
    return [shlex.split(line) for line in found]


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", [name if name == "any axes" else pytest.param(name, marks=pytest.mark.slow) for name in MAPS]
)
def test_every_suggestion_runs_and_is_of_the_same_system(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    said = run("map", *MAPS[name], "-o", "a map.nc")
    ds = xr.load_dataset("a map.nc")
    commands = suggested(said)
    assert commands
    for words in commands:
        if words[0] == "python":
            assert words[1] == "-c"
            exec(words[2])
            continue
        assert words[0] == "snapbeam"
        if words[1] == "map":  # the very same, on few points and cycles
            words = [re.sub(r":40$", ":2", word) for word in words] + ["--cycles", "4"]
        run(*words[1:])
    see = [words for words in commands if words[1] == "simulate"]
    assert len(see) == (1 if (ds.response_class >= 1).any() else 0)
    for words in see:
        told = json.loads(run(*[w for w in words[1:] if w not in ("--plot", "run.png")], "--json", "-"))
        at = (
            dict(part.split("=") for part in words[words.index("--point") + 1].split(",")) if "--point" in words else {}
        )
        point = ds
        for axis, value in at.items():
            assert float(value) in ds[axis].values, "to the last digit"
            point = point.sel({axis: float(value)})
        point = point.squeeze()
        assert told["summary"]["response_class"] == sb.ResponseClass(int(point.response_class)).label
        assert told["summary"]["zero_crossings"] == int(point.zero_crossings)
        assert told["summary"]["peak_force"] == pytest.approx(float(point.peak_force), rel=1e-6)


def leaves(group, before=()):
    """Every command by its words, those of groups of commands too."""
    for name, command in sorted(group.commands.items()):
        words = (*before, name)
        yield from leaves(command, words) if hasattr(command, "commands") else [(" ".join(words), command)]


LEAVES = dict(leaves(typer.main.get_command(app)))


@pytest.mark.parametrize("command", LEAVES)
def test_json_and_quiet_everywhere(command):
    flags = {flag for each in LEAVES[command].params for flag in each.opts}
    assert {"--json", "--quiet", "--force"} <= flags
    assert isinstance(LEAVES[command], ShortHelpCommand), "takes --json without a file"
    assert ("--set" in flags) == ("--print-config" in flags), "what takes parameters prints them"


@pytest.mark.parametrize("name", _COMMANDS)
def test_every_command_writes_json(name):
    """A command without results would write no file for --json."""
    module = import_module(_COMMANDS[name].partition(":")[0])
    assert re.search(r"^\s+(add_json|write_json_now)\(", inspect.getsource(module), re.MULTILINE)


def test_json_goes_to_standard_output_alone(tmp_path):
    words = ["simulate", *SMALL]
    result = RUNNER.invoke(app, [*words, "--json", "-"])
    found = json.loads(result.stdout)
    assert found["summary"]["response_class"] in {kind.label for kind in sb.ResponseClass}
    assert set(found["summary"]) == {*sb.STATISTICS, "initial_well", "initial_well_reason"}
    for bare in ([*words, "--json"], ["simulate", "--json", *SMALL]):
        assert json.loads(RUNNER.invoke(app, bare).stdout)["summary"] == found["summary"]
    assert RUNNER.invoke(app, [*words, "--quiet"]).output == ""
    said = RUNNER.invoke(app, [*words, "--json", str(tmp_path / "a.json")])
    again = json.loads((tmp_path / "a.json").read_text(encoding="utf-8"))
    assert again["summary"] == found["summary"] and "impacts" in said.stdout
    refused = RUNNER.invoke(app, ["simulate", "--cycles", "0", "--json", "-", "--quiet"])
    assert refused.exit_code == 2 and refused.stdout == "" and "cycles = 0" in refused.stderr


def test_frequencies_and_thresholds_as_json(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = json.loads(run("frequencies", "--count", "3", "--json", "-"))
    assert found["reduced"] == pytest.approx([81.853, 159.268, 380.441], abs=1e-3)
    axes = ["--frequency-ratio", "0.8:1.6:3", "--velocity-amplitude", "0.05:0.6:12"]
    found = json.loads(run("threshold", *SMALL, *axes, "--json", "-"))
    ds = xr.load_dataset("threshold.nc")
    np.testing.assert_array_equal(found["lower_threshold"], ds.lower_threshold.values)
    assert found["axes"]["frequency_ratio"] == pytest.approx([0.8, 1.2, 1.6])


@pytest.mark.parametrize("words", [
    ["map", *MAPS["numbers of modes"]], ["map", *MAPS["any axes"]], ["map", "--modes", "1"],
    ["simulate", "--frequency-hz", "100", "--velocity-m-s", "0.03", "--location-m", "0.07", "--gap", "1e-5"],
    ["threshold", "--modes", "1,2"], ["simulate", "--modes", "3", "--damping-ratio", "0.01,0.02,0.03"],
    ["simulate", "--contact-radius", "2.5e-3", "--contact-young-modulus", "3.5e9,2e11", "--contact-poisson-ratio",
     "0.36,0.3"],
])  # fmt: skip
def test_printed_config_is_the_same_system(words, tmp_path):
    printed = run(*words, "--print-config")
    assert tomllib.loads(printed)["integration"]["cycles"] in (12, 200)
    file = tmp_path / "printed.toml"
    file.write_text(printed, encoding="utf-8")
    assert run(words[0], "--config", str(file), "--print-config") == printed
    config = load_config(file)
    assert config.defaulted == ()
    if words[0] == "simulate":
        direct = json.loads(run(*words, "--cycles", "2", "--json", "-"))
        again = json.loads(run("simulate", "--config", str(file), "--cycles", "2", "--json", "-"))
        assert again["system"] == direct["system"] and again["summary"] == direct["summary"]


def test_what_the_paper_lent_is_told(tmp_path):
    file = tmp_path / "beam.toml"
    text = "[beam]\nlength = 0.2\n[model]\nmodes = 1\n[integration]\ncycles = 4\n"
    file.write_text('extends = "paper"\n' + text, encoding="utf-8")
    told = RUNNER.invoke(app, ["simulate", "--config", str(file)]).stderr
    for value in ("beam.thickness = 0.0004 m", "beam.density = 7800 kg/m^3", "contact.stiffness = 4e+08 N/m^1.5"):
        assert value in told
    assert "beam.length" not in told
    assert "taken from" not in RUNNER.invoke(app, ["simulate", *SMALL]).stderr
    file.write_text(text, encoding="utf-8")
    refused = RUNNER.invoke(app, ["simulate", "--config", str(file)]).stderr
    assert "[beam] thickness, width, density" in " ".join(refused.split())


def test_damping_of_each_mode_and_samples(tmp_path):
    file = tmp_path / "run.nc"
    run("simulate", "--modes", "2", "--damping-ratio", "0.01,0.02", "--cycles", "4", "--samples", "50", "-o", file)
    read = sb.load(file)
    np.testing.assert_array_equal(read.system.model.damping_ratio, [0.01, 0.02])
    assert read.dataset.sizes["time"] == 4 * 50 + 1
    np.testing.assert_allclose(np.diff(read.dataset.cycle), 0.02, rtol=1e-9)
    refused = RUNNER.invoke(app, ["simulate", "--modes", "2", "--damping-ratio", "0.01,0.02,0.03"])
    assert refused.exit_code == 2 and "damping_ratio" in refused.stderr


@pytest.mark.parametrize("words", [
    ["reproduce", "fig6", "--measurements", "nosuch.csv"], ["reproduce", "fig4", "--measured", "nosuch.nc"],
    ["reproduce", "fig2", "--measurements", "nosuch.csv"], ["simulate", "--window", "5:2"], ["map", "--threads", "0"],
    ["simulate", "--samples", "0"], ["simulate", "--json", "nosuch/a.json"],
])  # fmt: skip
def test_refusals_come_before_computing(words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = RUNNER.invoke(app, words)
    assert result.exit_code == 2 and "error:" in result.stderr
    assert not re.search(r"\d+ of \d+|to compute", result.output)


def test_a_point_of_a_list_is_gone_on_from(tmp_path):
    """The nearest point of a list of points, with all of its parameters to the last digit."""
    rng = np.random.default_rng(2)
    system = Config().system.replace(**{"model.modes": 1})
    table = xr.Dataset({
        "drive.frequency_ratio": ("point", rng.uniform(0.6, 2.0, 9)),
        "drive.velocity_amplitude": ("point", rng.uniform(0.05, 0.4, 9)),
        "beam.thickness": ("point", rng.choice([3.9e-4, 4.1e-4], 9)),
    })  # fmt: skip
    found = sb.sweep(system, table, sb.Integration(cycles=8))
    found.to_netcdf(tmp_path / "list.nc", engine="h5netcdf")
    names = ("frequency_ratio", "velocity_amplitude")
    near = ",".join(f"{name}={float(found[name][3]):.4f}" for name in names)
    command = ["simulate", "--from", str(tmp_path / "list.nc"), "--point", near, "--json", "-", "--quiet"]
    done = RUNNER.invoke(app, command)
    assert done.exit_code == 0, done.output
    told = json.loads(done.stdout)["summary"]
    assert told["peak_force"] == float(found.peak_force[3]) and told["zero_crossings"] == int(found.zero_crossings[3])
    refused = RUNNER.invoke(app, ["simulate", "--from", str(tmp_path / "list.nc"), "--point", "location=0.3"])
    assert refused.exit_code == 2


@pytest.mark.slow
def test_what_is_given_beside_a_store_is_compared_with_the_store(tmp_path, monkeypatch):
    """Not with the paper's beam: only what is asked for otherwise is told to differ."""
    monkeypatch.chdir(tmp_path)
    run("map", *MAPS["a beam of its own"], "--checkpoint", "kept")
    before = xr.load_dataset("map.nc").response_class
    run("map", "--checkpoint", "kept", "--cycles", "12", "--length", "0.1", "-o", "again.nc")
    np.testing.assert_array_equal(xr.load_dataset("again.nc").response_class, before)
    refused = RUNNER.invoke(app, ["map", "--checkpoint", "kept", "--cycles", "13", "-o", "other.nc"])
    assert refused.exit_code == 2
    differences = [line for line in refused.stderr.splitlines() if "in the checkpoint" in line]
    assert len(differences) == 1 and "cycles: 12 in the checkpoint, 13 requested" in differences[0]


def test_options_complete_a_file(tmp_path):
    """An axis or a value of an option is a parameter that the file needs and does not contain."""
    from snapbeam.cli.parameter_options import configured
    from snapbeam.util.validation import InputError

    path = tmp_path / "harvester.toml"
    path.write_text(
        'extends = "paper"\n[base_excitation]\ntype = "acceleration_sine"\nfrequency_ratio = 0.5\n'
        '[harvester]\ntype = "coil"\nforce_factor = 0.1\n'
    )
    swept = configured(
        {"config": path, "sweep": ["base_excitation.acceleration_amplitude=0.1,0.2", "harvester.resistance=1e3:1e6:3"]}
    )
    assert swept.axes()["harvester.resistance"].size == 3
    both = ["base_excitation.acceleration_amplitude=0.1", "harvester.resistance=1e4"]
    assert configured({"config": path, "set_": both}).system.get("harvester.resistance") == 1e4
    with pytest.raises(InputError, match=r"harvester\.toml: \[base_excitation\] acceleration_amplitude: missing"):
        configured({"config": path})


def test_no_striker_is_added_to_a_base(tmp_path, capsys):
    """The drive of a striker that the file does not have is refused; with a striker it is one.  No empty note is printed."""
    from snapbeam.cli.parameter_options import configured
    from snapbeam.util.validation import InputError

    path = tmp_path / "base.toml"
    path.write_text(
        "[beam]\nlength = 0.1\nwidth = 0.01\nthickness = 3e-4\ndensity = 7850\nyoung_modulus = 2e11\n"
        "buckling_level = 5e-4\n[model]\nmodes = 2\ndamping_ratio = 0.01\n"
        '[base_excitation]\ntype = "sine"\nfrequency_ratio = 0.5\nvelocity_amplitude = 0.1\n'
    )
    assert configured({"config": path}).system.striker is None
    assert "taken from the paper" not in "".join(capsys.readouterr())
    moved = configured({"config": path, "drive.frequency_ratio": 0.7}).system
    assert moved.striker is None and moved.get("base_excitation.frequency_ratio") == 0.7
    for given in ({"set_": ["drive.velocity_amplitude=0.3"]}, {"sweep": ["drive.frequency_hz=20:30:2"]}):
        with pytest.raises(InputError, match="there is no striker to drive, base_excitation moves the beam"):
            configured({"config": path} | given)
    own = {"contact.location": 0.5, "contact.stiffness": 1e8}
    both = configured({"config": path, "drive.frequency_ratio": 1.0} | own)
    assert both.system.striker is not None


def test_frequencies_of_an_arch_are_about_its_equilibrium(tmp_path):
    """The exact frequencies of the straight beam are none of a curved one, and are not printed."""
    path = tmp_path / "arch.toml"
    path.write_text(
        "[beam]\nlength = 500e-6\nwidth = 20e-6\nthickness = 2e-6\ndensity = 2330\nyoung_modulus = 160e9\n"
        "axial_load = 0.0\n[imperfection]\nmidspan_amplitude = 6e-6\n[model]\nmodes = 4\n"
    )
    target = tmp_path / "found.json"
    done = RUNNER.invoke(app, ["frequencies", "--config", str(path), "--count", "3", "--json", str(target)])
    assert done.exit_code == 0, done.output
    found = json.loads(target.read_text())
    assert "exact" not in found
    assert found["wells"] == ["equilibrium"]
    assert found["reduced"][0] == pytest.approx(load_config(path).model.natural_frequencies[:3].tolist())
