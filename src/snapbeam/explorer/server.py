"""The server of the page: on the loopback address, to pages of its own origin, or elsewhere to who has the token."""

from __future__ import annotations

import hmac
import ipaddress
import logging
import secrets
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import urlparse

import panel as pn
from bokeh.server.auth_provider import AuthProvider
from tornado.web import RequestHandler

from snapbeam import InputError, InputTypeError, Integration, System
from snapbeam.explorer.jobs import BODY, SESSIONS
from snapbeam.explorer.shared import Shared

__all__ = ["Explorer", "Gate", "explore", "is_loopback", "make_server", "serve"]


_LOG = logging.getLogger("snapbeam.explorer")
_COOKIE = "snapbeam_token"
_OWN = "static/extensions/panel/"
"""Where the server keeps what pages are made of; what Panel is not told it fetches from elsewhere."""


def is_loopback(address: str) -> bool:
    """Whether an address is of this machine alone."""
    if address == "localhost":
        return True
    try:
        return ipaddress.ip_address(address).is_loopback
    except ValueError:
        return False


class _Refused(RequestHandler):
    """Says that there is no entrance."""

    def get(self) -> None:
        """Refuse."""
        self.set_status(403)
        self.finish("This page needs its token: open the address that snapbeam explore printed.")


class Gate(AuthProvider):
    """Who may see the page and speak to it: by the name it is called by, and by the token, if there is one.

    The name is looked at because any page on the Internet may have a name of its own lead to the loopback address.
    """

    def __init__(self, hosts: tuple[str, ...], token: str | None) -> None:
        self._hosts, self._token = hosts, token
        super().__init__()

    @property
    def get_user(self) -> Any:
        """Decide about a request."""

        def decide(request: Any) -> str | None:
            host = urlparse(f"//{request.request.host}").hostname or ""
            if host not in self._hosts:
                _LOG.warning("refused a request to the name %r", host[:80])
                return None
            if self._token is None:
                return "reader"
            given = request.get_argument("token", "") or request.get_cookie(_COOKIE, "")
            if not hmac.compare_digest(given.encode(), self._token.encode()):
                return None
            if not request.get_cookie(_COOKIE):
                request.set_cookie(_COOKIE, self._token, httponly=True, samesite="Strict")
            return "reader"

        return decide

    @property
    def get_user_async(self) -> None:
        """Not used."""
        return None

    @property
    def login_url(self) -> str:
        """Where the refused are led."""
        return "/refused"

    @property
    def get_login_url(self) -> None:
        """Not used."""
        return None

    @property
    def login_handler(self) -> type[RequestHandler]:
        """What tells the refused."""
        return _Refused

    @property
    def logout_url(self) -> None:
        """There is none."""
        return None

    @property
    def logout_handler(self) -> None:
        """There is none."""
        return None


def make_server(
    shared: Shared,
    address: str = "127.0.0.1",
    port: int = 0,
    *,
    allow_remote: bool = False,
    token: str | None = None,
) -> tuple[Any, str, str | None]:
    """A server that is not started, its port and its address for a browser.

    Raises
    ------
    InputError
        For an address beyond this machine that was not allowed, and for a port in use.
    """
    if not is_loopback(address) and not allow_remote:
        raise InputError(
            f"address = {address!r}: others could reach the page there and compute on this machine; give --allow-remote"
        )
    if ":" in address:
        raise InputError(f"address = {address!r}: must be a name or an address of four numbers")
    if not is_loopback(address) and token is None:
        token = secrets.token_urlsafe(24)
    hosts: tuple[str, ...] = ("127.0.0.1", "localhost") if is_loopback(address) else (address,)
    if address == "0.0.0.0":
        import socket

        hosts = ("127.0.0.1", "localhost", socket.gethostname(), socket.getfqdn(), *_own_addresses())
    taken = port or _free_port(address)
    origins = [f"{host}:{taken}" for host in hosts if ":" not in host]
    try:
        server = pn.io.server.get_server(
            {"/": _factory(shared)}, port=taken, address=address, websocket_origin=origins, show=False, start=False,
            title="snapbeam explorer", auth_provider=Gate(hosts, token), websocket_max_message_size=BODY,
            http_server_kwargs={"max_body_size": BODY}, check_unused_sessions_milliseconds=5000,
            unused_session_lifetime_milliseconds=15000,
        )  # fmt: skip
    except OSError as error:
        raise InputError(f"port = {port}: cannot be used, {error.strerror or error}") from None
    shown = "127.0.0.1" if address == "0.0.0.0" else address
    return server, f"http://{shown}:{taken}/" + (f"?token={token}" if token else ""), token


def _factory(shared: Shared) -> Callable[[], Any]:
    def page() -> Any:
        from snapbeam.explorer.page import Page
        from snapbeam.explorer.style import Html

        if shared.pages >= SESSIONS:
            return Html(f"{SESSIONS} pages are open, the most that there may be: close one of them.")
        shared.pages += 1
        pn.state.curdoc.template_variables.setdefault("dist_url", _OWN)
        try:
            made = Page(shared, dict(pn.state.session_args))
        except BaseException:
            shared.pages -= 1
            raise

        def gone(_: Any) -> None:
            shared.pages -= 1
            made.close()

        pn.state.on_session_destroyed(gone)
        return made.layout

    return page


def _free_port(address: str) -> int:
    import socket

    with socket.socket() as probe:
        probe.bind((address, 0))
        return int(probe.getsockname()[1])


def _own_addresses() -> tuple[str, ...]:
    import socket

    try:
        return tuple({str(item[4][0]) for item in socket.getaddrinfo(socket.gethostname(), None)})
    except OSError:
        return ()


# ----------------------------------------------------------------------------------------------------
# How the explorer is started: from a notebook or a script, and from the command line.


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

    from snapbeam.explorer.maps import opened
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
        A map as :func:`snapbeam.sweep` gives it, a file or a checkpoint of one, or a system, of which a map over frequency
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

    server, url, _ = make_server(shared, address, port, allow_remote=allow_remote, token=token)
    server.start()
    server.io_loop.add_callback(ready, url)
    try:
        server.io_loop.start()
    finally:
        shared.close()
        server.stop()
