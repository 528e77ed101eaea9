"""Several motions that are integrated as one drive: those of tips, the base, the axial load and external forces.

A run has one clock, whose argument belongs to one drive.  If one thing alone moves, the argument is its own, and what
repeats goes on repeating; of several each has its argument from the time since they began.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from snapbeam.model.drive.base import DRIVES, HORIZON, Drive

__all__ = ["HORIZON", "Joined", "joined", "parts_of"]


_SEPARATOR = "__"


class Joined(Drive):
    """Motions of several parts; subclasses are made by :func:`joined`, one for each mixture of kinds.

    The engine sees the numbers of each part under its name, as ``base_amplitude``; unless one moves *alone*, its phase at
    the start too.  Of a base and of each external force they see a bound on its acceleration, or on itself, as
    ``base_hardest``; of a base the sign ``base_sign`` with which it counts in space, and ``base_follow``, how much of its
    motion the tip makes in the frame of the ends.
    """

    hooks = (*Drive.hooks, "alone")
    alone: ClassVar[bool] = False
    """True if only one part moves, with its own argument."""


def joined(kinds: Mapping[str, type[Drive]]) -> type[Joined]:
    """The class of a mixture: the kinds of what moves, by part."""
    named = list(kinds.items())
    for part, kind in named:
        if _known(part, kind.name) is not kind:
            raise TypeError(f"{kind.__name__}: is registered under no name")
    name = _SEPARATOR.join(["Joined", *(f"{part}{_SEPARATOR}{kind.name}" for part, kind in named)])
    if name not in globals():
        globals()[name] = _made(name, named)
    found: type[Joined] = globals()[name]
    return found


def parts_of(owner: type[Drive], kind: str) -> dict[int, str]:
    """Parts of a kind that has numbers, by number: ``tip1`` is that of the second striker, ``force0`` the first force."""
    names = [part for part, _ in owner.parts]
    return {int(part[len(kind) :]): part for part in names if part[: len(kind)] == kind and part != kind}


def _known(part: str, name: str) -> type[Drive] | None:
    """The kind of drive that a part may have, by its name, or None."""
    from snapbeam.model.axial_load import LOADS
    from snapbeam.model.external_force import FORCES

    if part == "load":
        return LOADS.get(name)
    return (FORCES if part.startswith("force") else DRIVES).get(name)


def _made(name: str, named: list[tuple[str, type[Drive]]]) -> type[Joined]:
    alone = len(named) == 1
    numbers = ["omega", "fastest"]
    for part, kind in named:
        numbers += [f"{part}_{each}" for each in kind.number_names]
        numbers += [] if alone else [f"{part}_phase"]
        numbers += [f"{part}_hardest"] if part == "base" or part.startswith("force") else []
    if any(part == "base" for part, _ in named):
        numbers += ["base_sign", "base_follow"]
    body: dict[str, Any] = {
        "__module__": __name__,
        "__qualname__": name,
        "__doc__": f"Moving: {', '.join(f'the {part} as {kind.name!r}' for part, kind in named)}.",
        "parts": tuple(named),
        "alone": alone,
        "is_periodic": alone and named[0][1].is_periodic,
        "number_names": tuple(numbers),
        "amplitudes": tuple(f"{part}_{each}" for part, kind in named for each in kind.amplitudes),
    }
    return type(name, (Joined,), body)


def __getattr__(name: str) -> type[Joined]:
    """A mixture by its name, as another process knows it."""
    first, *words = name.split(_SEPARATOR)
    if first != "Joined" or not words or len(words) % 2:
        raise AttributeError(name)
    pairs = dict(zip(words[::2], words[1::2], strict=True))
    kinds = {part: _known(part, kind) for part, kind in pairs.items()}
    if any(kind is None for kind in kinds.values()):
        raise AttributeError(name)
    return joined({part: kind for part, kind in kinds.items() if kind is not None})
