"""What computes: everything beside the parameters that the digits of a number depend on."""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Iterable
from dataclasses import astuple, dataclass, fields
from importlib.metadata import PackageNotFoundError, version

from snapbeam.core.provenance import __version__, arithmetic_hash, code_hash, processor_name
from snapbeam.engines.scalar.fingerprint import fingerprint
from snapbeam.model.system import System

__all__ = ["Maker", "differences", "this_maker"]

_WORDS = {
    "version": "version of snapbeam",
    "code": "state of its code",
    "libraries": "version of NumPy, Numba or Python",
    "arithmetic": "kind of rounding in NumPy and its linear algebra",
    "processor": "type of processor",
}


@dataclass(frozen=True)
class Maker:
    """What computes in one process."""

    version: str
    code: str
    libraries: str
    arithmetic: str
    processor: str


def this_maker(system: System) -> Maker:
    """What computes here, for a system with its law of contact and its drive."""
    return Maker(__version__, _code(system), _libraries(), arithmetic_hash(), processor_name())


def _code(system: System) -> str:
    """Of the package, and of a law or a drive that somebody else wrote."""
    parts = [system.contact, system.striker and system.striker.drive]
    foreign = tuple(
        type(part) for part in parts if part and not type(part).__module__.startswith("snapbeam.")
    )
    mark = fingerprint(foreign) if foreign else ""
    if not mark:
        return code_hash() if not foreign else f"{code_hash()}+?"
    return f"{code_hash()}+{hashlib.sha256(mark.encode()).hexdigest()[:8]}"


def _libraries() -> str:
    found = []
    for name in ("numpy", "numba"):
        try:
            found.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            found.append(f"{name} of unknown version")
    return ", ".join([*found, f"python {platform.python_version()}"])


def differences(makers: Iterable[Maker]) -> list[str]:
    """In words, what is not the same among them; nothing if there is at most one."""
    columns = list(zip(*map(astuple, makers), strict=True))
    names = [field.name for field in fields(Maker)]
    return [_WORDS[name] for name, values in zip(names, columns, strict=False) if len(set(values)) > 1]
