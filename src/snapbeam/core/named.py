"""Things by name, some of which are made when they are first asked for."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, TypeVar

__all__ = ["NamedTable"]

Kind = TypeVar("Kind")


class NamedTable(dict[str, Kind]):
    """A list of things by name that knows more names than it lists, as ``sine+burst`` or ``impacts_striker_2``.

    Parameters
    ----------
    find : callable
        What has a name that is not listed, or None if there is no such thing.
    listed : pairs, optional
        Of name and thing.
    """

    def __init__(self, find: Callable[[str], Kind | None], listed: Iterable[tuple[str, Kind]] = ()) -> None:
        super().__init__(listed)
        self._find = find

    def __missing__(self, name: str) -> Kind:
        found = self._find(name) if isinstance(name, str) else None
        if found is None:
            raise KeyError(name)
        return found

    def __contains__(self, name: object) -> bool:
        return super().__contains__(name) or (isinstance(name, str) and self._find(name) is not None)

    def get(self, name: str, default: Any = None) -> Any:
        """As of any mapping."""
        return self[name] if name in self else default
