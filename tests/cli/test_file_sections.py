"""Every combination of the sections of a parameter file, through every command: it works, or its message names the section."""

from __future__ import annotations

import itertools
import re
import sys

import pytest
import tomli_w
from typer.testing import CliRunner

from snapbeam.cli import parameter_options
from snapbeam.cli.app import app
from snapbeam.model.mapping import flattened
from snapbeam.model.parameter_file import config_from_mapping
from snapbeam.util.validation import InputError

BEAM = {
    "length": 0.0297, "thickness": 3.2e-4, "width": 6e-3, "density": 8.2e3, "young_modulus": 1.2e11, "buckling_level": 2e-4,
}  # fmt: skip
STRUCTURE = {"beam": BEAM, "model": {"modes": 2, "damping_ratio": 0.01}}
PARTS = {
    "contact": {"type": "hertz", "stiffness": 1e8, "location": 0.45, "gap": 1e-5},
    "drive": {"type": "sine", "frequency_ratio": 0.83, "velocity_amplitude": 0.11},
    "base_excitation": {"type": "acceleration_sine", "frequency_hz": 310.0, "amplitude_g": 30.0},
    "axial_load": {"type": "harmonic_force", "frequency_ratio": 1.4, "amplitude": 0.7},
    "force": {"type": "harmonic_force", "frequency_ratio": 0.6, "amplitude": 0.02, "location": 0.35},
    "harvester": {"type": "piezo", "moment_per_volt": 1e-6, "capacitance": 2e-8, "resistance": 1e5},
    "initial_state": {"velocity[1]": 0.05},
    "sweep": {"beam.thickness": "3e-4:3.4e-4:2"},
    "boundary": {"left_rotational_stiffness": 5.0},
    "imperfection": {"point_load": 0.01},
    "integration": {"cycles": 2, "early_termination": False},
}  # fmt: skip
MOVING = ("contact", "drive", "base_excitation", "axial_load", "force", "harvester", "initial_state")
STATIC = ("sweep", "boundary", "imperfection", "integration")


def subsets(names):
    return [chosen for count in range(len(names) + 1) for chosen in itertools.combinations(names, count)]


def sections_of(chosen, start):
    """Sections of a file; *start*: a beam of its own, the paper's beam, or the paper's with another beam."""
    first = {
        "own": STRUCTURE,
        "paper": {"extends": "paper", "model": {"modes": 2}},
        "changed": {"extends": "paper"} | STRUCTURE,
    }[start]
    return first | {name: PARTS[name] for name in chosen}  # fmt: skip


def names_a_section(message, sections):
    """Return whether a message names one of the sections, or one that is missing, as a section or in a dotted name."""
    known = {*flattened(sections), *PARTS, "contacts", "uncertainty", "probability", "design"} - {"extends"}
    return any(re.search(rf"(?<![\w]){re.escape(name)}(?![\w])", message) for name in known)


@pytest.mark.parametrize("name", PARTS)
def test_every_section_is_valid_where_it_belongs(name):
    beside = {"drive": "contact", "contact": "drive"}.get(name, "base_excitation")
    config = config_from_mapping(sections_of((name, beside), "own"))
    assert name in config.given
    assert config.system.moving


@pytest.mark.slow
@pytest.mark.parametrize("start", ["own", "paper", "changed"])
def test_every_combination_makes_a_system_or_names_the_section(tmp_path, capsys, start):
    for number, chosen in enumerate(subsets(MOVING)[0 if start == "own" else 1 :: 1 if start == "own" else 3]):
        sections = sections_of((*chosen, *STATIC[number % 5 :]), start)
        if number % 2 and "contact" in sections:
            sections["contact"] = [sections["contact"], {"side": "above", "gap": 2e-5}]
        # every command reads its parameters by this function; its options differ in whether a drive and axes are known
        file = tmp_path / "system.toml"
        file.write_text(tomli_w.dumps(sections))
        given = ({"drive.frequency_ratio": None}, {}, {"drive.frequency_ratio": None, "sweep": None})[number % 3]
        try:
            config = parameter_options.configured({"config": file} | given)
            system = config.system
        except InputError as error:
            assert names_a_section(str(error), sections), (chosen, str(error))
            continue
        noted = capsys.readouterr().err
        for name in re.findall(r"(drive\.\w+) = ", noted):
            assert name in system.parameters, (chosen, noted)
        assert bool(system.contacts) == ("contact" in chosen or "drive" in chosen or (config.extends_paper
                                         and not {"base_excitation", "axial_load", "force"} & {*chosen})), chosen  # fmt: skip
        whole = config_from_mapping(config.whole().to_mapping())
        assert "sweep" in sections or whole.system == system, chosen


class ReachedError(Exception):
    """Raised in place of the first run: the command has read, checked and arranged everything."""


COMMANDS = {
    "simulate": ("simulate",),
    "simulate option": ("simulate", "--frequency-ratio", "0.9"),
    "map": ("map",),
    "threshold": ("threshold", "--values", "0.1:0.2:2"),
    "schematic": ("schematic", "-o", "system.png"),
    "frequencies": ("frequencies",),
    "equilibria": ("equilibria",),
    "force-displacement": ("equilibria", "--force-displacement"),
    "lifetimes": ("dynamics", "lifetimes", "--initial-conditions", "2"),
    "bifurcation-diagram": ("dynamics", "bifurcation-diagram", "--values", "0.1:0.2:2"),
    "hysteresis": ("dynamics", "hysteresis", "--values", "0.1:0.2:2"),
    "backbone-curve": ("dynamics", "backbone-curve", "--max-points", "3"),
    "lyapunov-spectrum": ("dynamics", "lyapunov-spectrum"),
    "poincare-section": ("dynamics", "poincare-section"),
    "branch": ("dynamics", "branch"),
    "manifold": ("dynamics", "manifold"),
    "bifurcation-curve": ("dynamics", "bifurcation-curve"),
    "basins": ("dynamics", "basins"),
    "edge": ("dynamics", "edge"),
    "probability": ("probability",),
    "design": ("design",),
}
SAMPLED = [chosen for chosen in subsets(MOVING[:5]) if len(chosen) in (0, 1, 5)]
REAL = [("contact",), ("base_excitation",), ("contact", "base_excitation"), ("axial_load", "initial_state"),
        ("contact", "drive", "base_excitation", "axial_load", "force", "harvester")]  # fmt: skip
UNCERTAIN = {
    "uncertainty": {"beam.thickness": {"normal": 1e-6}},
    "probability": {"runs": 8},
    "design": {"objectives": "peak_force", "variables": {"contact.location": [0.3, 0.5]}},
}


@pytest.fixture
def cli(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def run(sections, args):
        (tmp_path / "system.toml").write_text(tomli_w.dumps(sections))
        file = ("system.toml",) if args[0] in ("probability", "design") else ("--config", "system.toml")
        head = 2 if args[0] == "dynamics" else 1
        args = (*args[:head], *file, *args[head:], "--force")
        monkeypatch.setattr(sys, "argv", ["snapbeam", *args])
        return CliRunner().invoke(app, args)

    return run


def works(result, sections):
    """Return whether a command did what it is for; if it refused, its message must name a section."""
    if result.exception is not None and not isinstance(result.exception, (ReachedError, SystemExit)):
        raise result.exception
    if result.exit_code == 2:
        assert names_a_section(result.stderr, sections), result.stderr
    return isinstance(result.exception, ReachedError) or result.exit_code == 0


def file_of(chosen, command):
    return sections_of(chosen, "own") | (UNCERTAIN if command in ("probability", "design") else {})


@pytest.mark.sampled(4)
@pytest.mark.parametrize("command", COMMANDS)
def test_commands_before_the_first_run(cli, monkeypatch, command):
    def reached(*_, **__):
        raise ReachedError

    for place in ("step_size._free_runs", "native._Arrays"):
        monkeypatch.setattr(f"snapbeam.solver.{place}", reached)
    chosen = SAMPLED[:3] if command in ("schematic", "force-displacement") else SAMPLED  # those two compute
    files = [file_of(each, command) for each in chosen]
    accepted = [each for each, file in zip(chosen, files, strict=True) if works(cli(file, COMMANDS[command]), file)]
    assert accepted


SHORT = {
    "simulate": ("simulate",),
    "hysteresis": ("dynamics", "hysteresis", "--parameter"),
    "map": ("map", "--sweep"),
    "threshold": ("threshold", "--parameter"),
    "poincare-section": ("dynamics", "poincare-section", "--periods", "3", "--transient", "2"),
}  # fmt: skip
VARIED = {"drive": "velocity_amplitude", "base_excitation": "acceleration_amplitude", "axial_load": "amplitude"}


@pytest.mark.slow
@pytest.mark.parametrize("command", SHORT)
@pytest.mark.parametrize("chosen", REAL, ids="+".join)
def test_commands_run(cli, command, chosen):
    file, args = sections_of(chosen, "own") | {"integration": {"cycles": 3}}, SHORT[command]
    section = next((each for each in VARIED if each in chosen), "drive")
    if args[-1] == "--parameter":
        args = (*args, f"{section}.{VARIED[section]}", "--values", "0.1:0.2:2")
    elif args[-1] == "--sweep":
        args = (*args, f"{section}.{VARIED[section]}=0.1:0.2:2")
    repeats = command != "poincare-section" or chosen != REAL[-1]  # its frequencies have no common period
    assert works(cli(file, args), file) == repeats
