"""Options that set parameters, made from the table of parameters."""

from __future__ import annotations

import inspect
import math
import re
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer
from rich.markup import escape

from snapbeam.cli.console import add_json, duration, notes, open_result, out, pace, progress
from snapbeam.model.quantity import split_name
from snapbeam.util.files import check_writable
from snapbeam.util.validation import InputError, integer, parsed_json
from snapbeam.util.work_rate import WorkRate

if TYPE_CHECKING:
    import xarray as xr

    from snapbeam.model.parameter_file import Config
    from snapbeam.sweeps.compute import SweepReport

BEAM = ("beam.length", "beam.thickness", "beam.width", "beam.density", "beam.young_modulus", "beam.buckling_level",
        "beam.axial_load")  # fmt: skip
BOUNDARY = (
    "boundary.left_rotational_stiffness",
    "boundary.right_rotational_stiffness",
    "boundary.axial_support_stiffness",
)
IMPERFECTION = ("imperfection.midspan_amplitude", "imperfection.antisymmetric_amplitude", "imperfection.point_load", "imperfection.point_location",
                "imperfection.uniform_load", "imperfection.gravity")  # fmt: skip
MODEL = ("model.modes", "model.damping_ratio", "model.reference_frequency")
CONTACT = ("contact.stiffness", "contact.radius", "contact.young_modulus", "contact.poisson_ratio",
           "contact.coefficient", "contact.damping_factor", "contact.restitution", "contact.speed")  # fmt: skip
STRIKER = ("contact.location", "contact.location_m", "contact.side", "contact.gap", "contact.mass", "contact.suspension_stiffness",
           "contact.suspension_damping")  # fmt: skip
DRIVE = ("drive.frequency_ratio", "drive.frequency_hz", "drive.velocity_amplitude", "drive.velocity_m_s", "drive.phase")
RUN = (
    "integration.cycles",
    "integration.step",
    "integration.accuracy",
    "integration.engine",
    "integration.early_termination",
    "integration.max_steps",
    "initial_state.initial_well",
)

ALL = (*DRIVE, *STRIKER, *BEAM, *MODEL, *CONTACT, *RUN)
"""Parameters of the commands that compute runs."""
AXES = (
    "drive.frequency_ratio", "drive.frequency_hz", "drive.velocity_amplitude", "drive.velocity_m_s",
    "contact.location", "contact.location_m", "model.modes",
)  # fmt: skip
"""Those of them that may be axes of a map."""

_PANELS = {
    "beam": "Beam (default: the paper's)",
    "boundary": "Boundary conditions (default: clamped)",
    "imperfection": "Imperfection (default: none)",
    "model": "Reduced model and contact",
    "contact": "Reduced model and contact",
    "drive": "Striker and drive",
    "integration": "Integration",
    "initial_state": "Initial state",
}
# Options that differ from the name of the parameter, and help texts that the table does not contain.
_OPTIONS = {
    "contact.coefficient": "--newton-restitution",
    "contact.restitution": "--hunt-crossley-restitution",
    "contact.speed": "--hunt-crossley-speed",
    **{
        name: f"--{name.replace('.', '-').replace('_', '-')}"
        for name in (*CONTACT[:4], "contact.damping_factor", "drive.phase")
    },
    **{name: f"--striker-{split_name(name)[1].replace('_', '-')}" for name in STRIKER[4:]},
}
_WORDS = {
    "initial_state.initial_well": "well that runs begin in, by name or by its index; by default the one that the first striker or stop "
    "pushes away from; unforced: that of the beam without local forces, which begin with the run",
    "contact.radius": "radius of the sphere, m; with the next two options, instead of --contact-stiffness",
    "contact.young_modulus": "Young's moduli of sphere and beam, Pa: E1,E2",
    "contact.poisson_ratio": "Poisson ratios of sphere and beam: nu1,nu2",
    "contact.coefficient": "coefficient of Newton's restitution law, instead of Hertz's law",
    "contact.damping_factor": "damping factor of the Hunt-Crossley law, s/m",
    "contact.restitution": "coefficient of restitution of a free mass; with the next option, instead of --contact-damping-factor",
    "contact.speed": "impact speed of --hunt-crossley-restitution, m/s",
    "beam.axial_load": "axial load, N, compression positive; instead of --buckling-level",
    "model.reference_frequency": "frequency that normalises Omega and V, Hz; the first of the model by default",
    "model.damping_ratio": "damping ratio of every linear mode, or one for each: zeta1,zeta2,...",
    "integration.step": "step in free flight, s; follows from the model by default",
    "integration.accuracy": "accuracy level: standard, or reference (much shorter steps, to check results)",
    "integration.engine": "solver: auto or native, the core in C++; python, the equations in Python, slow; cuda, the core on a GPU, for maps",
    "integration.early_termination": "end a run once its response class is certain; its statistics then cover the time until then",
}
_PAIRS = ("contact.young_modulus", "contact.poisson_ratio")
_LISTS = ("model.damping_ratio",)
"""One number, or one for each linear mode."""


def with_parameters(*names: str, axes: tuple[str, ...] = ()) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Give a command options for parameters (those in *axes* may be axes), and for a parameter file and others by name.

    The command gets a mapping ``given`` of what was given: values by dotted name, and the file.  A parameter of its
    own, such as ``config``, replaces the general option of that name.
    """

    def decorate(function: Callable[..., Any]) -> Callable[..., Any]:
        own = inspect.signature(function, eval_str=True).parameters
        added = {name.replace(".", "__"): (name, _option(name, name in axes)) for name in names}
        general = {key: each for key, each in _general(bool(axes)).items() if key not in own}

        def command(**arguments: Any) -> Any:
            given = {full: arguments.pop(key) for key, (full, _) in added.items()}
            given |= {key: arguments.pop(key) for key in general if key in arguments}
            return function(given=given, **arguments)

        return _as(command, function, "given", general | {key: (None, kind) for key, (_, kind) in added.items()})

    return decorate


def _as(
    command: Callable[..., Any], function: Callable[..., Any], without: str, options: Mapping[str, tuple[Any, Any]]
) -> Callable[..., Any]:
    """Give a command the name and the parameters of a function, with *options* in place of the parameter *without*."""
    command.__name__, command.__doc__, command.__module__ = function.__name__, function.__doc__, function.__module__
    keyword = inspect.Parameter.KEYWORD_ONLY
    own = inspect.signature(function, eval_str=True).parameters
    kept = [parameter.replace(kind=keyword) for name, parameter in own.items() if name != without]
    kept += [inspect.Parameter(name, keyword, default=each, annotation=kind) for name, (each, kind) in options.items()]
    command.__signature__ = inspect.Signature(kept)  # type: ignore[attr-defined]
    return command


Law = Annotated[
    list[str] | None,
    typer.Option(
        "--law",
        help="Python file of your own with contact laws, drives, forces or statistics, which the parameters name by their "
        "type; FILE:CLASS requires this class of it. Repeat for further files. The file is executed.",
        metavar="FILE[:CLASS]",
    ),
]


def import_laws(given: Sequence[str] | None) -> None:
    """Execute Python files of the user's own, which register the laws that they define."""
    import importlib.util
    import sys

    for text in given or ():
        file, _, name = text.partition(".py:")
        path = Path(file + ".py" if name else text)
        where = f"law = {text!r}"
        if path.suffix != ".py" or not path.is_file():
            raise InputError(f"{where}: must be an existing Python file, such as mylaw.py or mylaw.py:Magnet")
        module = sys.modules.get(path.stem)
        known = None if module is not None or not path.stem.isidentifier() else importlib.util.find_spec(path.stem)
        origin = getattr(module, "__file__", None) if known is None else known.origin
        if (module is not None or known is not None) and Path(origin or "").resolve() != path.resolve():
            raise InputError(f"{where}: has the name of the installed module {path.stem!r}; give the file another name")
        if module is None:
            spec = importlib.util.spec_from_file_location(path.stem, path.resolve())
            assert spec is not None and spec.loader is not None
            module = importlib.util.module_from_spec(spec)
            sys.modules[path.stem] = module
            try:
                spec.loader.exec_module(module)
            except Exception as error:
                del sys.modules[path.stem]
                raise InputError(f"{where}: cannot be executed: {type(error).__name__}: {error}") from error
        if name and not isinstance(getattr(module, name, None), type):
            raise InputError(f"{where}: the file does not define a class {name!r}")


def _general(with_axes: bool) -> dict[str, tuple[Any, Any]]:
    config = typer.Option("--config", "-c", help="TOML parameter file; other options override it.", metavar="FILE")
    anything = typer.Option(
        "--set", help="Any parameter by its dotted name, such as contact.stiffness=2e8; repeat for further parameters.",
        metavar="NAME=VALUE",
    )  # fmt: skip
    source = typer.Option(
        "--from", help="File of a map or a run to take the parameters from; other options override them.",
        metavar="FILE",
    )  # fmt: skip
    point = typer.Option(
        help="Point of the map of --from, the nearest one: name=value,name=value.", metavar="NAME=VALUE,..."
    )
    shown = typer.Option(
        "--print-config", help="Print all parameters, defaults included, as a parameter file, and stop."
    )
    found: dict[str, tuple[Any, Any]] = {
        "config": (None, Annotated[Path | None, config]),
        "from_": (None, Annotated[Path | None, source]),
        "point": (None, Annotated[str | None, point]),
        "set_": (None, Annotated[list[str] | None, anything]),
        "print_config": (False, Annotated[bool, shown]),
        "law": (None, Law),
    }
    if with_axes:
        sweep = option(
            "Sweep any parameter: beam.thickness=3e-4:5e-4:20, model.modes=1,8; repeat for further axes. "
            "Without this option the map is over frequency ratio and velocity amplitude.",
            "Axes",
            "NAME=VALUES",
            "--sweep",
        )
        found["sweep"] = (None, Annotated[list[str] | None, sweep])
    return found


def _option(name: str, is_axis: bool) -> Any:
    """The type of an option, with its words."""
    from snapbeam.model.parameters import PHYSICAL, parameters

    section, field = split_name(name)
    row, physical = parameters().get(name), PHYSICAL.get(name)
    flag = _OPTIONS.get(name, f"--{field.replace('_', '-')}")
    unit, words, symbol = "", _WORDS.get(name, ""), ""
    if row is not None:
        unit = "" if row.quantity.unit == "1" else row.quantity.unit
        words = words or row.quantity.long_name + (f", {unit}" if unit else "")
        symbol = row.quantity.symbol
    elif physical is not None:
        words = f"{physical.words}, {physical.unit}, instead of a ratio"
    text = f"{words[:1].upper()}{words[1:]}{_symbol(symbol)}."
    panel = "Striker and drive" if name in STRIKER else _PANELS[section]
    options: dict[str, Any] = {"help": text, "rich_help_panel": "Axes" if is_axis else panel}
    if row is not None and row.quantity.kind is bool:
        return Annotated[bool | None, typer.Option(f"{flag}/--no-{flag[2:]}", **options)]
    if is_axis:
        return Annotated[str | None, typer.Option(flag, metavar="VALUES", **options)]
    if name in _PAIRS:
        return Annotated[str | None, typer.Option(flag, metavar="A,B", **options)]
    if name in _LISTS:
        return Annotated[str | None, typer.Option(flag, metavar="NUMBER|A,B,...", **options)]
    if row is not None and row.quantity.kind is str:
        return Annotated[str | None, typer.Option(flag, metavar="|".join(row.quantity.choices), **options)]
    if name == "initial_state.initial_well":
        return Annotated[str | None, typer.Option(flag, metavar="lower|upper|unforced|INDEX", **options)]
    if name == "model.modes":
        return Annotated[str | None, typer.Option(flag, metavar="COUNT|auto", **options)]
    if row is not None and row.quantity.kind is int:
        return Annotated[int | None, typer.Option(flag, parser=parse_count, metavar="COUNT", **options)]
    unit = physical.unit if physical is not None else unit
    return Annotated[float | None, typer.Option(flag, parser=_parser(unit), metavar="NUMBER", **options)]


def _parser(unit: str) -> Callable[[str], float]:
    """A parser of numbers that may have a unit: ``2e-6`` or ``2um``."""

    def parse(text: str) -> float:
        from snapbeam.model.parameter_axes import parse_axis

        try:
            return float(parse_axis("", text, unit=unit or "1"))
        except (InputError, TypeError):
            raise typer.BadParameter(f"{text!r} is not a number{f' in {unit}' if unit else ''}") from None

    return parse


_UPRIGHT = re.compile(r"\\mathrm\{([^}]*)\}")


def _symbol(symbol: str) -> str:
    """A LaTeX symbol as plain text, without braces and commands."""
    plain = _UPRIGHT.sub(r"\1", symbol).replace("\\", "").replace("{", "").replace("}", "")
    return f" ({plain})" if plain else ""


def parse_number(text: str) -> float:
    """A number, or a fraction."""
    numerator, slash, denominator = text.partition("/")
    try:
        return float(numerator) / float(denominator) if slash else float(text)
    except (ValueError, ZeroDivisionError):
        raise typer.BadParameter(f"{text!r} is not a number") from None


def parse_count(text: str) -> int:
    """A whole number."""
    try:
        return int(text)
    except ValueError:
        raise typer.BadParameter(f"{text!r} is not a whole number") from None


def configured(
    given: Mapping[str, Any], axes_of: Callable[[Config, Mapping[str, Any]], dict[str, Any]] | None = None
) -> Config:
    """The parameters of the ``--config`` file overridden by what was given on the command line.

    *axes_of* returns the axes of a command, its own ones included, for ``--print-config``.
    """
    from snapbeam.model.parameter_file import Config, load_config, override, same_axis

    import_laws(given.get("law"))
    file = given.get("config")
    config = load_config(file, complete=False) if file is not None else Config()
    if given.get("from_") is not None:
        if given.get("config") is not None:
            raise InputError("from, config: give one of the two")
        config = config_of_file(given["from_"], given.get("point"))
    sections: dict[str, dict[str, Any]] = {}
    axes: dict[str, Any] = {}
    with_striker = any(name.startswith("contact.") and value is not None for name, value in given.items())
    for name, value in given.items():
        if not split_name(name)[1] or value is None:
            continue
        name = name if with_striker else config.of_option(name)
        section, field = split_name(name)
        if isinstance(value, str) and _is_axis(name, value):
            axes[name] = value
        else:
            sections.setdefault(section, {})[field] = _value(name, value)
    for text in given.get("set_") or ():
        name, value = _assignment(text, "set")
        full = config.full_name(name)
        section, field = split_name(full)
        sections.setdefault(section, {})[field] = _value(full, value)
    for text in given.get("sweep") or ():
        name, value = _assignment(text, "sweep")
        name = config.full_name(name)
        if name in axes:
            raise InputError(f"sweep = {text!r}: {name} is given twice; give each axis once")
        axes[name] = value
    single = {f"{section}.{field}" for section, values in sections.items() for field in values}
    for name in axes:
        for same in sorted(same_axis(name) & single):
            raise InputError(f"{same}: is given as a single value and as an axis")
    _require_striker(config, sections, axes)
    if axes:
        sections["sweep"] = sections.get("sweep", {}) | axes
    config = override(config, sections, "" if file is None or sections else Path(file).name)
    if given.get("print_config"):
        from snapbeam.model.parameter_file import config_text

        printed = config.whole(None if axes_of is None else axes_of(config, given))
        out().print(config_text(printed), markup=False, end="")
        add_json(**printed.to_mapping())
        raise typer.Exit
    runs_one_drive = "drive.frequency_ratio" in given and "sweep" not in given
    if config.defaulted and (config.extends_paper or runs_one_drive):
        whole = config.whole().to_mapping()
        taken = [name for name in config.defaulted if split_name(name)[0] in whole]
        values = ", ".join(f"{name} = {_shown(whole, name)}" for name in taken)
        source = "taken from the paper's beam" if config.extends_paper else "not in the file, by default"
        if taken:
            notes().print(f"[bold yellow]note:[/] {source}: {escape(values)}")
    return config


def _require_striker(config: Config, sections: Mapping[str, Any], axes: Mapping[str, Any]) -> None:
    """Raise an error for a striker without a drive next to another excitation of the file."""
    moved = [name for name in ("base_excitation", "axial_load") if config.section(name) or sections.get(name)]
    given = [f"drive.{field}" for field in sections.get("drive", {})]
    given += [name for name in axes if name.startswith("drive.")]
    others = {*sections, *(split_name(name)[0] for name in axes), *config.given}
    if moved and given and "contact" not in others and not config.section("drive"):
        raise InputError(
            f"{', '.join(given)}: there is no striker to drive, {moved[0]} moves the beam; use --set or --sweep "
            f"{moved[0]}.NAME=..., or add a [contact]"
        )


def _shown(sections: Mapping[str, Mapping[str, Any]], name: str) -> str:
    """A value with its unit."""
    from snapbeam.model.parameters import lookup

    section, field = split_name(name)
    value, unit = sections[section][field], lookup(name).quantity.unit
    return f"{value:.6g}{'' if unit == '1' else ' ' + unit}"


def _is_axis(name: str, value: str) -> bool:
    """Return whether the text of an option is an axis, not a number."""
    from snapbeam.model.parameters import PHYSICAL, parameters

    row = parameters().get(name)
    numeric = name in PHYSICAL or (row is not None and row.quantity.kind in (float, int))
    return numeric and name not in (*_PAIRS, *_LISTS) and (":" in value or "," in value)


def _assignment(text: str, option: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not equals or not name.strip() or not value.strip():
        raise InputError(f"{option} = {text!r}: must be name=value, such as contact.stiffness=2e8")
    return name.strip(), value.strip()


def _value(name: str, value: Any) -> Any:
    """The text of an option as what its parameter holds."""
    from snapbeam.model.parameter_axes import parse_axis
    from snapbeam.model.parameters import PHYSICAL, lookup, row_of

    if not isinstance(value, str):
        return value
    row = row_of(name)
    kind = float if row is None else row.quantity.kind
    try:
        if name in _PAIRS or (name in _LISTS and "," in value):
            return [float(part) for part in value.split(",")]
        if kind is bool:
            return {"true": True, "false": False}[value.lower()]
        if kind is int:
            return value if name == "model.modes" and value.strip().startswith("auto") else int(value)
        if kind is float and (row is not None or name in PHYSICAL or name.startswith("initial_state.")):
            numbers = np.ravel(parse_axis(name, value, unit=lookup(name).quantity.unit))
            if numbers.size != 1:
                raise InputError(f"{name} = {value!r}: must be one number, not {numbers.size}")
            return float(numbers[0])
    except InputError:
        raise
    except (ValueError, KeyError, typer.BadParameter):
        words = {bool: "true or false", int: "a whole number"}.get(kind, "a number")
        raise InputError(f"{name} = {value!r}: must be {words}") from None
    return value


# ----------------------------------------------------------------------------------------------------
# The options that several commands share beside parameters.


_OUTPUT = "Output"


def option(about: str, panel: str, metavar: str | None = None, flags: str = "") -> Any:
    """An option, with the flags that its parameter does not name."""
    return typer.Option(*flags.split(), help=about, rich_help_panel=panel, metavar=metavar)


def number_option(about: str, panel: str) -> Any:
    """An option that takes a number."""
    return typer.Option(help=about, rich_help_panel=panel, parser=parse_number, metavar="NUMBER")


def count_option(about: str, panel: str) -> Any:
    """An option that takes a whole number."""
    return typer.Option(help=about, rich_help_panel=panel, parser=parse_count, metavar="COUNT")


Threads = Annotated[int | None, count_option("Number of processor cores; all by default.", "Integration")]
Plot = Annotated[
    Path | None,
    typer.Option("--plot", help="Figure file to write: .png, .pdf or .svg.", rich_help_panel=_OUTPUT, metavar="FILE"),
]
CurvesOver = Annotated[
    str | None,
    option("Axis of a map to draw a statistic over, as a curve for each value of the other axis.", _OUTPUT, "NAME"),
]
Output = Annotated[
    Path, typer.Option("--output", "-o", help="NetCDF file to write.", rich_help_panel=_OUTPUT, metavar="FILE")
]
CheckpointFolder = Annotated[
    Path | None,
    typer.Option(help="Checkpoint folder; an existing one is resumed.", rich_help_panel=_OUTPUT, metavar="DIR"),
]
Measurements = Annotated[
    Path | None,
    option(
        "CSV file of measured responses to plot on the map: columns frequency_ratio or frequency_hz, "
        "velocity_amplitude or velocity_m_s, location (optional), response_class.",
        _OUTPUT,
        "FILE",
    ),
]
QuasiStaticLine = Annotated[
    bool, option("Draw the quasi-static threshold V_QS1 (Eq. 21).", _OUTPUT, flags="--quasi-static-line")
]
Window = Annotated[
    str | None, typer.Option(help="Cycles to draw, first:last.", rich_help_panel=_OUTPUT, metavar="FIRST:LAST")
]


def parse_window(text: str | None) -> tuple[float, float] | None:
    """Return the cycles ``first:last`` as two numbers."""
    return None if text is None else parse_range("window", text)


def parse_range(name: str, text: str, unit: str = "1") -> tuple[float, float]:
    """Return ``first:last`` as two numbers in *unit*, the first less than the last."""
    from snapbeam.model.parameter_axes import parse_axis

    try:
        if "," in text:
            raise ValueError
        first, last = (float(parse_axis(name, part, unit=unit)) for part in text.split(":"))
    except ValueError:  # an InputError is one
        of = "" if unit == "1" else f", numbers in {unit}"
        raise InputError(f"{name} = {text!r}: must be first:last, such as 0:10{of}") from None
    if not first < last:
        raise InputError(f"{name} = {text!r}: first must be less than last")
    return first, last


# ----------------------------------------------------------------------------------------------------
# What ``snapbeam map`` needs for maps that take long: their options, their log and their summary.


_LONG = "Long maps"

CheckpointOption = Annotated[
    Path | None, option("Checkpoint folder; an existing one is resumed, and extended for longer axes.", _LONG, "DIR")
]
CheckCheckpoint = Annotated[
    bool, option("Check the checkpoint and compute damaged tasks again.", _LONG, flags="--check-checkpoint")
]
ClusterOption = Annotated[
    str | None, option("Dask cluster: local:N, tcp://host:port, or slurm.toml; needs --checkpoint.", _LONG, "WHERE")
]
RefineLevels = Annotated[
    int | None,
    count_option("Number of times to halve the grid spacing where neighbours differ in response class.", _LONG),
]
Replicates = Annotated[
    int | None, count_option("Number of repeats of each run with slightly different initial conditions.", _LONG)
]
PerturbationRms = Annotated[
    float | None,
    number_option(
        "Rms perturbation of the initial midspan displacement, m (3.5e-6, the resolution of the camera).", _LONG
    ),
]
CheckHalfStep = Annotated[
    bool,
    typer.Option("--check-half-step", help="Repeat each run once more with half the time step.", rich_help_panel=_LONG),
]
PointsPerTask = Annotated[
    int | None, count_option("Points in each task; chosen from the size of the map by default.", _LONG)
]
Log = Annotated[
    Path | None,
    typer.Option("--log", help="Text file to append the progress to.", rich_help_panel=_LONG, metavar="FILE"),
]

_STORED = {"refine_levels": int, "replicates": int, "perturbation_rms": float, "check_half_step": bool}
_OPTIONS_LONG: dict[str, tuple[Any, Any]] = {
    "checkpoint": (None, CheckpointOption),
    "check_checkpoint": (False, CheckCheckpoint),
    "cluster": (None, ClusterOption),
    "refine_levels": (None, RefineLevels),
    "replicates": (None, Replicates),
    "perturbation_rms": (None, PerturbationRms),
    "check_half_step": (False, CheckHalfStep),
    "points_per_task": (None, PointsPerTask),
    "log": (None, Log),
}


def with_checkpoint(function: Callable[..., Any]) -> Callable[..., Any]:
    """Give a command the options of sweeps that take long; it gets them as a mapping ``keeping``."""

    def command(**arguments: Any) -> Any:
        keeping = {name: arguments.pop(name) for name in _OPTIONS_LONG}
        return function(keeping=keeping, **arguments)

    return _as(command, function, "keeping", _OPTIONS_LONG)


def is_long(keeping: Mapping[str, Any]) -> bool:
    """Return whether any option except --log is set."""
    return any(value not in (None, False) for name, value in keeping.items() if name != "log")


def sweep_options(keeping: Mapping[str, Any]) -> dict[str, Any]:
    """Arguments of the sweep apart from its checkpoint."""
    from snapbeam.sweeps.replicates import MEASURING_ERROR, Replicates

    repeats = None
    count = 0 if keeping["replicates"] is None else integer("replicates", keeping["replicates"], 0, 10_000)
    if count or keeping["check_half_step"]:
        size = MEASURING_ERROR if keeping["perturbation_rms"] is None else keeping["perturbation_rms"]
        repeats = Replicates(count, size, bool(keeping["check_half_step"]))
    return {"cluster": keeping["cluster"], "refine_levels": keeping["refine_levels"] or 0, "replicates": repeats}


def resumed(given: Mapping[str, Any], keeping: dict[str, Any], settings: Config) -> Config:
    """The parameters of an existing checkpoint, overridden by the given ones.

    The path of a checkpoint is enough to resume it.  Given parameters are compared with those of the checkpoint, not with
    the paper's beam.  Stored options replace missing ones in *keeping*.
    """
    from snapbeam.model.parameter_file import config_from_mapping, override
    from snapbeam.sweeps.checkpoint.store import read_stored_config

    if keeping["checkpoint"] is None:
        return settings
    kept = read_stored_config(keeping["checkpoint"])
    if kept is None:
        return settings
    options = kept.get("options", {})
    if not isinstance(kept.get("parameters"), dict) or not isinstance(options, dict):
        raise InputError(f"checkpoint = {str(keeping['checkpoint'])!r}: contains no readable parameters")
    for name, kind in _STORED.items():
        if not keeping[name] and isinstance(options.get(name), kind):
            keeping[name] = options[name]
    own = config_from_mapping(kept["parameters"], source=f"{keeping['checkpoint'].name}/map.json")
    return override(own, settings.to_mapping())


def kept_config(settings: Config, keeping: Mapping[str, Any]) -> dict[str, Any]:
    """Parameters and options that a checkpoint stores, so that its path is enough to resume it."""
    import numpy as np

    options = {name: keeping[name] for name in _STORED if keeping[name]}
    plain = {
        section: {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in values.items()}
        for section, values in settings.to_mapping().items()
    }
    return {"parameters": plain | settings.extension, "options": options}


class LongReport:
    """Progress for a person: a bar on a terminal, lines elsewhere, and lines with the time in a log file."""

    _INTERVAL = 30.0

    def __init__(self, bar: Any, log: Path | None) -> None:
        self._bar = bar
        self._log = log
        self._last = time.monotonic()
        self._rate = WorkRate()
        self._before: int | None = None
        self._quiet = True

    def note(self, text: str) -> None:
        """Say something once."""
        notes().print(text, markup=False)
        self.log(text)

    def progress(self, done: int, total: int) -> None:
        """Say how far the present stage is."""
        now = time.monotonic()
        self._rate.report(done)
        finished = done >= total and done != self._before
        self._before = done
        self._bar(done, total)
        if finished or self._quiet or now - self._last >= self._INTERVAL:
            self._last, self._quiet = now, False
            share = 100.0 * done / max(total, 1)
            texts = (f"{done} of {total} points ({share:.1f} %)", pace(done, total, self._rate))
            self.log(", ".join(filter(None, texts)))

    def log(self, text: str) -> None:
        """Append a line with the time to the log file, if there is one."""
        if self._log is None:
            return
        from snapbeam.util.provenance import created_now

        try:
            with self._log.open("a", encoding="utf-8") as stream:
                stream.write(f"{created_now()}  {text}\n")
        except OSError as error:  # no reason to give up what is computed
            where, self._log = self._log, None
            self.note(f"log {str(where)!r}: cannot be written any more, {error.strerror or error}")


@contextmanager
def report(total: int, log: Path | None, store: Path | None) -> Iterator[LongReport]:
    """Give a report of a map of *total* points; refuse, before any work, a log that cannot be written."""
    if log is not None:
        check_writable(log, "log", appended=True)
    with progress(total) as bar:
        said = LongReport(bar, log)
        said.log(f"map of {total} points")
        try:
            yield said
        except KeyboardInterrupt:
            said.note(
                "stopped; no result is stored; use --checkpoint FOLDER to be able to resume"
                if store is None
                else "stopped; the checkpoint contains all finished tasks; run the same command to resume"
            )
            raise


def sweep_report_lines(counts: SweepReport, store: Path | None, elapsed: float) -> list[str]:
    """Return what happened, in words."""
    lines = []
    if store is not None:
        lines.append(f"{counts.runs} runs computed in {duration(elapsed)}")
        lines.append(
            f"Checkpoint {store}: {counts.tasks} tasks, {counts.resumed} resumed, {counts.computed} computed, "
            f"{len(counts.damaged)} damaged, {len(counts.failed)} failed"
        )
    if counts.missing:
        lines.append(f"{counts.missing} tasks are not computed yet; run without --check-checkpoint to compute them")
    lines += [f"failed: {stage} task {task} {reason}" for stage, task, reason in counts.failed]
    return lines


# ----------------------------------------------------------------------------------------------------
# The parameters that a result was computed from, read back from its file.


def config_of_file(path: Path, point: str | None) -> Config:
    """The parameters of a file of results; of a map, at the point nearest to ``name=value,...``, its values exact."""
    from snapbeam.model.parameter_file import config_from_mapping
    from snapbeam.model.parameters import PHYSICAL

    dataset = open_result(path)
    text = dataset.attrs.get("system")
    if not isinstance(text, str):
        raise InputError(f"from = {str(path)!r}: does not contain the parameters of the computation")
    sections: dict[str, dict[str, Any]] = parsed_json(text, f"from = {str(path)!r}")
    if any(isinstance(value, dict) for values in sections.values() for value in values.values()):
        raise InputError(
            f"from = {str(path)!r}: has a recorded drive or large matrices, which the file does not contain; use it from "
            "Python, or --config with what System.save writes"
        )
    run = {
        name: value
        for name, value in parsed_json(dataset.attrs.get("integration", "{}"), f"from = {str(path)!r}").items()
        if value is not None and name != "engine"
    }
    sections = {
        part: {name: value for name, value in own.items() if value is not None} for part, own in sections.items()
    }
    sections["integration"] = run
    for name, value in _at_point(dataset, point, path).items():
        section, field = split_name(name)
        if name in PHYSICAL:
            sections[section].pop(split_name(PHYSICAL[name].parameter)[1], None)
        sections.setdefault(section, {})[field] = value
    return config_from_mapping(sections, path.name)


def _at_point(dataset: xr.Dataset, point: str | None, path: Path) -> dict[str, Any]:
    """Values of the parameters at the nearest point, by dotted name."""
    axes = {name: dataset[name] for name in map(str, dataset.dims) if "parameter" in dataset[name].attrs}
    if point is None:
        return {}
    if "point" in dataset.dims:
        return _of_list(dataset, point, path)
    found: dict[str, Any] = {}
    for part in point.split(","):
        dim, number = coordinate_on_axis(dataset, "point", part)
        values = axes[dim].values
        chosen = number if values.dtype.kind in "OU" else values[int(np.argmin(np.abs(values - number)))].item()
        found[str(axes[dim].attrs["parameter"])] = chosen
    missing = [name for name in axes if axes[name].attrs["parameter"] not in found and axes[name].size > 1]
    if missing:
        raise InputError(f"point = {point!r}: must also give {', '.join(missing)}")
    for name in axes:
        if axes[name].size == 1:
            found.setdefault(str(axes[name].attrs["parameter"]), axes[name].values[0].item())
    return found


def coordinate_on_axis(dataset: xr.Dataset, option: str, text: str) -> tuple[str, Any]:
    """The axis of a map and the value on it that ``name=value`` names, in the axis' own unit or as a physical value."""
    from snapbeam.model.parameter_axes import parse_axis
    from snapbeam.model.parameters import PHYSICAL, lookup, named_in, ratio_of

    name, value = _assignment(text, option)
    axes = {str(dim): dataset[dim].attrs["parameter"] for dim in dataset.dims if "parameter" in dataset[dim].attrs}
    last = [full for full in axes.values() if split_name(full)[1] == name]
    row = lookup(last[0] if len(last) == 1 else named_in(name, {split_name(full)[0]: {} for full in axes.values()}))
    dim = next((each for each, full in axes.items() if full in (row.name, ratio_of(row.name))), None)
    if dim is None:
        raise InputError(
            f"{option} = {text!r}: {name} is not an axis of the file; its axes: {', '.join(axes) or 'none'}"
        )
    if dataset[dim].dtype.kind in "OU":
        return dim, value
    numbers = np.ravel(parse_axis(name, value, unit=row.quantity.unit))
    if numbers.size != 1:
        raise InputError(f"{option} = {text!r}: must be one number")
    if row.name == axes[dim]:
        return dim, float(numbers[0])
    attrs = dataset.attrs
    if row.short in dataset.coords:
        unit = float(dataset[row.short][-1] / dataset[dim][-1])
    elif PHYSICAL[row.name].unit == "m":
        unit = attrs.get("beam_length", math.nan)
    else:
        length, frequency = (attrs.get(each, math.nan) for each in ("length_scale", "reference_frequency"))
        unit = PHYSICAL[row.name].unit_of(length, 2.0 * math.pi * frequency)
    if not math.isfinite(unit):
        raise InputError(
            f"{option} = {text!r}: the unit of the axis differs between the points of this file; give {dim}"
        )
    return dim, float(numbers[0]) / unit


def _of_list(dataset: xr.Dataset, point: str, path: Path) -> dict[str, Any]:
    """Values of all parameters of the point of a list that is nearest to what is given, by dotted name."""
    from snapbeam.model.parameters import lookup

    columns = {
        str(name): item.values
        for name, item in dataset.coords.items()
        if item.dims == ("point",) and "parameter" in item.attrs
    }
    away = np.zeros(dataset.sizes["point"])
    for part in point.split(","):
        name, equals, value = part.partition("=")
        short = lookup(name.strip()).short
        if not equals or short not in columns:
            raise InputError(f"point = {point!r}: must name parameters of {path.name}: {', '.join(columns)}")
        values = columns[short]
        if values.dtype.kind in "OU":
            away = np.where(values == value.strip(), away, np.inf)
            continue
        try:
            away = away + ((values - float(value)) / (float(np.ptp(values)) or 1.0)) ** 2
        except ValueError:
            raise InputError(f"point = {point!r}: {value!r} is not a number") from None
    if not np.isfinite(away).any():
        raise InputError(f"point = {point!r}: {path.name} has no such point")
    at = int(np.argmin(away))
    return {str(dataset[name].attrs["parameter"]): values[at].item() for name, values in columns.items()}


def point_text(coordinates: dict[str, Any]) -> str:
    """Coordinates as ``--point`` takes them, to the last digit."""
    return ",".join(
        f"{name}={value!r}" if isinstance(value, float) else f"{name}={value}" for name, value in coordinates.items()
    )
