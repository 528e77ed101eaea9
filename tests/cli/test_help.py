"""Help of every command: a first screen of at most 25 lines, and all options on request."""

from __future__ import annotations

import pytest
import typer.main
from typer.testing import CliRunner

from snapbeam.cli.app import app


def commands() -> dict[str, object]:
    """Every command and group, by its words."""
    found: dict[str, object] = {}

    def visit(command: object, words: tuple[str, ...]) -> None:
        found[" ".join(words)] = command
        for name in getattr(command, "commands", {}):
            visit(command.commands[name], (*words, name))

    visit(typer.main.get_command(app), ())
    return found


@pytest.fixture(autouse=True)
def narrow(monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")


@pytest.mark.parametrize("words", commands())
def test_first_screen(words):
    """Usage, purpose and example, on a terminal of 80 columns and 25 lines."""
    result = CliRunner().invoke(app, [*words.split(), "--help"])
    assert result.exit_code == 0, result.output
    lines = result.output.rstrip("\n").splitlines()
    assert len(lines) <= 25 and max(map(len, lines)) <= 80
    assert lines[0].startswith("Usage: ") and lines[2]


@pytest.mark.sampled(4)
@pytest.mark.parametrize("words", [words for words, each in commands().items() if not hasattr(each, "commands")])
def test_all_options(words):
    """``--help-all`` lists each option; the first screen states how many it leaves out."""
    command = commands()[words]
    flags = {flag for each in command.params for flag in each.opts if flag.startswith("--")}
    plain = CliRunner().invoke(app, [*words.split(), "--help-all"], env={"COLUMNS": "200"}).output
    assert sorted(flag for flag in flags if flag not in plain) == []
    first = CliRunner().invoke(app, [*words.split(), "--help"]).output
    left_out = [each for each in command.params if not any(flag in first for flag in each.opts)]
    assert not left_out or "more options: " in first


def test_arguments_and_usual_options_come_first():
    first = CliRunner().invoke(app, ["simulate", "--help"]).output
    for flag in (
        "--config",
        "--frequency-ratio",
        "--velocity-amplitude",
        "--location",
        "--modes",
        "--cycles",
        "--plot",
    ):
        assert flag in first
    assert "--hunt-crossley-speed" not in first
    assert "FILE" in CliRunner().invoke(app, ["info", "--help"]).output


@pytest.mark.parametrize("option", ["--help", "--help-all"])
def test_defaults(option):
    """The value of a parameter without an option and without a file."""
    text = CliRunner().invoke(app, ["simulate", option], env={"COLUMNS": "200"}).output
    after = " ".join(text.split()).partition("--frequency-ratio NUMBER")[2]
    assert "1.21" in after.partition(" --")[0]


@pytest.mark.parametrize(("arguments", "near"), [
    (["simulat"], "simulate"), (["map", "--cycle", "3"], "--cycles"), (["dynamics", "exponents"], "lyapunov-spectrum"),
])  # fmt: skip
def test_nearest_name(arguments, near):
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 2
    assert near in result.output
