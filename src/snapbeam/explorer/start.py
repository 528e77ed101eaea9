"""The doors of the explorer: from a notebook or a script, and from the command line."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

from snapbeam import InputError, InputTypeError, Integration, System

__all__ = ["Explorer", "explore", "serve"]

_MISSING = "the explorer needs Panel: pip install 'snapbeam[explorer]'"


class Explorer:
    """A page that is served beside a notebook; shown as a frame where one evaluates it.

    Attributes
    ----------
    url : str
        Its address.
    """

    def __init__(self, url: str, stop: Callable[[], None], height: int) -> None:
        self.url, self._stop, self._height = url, stop, height

    def stop(self) -> None:
        """Serve it no more."""
        self._stop()

    def _repr_html_(self) -> str:
        return f'<iframe src="{self.url}" width="100%" height="{self._height}" style="border:0"></iframe>'

    def __repr__(self) -> str:
        return f"<Explorer at {self.url}>"


def _shared(what: Any, system: System | None, integration: Integration | None) -> Any:
    try:
        import panel as pn
    except ImportError as error:
        raise InputError(_MISSING) from error
    from bokeh.settings import settings

    from snapbeam.explorer.maps.source import opened
    from snapbeam.explorer.shared import Shared

    settings.resources = "server"  # whatever a page is made of comes from this machine
    pn.extension()
    file = Path(what) if isinstance(what, (str, Path)) else None
    return Shared(opened(what, system=system, integration=integration), file)


def explore(what: Any = None, *, integration: Integration | None = None, height: int = 900) -> Explorer:
    """Open a map in the browser: click on a point, see its run, watch the beam.

    Parameters
    ----------
    what : xarray.Dataset, path, System, optional
        A map as :func:`snapbeam.sweep` gives it, a file or a store of one, or a system, of which a map over frequency
        ratio and velocity amplitude is computed while one looks at it; the paper's beam by default.
    integration : Integration, optional
        Of a system.
    height : int
        Of the frame in a notebook, pixels.

    Returns
    -------
    Explorer
        Shows itself in a notebook; ``url`` is its address on this machine, ``stop()`` ends it.

    Raises
    ------
    InputError
        If *what* is no map, or Panel is not installed.
    """
    if not isinstance(integration, (Integration, type(None))):
        raise InputTypeError(f"integration is a {type(integration).__name__}: must be an Integration or None")
    shared = _shared(what, None, integration)
    from snapbeam.explorer.server import make_server

    ready = threading.Event()
    held: dict[str, Any] = {}

    def serve_here() -> None:
        import asyncio

        asyncio.set_event_loop(asyncio.new_event_loop())
        try:
            server, held["url"], _ = make_server(shared)
            held["server"] = server
            server.start()
        except BaseException as error:
            held["error"] = error
            ready.set()
            return
        ready.set()
        server.io_loop.start()

    thread = threading.Thread(target=serve_here, name="snapbeam-explorer", daemon=True)
    thread.start()
    ready.wait()
    if "error" in held:
        raise held["error"]

    def stop() -> None:
        server = held["server"]
        server.io_loop.add_callback(server.stop)
        server.io_loop.add_callback(server.io_loop.stop)
        shared.close()

    return Explorer(held["url"], stop, height)


def serve(
    what: Any,
    *,
    address: str = "127.0.0.1",
    port: int = 0,
    allow_remote: bool = False,
    token: str | None = None,
    system: System | None = None,
    integration: Integration | None = None,
    ready: Callable[[str], None] = print,
) -> None:
    """Serve the page until the process is interrupted; *ready* is told its address.

    Raises
    ------
    InputError
        If *what* is no map, or the address cannot be served.
    """
    import matplotlib

    matplotlib.use("Agg")  # pictures are drawn beside the page, for files alone
    shared = _shared(what, system, integration)
    from snapbeam.explorer.server import make_server

    server, url, _ = make_server(shared, address, port, allow_remote=allow_remote, token=token)
    server.start()
    server.io_loop.add_callback(ready, url)
    try:
        server.io_loop.start()
    finally:
        shared.close()
        server.stop()
