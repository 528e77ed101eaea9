"""The options that several commands share, and how they become parameters."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from snapbeam.config import Config

__all__ = ["configured", "count_option", "number_option", "parse_window", "run_arguments"]

_BEAM = "Beam (default: the paper's)"
_MODEL = "Reduced model and contact"
_RUN = "Integration"
_OUTPUT = "Output"


def number_option(about: str, panel: str) -> Any:
    return typer.Option(help=about, rich_help_panel=panel, parser=_parse_number, metavar="NUMBER")


def count_option(about: str, panel: str) -> Any:
    return typer.Option(help=about, rich_help_panel=panel, parser=_parse_count, metavar="COUNT")


def _parse_number(text: str) -> float:
    numerator, slash, denominator = text.partition("/")
    try:
        return float(numerator) / float(denominator) if slash else float(text)
    except (ValueError, ZeroDivisionError):
        raise typer.BadParameter(f"{text!r} is not a number") from None


def _parse_count(text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise typer.BadParameter(f"{text!r} is not a whole number") from None


ConfigFile = Annotated[
    Path | None,
    typer.Option(
        "--config", "-c", help="TOML file of parameters; options given here override it.", metavar="FILE"
    ),
]
Length = Annotated[float | None, number_option("Distance between the clamps, m.", _BEAM)]
Thickness = Annotated[float | None, number_option("Thickness in the direction of bending, m.", _BEAM)]
Width = Annotated[float | None, number_option("Width of the section, m.", _BEAM)]
Density = Annotated[float | None, number_option("Mass density, kg/m^3.", _BEAM)]
YoungModulus = Annotated[float | None, number_option("Young's modulus, Pa.", _BEAM)]
BucklingLevel = Annotated[
    float | None, number_option("Height b of the buckled beam at its centre, m.", _BEAM)
]
AxialLoad = Annotated[
    float | None, number_option("Axial load, N, compression positive; instead of --buckling-level.", _BEAM)
]
Modes = Annotated[int | None, count_option("Number N of buckling modes, 1 to 256.", _MODEL)]
DampingRatio = Annotated[float | None, number_option("Damping ratio of every linear mode.", _MODEL)]
ContactStiffness = Annotated[float | None, number_option("Hertzian contact stiffness, N/m^1.5.", _MODEL)]
Cycles = Annotated[int | None, count_option("Cycles of excitation.", _RUN)]
ReferenceFreq = Annotated[
    float | None,
    number_option("Frequency that Omega and V are normalised by, Hz; the model's first by default.", _RUN),
]
Step = Annotated[float | None, number_option("Time step, s; follows from the model by default.", _RUN)]
Accuracy = Annotated[
    str | None,
    typer.Option(
        help="Of the integration: map, or reference, far finer, to check with.",
        rich_help_panel=_RUN,
        metavar="KIND",
    ),
]
Engine = Annotated[
    str | None,
    typer.Option(
        help="What integrates; auto takes the fastest there is.", rich_help_panel=_RUN, metavar="NAME"
    ),
]
EarlyDecision = Annotated[
    bool | None,
    typer.Option(
        "--early-decision/--no-early-decision",
        help="End a run once its response class is certain; its other statistics then stop there.",
        rich_help_panel=_RUN,
    ),
]
Threads = Annotated[int | None, count_option("Processor cores to use; all by default.", _RUN)]
Plot = Annotated[
    Path | None,
    typer.Option(
        "--plot", help="Picture to write: .png, .pdf or .svg.", rich_help_panel=_OUTPUT, metavar="FILE"
    ),
]
Dots = Annotated[
    Path | None,
    typer.Option(
        help="CSV of measured responses to lay over the picture: columns frequency_ratio or frequency_hz, "
        "velocity_amplitude or velocity_m_s, location (optional), response.",
        rich_help_panel=_OUTPUT,
        metavar="FILE",
    ),
]
ThresholdLine = Annotated[
    bool,
    typer.Option(
        "--threshold-line", help="Draw the quasi-static threshold V_QS1 (Eq. 21).", rich_help_panel=_OUTPUT
    ),
]
Window = Annotated[
    str | None,
    typer.Option(help="Cycles to draw, first:last.", rich_help_panel=_OUTPUT, metavar="FIRST:LAST"),
]

_PLACES = {
    "length": ("beam", "length"),
    "thickness": ("beam", "thickness"),
    "width": ("beam", "width"),
    "density": ("beam", "density"),
    "young_modulus": ("beam", "young_modulus"),
    "buckling_level": ("beam", "buckling_level"),
    "axial_load": ("beam", "axial_load"),
    "modes": ("model", "modes"),
    "damping_ratio": ("model", "damping_ratio"),
    "contact_stiffness": ("contact", "stiffness"),
    "cycles": ("run", "cycles"),
    "reference_freq": ("run", "reference_freq"),
    "step": ("run", "step"),
    "accuracy": ("run", "accuracy"),
    "engine": ("run", "engine"),
    "early_decision": ("run", "early_decision"),
}


def configured(given: Mapping[str, Any], **more: Mapping[str, Any]) -> Config:
    """Return the parameters of the ``--config`` file among the options *given*, overridden by the others.

    *more* holds further overrides, by section.
    """
    from snapbeam.config import Config, load_config, override

    config = load_config(given["config"]) if given.get("config") is not None else Config()
    sections: dict[str, dict[str, Any]] = {name: dict(values) for name, values in more.items()}
    for option, (section, name) in _PLACES.items():
        if option in given:
            sections.setdefault(section, {})[name] = given[option]
    return override(config, sections)


def run_arguments(config: Config) -> dict[str, Any]:
    """Return the arguments of a run that were given, to pass on."""
    return config.run.model_dump(exclude_none=True)


def parse_window(text: str | None) -> tuple[float, float] | None:
    """Return ``first:last`` as two numbers."""
    from snapbeam.core.validate import InputError, finite

    if text is None:
        return None
    try:
        first, last = (finite("window", float(part)) for part in text.split(":"))
    except ValueError:
        raise InputError(f"window = {text!r}: must be first:last, in cycles, such as 0:10") from None
    return first, last
