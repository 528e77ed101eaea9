"""Options of ``snapbeam identify``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from snapbeam.cli.common import options as opt

__all__ = [
    "BucklingLevel",
    "ExponentialWindow",
    "Frequencies",
    "Method",
    "MirrorChannel",
    "Modes",
    "Soften",
    "Stabilisation",
    "Start",
    "Stop",
]

_DECAY = "Decay"


Modes = Annotated[int, opt.count_option("How many modes to look for (1).", _DECAY)]
Frequencies = Annotated[
    str | None,
    typer.Option(
        help="Rough frequencies of the modes, Hz, instead of --modes.",
        metavar="F,F",
        rich_help_panel=_DECAY,
    ),
]
Method = Annotated[str, typer.Option(help="fit, hilbert, log_decrement, or all.", rich_help_panel=_DECAY)]
Start = Annotated[float | None, opt.number_option("Start of the free decay, s.", _DECAY)]
Stop = Annotated[float | None, opt.number_option("End of the free decay, s.", _DECAY)]
Soften = Annotated[
    bool,
    typer.Option("--soften/--linear", help="Let frequency depend on amplitude.", rich_help_panel=_DECAY),
]
BucklingLevel = Annotated[
    float | None,
    opt.number_option("b, m: hold the softening near that of one mode, 0.75 (a/b)^2.", _DECAY),
]
ExponentialWindow = Annotated[
    float | None,
    opt.number_option("T, s: undo a window exp(-t/T) by which an analyser multiplied the record.", _DECAY),
]
MirrorChannel = Annotated[
    str | None,
    typer.Option(
        help="Channel of a second sensor at the mirror place: tells symmetric modes from antisymmetric ones.",
        metavar="NAME",
        rich_help_panel=_DECAY,
    ),
]
Stabilisation = Annotated[
    Path | None,
    typer.Option(
        help="Picture of the stabilisation diagram from which modes were read.",
        metavar="FILE",
        rich_help_panel="Output",
    ),
]
