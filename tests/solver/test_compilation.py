"""Compiled code is kept under a fingerprint of everything that it bakes in."""

from __future__ import annotations

import importlib
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import snapbeam
from snapbeam.model.contact.hertz import HertzContact
from snapbeam.model.contact.restitution import Restitution
from snapbeam.model.drive.recorded_motion import RecordedMotion
from snapbeam.model.drive.sine import Sine
from snapbeam.solver import compilation as marking
from snapbeam.solver.compilation import fingerprint

PACKAGE = Path(snapbeam.__file__).parent


@pytest.fixture
def copy(tmp_path, monkeypatch) -> Path:
    """A copy of the package whose fingerprint is taken; caches of this process are left as they were."""
    there = tmp_path / "snapbeam"
    shutil.copytree(PACKAGE, there, ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(marking, "_PACKAGE", there)
    yield there
    monkeypatch.undo()
    marking._package_mark.cache_clear()
    fingerprint.cache_clear()


def mark(kinds: tuple[type, ...] = (HertzContact, Sine)) -> str | None:
    marking._package_mark.cache_clear()
    fingerprint.cache_clear()
    return fingerprint(kinds)


def changed(path: Path) -> str | None:
    """The fingerprint with a file changed, which then is as it was."""
    before = path.read_bytes()
    path.write_bytes(before + b"\n# a change\n")
    found = mark()
    path.write_bytes(before)
    return found


def test_every_file_of_the_engines_and_the_codes_is_in_it(copy) -> None:
    """A status that is renumbered, a step that is rewritten, in whichever subfolder: another fingerprint."""
    first = mark()
    files = [copy / "util" / "status_codes.py", *sorted((copy / "solver").rglob("*.py"))]
    assert len(files) > 35
    assert {path.parent.name for path in files} == {"util", "solver", "cpu", "run_lanes", "terms", "cuda"}
    marks = {changed(path) for path in files}
    assert first not in marks
    assert len(marks) == len(files)
    assert mark() == first


def test_a_file_more_is_another_fingerprint(copy) -> None:
    first = mark()
    (copy / "solver" / "cpu" / "more.py").write_text("", encoding="utf-8")
    assert mark() != first


def test_what_no_kernel_bakes_in_is_not_in_it(copy) -> None:
    """A change of a label costs nobody a compilation."""
    first = mark()
    for name in (
        "util/diagnostics.py",
        "model/system.py",
        "simulation/simulate.py",
        "cli/app.py",
        "plot/style.py",
    ):
        assert changed(copy / name) == first


def test_laws_and_drives_have_their_own(copy) -> None:
    marks = [
        mark(kinds)
        for kinds in (
            (HertzContact, Sine),
            (Restitution, Sine),
            (HertzContact, RecordedMotion),
            (Restitution, RecordedMotion),
        )
    ]
    assert None not in marks
    assert len(set(marks)) == 4


LAW = """
from dataclasses import dataclass
from snapbeam.model.contact.base import ContactLaw
from snapbeam.model.quantity import RUN, quantity

@dataclass(frozen=True)
class Spring(ContactLaw):
    stiffness: float = quantity("N/m", "stiffness", low=0.0, scope=RUN)
    {more}

    @staticmethod
    def force(law, penetration):
        return {factor} * law.stiffness * penetration
"""


def law_of(folder: Path, text: str) -> type:
    """The law in a file of somebody's, read anew."""
    (folder / "somebodys_law.py").write_text(text, encoding="utf-8")
    sys.modules.pop("somebodys_law", None)
    importlib.invalidate_caches()
    shutil.rmtree(folder / "__pycache__", ignore_errors=True)
    return importlib.import_module("somebodys_law").Spring


def test_a_law_of_somebody_is_marked_by_what_it_computes(tmp_path, monkeypatch) -> None:
    """Its force, a constant and a function that the force reads; not a comment beside them."""
    monkeypatch.syspath_prepend(str(tmp_path))
    plain = LAW.format(factor="1.0", more="")
    first = fingerprint((law_of(tmp_path, plain), Sine))
    assert first is not None
    assert fingerprint((law_of(tmp_path, plain + "\n# a comment\n"), Sine)) == first
    assert fingerprint((law_of(tmp_path, LAW.format(factor="2.0", more="")), Sine)) != first
    marks = [
        fingerprint((law_of(tmp_path, f"FACTOR = {value}\n" + LAW.format(factor="FACTOR", more="")), Sine))
        for value in (1.0, 2.0)
    ]
    called = [
        fingerprint(
            (
                law_of(
                    tmp_path, f"def twice():\n    return {value}\n" + LAW.format(factor="twice()", more="")
                ),
                Sine,
            )
        )
        for value in (1.0, 2.0)
    ]
    found = [first, *marks, *called]
    assert None not in found and len(set(found)) == 5


def test_the_names_that_a_law_gives_are_part_of_it(tmp_path, monkeypatch) -> None:
    """As the times at which a drive jumps: kernels read numbers by them."""
    monkeypatch.syspath_prepend(str(tmp_path))
    marks = [
        fingerprint((law_of(tmp_path, LAW.format(factor="1.0", more=f"rate_dependent = {words}")), Sine))
        for words in (
            "False",
            "True\n    damping_coefficient = staticmethod(lambda law, penetration: law.stiffness)",
        )
    ]
    assert None not in marks and len(set(marks)) == 2


def test_a_statistic_of_somebody_is_never_kept() -> None:
    """It stands for functions from anywhere; two of them must not share a kernel."""
    from snapbeam.solver.registered_statistics import extras_of_table
    from snapbeam.solver.statistics import Statistic, register_statistic, unregister_statistic

    assert fingerprint((HertzContact, Sine, type(extras_of_table()).owner)) is not None
    register_statistic(
        Statistic("own", "float64", "s", "time of the run", lambda r, h: h, update=lambda held, step: held)
    )
    try:
        assert fingerprint((HertzContact, Sine, type(extras_of_table()).owner)) is None
    finally:
        unregister_statistic("own")


@pytest.mark.slow
def test_a_law_typed_at_a_prompt_is_never_kept() -> None:
    """Its source cannot be read, so nothing tells two of them apart."""
    code = LAW.format(factor="1.0", more="") + (
        "\nfrom snapbeam.solver.compilation import fingerprint\n"
        "from snapbeam.model.drive.sine import Sine\nprint(fingerprint((Spring, Sine)))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "None\n"
