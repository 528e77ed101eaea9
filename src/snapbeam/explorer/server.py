"""The server of the page: it answers its own pages, and whoever has the token."""

from __future__ import annotations

import hmac
import ipaddress
import logging
import os
import secrets
import socket
import threading
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path
from typing import Any
from urllib.parse import parse_qsl, quote, unquote, urlencode

import panel as pn
from tornado.httputil import HTTPServerRequest
from tornado.iostream import StreamClosedError
from tornado.routing import Router
from tornado.web import OutputTransform, RequestHandler
from tornado.websocket import WebSocketClosedError

from snapbeam import InputError, InputTypeError, Integration, System
from snapbeam.explorer.jobs import BODY, SESSIONS
from snapbeam.explorer.shared import Shared

_LOG = logging.getLogger("snapbeam.explorer")
_ICON = "/favicon.ico"
_PORT, _PORTS = 8760, 20
UNUSED, CHECKED = 15_000, 5_000
"""Time after which a session without a browser ends, and between two looks at it, ms."""
"""The port by default, and how many are tried."""
_COOKIE = "snapbeam_token"
_TEMPLATE = """
{% block preamble %}
    <meta name="viewport" content="width=device-width, initial-scale=1">
    <script>
      const log = console.log.bind(console);
      console.log = (...words) => { if (words[0] !== 'Bokeh items were rendered successfully') { log(...words); } };
    </script>
    {{ super() }}
{% endblock %}
{% block postamble %}<script>Bokeh.logger.set_level('warn');</script>{% endblock %}
"""
"""Nothing but warnings in the console; for one line Bokeh has no level."""
_OWN = "static/extensions/panel/"
"""Path of the static files on the server; Panel loads all others from elsewhere."""


def is_loopback(address: str) -> bool:
    """Return whether an address is a loopback address."""
    if address == "localhost":
        return True
    try:
        return ipaddress.ip_address(address).is_loopback
    except ValueError:
        return False


class _Refused(RequestHandler):
    """Answers a request that the gate refuses."""

    def initialize(self, status: int, words: str) -> None:
        self._refusal = status, words

    def prepare(self) -> None:
        status, words = self._refusal
        self.set_status(status)
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        self.finish(words)


class _Entered(RequestHandler):
    """Moves the token from the address into a cookie."""

    def initialize(self, key: str) -> None:
        self._key = key

    def get(self) -> None:
        rest = [(name, value) for name, value in parse_qsl(self.request.query) if name != "token"]
        path = self.request.path
        self.set_cookie(_COOKIE, self._key, path=path, httponly=True, samesite="Strict")
        self.redirect(path + (f"?{urlencode(rest, safe=',:')}" if rest else ""))


class Gate(Router):
    """Every request to the server passes here: pages, scripts, sockets, and addresses that do not exist.

    A request must call the server by one of its names, because any page on the Internet may direct a name of its own to
    the loopback address.  It must come from a page of this server or from the address bar.  A page and its socket need
    the token: in a cookie, limited to the path *prefix*, or, in the frame of a notebook, which has no cookies, in the
    address.
    """

    def __init__(self, application: Any, shared: Shared, hosts: tuple[str, ...], prefix: str, token: str) -> None:
        self._application, self._shared, self._hosts = application, shared, hosts
        self._prefix, self._token = prefix, token
        self._key = sha256(b"cookie " + token.encode()).hexdigest()
        self._pages = {f"{prefix}/", f"{prefix}/ws"}

    def find_handler(self, request: HTTPServerRequest, **_: Any) -> Any:
        """Choose what answers a request."""
        refusal = self._refusal(request)
        if refusal is not None:
            _LOG.info("refused %r: %s", request.path[:80], refusal[1])
            return self._answer(request, _Refused, status=refusal[0], words=refusal[1])
        is_frame = request.headers.get("Sec-Fetch-Dest", "document") != "document"
        if request.path == f"{self._prefix}/" and self._in_address(request) and not is_frame:
            return self._answer(request, _Entered, key=self._key)
        return self._application.find_handler(request)

    def _answer(self, request: HTTPServerRequest, handler: type[RequestHandler], **arguments: Any) -> Any:
        return self._application.get_handler_delegate(request, handler, arguments)

    def _refusal(self, request: HTTPServerRequest) -> tuple[int, str] | None:
        host, origin = request.host.lower(), request.headers.get("Origin")
        if host not in self._hosts:
            return 403, f"the server is not called {host[:80]!r}"
        if origin is not None and origin != f"http://{host}":
            return 403, f"pages of {origin[:80]!r} may not ask this server"
        entering = request.headers.get("Sec-Fetch-Mode") == "navigate" and self._in_address(request)
        if request.headers.get("Sec-Fetch-Site", "none") not in ("none", "same-origin") and not entering:
            return 403, "other pages may not ask this server; type the address"
        if request.path.startswith(f"{self._prefix}/static/") and not unquote(request.path).isprintable():
            # a null character is an error of the functions that open files
            return 404, "there is no such file"
        if request.path.startswith(f"{self._prefix}/static/") or request.path == _ICON:
            return None
        if request.path not in self._pages:
            return 404, "there is no such page; open the address that the command printed"
        if not (self._in_address(request) or self._in_cookie(request)):
            return 403, "this page needs its token; open the address that the command printed"
        if request.path != f"{self._prefix}/ws" and self._shared.pages >= SESSIONS:
            wait = (UNUSED + CHECKED) // 1000
            return 503, f"{SESSIONS} pages are open, which is the limit; close one of them, and wait {wait} s"
        return None

    def _in_address(self, request: HTTPServerRequest) -> bool:
        given = request.query_arguments.get("token", [b""])[0]
        return hmac.compare_digest(given, self._token.encode())

    def _in_cookie(self, request: HTTPServerRequest) -> bool:
        held = request.cookies.get(_COOKIE)
        return held is not None and hmac.compare_digest(held.value.encode(), self._key.encode())


class _Headers(OutputTransform):
    """The headers of every response, which tell the browser what a page may do.

    Only the server's files and the scripts of the page as it was sent may run: text that becomes markup later cannot
    run a script.  Bokeh needs ``unsafe-eval`` for its callbacks, inline style sheets, and scripts that it composes (``blob:``).
    """

    def __init__(self, request: HTTPServerRequest) -> None:
        self._host = request.headers.get("Host", "")
        self._framed = request.headers.get("Sec-Fetch-Dest") == "iframe"

    def transform_first_chunk(
        self, status_code: int, headers: Any, chunk: bytes, finishing: bool
    ) -> tuple[int, Any, bytes]:
        """Add the headers."""
        nonce = secrets.token_urlsafe(16)
        if headers.get("Content-Type", "").startswith("text/html") and finishing:
            chunk = chunk.replace(b"<script", f'<script nonce="{nonce}"'.encode())
            headers["Content-Length"] = str(len(chunk))
        headers["Content-Security-Policy"] = (
            f"default-src 'none'; script-src 'self' blob: 'unsafe-eval' 'nonce-{nonce}'; style-src 'self' 'unsafe-inline'; "
            f"img-src 'self' data: blob:; media-src data: blob:; font-src 'self' data:; "
            f"connect-src 'self' ws://{self._host}; base-uri 'none'; form-action 'none'"
            + ("" if self._framed else "; frame-ancestors 'none'")
        )
        headers["Referrer-Policy"] = "no-referrer"
        headers["X-Content-Type-Options"] = "nosniff"
        headers["Cross-Origin-Resource-Policy"] = "same-origin"
        return status_code, headers, chunk


_LOGGERS = ("asyncio", "bokeh.server.protocol_handler", "bokeh.server.views.ws", "tornado.application")


def _lives_on(record: logging.LogRecord) -> bool:
    """Return False for a message that a tab was closed while something was sent to it or received from it."""
    error = record.exc_info[1] if record.exc_info else None
    at = error.__traceback__ if error is not None else None
    while at is not None and at.tb_next is not None:
        at = at.tb_next
    of_session = at is not None and at.tb_frame.f_globals.get("__name__") == "bokeh.server.connection"
    closed = isinstance(error, (WebSocketClosedError, StreamClosedError)) or (
        isinstance(error, AssertionError) and of_session  # the session was ended before its last message came
    )
    return not closed and "connection was closed" not in str(record.msg)


def make_server(
    shared: Shared,
    address: str = "127.0.0.1",
    port: int | None = 0,
    *,
    allow_remote: bool = False,
    token: str | None = None,
) -> tuple[Any, str]:
    """A server that is not started, and its address for a browser.

    The address contains the token, a random one unless given.  Port None is 8760 or, if that is in use, the next
    free one; 0 is any free port.
    """
    if not is_loopback(address) and not allow_remote:
        raise InputError(
            f"address = {address!r}: others could reach the page there and compute on this machine; give --allow-remote"
        )
    if ":" in address:
        raise InputError(f"address = {address!r}: must be a name or an address of four numbers")
    token = token or secrets.token_urlsafe(24)
    names: tuple[str, ...] = ("127.0.0.1", "localhost") if is_loopback(address) else (address,)
    if address == "0.0.0.0":
        names = ("127.0.0.1", "localhost", socket.gethostname(), socket.getfqdn(), *_own_addresses())
    taken = (_next_port(address) if port is None else port) or _free_port(address)
    names = tuple(name.lower() for name in names if ":" not in name)
    hosts = names if taken == 80 else tuple(f"{name}:{taken}" for name in names)
    prefix = f"/{sha256(token.encode()).hexdigest()[:16]}"  # other servers of this machine never get its cookie
    try:
        server = pn.io.server.get_server(
            {"/": _factory(shared)}, port=taken, address=address, websocket_origin=list(hosts), show=False,
            start=False, title="snapbeam explorer", prefix=prefix, websocket_max_message_size=BODY,
            http_server_kwargs={"max_body_size": BODY}, check_unused_sessions_milliseconds=CHECKED,
            unused_session_lifetime_milliseconds=UNUSED,
        )  # fmt: skip
    except OSError as error:
        raise InputError(f"port = {port}: cannot be used, {error.strerror or error}") from None
    for name in _LOGGERS:
        logging.getLogger(name).addFilter(_lives_on)  # a filter that it has already is not added again
    application = server._tornado
    application.transforms.append(_Headers)
    server._http.request_callback = Gate(application, shared, hosts, prefix, token)
    shown = "127.0.0.1" if address == "0.0.0.0" else address
    return server, f"http://{shown}:{taken}{prefix}/?token={quote(token)}"


def _factory(shared: Shared) -> Callable[[], Any]:
    def page() -> Any:
        shared.pages += 1
        doc = pn.state.curdoc
        doc.template = _TEMPLATE
        doc.template_variables.update(dist_url=_OWN, app_favicon=_ICON)
        try:
            made = shared.page(dict(pn.state.session_args), doc)
        except BaseException:
            shared.pages -= 1
            raise

        def gone(_: Any) -> None:
            shared.pages -= 1
            made.close()

        pn.state.on_session_destroyed(gone)
        return made.layout

    return page


def kept_token() -> str | None:
    """The token of this user, written to a file when it is first needed; None if there is no such file.

    With it and with the fixed port, links to the page remain valid after a restart.
    """
    try:
        base = os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state"
        path = Path(base) / "snapbeam" / "explorer-token"
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        if not path.exists():
            path.touch(mode=0o600)
            path.write_text(secrets.token_urlsafe(24), encoding="ascii")
        if os.name == "posix" and path.stat().st_mode & 0o077:
            return None  # others could read it
        text = path.read_text(encoding="ascii").strip()
    except (OSError, UnicodeDecodeError, RuntimeError):
        return None
    return text if len(text) >= 16 else None


def _next_port(address: str) -> int:
    """The first free port from the fixed one on; 0 if all of them are in use."""
    for port in range(_PORT, _PORT + _PORTS):
        with socket.socket() as probe:
            if os.name == "posix":  # as the server does: a port whose last connections are ending is free
                probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind((address, port))
            except OSError:
                continue
            return port
    return 0


def _free_port(address: str) -> int:
    with socket.socket() as probe:
        probe.bind((address, 0))
        return int(probe.getsockname()[1])


def _own_addresses() -> tuple[str, ...]:
    try:
        return tuple({str(item[4][0]) for item in socket.getaddrinfo(socket.gethostname(), None)})
    except OSError:
        return ()


# ----------------------------------------------------------------------------------------------------
# How the explorer is started: from a notebook or a script, and from the command line.


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


def begin_pages() -> None:
    """Prepare Panel and Bokeh for pages that ask no other machine."""
    from bokeh.settings import settings

    settings.resources = "server"  # whatever a page is made of comes from this machine
    settings.log_level = None  # to set it in this way is a message in the console of the browser
    pn.extension()


def _shared(what: Any, system: System | None, integration: Integration | None, against: Any) -> Any:
    from snapbeam.explorer.maps import ResultSource, opened
    from snapbeam.explorer.shared import Shared

    begin_pages()
    file = Path(what) if isinstance(what, (str, Path)) else None
    other = None if against is None else opened(against)
    if other is not None and (isinstance(other, ResultSource) or other.is_list):
        raise InputError(f"against = {other.name!r}: must be a map over a grid of two parameters")
    shared = Shared(opened(what, system=system, integration=integration), file, other)
    shared.warm()
    return shared


def explore(
    what: Any = None, *, integration: Integration | None = None, height: int = 900, against: Any = None
) -> Explorer:
    """Open a result in the browser: click on a point of a map, see its run, watch the beam.

    Parameters
    ----------
    what : xarray.Dataset, Run, path, System, optional
        A map as :func:`snapbeam.sweep` gives it or any other result, its file, a checkpoint, or a system, of which a map
        over two parameters of its excitation is computed while one looks at it; the paper's beam by default.
    integration : Integration, optional
        Of a system.
    height : int
        Of the frame in a notebook, pixels.
    against : xarray.Dataset or path, optional
        Another map, whose difference from *what* is shown.

    Returns
    -------
    Explorer
        Shows itself in a notebook; ``url`` is its address on this machine, ``stop()`` ends it.

    Raises
    ------
    InputError
        If *what* is no result, or Panel is not installed.
    """
    if not isinstance(integration, (Integration, type(None))):
        raise InputTypeError(f"integration is a {type(integration).__name__}: must be an Integration or None")
    shared = _shared(what, None, integration, against)

    ready = threading.Event()
    held: dict[str, Any] = {}

    def serve_here() -> None:
        import asyncio

        asyncio.set_event_loop(asyncio.new_event_loop())
        try:
            server, held["url"] = make_server(shared)
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
    port: int | None = None,
    allow_remote: bool = False,
    token: str | None = None,
    system: System | None = None,
    integration: Integration | None = None,
    against: Any = None,
    ready: Callable[[str], None] = print,
) -> None:
    """Serve the page until the process is interrupted; *ready* is called with its address.

    Raises
    ------
    InputError
        If *what* is no result, or the address cannot be served.
    """
    import matplotlib

    matplotlib.use("Agg")  # pictures are drawn beside the page, for files alone
    shared = _shared(what, system, integration, against)
    serve_shared(shared, address, port, allow_remote=allow_remote, token=token, ready=ready)


def serve_shared(
    shared: Any,
    address: str = "127.0.0.1",
    port: int | None = None,
    *,
    allow_remote: bool = False,
    token: str | None = None,
    ready: Callable[[str], None] = print,
) -> None:
    """Serve the pages that ``shared.page(arguments, document)`` makes; see :func:`serve`."""
    if token is None and is_loopback(address):
        token = kept_token()
    server, url = make_server(shared, address, port, allow_remote=allow_remote, token=token)
    server.start()
    server.io_loop.add_callback(ready, url)
    try:
        server.io_loop.start()
    finally:
        shared.close()
        server.stop()
