"""Options of ``snapbeam calibrate``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from snapbeam.cli.common import options as opt

__all__ = [
    "Config",
    "Damping",
    "EffectiveMass",
    "Fit",
    "FrequencySe",
    "Impacts",
    "LowerWell",
    "MeasuredBucklingLevel",
    "MeasuredThickness",
    "Measurements",
    "Modes",
    "Output",
    "Straight",
    "UpperWell",
]

_MEASURED = "Measured (instead of, or beside, the file)"
_FIT = "Fit"


def _list_option(about: str) -> Any:
    return typer.Option(help=about, metavar="F,F", rich_help_panel=_MEASURED)


Measurements = Annotated[
    Path | None,
    typer.Argument(help="TOML file with a section named measured.", metavar="[MEASUREMENTS]"),
]
Straight = Annotated[str | None, _list_option("Natural frequencies without load, Hz.")]
LowerWell = Annotated[
    str | None, _list_option("About the lower well, Hz; 81.3s or 159a says symmetric or antisymmetric.")
]
UpperWell = Annotated[str | None, _list_option("About the upper well, Hz, likewise.")]
Damping = Annotated[str | None, _list_option("Damping ratios from free decays.")]
FrequencySe = Annotated[
    float | None, opt.number_option("Standard error of these frequencies, Hz (0.5 %).", _MEASURED)
]
MeasuredThickness = Annotated[
    float | None, opt.number_option("Thickness by gauge, m, to compare with.", _MEASURED)
]
MeasuredBucklingLevel = Annotated[
    float | None, opt.number_option("Buckling level by gauge, m, to compare with.", _MEASURED)
]
Impacts = Annotated[
    Path | None,
    typer.Option(
        help="NetCDF file of tracked impacts on a heavy body, for the contact stiffness.",
        metavar="FILE",
        rich_help_panel=_MEASURED,
    ),
]
EffectiveMass = Annotated[
    float | None, opt.number_option("1/(1/m1 + 1/m2) of the two bodies of --impacts, kg.", _MEASURED)
]
Config = Annotated[
    Path | None,
    typer.Option("--config", "-c", help="TOML file of parameters of the beam and the model.", metavar="FILE"),
]
Fit = Annotated[
    str | None,
    typer.Option(
        help="What to fit, among thickness, young_modulus, density, length, buckling_level; by default "
        "what the measurements ask for.",
        metavar="NAME,NAME",
        rich_help_panel=_FIT,
    ),
]
Imperfection = Annotated[
    str | None,
    typer.Option(
        help="What makes the wells unequal, fitted to the first frequencies about both: rise, point_load or "
        "uniform_load.",
        rich_help_panel=_FIT,
    ),
]
Modes = Annotated[int | None, opt.count_option("Number N of buckling modes, 1 to 256.", _FIT)]
Output = Annotated[
    Path | None,
    typer.Option(
        "--output",
        "-o",
        help="TOML file for snapbeam map --config to write.",
        metavar="FILE",
        rich_help_panel="Output",
    ),
]
