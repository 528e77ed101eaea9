"""Tutorials: files, code and commands run in their order, and give the output that the pages show."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import matplotlib.pyplot as plt
import pytest
from typer.testing import CliRunner

from snapbeam.cli.app import app
from snapbeam.cli.parameter_options import LongReport

DOCS = Path(__file__).parents[2] / "docs"


def blocks(name: str, end: str = "") -> list[tuple[str, str]]:
    """Kind and text of every fenced block of a page, or of its part before a heading."""
    text = (DOCS / f"{name}.md").read_text(encoding="utf-8")
    if end:
        assert f"\n{end}\n" in text
        text = text.partition(f"\n{end}\n")[0]
    return re.findall(r"^```([\w{}]*)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


def assert_shown(shown: str, printed: str, name: str) -> None:
    """Each shown line is printed, in order; three dots stand for any text, or for any lines."""
    rest = [line.rstrip() for line in printed.splitlines()]
    for line in shown.splitlines():
        if line.strip() == "...":
            continue
        pattern = ".*".join(map(re.escape, line.rstrip().split("...")))
        found = [number for number, each in enumerate(rest) if re.fullmatch(pattern, each)]
        assert found, f"{name}: {line!r} is not in\n{printed}"
        rest = rest[found[0] + 1 :]


def follow(name: str, capsys: pytest.CaptureFixture[str], end: str = "") -> None:
    """Do what a page says, up to a heading, in the present folder."""
    printed, scope = "", {}
    for kind, text in blocks(name, end):
        file = re.match(r"# (\S+\.toml)\b", text)
        if kind == "toml" and file:
            Path(file[1]).write_text(text, encoding="utf-8")
        elif kind == "python":
            capsys.readouterr()
            exec(compile(text, name, "exec"), scope)
            printed = capsys.readouterr().out
        elif text.startswith("snapbeam "):
            printed = ""
            for line in text.replace("\\\n", " ").splitlines():
                if not line.startswith("snapbeam "):
                    continue
                result = CliRunner().invoke(app, shlex.split(line, comments=True)[1:])
                stopped = result.exit_code == 130 and "--cluster" in line
                assert result.exit_code == 0 or stopped, f"{line}\n{result.output}"
                printed += result.output
        elif kind in ("", "text"):
            assert_shown(text, printed, name)
    plt.close("all")


@pytest.mark.filterwarnings("ignore:the lowest mode about the equilibrium")
@pytest.mark.filterwarnings("ignore:this imperfection leaves one well")
@pytest.mark.parametrize(
    "name",
    [
        "tutorial_beam",
        *(
            pytest.param(each, marks=pytest.mark.slow)
            for each in ("tutorial_waveform", "howto_harvester", "mems_arch", "mems_switch")
        ),
    ],
)
def test_tutorial(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    follow(name, capsys)


@pytest.mark.slow  # two workers are started twice
def test_tutorial_of_a_long_sweep(tmp_path, monkeypatch, capsys):
    """Ctrl-C is pressed once, after the first finished task."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "beam.toml").write_text(blocks("tutorial_beam")[0][1], encoding="utf-8")
    report, pressed = LongReport.progress, []

    def interrupted(self, done, total):
        report(self, done, total)
        if done and not pressed:
            pressed.append(done)
            raise KeyboardInterrupt

    monkeypatch.setattr(LongReport, "progress", interrupted)
    follow("long_maps", capsys, end="## Other parameters than those of the checkpoint")
    assert pressed
