"""Documentation pages: code runs, commands and options exist, the interface page is complete."""

from __future__ import annotations

import re
import runpy
import shlex
from importlib import import_module
from pathlib import Path
from types import ModuleType

import matplotlib.pyplot as plt
import numpy as np
import pytest
import typer.main

import snapbeam as sb
from snapbeam.cli.app import app
from snapbeam.model import default_values
from snapbeam.model.parameter_file import SECTIONS, load_config

ROOT = Path(__file__).parents[2]
PAGES = sorted([*(ROOT / "docs").glob("*.md"), *ROOT.glob("*.md")])
CODE = [
    "README.md",
    "contacts.md",
    "getting-started.md",
    "long_maps.md",
    "reproduction.md",
    "runs.md",
    "sweeps.md",
    "index.md",
    "variables.md",
    "api_system.md",
    "api_excitation.md",
    "api_runs.md",
    "api_dynamics.md",
    "api_uncertainty.md",
    "api_figures.md",
    "api_lab.md",
    pytest.param("base_and_load.md", marks=pytest.mark.slow),
    pytest.param("basins.md", marks=pytest.mark.slow),
    pytest.param("beams.md", marks=pytest.mark.slow),
    pytest.param("design.md", marks=pytest.mark.slow),
    pytest.param("exponents.md", marks=pytest.mark.slow),
    pytest.param("orbits.md", marks=pytest.mark.slow),
    pytest.param("systems.md", marks=pytest.mark.slow),
    pytest.param("strikers.md", marks=pytest.mark.slow),
    pytest.param("finite_elements.md", marks=pytest.mark.slow),
]
"""Pages whose Python blocks run in order in one namespace; those that take more than a few seconds are slow."""
ELSEWHERE = {
    "extending.md",
    "howto_harvester.md",
    "mems_arch.md",
    "mems_switch.md",
    "tutorial_beam.md",
    "tutorial_waveform.md",
}
"""Pages that other tests run: ``tests/solver/test_extending.py`` and ``test_tutorials.py``."""
NEEDS_FILES = (
    'open_dataset("map.nc")',
    'open_dataset("night.nc")',
    'open_recording("test.cihx"',
    'open_recording("wide.cihx"',
)
"""Beginnings of blocks that read a file which a command or a camera made."""
SMALLER = {"modes=32": "modes=2", "4.0, 128)": "4.0, 3)", "0.65, 80)": "0.65, 3)"}
"""The map of the page on long maps, with fewer modes and points."""
REFERENCE = runpy.run_path(str(ROOT / "docs" / "_ext" / "reference.py"))
API = "\n".join(path.read_text(encoding="utf-8") for path in sorted((ROOT / "docs").glob("api*.md")))
COMMANDS = typer.main.get_command(app).commands


def blocks(path: Path, kind: str) -> list[str]:
    """Fenced blocks of a kind."""
    found: list[list[str]] = []
    inside: str | None = None
    for line in path.read_text(encoding="utf-8").splitlines():
        if line.startswith("```"):
            inside = line[3:].strip() if inside is None else None
            if inside == kind:
                found.append([])
        elif inside == kind:
            found[-1].append(line)
    return ["\n".join(lines) + "\n" for lines in found]


def outputs(path: Path) -> dict[str, str]:
    """The output that a page shows directly below a block of Python, by the block."""
    text = path.read_text(encoding="utf-8")
    pattern = r"^```python\n((?:(?!```).*\n)*)```\n\n```\n((?:(?!```|snapbeam |pip ).*\n)+)```$"
    return dict(re.findall(pattern, text, re.MULTILINE))


def commands(path: Path) -> list[list[str]]:
    """Every command line of a page: in blocks of text, continued lines joined."""
    found = []
    for text in [*blocks(path, ""), *blocks(path, "sh"), *blocks(path, "bash")]:
        for line in text.replace("\\\n", " ").splitlines():
            if line.startswith("snapbeam "):
                words = shlex.split(line.partition("  #")[0])
                found.append([word for word in words if word != "..."])
    return found


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.name)
def test_python_is_python(path):
    for block in blocks(path, "python"):
        compile(block, path.name, "exec")


@pytest.mark.parametrize("name", CODE)
def test_code_runs(name, tmp_path, monkeypatch, capsys):
    path = next(page for page in PAGES if page.name == name)
    monkeypatch.chdir(tmp_path)
    scope: dict[str, object] = {}
    shown = outputs(path)
    for block in blocks(path, "python"):
        expected = shown.get(block)
        if any(words in block for words in NEEDS_FILES):
            continue
        if name == "long_maps.md":
            for words, fewer in SMALLER.items():
                assert words in block
                block = block.replace(words, fewer)
        capsys.readouterr()
        exec(compile(block, name, "exec"), scope)
        if expected is not None:
            printed = capsys.readouterr().out
            assert [line.rstrip() for line in printed.splitlines()] == expected.splitlines()
    plt.close("all")


def test_every_page_with_code_runs():
    """A page of ``docs`` with Python blocks is run, or all of its blocks need files."""
    run = {name if isinstance(name, str) else name.values[0] for name in CODE}
    for page in (ROOT / "docs").glob("*.md"):
        free = [b for b in blocks(page, "python") if not any(words in b for words in NEEDS_FILES)]
        assert not free or page.name in run | ELSEWHERE, page.name


def test_parameter_files_of_pages_are_valid(tmp_path):
    """Blocks of TOML with the sections of a parameter file are read without an error."""
    read = 0
    (tmp_path / "shaker.csv").write_text(
        "# sampling_frequency: 1000 Hz\nbase (g)\n" + "0.1\n-0.1\n" * 20, encoding="utf-8"
    )
    for page in PAGES:
        for block in blocks(page, "toml"):
            sections = set(re.findall(r"^\[+(\w+)", block, re.MULTILINE))
            if not sections <= set(SECTIONS):
                continue
            named = re.match(r"# (\S+\.toml)\b", block)
            file = tmp_path / (named[1] if named else f"{page.stem}{read}.toml")
            file.write_text(block, encoding="utf-8")
            load_config(file)
            read += 1
    assert read >= 4


def test_file_of_several_contacts_is_the_system_beside_it(tmp_path, monkeypatch):
    """The page on systems writes one system in Python and, with arrays of tables, as a file."""
    page, scope = ROOT / "docs" / "systems.md", {}
    monkeypatch.chdir(tmp_path)
    code = [block for block in blocks(page, "python") if "shaker = " in block or "stopped = " in block]
    exec(code[0].partition("print(")[0], scope)
    exec(code[1], scope)
    (tmp_path / "stopped.toml").write_text(blocks(page, "toml")[0], encoding="utf-8")
    read = load_config(tmp_path / "stopped.toml").system
    assert read.replace(**{"model.modes": 8}) == scope["closer"]
    command = next(words for words in commands(page) if "stopped.toml" in words)
    changed = dict(word.split("=") for word in command if word.startswith(("contact.", "force.")))
    assert set(changed) <= set(read.parameters)


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.name)
def test_commands_exist_with_their_options(path):
    for words in commands(path):
        assert words[1] in COMMANDS, words
        command = COMMANDS[words[1]]
        if hasattr(command, "commands"):  # a group of verbs
            assert words[2] in command.commands, words
            command = command.commands[words[2]]
        known = {flag for each in command.params for flag in (*each.opts, *each.secondary_opts)}
        for word in words[2:]:
            if word.startswith("-") and not re.match(r"-?-?[\d.]", word):
                assert word.partition("=")[0] in known, f"{word} in {' '.join(words)}"


def test_there_are_commands_in_the_pages():
    assert sum(len(commands(path)) for path in PAGES) > 15


@pytest.mark.parametrize("module", [
    "snapbeam", "snapbeam.model", "snapbeam.dynamics", "snapbeam.uncertainty", "snapbeam.plot", "snapbeam.lab",
    "snapbeam.explorer",
])  # fmt: skip
def test_interface_page_is_complete(module):
    text = API
    named = set(re.findall(r"(?:auto\w+|py:data)::\s*(\S+)$", text, re.MULTILINE))
    if block := re.search(rf"automodule:: {re.escape(module)}\n   :members:\n(?:   :exclude-members: (.*))?", text):
        # Sphinx lists every name of __all__; the page lists excluded names in another section
        assert {name for name in (block[1] or "").split(", ") if name} <= {name.split(".")[-1] for name in named}
        return
    package = import_module(module)
    elsewhere = {"Diagnostic", "Severity"} if module == "snapbeam.lab" else set()  # by the names of the core
    missing = [
        name
        for name in package.__all__
        if f"{module}.{name}" not in named
        and name not in elsewhere
        and not name.startswith("_")
        and not isinstance(getattr(package, name), ModuleType)
    ]
    assert not missing


def test_modules_of_the_interface_page_exist():
    text = API
    for name in re.findall(r"automodule:: (\S+)", text):
        import_module(name)


def test_names_stand_once_on_the_interface_page():
    text = API
    named = re.findall(r"auto(?:class|function|exception|data)::\s*(\S+)$", text, re.MULTILINE)
    assert len(named) > 50
    assert sorted({name for name in named if named.count(name) > 1}) == []


@pytest.mark.parametrize("path", sorted((ROOT / "docs").glob("api_*.md")), ids=lambda path: path.name)
def test_sections_of_the_interface_are_short(path):
    """At most 20 names under a heading, those of whole modules included."""
    for part in re.split(r"^## ", path.read_text(encoding="utf-8"), flags=re.MULTILINE):
        count = 0
        for directive in re.split(r"^(?=\.\. )", part, flags=re.MULTILINE)[1:]:
            module = re.match(r"\.\. automodule:: (\S+)", directive)
            members = re.search(r":members: (.+)", directive)
            left_out = re.search(r":exclude-members: (.+)", directive)
            if not module:
                count += 1
            elif members:
                count += len(members[1].split(","))
            else:
                count += len(import_module(module[1]).__all__) - len(left_out[1].split(",") if left_out else ())
        assert count <= 20


def test_every_page_is_in_the_tree():
    text = {path.stem: path.read_text(encoding="utf-8") for path in (ROOT / "docs").glob("*.md")}
    trees = "".join(re.findall(r"```\{toctree\}(.*?)```", "".join(text.values()), re.DOTALL))
    listed = re.findall(r"^(?:.* <)?([\w-]+)>?$", trees, re.MULTILINE)
    assert sorted(listed) == sorted(text.keys() - {"index"})


@pytest.mark.parametrize("name", [
    "api", "parameters", "variables", "command_line", "systems",
])  # fmt: skip
def test_tables_of_pages_are_those_of_the_program(name):
    """``python docs/_ext/reference.py`` writes them again."""
    text = (ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8")
    assert text == REFERENCE["written"](text, REFERENCE["pages"]()[name]())


def test_parameters_are_listed_by_type():
    text = REFERENCE["parameter_tables"]()
    assert "| `hunt_crossley` | `stiffness`, `damping_factor` |" in text
    assert "| `constant_velocity` |" in text and "## [harvester]" in text


def test_options_in_the_page_of_commands_are_code():
    """As words, ``--checkpoint`` would be set with a dash."""
    text = REFERENCE["command_line"]()
    words = re.sub(r"```.*?```", "", text, flags=re.DOTALL)
    bare = re.findall(r"(?<![\w`-])--[a-z][\w-]*", re.sub(r"`[^`]*`", "", words))
    assert not bare
    assert "`--checkpoint`" in words and "mathrm" not in words


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["a base with a sine", "a striker with a mass", "a load with a sine", "an external force"]
)
def test_crossings_end_runs_that_energy_does_not(name):
    """The table says "crossings" of these systems: runs end early, and none has another class than the complete run."""
    system = REFERENCE["_parts"]()[name].replace(**{"model.modes": 1})
    section, drive = system.primary_excitation
    axis = next(each for each in ("velocity_amplitude", "acceleration_amplitude", "amplitude") if hasattr(drive, each))
    axes = {f"{section}.{axis}": getattr(drive, axis) * np.linspace(1.0, 12.0, 40)}
    complete, early = (
        sb.sweep(system, axes, sb.Integration(cycles=60, early_termination=early)) for early in (False, True)
    )
    assert (early["status"] == sb.RunStatus.EARLY_STOP).sum() >= 4
    np.testing.assert_array_equal(early["response_class"], complete["response_class"])


@pytest.mark.slow
def test_a_proven_well_does_not_prove_the_class():
    """The page on frequent questions: after more cycles no proven well is another one, while the class may become transient."""
    system = sb.System(
        sb.ReducedModel.from_beam(default_values.BEAM, modes=2),
        contacts=[sb.Contact(default_values.CONTACT, sb.Shaker(frequency_ratio=1.2, velocity_amplitude=0.1))],
    )  # fmt: skip
    axes = {"drive.frequency_ratio": np.linspace(0.3, 3.0, 30), "drive.velocity_amplitude": np.linspace(0.1, 0.6, 30)}
    short, long = (sb.sweep(system, axes, sb.Integration(cycles=cycles)) for cycles in (60, 240))
    proven = short["final_well_proven"].values
    assert proven.sum() > 100
    np.testing.assert_array_equal(short["final_well"].values[proven], long["final_well"].values[proven])
    np.testing.assert_array_equal(short["zero_crossings"].values[proven], long["zero_crossings"].values[proven])
    before, after = (each["response_class"].values[proven] for each in (short, long))
    changed = before != after
    assert (before[changed] == sb.ResponseClass.CONTINUOUS).all()
    assert (after[changed] == sb.ResponseClass.TRANSIENT_2).all()


def test_supported_combinations():
    """Every row has an answer to each question; every refusal has a reason and a remedy."""
    text = REFERENCE["support_tables"]()
    first, second = (
        [line.strip("| ").split(" | ") for line in part.splitlines() if line.startswith("| ")]
        for part in re.split("These systems are refused as a whole.*", text)
    )
    assert len({tuple(row[1:]) for row in first[2:]}) == len(first[2:])
    answers = {name: dict(zip(first[0][1:], row[1:], strict=True)) for row in first[2:] for name in row[0].split("; ")}
    assert len(answers) > 40
    assert {value for row in answers.values() for value in row.values()} >= {
        "yes",
        "crossings",
        "crossings, energy",
        "no (1)",
    }
    assert all(row["`advance`"] == row["lifetimes"] == "yes" for row in answers.values())
    several = answers["several strikers of one frequency, or in such a ratio"]
    assert several["sections, exponents"] == several["orbits, branches, attractors, basins"] == "yes"
    reasons = re.findall(r"^\d+\. (.*)$", text, flags=re.MULTILINE)
    numbers = {
        int(number) for row in answers.values() for number in re.findall(r"no \((\d+)\)", " ".join(row.values()))
    }
    assert numbers == set(range(1, len(reasons) + 1))
    assert all(";" in reason for reason in reasons)
    assert len(second) > 5 and all(len(row) == 2 and len(row[1]) > 20 for row in second[2:])


def test_glossary_is_sorted_and_complete():
    """Terms of the axes, classes and tools; each has a definition."""
    text = (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8")
    entries = dict(re.findall(r"^(\S.*)\n((?:  .*\n)+)", text.partition("```{glossary}\n")[2], re.MULTILINE))
    assert list(entries) == sorted(entries, key=str.lower)
    assert all(words.rstrip().endswith(".") for words in entries.values())
    needed = {"snap-through", "penetration", "excitation", "checkpoint", "tolerance", "right-censored"}
    needed |= {"frequency ratio", "velocity amplitude", "attractor", "response class", "early termination"}
    assert needed <= set(entries)


TEXTS = [
    *(
        ROOT / name
        for name in (
            "README.md",
            "CONTRIBUTING.md",
            "CHANGELOG.md",
            "SECURITY.md",
            "benchmarks/README.md",
            "examples/lecture.md",
            "docs/data/studies.md",
            "docs/data/verification.md",
        )
    ),
    *sorted((ROOT / "docs").glob("*.md")),
]


@pytest.mark.parametrize("path", TEXTS, ids=lambda path: path.name)
def test_links_lead_to_files_of_the_repository(path) -> None:
    """Pages are read on the repository's page too, where nothing that is built exists."""
    text = re.sub(r"```.*?```", "", path.read_text(encoding="utf-8"), flags=re.DOTALL)
    targets = {link.split("#")[0] for link in re.findall(r"\]\(([^)\s]+)\)", text) if not re.match(r"[a-z]+:", link)}
    missing = [target for target in targets if target and not (path.parent / target).exists()]
    assert not missing


def table(name: str) -> list[list[str]]:
    """Rows of all tables of a stored text, without their headings."""
    text = (ROOT / "docs" / "data" / name).read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if line.startswith("|") and not re.match(r"\|[-:| ]+\|$", line)]
    return [[cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]] for line in lines]


def test_numbers_of_the_diagnostics():
    """The page states the counts of the stored tables."""
    page = " ".join((ROOT / "docs" / "verification.md").read_text(encoding="utf-8").split())
    ends = [row[1] for row in table("mistakes.md") if row[1] != "Result"]
    counts = [ends.count(end) for end in ("right", "flagged", "refused")]
    assert sum(counts) == len(ends)
    assert "Of {} errors, {} are right, {} are flagged and {} are refused".format(len(ends), *counts) in page
    samples = [
        row for row in table("random_defects.md") if row[0] and len(row) == 7 and "from its beginning" not in row[0]
    ]
    good, flagged, defective, undetected = (sum(int(row[i].split(",")[0]) for row in samples) for i in (1, 2, 4, 6))
    assert f"has {good + defective:,} random recordings" in page and f"{defective:,} of them with a defect" in page
    assert f"the {good:,} good ones, {flagged} were flagged by mistake" in page
    assert f"without a diagnostic. {undetected} did" in page


def test_lifetimes_of_the_pages():
    """Three pages round the lifetimes of the four points with 32 modes."""
    values = [float(row[1]) for row in table("lifetimes.md") if re.match(r"\(\d", row[0])]
    first, last = (round(value, -1) for value in (min(values), max(values)))
    for name in ("chaos", "exponents", "reproduction"):
        page = " ".join((ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8").split())
        assert f"about {first:.0f} to {last:.0f} cycles" in page, name
