"""Record the numbers of about 2,000 runs, and compare the package with them bitwise.

A refactoring must not change a number.  This script computes ensembles, recorded runs, advanced states, tangents and
small analyses of every entry of ``systems.SYSTEMS`` and stores them::

    python tests/conformance/reference_corpus.py record tests/conformance/data/reference_corpus.npz
    python tests/conformance/reference_corpus.py compare tests/conformance/data/reference_corpus.npz
    python tests/conformance/reference_corpus.py interface tests/conformance/data/reference_corpus.npz

``record`` writes three files:

``reference_corpus.npz``
    One array of 64-bit words per table, shape (variables, rows): the bits of a number, or the first 8 bytes of the
    SHA-256 hash of an array.
``reference_corpus.json``
    The names of the variables of each table, in the order of the array; the cases with their numbers of rows; and the
    hashes of the models.  If a variable is renamed, edit its name here.  ``null`` skips a variable.
``reference_interface.json``
    Signatures, command options, statistics, dataset schemas and printed results, with the commit they are of.  A rename
    may change this file: write it again with ``interface`` and read the difference.
"""

from __future__ import annotations

import contextlib
import difflib
import enum
import hashlib
import inspect
import json
import os
import platform
import re
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, fields
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any, NamedTuple

sys.path.insert(0, str(Path(__file__).parents[1]))

from blas_kernel import blas_kernel

os.environ.update(blas_kernel())

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from systems import SYSTEMS, ExtendedSystem

import snapbeam as sb
from snapbeam.model import default_values

DATA = Path(__file__).parent / "data" / "reference_corpus.npz"
ACCURACY = {"order 4": "standard", "order 6": "reference"}
"""Accuracy of an integration by the order of its composition."""
LAYOUTS = ("mode lanes", "run lanes")
"""CPU layouts: eight modes of a run in a register, or eight runs."""
RUN_LANE_MODES = 12
"""Maximum number of modes that the package itself integrates in run lanes."""

# ---------------------------------------------------------------- internals: all that this script uses


def integrate(
    system: sb.System, integration: sb.Integration, points: Mapping[str, Any], layout: str
) -> tuple[NDArray[Any], dict[str, NDArray[Any]]] | None:
    """Kernel records and statistics of an ensemble in one CPU layout; None if the layout does not support it."""
    from snapbeam.solver.cpu import driver

    from snapbeam.solver.assemble import make_ensemble
    from snapbeam.solver.statistics import statistics_of

    ensemble = make_ensemble(system, integration, points)
    before = driver.FEW_MODES, driver.FEWEST_STEPS
    driver.FEW_MODES, driver.FEWEST_STEPS = 0 if layout == "mode lanes" else RUN_LANE_MODES, 0.0
    try:
        if layout == "run lanes" and not driver._few_modes_pay(ensemble, driver._packed(ensemble)):
            return None
        records = driver.run_ensemble(ensemble, 1)
    finally:
        driver.FEW_MODES, driver.FEWEST_STEPS = before
    return records, statistics_of(ensemble, records)


def model_arrays(model: sb.ReducedModel) -> list[NDArray[Any]]:
    """Numbers of a model that linear algebra computes, also of its mirror image."""
    return [
        np.asarray(values)
        for each in (model, model.mirrored)
        for values in (
            each.mass, each.stiffness, each.tension_matrix, each.omega, each.linear_modes, each.well_amplitude
        )
    ]  # fmt: skip


def solver_fingerprint() -> str:
    from snapbeam.solver.fingerprint import solver_fingerprint

    return solver_fingerprint()


def command_app() -> Any:
    """The commands as a Typer application."""
    from snapbeam.cli.app import app

    return app


# ---------------------------------------------------------------- words

ABSENT = np.uint64(0x7FF8DEAD00000000)
"""Stands for a variable that a case does not have; a NaN that no computation gives."""
Row = dict[str, np.uint64]


def words(values: Any) -> NDArray[np.uint64]:
    """The bits of numbers; every NaN has the same bits."""
    array = np.asarray(values)
    if array.dtype.kind in "biu":
        return np.ascontiguousarray(array, dtype=np.int64).view(np.uint64)
    if array.dtype.kind == "c":
        array = np.stack((array.real, array.imag), axis=-1)
    array = np.array(array, dtype=np.float64, order="C", ndmin=1)
    array[np.isnan(array)] = np.nan
    return array.view(np.uint64)


def word(value: Any) -> np.uint64:
    """The bits of one number."""
    return np.uint64(words(np.atleast_1d(value))[0])


def digest(values: Any) -> np.uint64:
    """The first 8 bytes of the SHA-256 hash of an array's shape and bits."""
    found = hashlib.sha256(str(np.shape(values)).encode())
    found.update(words(values).astype("<u8").tobytes())
    return np.uint64(int.from_bytes(found.digest()[:8], "little"))


def model_hash(system: sb.System) -> str:
    """Hash of the matrices of a model, and of NumPy's elementary functions, from which drives are sampled.

    Linear algebra and vectorised functions round differently on other processors.
    """
    found = hashlib.sha256()
    x = np.linspace(0.01, 20.0, 1000)
    for values in (*model_arrays(system.model), np.sin(x), np.cos(x), np.exp(x), np.log(x), x**1.5):
        found.update(words(values).astype("<u8").tobytes())
    return found.hexdigest()[:16]


def dataset_row(dataset: xr.Dataset, prefix: str = "") -> Row:
    """Digests of all numeric variables and coordinates."""
    return {
        f"{prefix}{name}": digest(variable.values)
        for name, variable in dataset.variables.items()
        if variable.dtype.kind in "biufc"
    }


# ---------------------------------------------------------------- cases


@dataclass(frozen=True)
class Case:
    """Rows of one table."""

    name: str
    entry: str
    """Of ``systems.SYSTEMS``, or "analyses"."""
    table: str
    system: Callable[[], sb.System]
    rows: Callable[[], list[Row] | None]
    """None if the package does not support the case."""
    quick: bool = False
    """Whether the test suite without slow tests includes it."""


def columns_of(records: NDArray[Any]) -> dict[str, NDArray[Any]]:
    """Columns of kernel records; a column of arrays becomes several."""
    found: dict[str, NDArray[Any]] = {}
    for name in records.dtype.names or ():
        values = records[name].reshape(records.size, -1)
        many = records[name].ndim > 1
        found |= {f"{name}[{i}]" if many else name: values[:, i] for i in range(values.shape[1])}
    return found


def ensemble_rows(
    entry: ExtendedSystem, modes: int, runs: int, seed: int, layout: str, **how: Any
) -> list[Row] | None:
    """Kernel records and statistics of random runs."""
    system, points = entry.system(modes), entry.points(runs, seed)
    found = integrate(system, sb.Integration(threads=1, **how), points, layout)
    if found is None:
        return None
    records, statistics = found
    columns = {f"record.{name}": words(values) for name, values in columns_of(records).items()}
    columns |= {f"statistic.{name}": words(values) for name, values in statistics.items()}
    return [{name: values[i] for name, values in columns.items()} for i in range(runs)]


def run_row(system: sb.System, integration: sb.Integration, times: Any = None) -> Row:
    """One recorded run: time series, impacts, statistics, final state and error estimate."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        run = sb.simulate(system, integration, sample_times=times)
    row = dataset_row(run.dataset) | dataset_row(run.impacts, "impact.")
    row |= {f"statistic.{name}": word(value) for name, value in run.summary.items()}
    if run.accuracy is not None:
        row |= {
            f"accuracy.{each.name}": word(getattr(run.accuracy, each.name)) for each in fields(run.accuracy)
        }
    if run.final_state is not None:
        row |= state_row(run.final_state, (), "end.")
    return row


STATE_ARRAYS = (
    "amplitude", "velocity", "phase", "striker_position", "contact_time", "striker_shift", "striker_rate", "circuit"
)  # fmt: skip


def state_row(state: sb.State, index: tuple[Any, ...], prefix: str = "") -> Row:
    """One state of a batch."""
    arrays = {name: getattr(state, name) for name in STATE_ARRAYS}
    arrays["contact_time"] = state.contact_time[..., 0]  # of the first striker
    row = {f"{prefix}{name}": digest(values[index]) for name, values in arrays.items()}
    if state.modal is not None:
        modal = state.modal._asdict()
        del modal["structure"]
        row |= {f"{prefix}modal.{name}": digest(np.asarray(values)[index]) for name, values in modal.items()}
    return row


def advanced_rows(system: sb.System, order: str, periods: int, tangents: int = 0) -> list[Row] | None:
    """Four states, an equilibrium and three random ones, advanced; the hashes cover every period."""
    rng = np.random.default_rng(5)
    modes = system.model.modes
    scale = float(np.abs(system.model.well_amplitude).max())
    amplitude = np.array([-1.0, -0.9, 0.8, 1.0])[:, None] * system.model.well_amplitude
    amplitude[1:] += 0.02 * scale * rng.standard_normal((3, modes))
    velocity = 0.1 * scale * float(system.model.omega.min()) * rng.standard_normal((4, modes))
    tangent = scale * rng.standard_normal((4, tangents, 2, modes)) if tangents else None
    start = sb.State(amplitude=amplitude, velocity=velocity)
    how = sb.Integration(accuracy=ACCURACY[order], threads=1)
    try:
        found = sb.advance(system, start, periods, tangent, integration=how, save_every_period=not tangents)
    except sb.InputError:
        return None
    assert found.statistics is not None
    rows = []
    for i in range(4):
        row = state_row(found, (i,) if tangents else (slice(None), i))
        row |= {
            f"statistic.{name}": digest(np.asarray(values)[..., i])
            for name, values in found.statistics.items()
        }
        if found.tangent is not None:
            row["tangent"] = digest(found.tangent[i])
        rows.append(row)
    return rows


QUICK = ("the paper's",)
"""Entries whose kernels other quick tests use too, in the order in which a second process begins to use them."""
TANGENTS = (
    "the paper's", "power", "a gap", "recorded", "unequal wells", "a measured shape", "other ends", "a given load",
    "a base", "a changing load",
)  # fmt: skip
"""Entries whose tangents are recorded: each has a kernel of its own, which compiles for about 10 s."""


def modes_of(name: str, entry: ExtendedSystem) -> tuple[int, ...]:
    if entry.modes == 1:
        return (1,)
    return tuple(n for n in (1, 3, 8) if n >= entry.fewest) if entry.fewest < 2 else (2, 3, 8)


def ensemble_cases() -> Iterator[Case]:
    """Random runs of every entry, by modes, order, early termination and layout."""
    for number, (name, entry) in enumerate(SYSTEMS.items()):
        settings: list[tuple[int, str, bool, int, int]] = []  # modes, order, early, runs, cycles
        for modes in modes_of(name, entry):
            settings.append((modes, "order 4", False, 9, min(10, entry.cycles)))
            if entry.decides:
                settings.append((modes, "order 4", True, 8, min(40, entry.cycles)))
        middle = modes_of(name, entry)[-1 if entry.modes == 1 else 1]
        settings.append((middle, "order 6", False, 8, 3))
        if name == "the paper's":
            settings += [(modes, "order 4", False, 16, 8) for modes in (2, 16, 32)]
            settings += [(modes, "order 4", True, 16, 40) for modes in (1, 16)]
            settings += [(1, "order 6", False, 16, 6), (32, "order 6", False, 2, 1)]
        for at, (modes, order, early, runs, cycles) in enumerate(settings):
            how = {"cycles": cycles, "accuracy": ACCURACY[order], "early_termination": early}
            for layout in LAYOUTS:
                title = f"ensemble {at}: {name}, {modes} modes, {order}{', early' if early else ''}, {layout}"
                # the kernel of run lanes is compiled for each number of modes and order
                if layout == "run lanes" and not (name == "the paper's" or (modes == middle and not early)):
                    continue
                yield Case(
                    title,
                    name,
                    "ensembles",
                    lambda entry=entry, modes=modes: entry.system(modes),
                    lambda entry=entry, modes=modes, runs=runs, seed=100 * number + at, layout=layout, how=how: (
                        ensemble_rows(entry, modes, runs, seed, layout, **how)
                    ),
                    name in QUICK and layout == "mode lanes" and modes <= 8 and order == "order 4",
                )


def moved(entry: ExtendedSystem, modes: int, seed: int) -> sb.System:
    """The system of an entry with random values of the parameters that its runs differ in."""
    changes = {name: float(values[0]) for name, values in entry.points(1, seed).items()}
    return entry.system(modes).replace(**changes)


def run_cases() -> Iterator[Case]:
    """Recorded runs of every entry; requests of a tolerance."""
    for number, (name, entry) in enumerate(SYSTEMS.items()):
        few, many = modes_of(name, entry)[0], modes_of(name, entry)[-1]
        long = min(8, entry.cycles)
        settings = [
            (entry.modes, "order 4", long, False),
            (few, "order 4", long, True),
            (many, "order 6", 2, False),
        ]
        if name == "the paper's":
            settings += [(16, "order 4", 5, False), (32, "order 4", 3, False), (8, "order 4", 30, True)]
        for at, (modes, order, cycles, early) in enumerate(settings):
            how = sb.Integration(cycles=cycles, accuracy=ACCURACY[order], early_termination=early)

            def system(
                entry: ExtendedSystem = entry, modes: int = modes, seed: int = 10 * number + at
            ) -> sb.System:
                return entry.system(modes) if seed % 10 == 0 else moved(entry, modes, seed)

            title = f"run {at}: {name}, {modes} modes, {order}{', early' if early else ''}"
            yield Case(
                title,
                name,
                "runs",
                system,
                lambda system=system, how=how: [run_row(system(), how)],
                name in ("the paper's", "unequal wells") and modes <= 8 and order == "order 4",
            )
    for name, modes, tolerance in (
        ("the paper's", 1, 1e-6),
        ("the paper's", 3, 1e-4),
        ("restitution", 1, 1e-5),
        ("hunt_crossley", 2, 1e-5),
        ("unequal wells", 3, 1e-5),
    ):
        entry = SYSTEMS[name]
        how = sb.Integration(cycles=2, tolerance=tolerance)
        yield Case(
            f"tolerance {tolerance:g}: {name}, {modes} modes",
            name,
            "runs",
            lambda entry=entry, modes=modes: entry.system(modes),
            lambda entry=entry, modes=modes, how=how: [
                run_row(entry.system(modes), how, np.linspace(0.0, 0.01, 50))
            ],
        )


def state_cases() -> Iterator[Case]:
    """Advanced states and tangents of every entry."""
    for name, entry in SYSTEMS.items():
        for modes in dict.fromkeys((entry.modes, modes_of(name, entry)[-1])):
            for order in ACCURACY:
                periods = 3 if order == "order 4" else 1
                for tangents in (0, 2):
                    if tangents and (modes != entry.modes or name not in TANGENTS):
                        continue
                    title = f"advance: {name}, {modes} modes, {order}{', tangents' if tangents else ''}"
                    yield Case(
                        title,
                        name,
                        "states",
                        lambda entry=entry, modes=modes: entry.system(modes),
                        lambda entry=entry, modes=modes, order=order, periods=periods, tangents=tangents: (
                            advanced_rows(entry.system(modes), order, periods, tangents)
                        ),
                        name in ("the paper's", "a body") and order == "order 4" and not tangents,
                    )


# ---------------------------------------------------------------- analyses


def small_system(modes: int = 1, damping_ratio: float = 0.005, **drive: float) -> sb.System:
    """The paper's beam with few modes."""
    sine = sb.Sine(**({"frequency_ratio": 1.21, "velocity_amplitude": 0.18} | drive))
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=modes, damping_ratio=damping_ratio)
    return sb.System(model, contacts=[sb.Contact(default_values.CONTACT, sb.Striker(drive=sine))])


PLANE = {"frequency_ratio": [0.8, 1.4], "velocity_amplitude": [0.06, 0.15, 0.3]}
SPREAD = sb.uncertainty.ParameterUncertainty(
    of={"location": sb.uncertainty.Normal(0.01), "contact.stiffness": sb.uncertainty.LogNormal(0.2)},
    phase=True,
)
SHORT = sb.Integration(cycles=6, threads=1)


def quiet_system() -> sb.System:
    """A weakly driven beam with a periodic response in each well."""
    return small_system(1, 0.05, frequency_ratio=1.6, velocity_amplitude=0.03)


@cache
def found_attractors() -> Any:
    return sb.dynamics.find_attractors(
        quiet_system(), 12, transient=300, integration=sb.Integration(threads=1)
    )


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


def analysis_cases() -> Iterator[Case]:
    for name in ANALYSES:
        yield Case(
            f"analysis: {name}",
            "analyses",
            "analyses",
            small_system,
            lambda name=name: [dataset_row(analysed(name))],
        )


def cases() -> list[Case]:
    """All of them."""
    return [*ensemble_cases(), *run_cases(), *state_cases(), *analysis_cases()]


# ---------------------------------------------------------------- interface


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
    r"(?<=in )[\d.,]+ (?:ms|s|min|h)\b|[\d.,]+(?= runs/s)|[\d.,]+(?= kB)|(?<=\"seconds\": )[\d.e-]+"
    r"|(?<=\"snapbeam_version\": ).*"
)
"""What differs from call to call: durations, sizes of files, the version."""


def printed() -> dict[str, list[str]]:
    """Lines that commands print, without durations and sizes of files."""
    from typer.testing import CliRunner

    found = {}
    for line in PRINTED:
        with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            result = CliRunner().invoke(command_app(), line.split())
        assert result.exit_code == 0, f"{line}: {result.output}"
        found[line] = [VARYING.sub("...", text.rstrip()) for text in result.stdout.splitlines()]
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


# ---------------------------------------------------------------- files


class Corpus(NamedTuple):
    """A recorded corpus."""

    fingerprint: str
    made_with: dict[str, str]
    variables: dict[str, list[str | None]]
    """Names by table."""
    cases: dict[str, Any]
    """Number of rows, table and model hash by name; the first row follows from the order."""
    refused: list[str]
    """Cases that the package does not support."""
    tables: dict[str, NDArray[np.uint64]]

    def rows_of(self, name: str) -> NDArray[np.uint64]:
        """Words of a case, shape (variables, rows)."""
        table, first = self.cases[name]["table"], 0
        for other, case in self.cases.items():
            if other == name:
                return self.tables[table][:, first : first + case["rows"]]
            first += case["rows"] if case["table"] == table else 0
        raise KeyError(name)


def environment() -> dict[str, str]:
    names = ("numpy", "scipy", "numba", "llvmlite", "xarray")
    return {name: metadata.version(name) for name in names} | {
        "python": platform.python_version(), "machine": platform.machine()
    }  # fmt: skip


def recorded() -> Corpus:
    """Compute all cases; print the time after each."""
    found: dict[str, list[Row]] = {}
    listed: dict[str, Any] = {}
    refused: list[str] = []
    begun = time.perf_counter()
    for case in cases():
        rows = case.rows()
        if rows is None:
            refused.append(case.name)
            continue
        assert case.name not in listed, f"two cases of the name {case.name}"
        found.setdefault(case.table, []).extend(rows)
        listed[case.name] = {"table": case.table, "rows": len(rows), "model": model_hash(case.system())}
        print(f"{time.perf_counter() - begun:7.1f} s  {case.name}", flush=True)
    variables: dict[str, list[str | None]] = {}
    tables = {}
    for table, rows in found.items():
        names = list(dict.fromkeys(name for row in rows for name in row))
        variables[table] = list(names)
        tables[table] = np.array([[row.get(name, ABSENT) for row in rows] for name in names], dtype=np.uint64)
    return Corpus(solver_fingerprint(), environment(), variables, listed, refused, tables)


def index_path(path: Path) -> Path:
    return path.with_suffix(".json")


def interface_path(path: Path) -> Path:
    return path.with_name(path.stem.replace("corpus", "interface") + ".json")


def write(corpus: Corpus, path: Path) -> None:
    """Write the array and the index; the bytes depend on the numbers alone."""
    np.savez_compressed(path, **corpus.tables)  # type: ignore[arg-type]
    content = corpus._asdict()
    del content["tables"]
    lines = [f"{json.dumps(name)}: {json.dumps(case)}" for name, case in corpus.cases.items()]
    text = json.dumps(content | {"cases": None}, indent=1, ensure_ascii=False)
    text = text.replace('"cases": null', '"cases": {\n  ' + ",\n  ".join(lines) + "\n }")
    index_path(path).write_text(text + "\n", encoding="utf-8")


def read(path: Path = DATA) -> Corpus:
    with np.load(path) as stored:
        tables = {name: stored[name] for name in stored.files}
    return Corpus(**json.loads(index_path(path).read_text(encoding="utf-8")), tables=tables)


def parent_commit() -> str:
    """The commit that a record is made on, with "and changes" if files differ from it."""
    git = ["git", "-C", str(Path(__file__).parent)]
    commit = subprocess.run([*git, "log", "-1", "--format=%h %s"], check=True, capture_output=True, text=True)
    changed = subprocess.run([*git, "diff", "--quiet", "HEAD"], check=False).returncode
    return commit.stdout.strip() + (", and changes" if changed else "")


def write_interface(path: Path) -> None:
    found = {"recorded_on": parent_commit()} | {name: describe() for name, describe in PARTS.items()}
    text = json.dumps(found, indent=1, ensure_ascii=False)
    interface_path(path).write_text(text + "\n", encoding="utf-8")


def interface_differences(parts: Iterable[str] = PARTS, path: Path = DATA) -> list[str]:
    """Lines of a unified difference of some parts; empty if nothing changed."""
    stored = json.loads(interface_path(path).read_text(encoding="utf-8"))
    lines = []
    for name in parts:
        texts = [json.dumps(each, indent=1, ensure_ascii=False) for each in (stored.get(name), PARTS[name]())]
        lines += difflib.unified_diff(
            *(each.splitlines() for each in texts), f"{name}, {stored['recorded_on']}", "now", "", "", 2, ""
        )
    return lines


class Compared(NamedTuple):
    """A case compared with its recording."""

    differences: list[str]
    skipped: str = ""
    """Why the numbers cannot be compared bitwise."""
    notes: tuple[str, ...] = ()


def shown_word(bits: np.uint64) -> str:
    """A word as a number and as bits."""
    if bits == ABSENT:
        return "absent"
    number = float(np.array(bits).view(np.float64))
    integer = int(np.array(bits).view(np.int64))
    return f"{bits:016x} ({integer if abs(integer) < 2**31 else f'{number:.17g}'})"


def compare_case(corpus: Corpus, case: Case) -> Compared:
    """Every variable of every row of a case, bitwise."""
    stored = corpus.cases.get(case.name)
    if stored is None:
        return Compared([] if case.name in corpus.refused else [f"{case.name}: is not recorded"])
    if model_hash(case.system()) != stored["model"]:
        return Compared(
            [],
            f"{case.name}: the matrices of its model, or NumPy's functions, differ in their last digits from the "
            f"recorded ones (another processor or library; recorded with {corpus.made_with}, now {environment()})",
        )
    rows = case.rows()
    if rows is None:
        return Compared([f"{case.name}: is recorded, and the package refuses it now"])
    was = corpus.rows_of(case.name)
    if len(rows) != was.shape[1]:
        return Compared([f"{case.name}: {len(rows)} rows; recorded are {was.shape[1]}"])
    names = corpus.variables[case.table]
    differences = []
    for i, row in enumerate(rows):
        for at, name in enumerate(names):
            if name is not None and (now := row.get(name, ABSENT)) != was[at, i]:
                differences.append(
                    f"{case.name}, row {i}, {name}: {shown_word(now)}; recorded is {shown_word(was[at, i])}"
                )
    new = sorted({name for row in rows for name in row} - set(names))
    return Compared(differences, notes=tuple(f"{case.table}: {name} is not recorded" for name in new))


def compare(path: Path) -> int:
    """Compare all cases and print the result; the number of cases that differ."""
    corpus, differing, skipped, notes, rows = read(path), 0, 0, set(), 0
    everything = cases()
    for case in everything:
        result = compare_case(corpus, case)
        notes |= set(result.notes)
        if result.skipped:
            skipped += 1
            print(f"skipped: {result.skipped}")
        for line in result.differences[:5]:
            print(line, flush=True)
        if len(result.differences) > 5:
            print(f"{case.name}: {len(result.differences) - 5} more", flush=True)
        differing += bool(result.differences)
        rows += corpus.cases.get(case.name, {"rows": 0})["rows"]
    for name in set(corpus.cases) - {case.name for case in everything}:
        differing += 1
        print(f"{name}: is recorded and is not computed any more")
    if solver_fingerprint() != corpus.fingerprint:
        differing += 1
        print(f"fingerprint of the solver = {solver_fingerprint()}; recorded is {corpus.fingerprint}")
    for line in sorted(notes):
        print(f"note: {line}")
    print(f"{len(everything)} cases, {rows} rows: {differing} differ, {skipped} skipped")
    return differing


def main(command: str, file: str) -> int:
    path = Path(file)
    if command == "record":
        write(recorded(), path)
        write_interface(path)
        return 0
    if command == "compare":
        differing = compare(path)
        changed = interface_differences(path=path)
        print("\n".join(changed) if changed else "the interface is the recorded one")
        return int(differing > 0)
    if command == "interface":
        write_interface(path)
        return 0
    print(f"command = {command}: must be record, compare or interface")
    return 2


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:3]))
