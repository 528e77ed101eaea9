"""What the files of these commands hold: a system as any parameter file, its spread, and what is asked of it."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from snapbeam.cli.common.console import answer, file_line, notes, out

if TYPE_CHECKING:
    import xarray as xr

    from snapbeam.config import Config
    from snapbeam.design.plan import CostEstimate
    from snapbeam.design.spread import ParameterUncertainty

__all__ = ["File", "Output", "PlanOnly", "Store", "Yes", "agreed", "finish", "read", "taken"]

File = Annotated[
    Path, typer.Argument(help="TOML file of the system, its spread and the question.", metavar="FILE")
]
Store = Annotated[
    Path | None,
    typer.Option(
        help="Folder that keeps the runs; one that exists is resumed.",
        rich_help_panel="Output",
        metavar="DIR",
    ),
]
Yes = Annotated[
    bool,
    typer.Option(
        "--yes", "-y", help="Compute without being asked, however long it takes.", rich_help_panel="Cost"
    ),
]
PlanOnly = Annotated[
    bool,
    typer.Option(
        "--estimate-cost",
        help="Say what it costs, from a trial of ten seconds, and stop.",
        rich_help_panel="Cost",
    ),
]
Output = typer.Option(
    "--output", "-o", help="NetCDF file to write.", rich_help_panel="Output", metavar="FILE"
)


def read(file: Path, section: str) -> tuple[Config, ParameterUncertainty, dict[str, Any]]:
    """The system, its spread and the section of the question.

    Raises
    ------
    InputError
        If the file cannot be read, has no spread or no such section, or holds what nothing knows.
    """
    from snapbeam.config import config_from_mapping
    from snapbeam.core.validate import InputError
    from snapbeam.design.spread import spread_from_mapping

    try:
        sections = tomllib.loads(file.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise InputError(f"file = {str(file)!r}: cannot be read as TOML, {error}") from None
    if "spread" not in sections:
        raise InputError(
            f"{file.name}: has no [spread], which says what differs; without one use snapbeam map"
        )
    spread = spread_from_mapping(sections.pop("spread"))
    question = sections.pop(section, {})
    for other in ("probability", "design"):
        sections.pop(other, None)
    if not isinstance(question, dict):
        raise InputError(f"{file.name}: [{section}] must be a section")
    return config_from_mapping(sections, file.name), spread, question


def taken(kind: Any, table: dict[str, Any], where: str) -> Any:
    """A frozen value from a table; names that it does not have are refused."""
    import dataclasses

    from snapbeam.core.validate import InputError

    known = [each.name for each in dataclasses.fields(kind)]
    for name in table:
        if name not in known:
            raise InputError(f"{where}.{name}: unknown; must be one of {', '.join(known)}")
    try:
        return kind(**table)
    except TypeError as error:
        raise InputError(f"{where}: {error}") from None


def agreed(cost: CostEstimate, yes: bool, stop: bool) -> bool:
    """Tell what a computation costs, and ask where it is long and somebody is there to answer."""
    import sys

    notes().print(f"{cost}", markup=False)
    answer(
        plan={
            "runs": cost.runs,
            "runs_most": cost.max_runs,
            "seconds": cost.seconds,
            "disk_bytes": cost.disk,
        }
    )
    if stop:
        return False
    if cost.is_long and not yes and sys.stdin.isatty():
        return typer.confirm("This takes more than ten minutes. Compute it?")
    return True


def finish(dataset: xr.Dataset, output: Path, plot: Path | None, drawn: Any, lines: list[str]) -> None:
    """Write the results, draw them, and say what they are."""
    from snapbeam.cli.common.results import write_map

    files = [write_map(dataset, output)]
    if plot is not None:
        import matplotlib

        matplotlib.use("Agg")
        from snapbeam.figures import save_figure

        files.append(save_figure(drawn(dataset), plot))
    answer(words=lines, files=files)
    out().print(*lines, *(f"Written: {file_line(path)}" for path in files), sep="\n")
