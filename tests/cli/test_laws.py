"""Laws of the user's own on the command line."""

from __future__ import annotations

import json
import sys

import pytest
from typer.testing import CliRunner

import snapbeam as sb
from snapbeam.cli.app import app
from snapbeam.model.local_force import LOCAL_FORCES

LAW = """
from dataclasses import dataclass

import snapbeam as sb


@dataclass(frozen=True, kw_only=True)
class SpringOfATest(sb.LocalForce):
    constant: float = sb.quantity("N/m", "stiffness", low=0.0)

    name = "spring_of_a_test"

    @staticmethod
    def force(law, displacement):
        return -law.constant * displacement

    @staticmethod
    def energy(law, displacement):
        return 0.5 * law.constant * displacement * displacement
"""
BEAM = """
[beam]
length = "300 mm"
thickness = "0.4 mm"
width = "20 mm"
density = 7850.0
young_modulus = "200 GPa"
buckling_level = "0.7 mm"
[model]
modes = 3
damping_ratio = 0.02
"""


def run(*words: str) -> tuple[int, str]:
    result = CliRunner().invoke(app, list(words))
    return result.exit_code, result.output


@pytest.fixture(autouse=True)
def without_own_laws():
    """Take the law of the test out of the registry, whose rows other tests compare."""
    yield
    LOCAL_FORCES.pop("spring_of_a_test", None)
    sys.modules.pop("law_of_a_test", None)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:the lowest mode about")
def test_a_law_of_a_file_in_a_parameter_file(tmp_path, monkeypatch):
    """Equilibria and frequencies with an own linear spring are those with the one of the package."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "law_of_a_test.py").write_text(LAW, encoding="utf-8")
    own = BEAM + '[force]\ntype = "spring_of_a_test"\nconstant = 300.0\nlocation = 0.4\n'
    (tmp_path / "own.toml").write_text(own, encoding="utf-8")
    given = BEAM + '[force]\ntype = "local_spring"\nstiffness = 300.0\nlocation = 0.4\n'
    (tmp_path / "given.toml").write_text(given, encoding="utf-8")
    code, text = run("equilibria", "--config", "own.toml")
    assert code == 2 and "spring_of_a_test" in text  # nothing is executed that was not named
    results = {}
    for name, more in (("own", ["--law", "law_of_a_test.py:SpringOfATest"]), ("given", [])):
        code, text = run("equilibria", "--config", f"{name}.toml", *more, "--json", f"{name}.json")
        assert code == 0, text
        results[name] = json.loads((tmp_path / f"{name}.json").read_text(encoding="utf-8"))
    for key in ("centers", "energies", "frequencies", "barriers"):
        for one, other in zip(results["own"][key], results["given"][key], strict=True):
            assert one == pytest.approx(other, rel=1e-9)
    plain = sb.System.load(tmp_path / "given.toml").model.natural_frequencies[0]
    assert abs(results["own"]["frequencies"][0][0] / plain - 1.0) > 0.01


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("missing.py", "existing Python file"),
        ("broken.py", "ZeroDivisionError"),
        ("empty.py:Magnet", "does not define a class 'Magnet'"),
        ("beam.toml", "existing Python file"),
        ("json.py", "name of the installed module 'json'"),
        ("wave.py", "name of the installed module 'wave'"),
    ],
)
def test_refused_files(text, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "broken.py").write_text("1 / 0\n", encoding="utf-8")
    for name in ("empty", "json", "wave"):  # a module that is imported, and one that is not
        (tmp_path / f"{name}.py").write_text("", encoding="utf-8")
    (tmp_path / "beam.toml").write_text(BEAM, encoding="utf-8")
    code, output = run("equilibria", "--config", "beam.toml", "--law", text)
    assert code == 2 and message in " ".join(output.split())
