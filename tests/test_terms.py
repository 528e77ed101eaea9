"""No name that the glossary replaced is left in the public interface and on the pages of the documentation."""

from __future__ import annotations

import dataclasses
import inspect
import re
import types
import typing
from collections.abc import Callable, Iterator
from pathlib import Path

import prose
import pytest
import typer

import snapbeam as sb
from snapbeam.model.parameters import parameters
from snapbeam.parts import installed_parts
from snapbeam.simulation.dataset import SCHEMA
from snapbeam.solver.statistics import STATISTICS

NAMESPACES = [sb, sb.dynamics, sb.model, sb.plot, sb.uncertainty]

NAMES = set(
    """
    Another Keeping Tally Still Flight Sum Recorded RecordedDrive Noise TwoSines Ends Base AxialLoad LoadSine Piezo Coil Accuracy
    Outcome Response Replicas Starts Survival Orbit NoOrbit Event Spread Between Uniform Allocation Search Effort Evolution Goal Limit
    StatisticOf ThresholdOf NotchOf LifetimeOf Cost Finding Keeps conditioning lyapunov separation_exponent poincare integrity
    attractors basins edge_state continue_orbit plan posterior design judge_dots given_data_indices sobol fit_wells exact_natural_freq
    withdraw long_map threshold_curve response_map read_store load_run read_dots compare_dots StoreError PlausibilityWarning findings
    """.split()
)
MEMBERS = {
    "Chirp": {"spacing", "sweep_length"},
    "Burst": {"length", "rise", "fall", "retreat"},
    "BandLimitedNoise": {"rise"},
    "Striker": {"spring", "damper"},
    "KelvinVoigt": {"spring", "damper"},
    "HuntCrossley": {"loss"},
    "PowerLaw": {"force_at_micrometre"},
    "BoundaryConditions": {"left", "right", "axial", "turn"},
    "Imperfection": {"rise", "skew", "form", "side_load"},
    "BaseExcitation": {"carries_striker"},
    "PiezoelectricHarvester": {"start", "stop", "coupling"},
    "ElectromagneticHarvester": {"constant"},
    "Integration": {"early_decision"},
    "State": {"passed"},
    "RunSummary": {"table"},
    "Run": {"outcome", "end", "response"},
    "Replicates": {"size", "halve_step"},
    "CheckpointOptions": {"verify", "chunk", "tally"},
    "System": {"base", "axial", "start", "others", "leads", "has_surroundings", "findings"},
    "Beam": {"ends", "tension_stiffness"},
    "ReducedModel": {
        "tension_stiffness",
        "equilibrium",
        "natural_freq",
        "reference_freq",
        "side_force",
        "center_shape",
    },
    "ContactLaw": {"keeps", "lossy", "side_by_side", "resolved_time", "damping"},
    "Statistic": {"words"},
    "Diagnostic": {"words", "doubtful"},
    "LifetimeSettings": {"quiet"},
    "SpecialPoint": {"after"},
    "Branch": {"end", "events"},
    "Attractor": {"captures", "certificate"},
    "ParameterUncertainty": {"held"},
    "SamplingPlan": {"first", "most", "total"},
    "OptimizerSettings": {"fresh", "draws"},
    "Objective": {"of", "largest"},
    "Constraint": {"of", "at_least", "at_most"},
    "Posterior": {"effective"},
}
ARGUMENTS = {
    "advance": {"every"},
    "sweep": {"store", "replicas"},
    "threshold": {"along", "over", "share"},
    "continuation": {"most", "longest", "between"},
    "find_attractors": {"lasting", "most_periods"},
    "basins_of_attraction": {"found", "plane", "rest"},
    "edge_tracking": {"quiet", "snapping", "distance", "apart"},
    "lifetime_map": {"starts", "survival", "store"},
    "quantile_threshold": {"along", "between", "over", "how", "spread", "store"},
    "probability_map": {"spread", "store"},
    "optimize_design": {"goals", "limits", "spread", "effort", "store"},
    "estimate_posterior": {"draws"},
    "sensitivity": {"answer", "spread", "size", "store"},
    "score_measurements": {"dots"},
}
VARIABLES = set(
    """
    shaker_work work_shaker work_base work_load dissipated_energy harvested_energy contact_loss shaker_displacement displacement
    velocity center_displacement center_velocity crossings crossings_last_quarter last_crossing end_is_final contact_share
    high_frequency_share class_share decided_at first_interwell always_interwell response holds penetration rise_p monotone
    """.split()
)
SECTIONS = {"ends", "base", "axial", "start", "run", "axes", "spread"}
KEYS = {
    "law",
    "kind",
    "spring",
    "damper",
    "loss",
    "skew",
    "rise",
    "form",
    "retreat",
    "spacing",
    "sweep_length",
    "carries_striker",
    "early_decision",
}
OPTIONS = set(
    """
    --store --verify --axis --along --share --refine --chunk --halve-step --velocity --restitution-coefficient --contact-restitution
    --restitution-speed --drive --kick --threshold-line --dots --replicas --replica-size --plan --early-decision --contact-loss
    --striker-spring --striker-damper --ends-left --ends-right --ends-axial --quiet-cycles --reference-freq
    """.split()
)
COMMANDS = {"draw", "paper", "wells", "identify", "campaign"}
WORDS = re.compile(
    r"\b(march(es|ed|ing)?|ledgers?|worlds?|doors?|house|anew|tall(y|ies)|rungs?|campaigns?|goals?|early decisions?)\b",
    re.IGNORECASE,
)
"""Words that have a term in the glossary, and no other meaning on a page of this documentation."""
ROOT = Path(__file__).parents[1]
PAGES = [*sorted((ROOT / "docs").glob("*.md")), *sorted((ROOT / "docs" / "data").glob("*.md"))]
PAGES += [
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    ROOT / "benchmarks" / "README.md",
    *sorted((ROOT / "examples").glob("*.py")),
]


def public_objects() -> dict[str, object]:
    """Every public name of the package and its namespaces."""
    found: dict[str, object] = {}
    for namespace in NAMESPACES:
        found |= {name: getattr(namespace, name) for name in namespace.__all__}
    return found


def test_public_names() -> None:
    assert NAMES & public_objects().keys() == set()
    assert len(sb.__all__) <= 86, "the top level holds what a first script needs"


@pytest.mark.parametrize("name", sorted(MEMBERS))
def test_fields_and_attributes(name: str) -> None:
    kind = public_objects()[name]
    assert isinstance(kind, type)
    members = {attribute for attribute in dir(kind) if not attribute.startswith("_")}
    if dataclasses.is_dataclass(kind):
        members |= {field.name for field in dataclasses.fields(kind)}
    members |= set(
        typing.get_type_hints(kind) if isinstance(kind, types.GenericAlias) else getattr(kind, "__annotations__", {})
    )
    assert MEMBERS[name] & members == set()


@pytest.mark.parametrize("name", sorted(ARGUMENTS))
def test_arguments(name: str) -> None:
    function = public_objects()[name]
    assert callable(function)
    assert ARGUMENTS[name] & inspect.signature(function).parameters.keys() == set()


def test_statuses_and_levels() -> None:
    assert {"DECIDED", "RUNNING", "NOT_FINITE", "UNBALANCED", "INFERRED"} & set(sb.RunStatus.__members__) == set()
    assert sb.Integration().accuracy == "standard"


def test_dataset_variables() -> None:
    assert VARIABLES & set(STATISTICS) == set()
    assert VARIABLES & set(SCHEMA) == set()


def test_parameters() -> None:
    for name in parameters():
        section, _, key = name.partition(".")
        assert section not in SECTIONS and key not in KEYS, name


def commands() -> dict[str, object]:
    """Every command with its subcommands, by its words."""
    from snapbeam.cli import app

    found: dict[str, object] = {}

    def visit(command: object, words: str) -> None:
        for name in getattr(command, "commands", {}):
            visit(command.commands[name], f"{words} {name}".strip())
        if words:
            found[words] = command

    visit(typer.main.get_command(app), "")
    return found


def test_commands_and_options() -> None:
    found = commands()
    assert COMMANDS & found.keys() == set()
    left = {
        words: sorted(OPTIONS & {option for each in getattr(command, "params", []) for option in each.opts})
        for words, command in found.items()
    }
    assert {words: options for words, options in left.items() if options} == {}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_pages(page: Path) -> None:
    lines = page.read_text(encoding="utf-8").splitlines()
    assert [line for line in lines if WORDS.search(line)] == []


@pytest.fixture(scope="module")
def docstrings() -> list[tuple[str, str]]:
    return list(prose.docstrings())


def test_docstrings_begin_with_a_noun_or_an_imperative(docstrings: list[tuple[str, str]]) -> None:
    """A first word such as What or Whether names no object."""
    begins = ((place, re.match(r"\W*(\w+)", text)) for place, text in docstrings)
    assert [(place, word[1]) for place, word in begins if word and word[1] in prose.CLAUSES] == []


def test_docstrings(docstrings: list[tuple[str, str]]) -> None:
    assert [
        place for place, text in docstrings if WORDS.search(prose.plain(text)) or prose.BANNED.search(prose.plain(text))
    ] == []


@pytest.mark.parametrize("texts", [prose.help_texts, prose.headings, prose.labels], ids=lambda each: each.__name__)
def test_printed_texts(texts: Callable[[], Iterator[tuple[str, str]]]) -> None:
    """Help of the command line, headings of tables, labels of figures and variables."""
    printed = list(texts())
    found = [(place, text) for place, text in printed if WORDS.search(text) or prose.BANNED.search(text)]
    found += [(place, text) for place, text in printed if text.startswith("What ")]
    assert found == []


def test_parts_are_found() -> None:
    assert set(installed_parts()) <= {"lab", "explorer", "paper"}
