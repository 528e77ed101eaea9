"""Objects that the pages of one server share: the map, the threads, the computed windows."""

from __future__ import annotations

import threading
from collections import OrderedDict
from pathlib import Path
from typing import Any

import numpy as np

from snapbeam import InputError, Integration, System, simulate
from snapbeam.explorer.jobs import RUN_SECONDS, Jobs, Token
from snapbeam.explorer.maps import ResultSource, Source, Window, integration_of, system_of

_WINDOWS = 48
"""Windows that are kept; of more the one that was looked at longest ago is dropped."""


class Shared:
    """One map, its *file* if it has one, the *other* map that it is compared with, and its server."""

    def __init__(self, source: Source, file: Path | None = None, other: Source | None = None) -> None:
        self.source = source
        self.other = other
        self.file = file
        self.jobs = Jobs()
        self.pages = 0
        self._lock = threading.Lock()
        self._windows: OrderedDict[Any, Window] = OrderedDict()
        self.system: System | None = None
        self.integration = Integration()
        self.why_not = ""
        try:
            self.system = system_of(source.attrs, source.name)
            self.integration = integration_of(source.attrs)
        except (InputError, ValueError) as error:
            self.why_not = str(error)

    def page(self, arguments: dict[str, list[bytes]], doc: Any) -> Any:
        """A page for a session: a map's, or that of another result."""
        from snapbeam.explorer.page import Page
        from snapbeam.explorer.result_page import ResultPage

        kind = ResultPage if isinstance(self.source, ResultSource) else Page
        return kind(self, arguments, doc)

    def warm(self) -> None:
        """Load what a first run needs, while the browser starts."""
        system, how = self.system, self.integration
        if system is not None:
            self.jobs.run(
                lambda token: simulate(system, how.replace(cycles=1)).dataset, lambda _, __: None, Token(RUN_SECONDS)
            )

    def window(self, made: Window) -> Window:
        """The window that was computed for the same question, or *made*, kept from now on."""
        with self._lock:
            found = self._windows.setdefault(made.key, made)
            self._windows.move_to_end(made.key)
            while len(self._windows) > _WINDOWS:
                self._windows.popitem(last=False)
            return found

    def windows(self, plane: Any, keys: set[Any]) -> list[Window]:
        """Windows over one plane that have one of *keys*, the widest first; *plane* begins their keys."""
        with self._lock:
            found = [window for key, window in self._windows.items() if key[0] == plane and key in keys]
        return sorted(found, key=lambda each: np.ptp(each.bounds[:2]) * np.ptp(each.bounds[2:]), reverse=True)

    def close(self) -> None:
        """Compute no more."""
        self.jobs.close()
