"""Options of commands that set parameters: made from the one table, with its words, units and names."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape

from snapbeam.cli.common.console import answer, notes, out

if TYPE_CHECKING:
    from snapbeam.config import Config

__all__ = [
    "BEAM",
    "CONTACT",
    "DRIVE",
    "ENDS",
    "IMPERFECTION",
    "MODEL",
    "RUN",
    "STRIKER",
    "configured",
    "with_parameters",
]

BEAM = ("beam.length", "beam.thickness", "beam.width", "beam.density", "beam.young_modulus", "beam.buckling_level",
        "beam.axial_load")  # fmt: skip
ENDS = (
    "boundary.left_rotational_stiffness",
    "boundary.right_rotational_stiffness",
    "boundary.axial_support_stiffness",
)
IMPERFECTION = ("imperfection.midspan_amplitude", "imperfection.antisymmetric_amplitude", "imperfection.point_load", "imperfection.point_location",
                "imperfection.uniform_load", "imperfection.gravity")  # fmt: skip
MODEL = ("model.modes", "model.damping_ratio", "model.reference_frequency")
CONTACT = ("contact.stiffness", "contact.radius", "contact.young_modulus", "contact.poisson_ratio",
           "contact.coefficient", "contact.damping_factor", "contact.restitution", "contact.speed")  # fmt: skip
STRIKER = ("striker.location", "striker.location_m", "striker.side", "striker.gap", "striker.mass", "striker.suspension_stiffness",
           "striker.suspension_damping")  # fmt: skip
DRIVE = (
    "drive.frequency_ratio",
    "drive.frequency_hz",
    "drive.velocity_amplitude",
    "drive.velocity_m_s",
    "drive.phase",
)
RUN = (
    "integration.cycles",
    "integration.step",
    "integration.accuracy",
    "integration.engine",
    "integration.early_termination",
    "integration.max_steps",
)

_PANELS = {
    "beam": "Beam (default: the paper's)",
    "ends": "Ends (default: clamped)",
    "imperfection": "Imperfection (default: none)",
    "model": "Reduced model and contact",
    "contact": "Reduced model and contact",
    "striker": "Striker and drive",
    "drive": "Striker and drive",
    "run": "Integration",
}
# Option where it is not the parameter's own name, and words that the table does not have.
_OPTIONS = {
    "contact.stiffness": "--contact-stiffness",
    "contact.radius": "--contact-radius",
    "contact.young_modulus": "--contact-young-modulus",
    "contact.poisson_ratio": "--contact-poisson-ratio",
    "contact.coefficient": "--newton-restitution",
    "contact.damping_factor": "--contact-damping-factor",
    "contact.restitution": "--hunt-crossley-restitution",
    "contact.speed": "--hunt-crossley-speed",
    "drive.phase": "--drive-phase",
    "boundary.left_rotational_stiffness": "--left-rotational-stiffness",
    "boundary.right_rotational_stiffness": "--right-rotational-stiffness",
    "boundary.axial_support_stiffness": "--axial-support-stiffness",
    "drive.velocity_m_s": "--velocity-m-s",
    "striker.location_m": "--location-m",
    "striker.mass": "--striker-mass",
    "striker.suspension_stiffness": "--striker-suspension-stiffness",
    "striker.suspension_damping": "--striker-suspension-damping",
}
_WORDS = {
    "contact.radius": "radius of the sphere, with the two next ones in place of a stiffness, m",
    "contact.young_modulus": "Young's moduli of sphere and beam, Pa: E1,E2",
    "contact.poisson_ratio": "Poisson ratios of sphere and beam: nu1,nu2",
    "contact.coefficient": "coefficient of restitution, for one mode, in place of Hertz's law",
    "contact.damping_factor": "loss chi of the contact, s/m: Hunt and Crossley's law",
    "contact.restitution": "share of its speed that a free mass keeps, with the next one in place of a loss",
    "contact.speed": "speed at which it keeps that share, m/s",
    "beam.axial_load": "axial load, N, compression positive; instead of --buckling-level",
    "model.reference_frequency": "frequency that Omega and V are normalised by, Hz; the model's first by default",
    "model.damping_ratio": "damping ratio of every linear mode, or one for each: zeta1,zeta2,...",
    "integration.step": "step in free flight, s; follows from the model by default",
    "integration.accuracy": "accuracy level: standard, or reference, far finer, to check with",
    "integration.engine": "what integrates; auto takes the fastest there is",
    "integration.early_termination": "end a run once its response class is certain; its other statistics then stop there",
}
_PAIRS = ("contact.young_modulus", "contact.poisson_ratio")
_LISTS = ("model.damping_ratio",)
"""One number, or one for each linear mode."""


def with_parameters(
    *names: str, axes: tuple[str, ...] = ()
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Give a command options for parameters, and for a parameter file and anything else by name.

    The command gets a parameter ``given``, a mapping of what was given: values by dotted name, and the file.

    Parameters
    ----------
    *names : str
        Parameters, by dotted name.
    axes : tuple of str
        Those of them that may be a number, numbers a,b,c or start:stop:count.
    """

    def decorate(function: Callable[..., Any]) -> Callable[..., Any]:
        own = {
            name: parameter
            for name, parameter in inspect.signature(function, eval_str=True).parameters.items()
            if name != "given"
        }
        added = {_identifier(name): (name, _option(name, name in axes)) for name in names}

        def command(**arguments: Any) -> Any:
            given = {full: arguments.pop(key) for key, (full, _) in added.items()}
            given |= {
                key: arguments.pop(key)
                for key in ("config", "set_", "axis", "from_", "point", "print_config")
                if key in arguments
            }
            return function(given=given, **arguments)

        general = _general(bool(axes))
        command.__name__, command.__doc__ = function.__name__, function.__doc__
        command.__module__ = function.__module__
        parameters = [parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY) for parameter in own.values()]
        parameters += [
            inspect.Parameter(key, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=kind)
            for key, (default, kind) in general.items()
        ]
        parameters += [
            inspect.Parameter(key, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=kind)
            for key, (_, kind) in added.items()
        ]
        command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        return command

    return decorate


def _identifier(name: str) -> str:
    return name.replace(".", "__")


def _general(with_axes: bool) -> dict[str, tuple[Any, Any]]:
    config = typer.Option(
        "--config", "-c", help="TOML file of parameters; options given here override it.", metavar="FILE"
    )
    anything = typer.Option(
        "--set", help="Any parameter by its dotted name, such as contact.stiffness=2e8; again for another one.",
        metavar="NAME=VALUE",
    )  # fmt: skip
    source = typer.Option(
        "--from", help="File of a map or a run whose parameters are taken; options given here override them.",
        metavar="FILE",
    )  # fmt: skip
    point = typer.Option(
        help="Point of the map of --from, the nearest there is: name=value,name=value.",
        metavar="NAME=VALUE,...",
    )
    shown = typer.Option(
        "--print-config", help="Print every parameter as a parameter file, what was not given too, and stop."
    )
    found: dict[str, tuple[Any, Any]] = {
        "config": (None, Annotated[Path | None, config]),
        "from_": (None, Annotated[Path | None, source]),
        "point": (None, Annotated[str | None, point]),
        "set_": (None, Annotated[list[str] | None, anything]),
        "print_config": (False, Annotated[bool, shown]),
    }
    if with_axes:
        axis = typer.Option(
            "--sweep",
            help="Sweep any parameter: beam.thickness=3e-4:5e-4:20, model.modes=1,8; again for another axis. Without "
            "one, the map is over frequency ratio and velocity amplitude.",
            metavar="NAME=VALUES",
            rich_help_panel="Axes",
        )
        found["axis"] = (None, Annotated[list[str] | None, axis])
    return found


def _option(name: str, is_axis: bool) -> Any:
    """The type of an option, with its words."""
    from snapbeam.config import PHYSICAL, parameters

    section, _, field = name.partition(".")
    row, physical = parameters().get(name), PHYSICAL.get(name)
    flag = _OPTIONS.get(name, f"--{field.replace('_', '-')}")
    unit, words, symbol = "", _WORDS.get(name, ""), ""
    if row is not None:
        unit = "" if row.quantity.unit == "1" else row.quantity.unit
        words = words or row.quantity.long_name + (f", {unit}" if unit else "")
        symbol = row.quantity.symbol
    elif physical is not None:
        words = f"{physical.words}, {physical.unit}, in place of a ratio"
    text = f"{words[:1].upper()}{words[1:]}{_symbol(symbol)}."
    options: dict[str, Any] = {"help": text, "rich_help_panel": "Axes" if is_axis else _PANELS[section]}
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
    if row is not None and row.quantity.kind is int:
        return Annotated[int | None, typer.Option(flag, parser=parse_count, metavar="COUNT", **options)]
    return Annotated[float | None, typer.Option(flag, parser=parse_number, metavar="NUMBER", **options)]


_UPRIGHT = re.compile(r"\\mathrm\{([^}]*)\}")


def _symbol(symbol: str) -> str:
    """A symbol of a formula as a terminal shows it: ``x_\\mathrm{s}`` is x_s."""
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

    *axes_of* says what the axes of a command are, those that it has by itself among them, for ``--print-config``.
    """
    from snapbeam.config import Config, load_config, lookup, override, same_axis
    from snapbeam.core.validate import InputError

    config = load_config(given["config"]) if given.get("config") is not None else Config()
    if given.get("from_") is not None:
        from snapbeam.cli.common.source import config_of_file

        if given.get("config") is not None:
            raise InputError("from, config: give one of the two")
        config = config_of_file(given["from_"], given.get("point"))
    sections: dict[str, dict[str, Any]] = {}
    axes: dict[str, Any] = {}
    for name, value in given.items():
        section, dot, field = name.partition(".")
        if not dot or value is None:
            continue
        if isinstance(value, str) and _is_axis(name, value):
            axes[name] = value
        else:
            sections.setdefault(section, {})[field] = _value(name, value)
    for text in given.get("set_") or ():
        name, value = _assignment(text, "set")
        full = name if "." in name and name.partition(".")[2] in ("type", "type") else lookup(name).name
        section, _, field = full.partition(".")
        sections.setdefault(section, {})[field] = _value(full, value)
    for text in given.get("axis") or ():
        name, value = _assignment(text, "axis")
        if name in axes:
            raise InputError(f"axis {name}: is given twice")
        axes[name] = value
    single = {f"{section}.{field}" for section, values in sections.items() for field in values}
    for name in axes:
        for same in sorted(same_axis(name) & single):
            raise InputError(f"{same}: is given as a single value and as an axis")
    if axes:
        sections["axes"] = sections.get("axes", {}) | axes
    config = override(config, sections)
    if given.get("print_config"):
        from snapbeam.config import config_text

        printed = config.whole(None if axes_of is None else axes_of(config, given))
        out().print(config_text(printed), markup=False, end="")
        answer(**printed.to_mapping())
        raise typer.Exit
    if config.defaulted:
        whole = config.whole().to_mapping()
        values = ", ".join(
            f"{name} = {_shown(whole, name)}" for name in config.defaulted if name.partition(".")[0] in whole
        )
        notes().print(f"[bold yellow]note:[/] taken from the paper's beam: {escape(values)}")
    return config


def _shown(sections: Mapping[str, Mapping[str, Any]], name: str) -> str:
    """A value with its unit."""
    from snapbeam.config import lookup

    section, _, field = name.partition(".")
    value, unit = sections[section][field], lookup(name).quantity.unit
    return f"{value:.6g}{'' if unit == '1' else ' ' + unit}"


def _is_axis(name: str, value: str) -> bool:
    """Whether the text of an option that may be an axis is one, and not a number."""
    from snapbeam.config import PHYSICAL, parameters

    row = parameters().get(name)
    numeric = name in PHYSICAL or (row is not None and row.quantity.kind in (float, int))
    return numeric and name not in (*_PAIRS, *_LISTS) and (":" in value or "," in value)


def _assignment(text: str, option: str) -> tuple[str, str]:
    from snapbeam.core.validate import InputError

    name, equals, value = text.partition("=")
    if not equals or not name.strip() or not value.strip():
        raise InputError(f"{option} = {text!r}: must be name=value, such as contact.stiffness=2e8")
    return name.strip(), value.strip()


def _value(name: str, value: Any) -> Any:
    """The text of an option as what its parameter holds."""
    from snapbeam.config import PHYSICAL
    from snapbeam.config.parameters import row_of
    from snapbeam.core.validate import InputError

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
            return int(value)
        if kind is float and (row is not None or name in PHYSICAL or name.startswith("start.")):
            return parse_number(value)
    except (ValueError, KeyError, typer.BadParameter):
        words = {bool: "true or false", int: "a whole number"}.get(kind, "a number")
        raise InputError(f"{name} = {value!r}: must be {words}") from None
    return value
