"""Reading and writing parameter files, and saying what is wrong with one."""

from __future__ import annotations

import difflib
import os
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import tomli_w
from pydantic import BaseModel, ValidationError

from snapbeam.config.sections import Config, units_of
from snapbeam.core.files import atomic_path, check_writable
from snapbeam.core.validate import InputError

__all__ = ["config_from_mapping", "dump_config", "load_config", "override"]

_SYMBOLS = {
    "E": "young_modulus",
    "L": "length",
    "N": "modes",
    "Omega": "frequency_ratio",
    "P": "axial_load",
    "V": "velocity_amplitude",
    "b": "buckling_level",
    "f1": "reference_freq",
    "h": "thickness",
    "k_c": "stiffness",
    "kc": "stiffness",
    "omega": "frequency_ratio",
    "rho": "density",
    "x_s": "location",
    "xs": "location",
    "zeta": "damping_ratio",
}

# What stands for the same thing in a section: giving one set takes the other away.
_RIVALS: dict[str, tuple[set[str], set[str]]] = {
    "beam": ({"buckling_level"}, {"axial_load"}),
    "contact": ({"stiffness"}, {"radius", "young_modulus", "poisson_ratio"}),
}

_KINDS = {
    "bool_type": "true or false",
    "finite_number": "a finite number",
    "float_type": "a number",
    "int_type": "a whole number",
    "list_type": "a list of numbers",
    "string_type": "text",
}


def config_from_mapping(sections: Mapping[str, Any], source: str = "") -> Config:
    """Check nested parameters, as a TOML file holds them.

    Parameters
    ----------
    sections : mapping of mapping
        Values by section and name.
    source : str
        Where they come from, to stand before each refusal.

    Raises
    ------
    InputError
        One line for each thing that is wrong: unknown names, wrong kinds, wrong units.
    """
    lines = _unknown_names(sections)
    if not lines:
        try:
            return Config.model_validate(dict(sections))
        except ValidationError as error:
            lines = [_refusal(item) for item in error.errors()]
    raise InputError("\n".join(f"{source}: {line}" if source else line for line in lines))


def override(config: Config, sections: Mapping[str, Mapping[str, Any]]) -> Config:
    """Return *config* with some values replaced; a value of ``None`` replaces nothing.

    ``axial_load`` takes the place of ``buckling_level`` and the other way round, and so do the contact
    stiffness and the materials.
    """
    merged = config.model_dump(exclude_unset=True, exclude_none=True)
    for section, changes in sections.items():
        given = {name: value for name, value in changes.items() if value is not None}
        kept = merged.get(section, {})
        for mine, other in (_RIVALS[section], _RIVALS[section][::-1]) if section in _RIVALS else ():
            if mine & given.keys():
                kept = {name: value for name, value in kept.items() if name not in other}
        if given:
            merged[section] = kept | given
    return config_from_mapping(merged)


def load_config(path: str | os.PathLike[str]) -> Config:
    """Read parameters from a TOML file.

    Raises
    ------
    InputError
        If the file cannot be read, is no TOML, or holds anything but known keys with values of the right
        kind and size; the message names the file, the section and the key.
    """
    file = Path(path)
    try:
        with file.open("rb") as stream:
            sections = tomllib.load(stream)
    except OSError as error:
        raise InputError(f"config = {str(path)!r}: cannot be read, {error.strerror or error}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"config = {str(path)!r}: is no TOML, {error}") from error
    return config_from_mapping(sections, source=file.name)


def dump_config(config: Config, path: str | os.PathLike[str], comment: str = "") -> None:
    """Write the parameters that were given to a TOML file, each with its unit and meaning above it.

    Parameters
    ----------
    config : Config
        What to write; what was not given, and takes the paper's value, is left out.
    path : path
        The file, ending in ``.toml``; written whole or not at all.
    comment : str
        Lines to stand at the head of the file, such as where the numbers come from.
    """
    target = check_writable(path, "config", (".toml",))
    lines = [f"# {line}".rstrip() for line in comment.splitlines()]
    for section, values in config.model_dump(exclude_unset=True, exclude_none=True).items():
        model = _section_model(section)
        lines += ["", f"[{section}]"] if lines else [f"[{section}]"]
        for name, value in values.items():
            units = units_of(model, name)
            meaning = f"{model.model_fields[name].description}{f', {units}' if units else ''}"
            lines += [f"# {meaning}", tomli_w.dumps({name: value}).rstrip()]
    with atomic_path(target) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _section_model(section: str) -> type[BaseModel]:
    model = Config.model_fields[section].annotation
    assert isinstance(model, type) and issubclass(model, BaseModel)
    return model


def _unknown_names(sections: Mapping[str, Any]) -> list[str]:
    lines = []
    for section, values in sections.items():
        if section not in Config.model_fields:
            lines.append(f"[{section}]: unknown section{_nearest(section, list(Config.model_fields))}")
        elif not isinstance(values, Mapping):
            lines.append(f"{section} = {values!r}: must be a section [{section}]")
        else:
            known = list(_section_model(section).model_fields)
            unknown = [key for key in values if key not in known]
            lines += [f"[{section}] {key}: unknown key{_nearest(key, known)}" for key in unknown]
    return lines


def _nearest(name: str, known: list[str]) -> str:
    close = [word for word in known if _SYMBOLS.get(name) == word or name.lower().startswith(word)]
    close = close or difflib.get_close_matches(name.lower(), known, 1)
    if close:
        return f"; did you mean {close[0]!r}?"
    return f"; must be one of {', '.join(known)}"


def _refusal(item: Any) -> str:
    section, *rest = (str(part) for part in item["loc"])
    name = rest[0] if rest else ""
    place = f"[{section}] {name}".rstrip()
    value = item["input"]
    if item["type"] == "value_error":
        message = str(item["ctx"]["error"])
        if not name or message.startswith(f"{name} = ") or message.startswith(f"{name}["):
            return f"[{section}] {message}"
        return f"{place} = {value!r}: {message}"
    allowed = _KINDS.get(item["type"], item["msg"])
    units = units_of(_section_model(section), name) if name else ""
    return f"{place} = {value!r}: must be {allowed}{f' in {units}' if units else ''}"
