"""README: its length, its commands and its numbers."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

import matplotlib.pyplot as plt
import pytest
import xarray as xr
from typer.testing import CliRunner

from snapbeam import ResponseClass
from snapbeam.cli.app import app

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "README.md").read_text(encoding="utf-8")
PLAIN = " ".join(TEXT.split())
SMALLER = ["--modes", "1", "--cycles", "5", "--frequency-ratio", "0.8:2:3", "--velocity-amplitude", "0.1:0.4:2"]


def command(name: str) -> list[str]:
    """The words of the command of this name, without its comment."""
    line = next(line for line in TEXT.splitlines() if line.startswith(f"snapbeam {name}"))
    return shlex.split(line, comments=True)[1:]


def test_length():
    assert len(TEXT.splitlines()) <= 120


@pytest.mark.parametrize(("name", "options"), [("simulate", []), ("map", SMALLER)])
def test_commands(name, options, tmp_path, monkeypatch):
    """The commands run as they stand; the map has fewer modes, cycles and points."""
    monkeypatch.chdir(tmp_path)
    words = command(name)
    result = CliRunner().invoke(app, [*words, *options])
    plt.close("all")
    assert result.exit_code == 0, result.output
    for file in words[words.index("-o") + 1], words[words.index("--plot") + 1]:
        assert (tmp_path / file).stat().st_size > 1000


def test_map_size_is_that_of_the_command():
    """64 x 40 points are the defaults of ``snapbeam map`` and of ``make map``."""
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    assert "64 x 40 points" in TEXT
    assert "FREQUENCY_RATIO ?= 0.1:4:64" in makefile and "VELOCITY_AMPLITUDE ?= 0.01:0.65:40" in makefile
    assert {"map", "test", "test-slow"} <= set(re.findall(r"^([\w-]+):", makefile, re.MULTILINE))


@pytest.mark.slow  # a minute
@pytest.mark.filterwarnings("ignore:2560 runs of .* in flight on average may take")
def test_classes_of_the_map(tmp_path, monkeypatch):
    """The fractions of the classes, from the command as it stands."""
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(app, command("map"))
    plt.close("all")
    assert result.exit_code == 0, result.output
    with xr.open_dataset("map.nc") as ds:
        assert f"of the {ds.response_class.size} runs" in PLAIN
        share = {kind: 100.0 * float((ds.response_class == kind).mean()) for kind in ResponseClass}
    written = re.search(r"About ([\d.]+) % .* intrawell, ([\d.]+) % are transient interwell, and ([\d.]+) %", PLAIN)
    transient = share[ResponseClass.TRANSIENT_1] + share[ResponseClass.TRANSIENT_2]
    shares = share[ResponseClass.INTRAWELL], transient, share[ResponseClass.CONTINUOUS]
    assert [float(value) for value in written.groups()] == pytest.approx(shares, abs=1.5)


def test_numbers_of_the_comparison():
    """Times and ratios are those of the stored benchmark, rounded."""
    table = (ROOT / "docs" / "images" / "rivals.inc").read_text(encoding="utf-8")
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in table.splitlines() if "e-0" in line]
    ratio = {row[0]: float(row[4]) for row in rows}
    seconds = float(rows[0][3].split()[0])
    assert f"takes {1e3 * seconds:.0f} ms on one core, averaged over twelve test points" in PLAIN
    page = (ROOT / "docs" / "accuracy_and_speed.md").read_text(encoding="utf-8")
    first, second = re.search(r"dop853 took ([\d.]+) and ([\d.]+) times", page).groups()
    assert float(second) == min(ratio["numbalsoda dop853"], ratio["numbalsoda lsoda"])
    assert f"numbalsoda takes {first} to {float(second):.0f} times" in PLAIN
    odeint = min(value for name, value in ratio.items() if name.startswith("Boost.odeint"))
    taylor, diffrax = ratio["heyoka Taylor"], ratio["diffrax Tsit5"]
    scipy = [value for name, value in ratio.items() if name.startswith("scipy")]
    assert f"Boost.odeint {odeint:.0f}, heyoka {taylor:.0f}, diffrax {diffrax:.0f}" in PLAIN
    assert f"SciPy {min(scipy):.0f} to {max(scipy):.0f}" in PLAIN


def test_numbers_of_the_claims():
    words = json.loads((ROOT / "docs" / "data" / "claims.json").read_text(encoding="utf-8"))["summary"]
    total, hold, part, fail, close = re.findall(r"\d+", words)[:5]
    assert f"Of {total} statements of the paper that can be tested, {hold} hold, {part} hold in part" in PLAIN
    assert f"{fail} fail; {close} of these verdicts" in PLAIN
