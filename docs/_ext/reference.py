"""Tables of the reference pages: commands, keys of parameter files, variables and codes, supported combinations.

The text comes from the program itself: its commands, its tables of parameters and statistics, and its refusals.  The
pages are committed, so that they are complete on the page of the repository too.
"""

from __future__ import annotations

import dataclasses
import functools
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

__all__ = [
    "command_line",
    "pages",
    "parameter_tables",
    "status_tables",
    "support_tables",
    "variable_tables",
    "write_pages",
    "written",
]

_SECTIONS = {
    "beam": "Geometry and material. Give one of `buckling_level` and `axial_load`.",
    "model": 'The reduced model. `modes = "auto"` takes the smallest power of two with an estimated error of the frequencies below 1 %, '
    '`"auto 0.1 %"` below 0.1 %.',
    "boundary": "Stiffness of the supports; without this section both ends are clamped.",
    "imperfection": "Initial deflection and constant transverse loads, which make the wells unequal; without this section the "
    "beam is perfect.",
    "contact": "A striker and the law of its contact with the beam. The law is selected by `type`. You can give "
    "materials instead of `stiffness`: `radius` of the sphere (m), `young_modulus` (Pa) and `poisson_ratio`, the last two as "
    "lists of two numbers, of sphere and beam. You can give `restitution` and `speed` (m/s) instead of `damping_factor`. Keys "
    "without a type are those of the striker; `location_m` (m) can replace `location`. Several contacts are an array "
    "`[[contact]]`, the drive of each below it as `[contact.drive]`. A `label` replaces the number in the names of their "
    "parameters; see [systems](systems.md#names-of-parameters).",
    "drive": "The motion of the striker, selected by `type`. "
    "[Names in physical units](#names-in-physical-units) can replace the ratios. A type with samples can have `file` and its [keys](base_and_load.md#records-from-files) instead of them.",
    "base_excitation": "The motion of the base, selected by `type`: {bases}; without this section the base is at rest. "
    "Keys that are not in the table are those of [`[drive]`](#drive), with the same unit, limits, default and level. "
    "[Names in physical units](#names-in-physical-units) can replace the ratios. A type with samples or a spectrum can have "
    "`file` and its [keys](base_and_load.md#records-from-files) instead of them.",
    "axial_load": "The change of the axial load in time, selected by `type`; without this section the load is constant.",
    "force": "A force on the structure, selected by `type`: as a function of time those of [`[axial_load]`](#axial_load), with "
    "the same keys, and `location` and `shape`; of the displacement or velocity of one point those of the table. A law of your own has its own type; see [Your own parts](extending.md#local-force). Several "
    "forces are an array `[[force]]`, each with a `label` if you like. `recorded_force` can have `file` and its "
    "[keys](base_and_load.md#records-from-files) instead of samples.",
    "harvester": "The circuit of an energy harvester, selected by `type`.",
    "integration": "Solver settings.",
}


_SAME_KEYS = {"base_excitation": "drive", "force": "axial_load"}
"""Sections whose table leaves out the keys of another: a base moves as a tip, a force changes as a load."""


def _cell(text: object) -> str:
    return str(text).replace("|", "\\|").replace("\n", " ")


def _table(header: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    lines = ["| " + " | ".join(header) + " |", "|" + " --- |" * len(header)]
    lines += ["| " + " | ".join(_cell(value) for value in row) + " |" for row in rows]
    return "\n".join(lines) + "\n"


def parameter_tables() -> str:
    """Return a table of the keys of each section of a parameter file."""
    from snapbeam.model.contact.base import LAWS
    from snapbeam.model.drive.base import DRIVES
    from snapbeam.model.drive.force import FORCES
    from snapbeam.model.harvester import HARVESTERS
    from snapbeam.model.local_force import LOCAL_FORCES
    from snapbeam.model.parameter_file import Config
    from snapbeam.model.parameters import parameters

    given = Config().system.parameters
    types = {
        "contact": LAWS,
        "drive": {name: kind for name, kind in DRIVES.items() if name != "sum"},
        "axial_load": FORCES,
        "force": LOCAL_FORCES,
        "harvester": HARVESTERS,
    }
    bases = _listed(name for name, kind in types["drive"].items() if kind.can_excite_base())
    parts = []
    above: dict[str, dict[str, tuple[str, ...]]] = {}
    for section, words in _SECTIONS.items():
        rows = []
        own = {name: row for name, row in parameters().items() if row.section == section}
        prefixed = all(row.short.startswith(f"{section}_") for row in own.values())
        for name, row in own.items():
            default = given.get(name, row.default)
            shown = "" if default is None or row.quantity.kind is object else _number(default)
            unit = "" if row.quantity.unit == "1" else row.quantity.unit
            symbol = f"${row.quantity.symbol}$" if row.quantity.symbol else ""
            limits = row.limits.replace("inf", "∞")
            key = name.partition(".")[2]
            meaning = row.quantity.long_name + (f", {symbol}" if symbol else "")
            usual = f"{section}_{key}" if prefixed else key
            meaning += f"; in datasets `{row.short}`" if row.short != usual else ""
            level = "run" if row.is_run else "model"
            rows.append((f"`{key}`", meaning, unit, limits, shown or "–", level))
        keys = [row[0] for row in rows]
        above[section] = {row[0]: row[2:6] for row in rows}
        if section in _SAME_KEYS:
            rows = [row for row in rows if above[_SAME_KEYS[section]].get(row[0]) != row[2:6]]
        note = f" In datasets their names begin with `{section}_`." if prefixed else ""
        text = f"## [{section}]\n\n{words.format(bases=bases)}{note}\n\n"
        if section in types:
            text += _keys_by_type(types[section], keys) + "\n"
        parts.append(text + _table(("key", "meaning", "unit", "allowed", "default", "level"), rows))
    return "\n".join([*parts, _physical()])


def _physical() -> str:
    """Return the table of names in physical units, and of the sections that have them."""
    from snapbeam.model.parameters import PHYSICAL
    from snapbeam.model.quantity import numbered, split_name

    found: dict[tuple[str, str, str], list[str]] = {}
    for name, row in PHYSICAL.items():
        section, field = split_name(name)
        if numbered(section)[1] == 1 and not field.endswith(tuple("1234")):
            key = field, split_name(row.parameter)[1], row.unit.replace("um", "µm")
            found.setdefault(key, []).append(section)
    rows = [(f"`{one}`", f"`{ratio}`", unit, _listed(own)) for (one, ratio, unit), own in found.items()]
    return (
        "## Names in physical units\n\n"
        "Files, options, axes, uncertainties and Python accept these names in place of the ratios, of every contact and force by "
        "its number or label and of every term of a sum too (`drive.2.frequency_hz`, `frequency_hz_2`). The last part alone names the parameter if one part of the system alone "
        "has it.\n\n" + _table(("name", "in place of", "unit", "sections"), rows)
    )


def _keys_by_type(types: Mapping[str, Any], keys: Sequence[str]) -> str:
    """Return a table of the keys that each type has."""
    fields = {name: {f"`{each.name}`" for each in dataclasses.fields(kind)} for name, kind in types.items()}
    rows = [(f"`{name}`", ", ".join(key for key in keys if key in own) or "–") for name, own in fields.items()]
    return _table(("type", "its keys"), rows)


def _listed(names: Iterable[str]) -> str:
    return ", ".join(f"`{name}`" for name in names)


def _number(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.6g}" if isinstance(value, (int, float)) else str(value)


def variable_tables() -> str:
    """Return tables of the variables of runs, impacts and maps, and of the codes."""
    from snapbeam.simulation.dataset import IMPACT_COLUMNS, SCHEMA
    from snapbeam.solver.statistics import STATISTICS

    runs = [(f"`{name}`", ", ".join(row.dims), row.unit, row.long_name) for name, row in SCHEMA.items()]
    impacts = [(f"`{name}`", unit, words) for name, unit, words in IMPACT_COLUMNS]
    statistics = [(f"`{row.name}`", row.dtype, row.unit, row.long_name) for row in STATISTICS.values()]
    return "\n".join((
        "## A run\n", _table(("variable", "dimensions", "unit", "meaning"), runs),
        "## Impacts of a run\n", "Dimension `impact`.\n", _table(("variable", "unit", "meaning"), impacts),
        "## Statistics\n",
        "Variables of maps, and attributes of `run.summary`.\n",
        _table(("variable", "kind", "unit", "meaning"), statistics),
    ))  # fmt: skip


def status_tables() -> str:
    """Return tables of the statuses of runs, with remedies, and of the response classes."""
    from snapbeam.util.status_codes import ResponseClass, RunStatus

    statuses = [(int(kind), f"`{kind.name}`", kind.advice) for kind in RunStatus]
    classes = [(int(kind), f"`{kind.name}`", kind.label) for kind in ResponseClass]
    return "\n".join((
        "## Statuses of runs\n", _table(("code", "name", "meaning and remedy"), statuses),
        "## Response classes\n", _table(("code", "name", "class"), classes),
    ))  # fmt: skip


def command_line() -> str:
    """Return the options that commands share, then the help of each command with its own options."""
    import typer.main

    from snapbeam.cli.app import app

    group: Any = typer.main.get_command(app)
    commands = [each for name, command in group.commands.items() for each in _commands(f"snapbeam {name}", command, 2)]
    counts = Counter(row for _, command, _ in commands for row in _options(command))
    common: dict[str, list[tuple[str, str, str]]] = {}
    fewest = {panel: min(count for row, count in counts.items() if row[0] == panel) for panel, _, _ in counts}
    for row, count in counts.items():
        if count >= _COMMON or fewest[row[0]] >= _COMMON - 1:  # or of a panel that goes as a whole
            common.setdefault(row[0], []).append(row)
    parts = ["## Common options\n\nBelow each command, a line names the groups of these options that it has.\n"]
    for panel, rows in common.items():
        parts.append(f"### {panel.partition(' (')[0]}\n\n" + _table(("option", "meaning"), [row[1:] for row in rows]))
    return "\n".join([*parts, *(part for each in commands for part in _command(*each, common))])


_COMMON = 4
"""Number of commands that share a common option, at least."""


def _commands(title: str, command: Any, level: int) -> list[tuple[str, Any, int]]:
    """Return a command and its subcommands, each with its title and the level of its heading."""
    found = [(title, command, level)]
    for name, each in getattr(command, "commands", {}).items():
        found += _commands(f"{title} {name}", each, level + 1)
    return found


def _options(command: Any) -> list[tuple[str, str, str]]:
    """Return panel, flags and meaning of every option of a command."""
    rows = []
    for parameter in command.params:
        if parameter.name in ("help", "help_all"):
            continue
        argument = parameter.param_type_name == "argument"
        panel = getattr(parameter, "rich_help_panel", None) or ("Arguments" if argument else "Options")
        flags = ", ".join(f"`{flag}`" for flag in [*parameter.opts, *parameter.secondary_opts])
        if argument:
            flags = f"`{parameter.metavar or parameter.human_readable_name}`"
        elif parameter.metavar:
            flags += f" *{parameter.metavar}*"
        rows.append((panel, flags, _options_as_code(parameter.help or "")))
    return rows


def _command(title: str, command: Any, level: int, common: Mapping[str, list[tuple[str, str, str]]]) -> list[str]:
    """Return the help of a command, a table of its own options, and the groups of its common options."""
    words = "\n\n".join(_paragraphs(command.help or ""))
    parts = [f"{'#' * level} {title}\n\n{words}\n"]
    options = _options(command)
    own = [row[1:] for row in options if row not in common.get(row[0], ())]
    if own:
        parts.append(_table(("option", "meaning"), own))
    groups = []
    for panel, rows in common.items():
        name = panel.partition(" (")[0]
        flags = {row: row[1].split(" *")[0].split(", ")[0] for row in rows}
        has = [flags[row] for row in rows if row in options]
        lacks = [flags[row] for row in rows if row not in options]
        if has:
            some = (
                ""
                if not lacks
                else f" ({', '.join(has)})"
                if len(has) <= len(lacks)
                else f" without {', '.join(lacks)}"
            )
            groups.append(f"[{name}](#{name.lower().replace(' ', '-')}){some}")
    if groups:
        parts.append(f"Common options: {'; '.join(groups)}.\n")
    return parts


_INTERFACE = ("system", "excitation", "runs", "dynamics", "uncertainty", "figures", "lab", "paper")
"""Pages of the interface."""


def interface_tables() -> str:
    """Return tables of the pages of the interface, with the names on each."""
    from importlib import import_module

    docs = Path(__file__).parents[1]
    rows = []
    for page in _INTERFACE:
        text = (docs / f"api_{page}.md").read_text(encoding="utf-8")
        title = text.partition("\n")[0].removeprefix("# ")
        for heading, part in re.findall(r"^##? (.*)\n((?:(?!## ).*\n)*)", text, re.MULTILINE):
            found: list[str] = []
            for kind, name, members in re.findall(
                r"^\.\. (auto\w+|py:data):: (\S+)$(?:\n   :members:(.*)$)?", part, re.MULTILINE
            ):
                module = kind == "automodule"
                listed = [each.strip() for each in members.split(",") if each.strip()] if module else []
                found += listed or (import_module(name).__all__ if module else [name.rpartition(".")[2]])
            if found:
                anchor = "" if heading == title else "#" + re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-")
                rows.append((f"[{heading}](api_{page}.md{anchor})", _listed(found)))
    tree = "\n".join(f"api_{page}" for page in _INTERFACE)
    return _table(("page", "names"), rows) + f"\n```{{toctree}}\n:hidden:\n:maxdepth: 1\n\n{tree}\n```"


def _paragraphs(text: str) -> list[str]:
    """Return the paragraphs of a help text; an example becomes a code block."""
    found = []
    for part in text.split("\n\n"):
        plain = " ".join(line.strip() for line in part.splitlines())
        if plain.startswith("Example: "):
            found.append(f"```\n{plain.removeprefix('Example: ')}\n```")
        elif plain:
            found.append(_options_as_code(plain))
    return found


def _options_as_code(text: str) -> str:
    """Set options as code, so that their two hyphens do not become a dash."""
    return re.sub(r"(?<![\w`-])(--[a-z][\w-]*)", r"`\1`", text)


@functools.cache
def support_tables() -> str:
    """Return which parts of a system work with which question, and every reason for a refusal.

    Each cell is found by asking: a part that is refused raises an error, whose text is the reason.
    """
    from snapbeam.util.validation import InputError

    questions = _questions()
    reasons: list[str] = []
    alike: dict[tuple[str, ...], list[str]] = {}
    for name, system in _parts().items():
        row: list[str] = []
        for ask in questions.values():
            try:
                row.append(ask(system) or "yes")
            except InputError as error:
                reason = _without_names(str(error))
                reasons += [reason] if reason not in reasons else []
                row.append(f"no ({reasons.index(reason) + 1})")
        alike.setdefault(tuple(row), []).append(name)
    refused = []
    for words, make in _refused_systems().items():
        try:
            make()
        except InputError as error:
            refused.append((words, str(error)))
        else:
            raise AssertionError(f"{words}: no longer refused; remove it from this table")
    listed = "\n".join(f"{i}. {_plain_text(reason)}" for i, reason in enumerate(reasons, 1))
    return (
        _table(("systems", *questions), [("; ".join(names), *answers) for answers, names in alike.items()])
        + f"\nThe numbers are those of the reasons:\n\n{listed}\n\n"
        + "These systems are refused as a whole, when they are made or when a run of them is assembled:\n\n"
        + _table(("system", "reason"), [(words, _plain_text(reason)) for words, reason in refused])
    )


def _without_names(text: str) -> str:
    """A reason that many systems share: without the section and the type that the message names."""
    text = re.sub(r"^(drive|base_excitation|axial_load): a motion", "a motion", text)
    text = re.sub(r"(type|law of contact|drive) '[\w+]+'", r"\1 '...'", text)
    return re.sub(r"contact = \w+\([^)]*\)", "contact = ...", text)


def _plain_text(text: str) -> str:
    """A message as text of a page: no mark-up in it."""
    return re.sub(r"([*_<>$])", r"\\\1", text)


def _questions() -> dict[str, Any]:
    """Functions of a system that return a word, or None for yes, and raise an InputError for no."""
    import snapbeam as sb
    from snapbeam.dynamics.lifetimes import require_excitation
    from snapbeam.dynamics.shooting import require_isolated_orbits
    from snapbeam.dynamics.stroboscope import Stroboscope
    from snapbeam.solver.assemble import make_ensemble

    def advance(system: Any) -> None:
        make_ensemble(system, sb.Integration(early_termination=False), periods=1)

    def map_of(system: Any) -> None:
        Stroboscope(system)

    def orbits(system: Any) -> None:
        require_isolated_orbits(Stroboscope(system))

    def ends_early(system: Any) -> str:
        how = sb.Integration(cycles=1, early_termination=True)
        energy = make_ensemble(system, how).runs["decide_energy"][0]
        return "crossings, energy" if energy > float("-inf") else "crossings"

    return {
        "`advance`": advance,
        "orbits, branches, attractors, basins": orbits,
        "sections, exponents": map_of,
        "lifetimes": require_excitation,
        "early termination": ends_early,
    }


def _parts() -> dict[str, Any]:
    """Systems, each with one part that differs from the paper's."""
    import numpy as np

    import snapbeam as sb
    from snapbeam.model import default_values

    beam, hertz = default_values.BEAM, default_values.CONTACT
    model = sb.ReducedModel.from_beam(beam, modes=2)
    sine = sb.Sine(frequency_ratio=1.2, velocity_amplitude=0.1)
    chirp = sb.Chirp(start_ratio=0.8, stop_ratio=1.2, velocity_amplitude=0.1, sweep_cycles=9.0)
    stop = sb.FixedStop()

    def struck(drive: Any = sine, contact: Any = hertz, of: Any = model, **parts: Any) -> Any:
        striker = {name: parts.pop(name) for name in ("gap", "mass", "suspension_stiffness") if name in parts}
        return sb.System(of, contacts=[sb.Contact(contact, sb.Striker(drive=drive, **striker))], **parts)

    def several(ratio: float, contact: Any = hertz) -> Any:
        other = sb.Sine(frequency_ratio=ratio, velocity_amplitude=0.1)
        above = sb.Striker(drive=other, location=0.3, side="above", gap=5e-5)
        return sb.System(model, contacts=[sb.Contact(contact, sb.Striker(drive=sine)), sb.Contact(hertz, above)])

    def based(motion: Any) -> Any:
        return struck(stop, gap=5e-5, base_excitation=sb.BaseExcitation(motion=motion))

    time = np.arange(400) / 2e4
    record = sb.RecordedMotion(
        displacement=5e-5 * np.sin(200.0 * np.pi * time), velocity=5e-5 * 200.0 * np.pi * np.cos(200.0 * np.pi * time),
        sampling_frequency=2e4, frequency=100.0,
    )  # fmt: skip
    burst = sb.Burst(frequency_ratio=1.2, velocity_amplitude=0.1, duration_cycles=9.0)
    noise = sb.BandLimitedNoise(low_ratio=0.8, high_ratio=1.4, velocity_rms=0.1, seed=1)
    ends = beam.replace(boundary=sb.BoundaryConditions(left_rotational_stiffness=50.0, right_rotational_stiffness=50.0))
    uneven = sb.ReducedModel.from_beam(beam, modes=2, imperfection=sb.Imperfection(midspan_amplitude=1e-6))
    piezo = sb.PiezoelectricHarvester(
        moment_per_volt=4e-3, capacitance=60e-9, resistance=2e4, patch_start=0.05, patch_end=0.4
    )
    spring, drag = (sb.LocalSpring(stiffness=10.0, location=0.4), sb.QuadraticDamping(coefficient=0.1, location=0.4))
    return {
        "the paper's": struck(),
        "a gap": struck(gap=5e-5),
        "contact `power`": struck(contact=sb.PowerLaw.from_stiffness(1e13, 2.0)),
        "contact `layer`": struck(contact=sb.LayeredHertz(stiffness=1e9, layer_stiffness=1e6)),
        "contact `hunt_crossley`": struck(contact=sb.HuntCrossley(4e8, 1.0)),
        "contact `kelvin_voigt`": struck(contact=sb.KelvinVoigt(1e5, 1.0)),
        "contact `elastic_plastic`": struck(contact=sb.ElasticPlasticContact(1e5, 2e5)),
        "contact `restitution`": struck(contact=sb.Restitution(0.9), of=sb.ReducedModel.from_beam(beam, modes=1)),
        "drive `displacement_sine`": struck(sb.DisplacementSine(frequency_ratio=1.2, displacement_amplitude=0.1)),
        "drive `acceleration_sine`": struck(sb.AccelerationSine(frequency_ratio=1.2, acceleration_amplitude=0.1)),
        "drive `sine+sine`, in a ratio of small whole numbers": struck(
            sine + sb.Sine(frequency_ratio=1.8, velocity_amplitude=0.1)
        ),
        "drive `burst`": struck(burst),
        "drive `chirp`": struck(chirp),
        "drive `half_sine`": struck(sb.HalfSine(displacement_amplitude=0.5, duration=0.5)),
        "drive `band_limited_noise`": struck(noise),
        "drive `constant_velocity`": struck(sb.ConstantVelocity(speed=0.1)),
        "drive `recorded_motion`": struck(record),
        "drive `recorded_motion` with a base": struck(
            record,
            base_excitation=sb.BaseExcitation(
                motion=sb.AccelerationSine(frequency_ratio=0.6, acceleration_amplitude=0.25)
            ),
        ),
        "drive `fixed`": struck(stop, gap=5e-5),
        "a striker with a mass": struck(mass=2e-3, suspension_stiffness=1e3),
        "several strikers of one frequency, or in such a ratio": several(1.8),
        "several strikers of other frequencies": several(1.2345678),
        "several strikers, the first with `hunt_crossley`": several(1.2, sb.HuntCrossley(4e8, 1.0)),
        "unequal wells": struck(of=uneven),
        "other ends": struck(of=sb.ReducedModel.from_beam(ends, modes=2)),
        "a base with a sine": based(sb.AccelerationSine(frequency_ratio=0.9, acceleration_amplitude=0.25)),
        "a base with a chirp": based(chirp),
        "a base with noise": based(noise),
        "a base with a shock": based(sb.Shock(acceleration_g=20.0, duration_ms=11.0)),
        "a base with a recorded acceleration": based(sb.RecordedAcceleration.from_g(np.sin(50.0 * time), 2e4)),
        "a base with random vibration": based(
            sb.RecordedAcceleration.from_psd([(20.0, 0.01), (200.0, 0.01)], duration_s=0.5, seed=1)
        ),
        "a load with a sine": struck(
            axial_load=sb.AxialLoadModulation(motion=sb.HarmonicForce(frequency_ratio=2.4, amplitude=3.0))
        ),
        "a load with a ramp": struck(axial_load=sb.AxialLoadModulation(motion=sb.RampForce(change=1.0, duration=3.0))),
        "an external force": struck(
            forces=[sb.ExternalForce(history=sb.HarmonicForce(frequency_ratio=0.9, amplitude=0.1), location=0.4)]
        ),
        "two external forces and a base": struck(
            forces=[
                sb.ExternalForce(history=sb.HarmonicForce(frequency_ratio=ratio, amplitude=0.1), location=0.4)
                for ratio in (0.9, 1.8)
            ],
            base_excitation=sb.BaseExcitation(
                motion=sb.AccelerationSine(frequency_ratio=0.6, acceleration_amplitude=0.25)
            ),
        ),
        "a constant external force": struck(
            forces=[sb.ExternalForce(history=sb.ConstantForce(force=0.01), location=0.4)]
        ),
        "a recorded external force": struck(
            forces=[
                sb.ExternalForce(
                    history=sb.RecordedForce(record=np.sin(50.0 * time), sampling_frequency=2e4), location=0.4
                )
            ]
        ),
        "a local force": struck(forces=[spring]),
        "an electrode": struck(forces=[sb.ElectrostaticForce(location=0.5, area=1e-6, gap=2e-3, voltage=10.0)]),
        "a magnet": struck(forces=[sb.MagneticForce(location=0.5, gap=2e-3, strength=1e-9)]),
        "Coulomb friction of a point": struck(forces=[sb.CoulombFriction(friction_force=1e-3, smoothing_velocity=1e-3, location=0.4)]),
        "a local force with damping": struck(forces=[drag]),
        "several local forces, one with damping, and an external force": struck(
            forces=[spring, drag, sb.ExternalForce(history=sb.ConstantForce(force=0.01), location=0.4)]
        ),
        "two harvesters, a local force with damping and a lossy contact": struck(
            sine, sb.HuntCrossley(4e8, 1.0), harvesters=[piezo, piezo], forces=[drag]
        ),
        "a harvester": struck(harvesters=[piezo]),
        "a coil": struck(harvesters=[sb.ElectromagneticHarvester(force_factor=1.0, resistance=10.0)]),
        "a coil with an inductance": struck(
            harvesters=[sb.ElectromagneticHarvester(force_factor=1.0, resistance=10.0, inductance=0.01)]
        ),
        "a structure given by matrices": struck(
            of=sb.ReducedModel.from_matrices([[1.0]], [[1e5]], contact_shape=[1.0], length_scale=1e-3)
        ),
        "a base and no contact": sb.System(
            model,
            base_excitation=sb.BaseExcitation(
                motion=sb.AccelerationSine(frequency_ratio=0.9, acceleration_amplitude=0.25)
            ),
        ),
    }  # fmt: skip


def _refused_systems() -> dict[str, Any]:
    """Functions that make systems whose parts do not go together, and assemble a run of them."""
    import snapbeam as sb

    parts = _parts()
    load = parts["a load with a sine"].axial_load
    base = parts["a base with a sine"].base_excitation
    matrices = sb.ReducedModel.from_matrices([[1.0]], [1.0], contact_shape=[1.0], length_scale=1.0)
    chirp = parts["drive `chirp`"].striker.drive
    half = parts["drive `half_sine`"].striker.drive

    def made(**around: Any) -> Any:
        return lambda: sb.System(matrices, **around)

    return {
        "a base with a half sine": lambda: sb.BaseExcitation(motion=half),
        "a base with a chirp that does not carry the striker": lambda: sb.BaseExcitation(
            motion=chirp, striker_on_base=False
        ),
        "a base under a structure given by matrices": made(base_excitation=base),
        "a changing load on a structure given by matrices": made(axial_load=load),
        "a suspension without a mass": lambda: sb.Striker(drive=sb.FixedStop(), suspension_stiffness=1e3),
        "an overdamped suspension": lambda: sb.Striker(
            drive=sb.FixedStop(), mass=1e-3, suspension_stiffness=1.0, suspension_damping=1.0
        ),
    }


MARK = (
    "<!-- From here on the text is written by `python docs/_ext/reference.py`; a test compares it with the program. -->"
)


def pages() -> dict[str, Any]:
    """Functions that write the second part of a page, by the name of the page."""
    return {
        "parameters": parameter_tables, "variables": lambda: variable_tables() + "\n" + status_tables(),
        "command_line": command_line, "systems": support_tables, "api": interface_tables,
    }  # fmt: skip


def written(text: str, tables: str) -> str:
    """Return a page with these tables in place of those that stand there."""
    return text.partition(MARK)[0].rstrip() + f"\n\n{MARK}\n\n" + tables.strip() + "\n"


def write_pages(folder: Path) -> None:
    """Write the tables into the pages of a folder."""
    for name, make in pages().items():
        target = folder / f"{name}.md"
        target.write_text(written(target.read_text(encoding="utf-8"), make()), encoding="utf-8")


if __name__ == "__main__":
    write_pages(Path(__file__).parents[1])
