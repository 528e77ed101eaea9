"""The recorded interface: signatures, command options, statistics, dataset schemas and printed results.

A rename may change the record: write it again, and read the difference::

    python tests/conformance/recorded_interface.py
"""

from __future__ import annotations

import contextlib
import difflib
import enum
import inspect
import json
import re
import subprocess
import tempfile
import warnings
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from systems import SYSTEMS

import snapbeam as sb
from snapbeam.model import default_values

DATA = Path(__file__).parent / "data" / "recorded_interface.json"


def command_app() -> Any:
    """The commands as a Typer application."""
    from snapbeam.cli.app import app

    return app


def small_system(modes: int = 1, damping_ratio: float = 0.005, **drive: float) -> sb.System:
    """The paper's beam with few modes."""
    sine = sb.Sine(**({"frequency_ratio": 1.21, "velocity_amplitude": 0.18} | drive))
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=modes, damping_ratio=damping_ratio)
    return sb.System(model, contacts=[sb.Contact(default_values.CONTACT, sb.Striker(drive=sine))])


PLANE = {"frequency_ratio": [0.8, 1.4], "velocity_amplitude": [0.06, 0.15, 0.3]}
SPREAD = sb.uncertainty.ParameterUncertainty(
    of={"location": sb.uncertainty.Normal(0.01), "contact.stiffness": sb.uncertainty.LogNormal(0.2)}, phase=True
)
SHORT = sb.Integration(cycles=6, threads=1)


def quiet_system() -> sb.System:
    """A weakly driven beam with a periodic response in each well."""
    return small_system(1, 0.05, frequency_ratio=1.6, velocity_amplitude=0.03)


@cache
def found_attractors() -> Any:
    return sb.dynamics.find_attractors(quiet_system(), 12, transient=300, integration=sb.Integration(threads=1))


def basins() -> xr.Dataset:
    grid = {"amplitude[1]": np.linspace(-1.6, 1.6, 6), "velocity[1]": np.linspace(-1.0, 1.0, 5)}
    return sb.dynamics.basins_of_attraction(found_attractors(), grid, periods=100)


@cache
def orbit() -> Any:
    return sb.dynamics.periodic_orbit(quiet_system(), transient=300)


def branch() -> xr.Dataset:
    return sb.dynamics.continuation(orbit(), "velocity_amplitude", (0.02, 0.04), max_points=12).to_dataset()


def a_run() -> Any:
    return sb.simulate(small_system(3), SHORT)


ANALYSES: dict[str, Callable[[], xr.Dataset]] = {
    "run": lambda: a_run().dataset,
    "impacts of a run": lambda: a_run().impacts,
    "run with everything": lambda: sb.simulate(SYSTEMS["a bit of all"].system(), SHORT).dataset,
    "run with two strikers, impacts": lambda: sb.simulate(SYSTEMS["two strikers"].system(), SHORT).impacts,
    "perturbation growth": lambda: sb.perturbation_growth(small_system(3), sb.Integration(cycles=4)),
    "sweep": lambda: sb.sweep(small_system(3), PLANE, SHORT),
    "sweep with two strikers": lambda: sb.sweep(
        SYSTEMS["two strikers"].system(), {"velocity_amplitude": [0.1, 0.2]}, SHORT
    ),
    "sweep with replicates": lambda: sb.sweep(small_system(), PLANE, SHORT, replicates=sb.Replicates(3, check_half_step=True)),
    "sweep with refinement": lambda: sb.sweep(small_system(), PLANE, SHORT, refine_levels=1),
    "threshold": lambda: sb.threshold(
        small_system(), "velocity_amplitude", np.linspace(0.05, 0.4, 8), {"frequency_ratio": [0.8, 1.4]}, SHORT
    ),
    "lifetimes": lambda: sb.dynamics.lifetime_map(
        small_system(), PLANE, sb.Integration(cycles=60, threads=1), initial_conditions=6, after=[3, 10]
    ),
    "attractors": lambda: found_attractors().to_dataset(),
    "basins": basins,
    "bifurcation diagram": lambda: sb.dynamics.bifurcation_diagram(
        quiet_system(), "velocity_amplitude", [0.03, 0.05], sb.Integration(threads=1), periods=(20, 4), grazing=True
    ),
    "Poincare section": lambda: sb.dynamics.poincare_section(quiet_system(), periods=20, transient=10),
    "Lyapunov exponents": lambda: sb.dynamics.lyapunov_spectrum(small_system(3), 3, periods=20, transient=10),
    "largest Lyapunov exponent": lambda: sb.dynamics.largest_lyapunov(small_system(3), periods=20, transient=10),
    "branch": branch,
    "probability map": lambda: sb.uncertainty.probability_map(small_system(), PLANE, SPREAD, 12, integration=SHORT),
    "quantile threshold": lambda: sb.uncertainty.quantile_threshold(
        small_system(), "velocity_amplitude", (0.05, 0.4), uncertainty=SPREAD, options=sb.uncertainty.QuantileSearchSettings(runs=120), integration=SHORT
    ),
    "sensitivity": lambda: sb.uncertainty.sensitivity(
        small_system(), "peak_force", sb.uncertainty.ParameterUncertainty(of=SPREAD.of), samples=8, integration=SHORT
    ),
    "design": lambda: sb.uncertainty.optimize_design(
        small_system(), {"velocity_amplitude": (0.05, 0.4), "location": (0.3, 0.5)}, "speed",
        sb.uncertainty.Constraint(quantity="snap", lower=0.8), SPREAD,
        sb.uncertainty.OptimizerSettings(generations=2, population=6, samples=8, validation_samples=100, candidates=2), integration=SHORT,
    ),
}  # fmt: skip


@cache
def analysed(name: str) -> xr.Dataset:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return ANALYSES[name]()


def described_dataset(dataset: xr.Dataset) -> dict[str, Any]:
    """Dims, types and units of the variables, names of the attributes; no numbers."""
    variables = {}
    for name, variable in dataset.variables.items():
        found: dict[str, Any] = {
            "dims": ", ".join(map(str, variable.dims)), "dtype": str(variable.dtype),
            "coordinate": name in dataset.coords,
        }  # fmt: skip
        found |= {key: str(value) for key, value in sorted(variable.attrs.items())}
        if variable.dtype.kind in "OUST":
            found["values"] = sorted(set(map(str, variable.values.ravel())))
            found["dtype"] = "text"
        variables[str(name)] = found
    attributes = {str(name): type(value).__name__ for name, value in sorted(dataset.attrs.items())}
    return {"variables": variables, "attributes": attributes}


def described_commands() -> dict[str, Any]:
    """Options of every command, also of commands in groups."""
    import click
    import typer

    def walk(command: Any, path: str) -> Iterator[tuple[str, list[str]]]:
        context = click.Context(command, info_name=path)
        yield path, sorted("/".join([*each.opts, *each.secondary_opts]) for each in command.params)
        for name in getattr(command, "list_commands", lambda _: [])(context):
            yield from walk(command.get_command(context, name), f"{path} {name}")

    return dict(walk(typer.main.get_command(command_app()), "snapbeam"))


SMALL = "--modes 3 --cycles 5"
PRINTED = (
    f"simulate {SMALL} --frequency-ratio 1.21 --velocity-amplitude 0.18",
    f"simulate {SMALL} --frequency-ratio 1.21 --velocity-amplitude 0.18 --json -",
    "map --modes 1 --cycles 5 --frequency-ratio 0.5:2:4 --velocity-amplitude 0.1:0.6:3",
    "threshold --modes 1 --cycles 5 --frequency-ratio 0.8:1.4:2 --velocity-amplitude 0.05:0.5:6",
    "equilibria --modes 3",
    "frequencies --modes 3",
)
VARYING = re.compile(
    r"(?<=in )[\d.,]+ (?:ms|s|min|h)\b|[\d.,]+(?:e\+\d+)?(?= runs/s)|[\d.,]+(?= kB)|(?<=\"seconds\": )[\d.e-]+"
    r"|(?<=\"snapbeam_version\": ).*"
)
"""What differs from call to call: durations, sizes of files, the version."""
LONG = re.compile(r"-?\d+\.\d{6,}(?:e[-+]?\d+)?")
"""Numbers of which four digits are kept: the others are those of the steps."""


def printed() -> dict[str, list[str]]:
    """Lines that commands print, without durations and sizes of files."""
    from typer.testing import CliRunner

    found = {}
    for line in PRINTED:
        with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            result = CliRunner().invoke(command_app(), line.split())
        assert result.exit_code == 0, f"{line}: {result.output}"
        found[line] = [
            LONG.sub(lambda number: f"{float(number[0]):.4g}", VARYING.sub("...", text.rstrip()))
            for text in result.stdout.splitlines()
        ]
    return found


def described_signatures() -> dict[str, str]:
    """Signatures of public functions and classes."""
    public = {name: getattr(sb, name) for name in sorted(sb.__all__)}
    unsigned = (enum.Enum, BaseException)
    return {
        name: re.sub(r" at 0x[0-9a-f]+", "", str(inspect.signature(each)))
        if inspect.isfunction(each) or (inspect.isclass(each) and not issubclass(each, unsigned))
        else type(each).__name__
        for name, each in public.items()
    }


def described_variables() -> dict[str, Any]:
    """Attributes of every statistic and of the variables of a run, from the tables that datasets are made by."""
    from snapbeam.simulation.dataset import IMPACT_COLUMNS, SCHEMA
    from snapbeam.solver.statistics import STATISTICS

    return {
        "statistics": {name: [row.dtype, row.unit, row.long_name] for name, row in STATISTICS.items()},
        "runs": {name: list(map(str, row)) for name, row in SCHEMA.items()},
        "impacts": {name: list(row) for name, *row in IMPACT_COLUMNS},
    }


QUICK_PARTS: dict[str, Callable[[], Any]] = {
    "signatures": described_signatures,
    "commands": described_commands,
    "variables": described_variables,
}
"""Parts of the interface that are described without a run."""
PARTS = {
    "datasets": lambda: {name: described_dataset(analysed(name)) for name in ANALYSES},
    **QUICK_PARTS,
    "printed": printed,
}


def parent_commit() -> str:
    """The commit that a record is made on, with "and changes" if files differ from it."""
    git = ["git", "-C", str(Path(__file__).parent)]
    commit = subprocess.run([*git, "log", "-1", "--format=%h %s"], check=True, capture_output=True, text=True)
    changed = subprocess.run([*git, "diff", "--quiet", "HEAD"], check=False).returncode
    return commit.stdout.strip() + (", and changes" if changed else "")


def write(path: Path = DATA) -> None:
    found = {"recorded_on": parent_commit()} | {name: describe() for name, describe in PARTS.items()}
    text = json.dumps(found, indent=1, ensure_ascii=False)
    path.write_text(text + "\n", encoding="utf-8")


def differences(parts: Iterable[str] = PARTS, path: Path = DATA) -> list[str]:
    """Lines of a unified difference of some parts; empty if nothing changed."""
    stored = json.loads(path.read_text(encoding="utf-8"))
    lines = []
    for name in parts:
        texts = [json.dumps(each, indent=1, ensure_ascii=False) for each in (stored.get(name), PARTS[name]())]
        lines += difflib.unified_diff(
            *(each.splitlines() for each in texts), f"{name}, {stored['recorded_on']}", "now", "", "", 2, ""
        )
    return lines


if __name__ == "__main__":
    write()
