"""The server of the page: on the loopback address, to pages of its own origin, or elsewhere to who has the token."""

from __future__ import annotations

import hmac
import ipaddress
import logging
import secrets
from collections.abc import Callable
from typing import Any
from urllib.parse import urlparse

import panel as pn
from bokeh.server.auth_provider import AuthProvider
from tornado.web import RequestHandler

from snapbeam import InputError
from snapbeam.explorer.limits import BODY, SESSIONS
from snapbeam.explorer.shared import Shared

__all__ = ["Gate", "is_loopback", "make_server"]

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

        if shared.pages >= SESSIONS:
            return pn.pane.HTML(
                f"<p>{SESSIONS} pages are open, the most that there may be: close one of them.</p>"
            )
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
