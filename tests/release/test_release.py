"""What is released: archives that hold what they must and nothing else, and one version everywhere."""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
import venv
import zipfile
from pathlib import Path

import pytest
from packaging.requirements import Requirement

import snapbeam as sb

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(Path(__file__).parent))
import alone  # noqa: E402
from prepare import VERSIONS, prepare, versions  # noqa: E402


def test_one_version_everywhere():
    assert set(versions().values()) == {sb.__version__}


def test_metadata_agree():
    """Name, license, keywords and title of codemeta.json and CITATION.cff are those of pyproject.toml."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    meta = json.loads((ROOT / "codemeta.json").read_text(encoding="utf-8"))
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert (meta["name"], meta["description"]) == (project["name"], project["description"])
    assert meta["keywords"] == project["keywords"]
    assert meta["license"].endswith("/" + project["license"]) and f"license: {project['license']}\n" in citation
    author = project["authors"][0]["name"]
    assert meta["author"][0]["name"] == author and f'name: "{author}"' in citation
    bibtex = (ROOT / "docs" / "getting-started.md").read_text(encoding="utf-8")
    title = re.search(r'^title: "(.*)"$', citation, re.MULTILINE)
    assert title and f"title   = {{{title[1]}}}" in bibtex and f"{{{{{author}}}}}" in bibtex
    assert meta["referencePublication"] == project["urls"]["Paper"]


@pytest.fixture
def copied(tmp_path):
    """The files that a release changes, in a folder of their own."""
    for name in (*VERSIONS, "pyproject.toml", "README.md", "LICENSE", "build_backend/snapbeam_build.py"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / name, tmp_path / name)
    text = "# Changelog\n\n## Unreleased\n\n### Added\n\n- A file.\n\n## 0.1.0\n"
    (tmp_path / "CHANGELOG.md").write_text(text, encoding="utf-8")
    return tmp_path


def test_a_release_is_prepared(copied):
    """One call writes version, date and address; a second one with the next version replaces them."""
    address = "https://example.org/snapbeam"
    prepare("0.2.0", address, "2026-12-01", copied)
    assert set(versions(copied).values()) == {"0.2.0"}
    changelog = (copied / "CHANGELOG.md").read_text(encoding="utf-8")
    assert "\n## 0.2.0 (2026-12-01)\n" in changelog and "## Unreleased" not in changelog
    prepare("0.3.0.dev0", root=copied)
    assert "\n## Unreleased\n\n## 0.2.0 (" in (copied / "CHANGELOG.md").read_text(encoding="utf-8")
    prepare("0.3.0", address, "2027-01-15", copied)
    citation = (copied / "CITATION.cff").read_text(encoding="utf-8")
    assert "version: 0.3.0\ndate-released: 2027-01-15\n" in citation and citation.count("repository-code:") == 1
    meta = json.loads((copied / "codemeta.json").read_text(encoding="utf-8"))
    assert (meta["version"], meta["dateModified"], meta["codeRepository"]) == ("0.3.0", "2027-01-15", address)
    urls = tomllib.loads((copied / "pyproject.toml").read_text(encoding="utf-8"))["project"]["urls"]
    assert urls["Source"] == address and set(urls) == {"Paper", "Source", "Issues", "Changelog"}
    with pytest.raises(SystemExit, match="must be like"):
        prepare("v0.3", root=copied)


def test_description_has_links_that_work_elsewhere(copied):
    """In the archives of a release, links of the README are absolute."""
    prepare("0.2.0", "https://example.org/snapbeam", root=copied)
    text = (copied / _build("prepare_metadata_for_build_wheel", copied, root=copied) / "METADATA").read_text(
        encoding="utf-8"
    )
    targets = re.findall(r"\]\(([^)]+)\)", text)
    assert len(targets) > 20 and all(target.startswith("https://") for target in targets)
    assert (
        "![Response class over excitation frequency and velocity amplitude](https://example.org/snapbeam/raw/v0.2.0/"
        in text
    )


def test_locked_versions_are_those_of_the_constraints():
    """``make lock`` writes requirements-dev.txt; every file in it has a hash."""

    def pins(name):
        text = (ROOT / name).read_text(encoding="utf-8")
        found = re.findall(r"^([A-Za-z0-9_.-]+)(?:\[[^\]]*\])?==([^\s;]+)", text, re.MULTILINE)
        return {re.sub(r"[-_.]+", "-", key).lower(): version for key, version in found}

    locked, stated = pins("requirements-dev.txt"), pins("constraints.txt")
    assert len(locked) > 100
    assert locked == {name: stated.get(name) for name in locked}
    text = (ROOT / "requirements-dev.txt").read_text(encoding="utf-8")
    assert all("--hash=sha256:" in block for block in re.split(r"\n(?=\S)", text.strip()))
    groups = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["dependency-groups"]
    for group in ("test", "lint", "docs"):
        assert {Requirement(each).name.lower() for each in groups[group]} <= set(locked)


def test_no_machine_is_named():
    """No path of a machine, no host of packages in what is released."""
    for folder in ("docs", "examples", "benchmarks", ".github"):
        for path in (ROOT / folder).rglob("*"):
            if path.suffix in (".md", ".py", ".yml", ".rst", ".toml") and "_build" not in path.parts:
                text = path.read_text(encoding="utf-8")
                assert not re.search(r"(?<![\w/.])/(work|root|home|opt)/|/simple/", text), path


def _build(entry, folder, settings=None, root=ROOT, **environment):
    """Path of what an entry of the build backend makes in a folder."""
    pytest.importorskip("scikit_build_core", reason="the build backend")
    program = f"import snapbeam_build; print('made', snapbeam_build.{entry}({str(folder)!r}, {settings!r}))"
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=root, capture_output=True, text=True,
        env={**os.environ, "PYTHONPATH": str(root / "build_backend"), **environment},
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return folder / done.stdout.split("\nmade ")[-1].removeprefix("made ").strip()


@pytest.fixture(scope="module")
def archives(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dist")
    return _build("build_sdist", folder), _build("build_wheel", folder)


@pytest.mark.slow
def test_wheel_is_reproducible(archives, tmp_path):
    """A second build has the same bytes."""
    first, second = (path.read_bytes() for path in (archives[1], _build("build_wheel", tmp_path)))
    assert hashlib.sha256(first).hexdigest() == hashlib.sha256(second).hexdigest()


@pytest.mark.slow
def test_archives_hold_what_they_must(archives):
    source, wheel = archives
    assert max(source.stat().st_size, wheel.stat().st_size) < 8_000_000
    names = zipfile.ZipFile(wheel).namelist()
    for needed in ("snapbeam/py.typed", "snapbeam/paper/claims/topics/beam.toml"):
        assert needed in names
    assert all(name.startswith(("snapbeam/", "snapbeam-")) for name in names)
    assert len([name for name in names if re.fullmatch(r"snapbeam/_core[.\w-]*[.](so|pyd)", name)]) == 1
    assert not [name for name in names if name.endswith((".cpp", "CMakeLists.txt"))]
    assert "snapbeam/core/kernel.cu" in names  # with the headers, for a GPU
    with tarfile.open(source) as archive:
        held = {name.partition("/")[2] for name in archive.getnames()}
    for needed in (
        "pyproject.toml",
        "README.md",
        "LICENSE",
        "CITATION.cff",
        "docs/index.md",
        "tests/conftest.py",
        "CMakeLists.txt",
        "build_backend/snapbeam_build.py",
        "src/snapbeam/core/module.cpp",
        "src/snapbeam/core/step.hpp",
    ):
        assert needed in held
    assert not [name for name in held if "/_build/" in name or name.endswith((".pyc", ".so", ".pyd"))]
    assert not [name for name in held if name.startswith((".", "build/"))]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("which", "extra"), [("source", ""), ("wheel", ""), *(("wheel", extra) for extra in alone.EXTRAS)]
)
def test_each_runs_alone(which, extra, archives):
    """In a fresh environment, from nothing but the archive and what it says it needs."""
    source, wheel = archives
    alone.try_alone(source if which == "source" else wheel, extra)


@pytest.mark.slow
def test_no_compiler_is_needed(archives, tmp_path):
    """With nothing on the PATH, pip brings a compiler; its core has an AVX set where the processor has one."""
    venv.create(tmp_path / "env", with_pip=True)
    python = tmp_path / "env" / ("Scripts" if os.name == "nt" else "bin") / "python"
    (tmp_path / "empty").mkdir()
    environment = {name: value for name, value in os.environ.items() if name not in ("CXX", "PYTHONPATH")}
    environment["PATH"] = str(tmp_path / "empty")
    words = ["-m", "pip", "install", "--no-deps", "--no-compile", str(archives[0])]
    done = subprocess.run([python, *words], cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    # the module alone: what the package needs is not installed
    program = "import sys, sysconfig; sys.path.insert(0, sysconfig.get_path('platlib') + '/snapbeam'); import _core; "
    program += "print(*_core.instruction_sets())"
    sets = subprocess.run(
        [python, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=True
    ).stdout.split()
    flags = Path("/proc/cpuinfo").read_text(encoding="utf-8").split() if sys.platform == "linux" else []
    assert sets
    if {"avx2", "fma"} <= set(flags):
        assert {"avx2", "avx512"} & set(sets)


def test_an_editable_core_lies_in_the_package(tmp_path):
    """Also where one build has several configurations, as with Visual Studio, which adds a folder to a plain path."""
    pytest.importorskip("nanobind", reason="part of the build")
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    cmake = shutil.which("cmake", path=path) or pytest.skip("cmake was not found")
    words = ["-DSNAPBEAM_EDITABLE=ON", "-DSNAPBEAM_SETS=baseline", f"-DPython_EXECUTABLE={sys.executable}"]
    done = subprocess.run(
        [cmake, "-G", "Ninja Multi-Config", "-S", str(ROOT), "-B", str(tmp_path), *words], capture_output=True, text=True,
        env={**os.environ, "PATH": path},
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    rules = (tmp_path / "CMakeFiles" / "impl-Release.ninja").read_text(encoding="utf-8")
    folders = {
        Path(found).parent
        for found in re.findall(r"^build (\S*[/\\]_core[.][\w.-]*(?:so|pyd))[ :]", rules, re.MULTILINE)
    }
    assert folders == {ROOT / "src" / "snapbeam"}


def test_every_extra_is_tried():
    stated = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert set(stated["optional-dependencies"]) == set(alone.EXTRAS)
    assert set(alone.USES) == {"", *alone.EXTRAS}


def test_the_conda_recipe_has_the_dependencies_of_the_package():
    stated = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    recipe = (ROOT / "recipe" / "recipe.yaml").read_text(encoding="utf-8")
    held = {}
    for part in ("build", "host", "run"):
        lines = re.search(rf"  {part}:\n((?:    [^\n]*\n)+)", recipe).group(1).splitlines()
        held[part] = {line.strip("- ").replace("matplotlib-base", "matplotlib").replace(" ", "") for line in lines}
    project = stated["project"]
    assert held["run"] == {*project["dependencies"], "python" + project["requires-python"]}
    assert held["host"] == {*stated["build-system"]["requires"], "python", "pip"}
    assert '${{compiler("cxx")}}' in held["build"]


def test_the_paper_cites_what_its_bibliography_has():
    """Each citation resolves, each entry is cited and has a DOI, the sections are those of JOSS, of at most 1,000 words."""
    text = (ROOT / "paper" / "paper.md").read_text(encoding="utf-8")
    entries = dict(
        re.findall(r"@\w+\{(\w+),(.*?)\n\}", (ROOT / "paper" / "paper.bib").read_text(encoding="utf-8"), re.DOTALL)
    )
    body = text.split("---", 2)[2]
    assert re.findall(r"^# (.*)$", body, re.MULTILINE) == [
        "Summary", "Statement of need", "State of the field", "Software design", "Research impact statement",
        "AI usage disclosure", "References",
    ]  # fmt: skip
    assert set(re.findall(r"@([a-z]+\d{4})", body)) == set(entries)
    assert all("doi = {10." in entry for entry in entries.values())
    assert len(body.split()) <= 1000
    assert (ROOT / "paper" / re.search(r"\]\((\S+\.png)\)", body).group(1)).exists()


def test_the_paper_states_the_verdicts_that_are_stored():
    first = (ROOT / "docs" / "data" / "claims.md").read_text(encoding="utf-8").split("**")[1]
    numbers = re.search(r"Of (\d+) statements (\d+) hold, (\d+) hold in part and (\d+) fail", first).groups()
    text = (ROOT / "paper" / "paper.md").read_text(encoding="utf-8")
    assert (
        re.search(r"Of (\d+) testable statements (\d+) hold, (\d+) hold in part and (\d+) fail", text).groups()
        == numbers
    )
