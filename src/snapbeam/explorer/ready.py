"""A page that is made before it is asked for: whoever opens the address need not wait until it is built."""

from __future__ import annotations

import logging
import time
from typing import Any

from bokeh.server.contexts import ApplicationContext
from bokeh.util.token import generate_jwt_token, generate_session_id
from panel.io.server import DocHandler
from tornado.httputil import HTTPHeaders, HTTPServerRequest, RequestStartLine
from tornado.ioloop import IOLoop

from snapbeam.explorer.limits import SESSIONS
from snapbeam.explorer.shared import Shared

__all__ = ["Ready", "keep_ready"]

_LOG = logging.getLogger("snapbeam.explorer")
_SOON = 0.05
"""Seconds from the server's start to the first page: its address is told before."""
_REST = 5.0
"""Seconds without a question after which the next page is made."""
_FRESH = 240.0
"""Seconds for which a page can be given away: the token that leads to it is good for 300."""
_TAKEN = 60.0
"""Seconds that a browser has to connect to the page that it was given."""
_LOOK = 2.0
"""Seconds between two looks whether it has."""


class Ready:
    """The page that waits for whoever comes next without wishes of their own, a theme aside.

    Parameters
    ----------
    loop : tornado.ioloop.IOLoop
    context : bokeh.server.contexts.ApplicationContext
        What makes pages.
    shared : Shared
    """

    def __init__(self, loop: IOLoop, context: ApplicationContext, shared: Shared) -> None:
        self._loop, self._context, self._shared = loop, context, shared
        self._held: tuple[str, float, Any] | None = None
        self._theme = ""

    def begin(self) -> None:
        """Make the first one, once the server runs."""
        self._loop.call_later(_SOON, self._make)

    def take(self, arguments: dict[str, list[bytes]]) -> Any:
        """The session of the page that waits, if there is one for these arguments; the next is made in a while."""
        if set(arguments) - {"theme", "token"}:
            return None
        self._theme = "dark" if arguments.get("theme") == [b"dark"] else ""
        self._loop.call_later(_REST, self._again)
        if self._held is None or self._held[0] != self._theme or time.monotonic() - self._held[1] > _FRESH:
            return None
        session, self._held = self._held[2], None
        self._loop.call_later(_LOOK, self._settled, session, time.monotonic() + _TAKEN)
        return session

    def _settled(self, session: Any, until: float) -> None:
        """Let a session end as any other does, once a browser is connected to it or none has come."""
        if session.connection_count > 0 or time.monotonic() > until:
            session.unblock_expiration()
        else:
            self._loop.call_later(_LOOK, self._settled, session, until)

    async def _again(self) -> None:
        """Make the next one, when nobody is kept waiting by that."""
        if not self._shared.rests(_REST):
            self._loop.call_later(_REST, self._again)
            return
        if self._held is not None and self._held[0] != self._theme:
            self._held[2].unblock_expiration()  # it ends by itself
            self._held = None
        await self._make()

    async def _make(self) -> None:
        if self._held is not None or self._shared.pages >= SESSIONS - 1:
            return
        name = generate_session_id(secret_key=None, signed=False)
        arguments = {"theme": [self._theme.encode()]} if self._theme else {}
        asked = {"headers": {}, "cookies": {}, "arguments": arguments}
        token = generate_jwt_token(name, secret_key=None, signed=False, extra_payload=asked)
        line, headers = RequestStartLine("GET", "/", "HTTP/1.1"), HTTPHeaders({"Host": "127.0.0.1"})
        request = HTTPServerRequest(start_line=line, headers=headers)
        try:
            session = await self._context.create_session_if_needed(name, request, token)
        except Exception as error:  # whoever comes is told by the page that is made for them
            _LOG.warning("no page was made in advance: %s", error)
            return
        session.block_expiration()
        self._held = (self._theme, time.monotonic(), session)


class _Door(DocHandler):
    """Gives the page that is ready, or has one made."""

    ready: Ready

    async def get_session(self) -> Any:
        """The session of a page."""
        own = "Bokeh-Session-Id" in self.request.headers
        session = None if own else self.ready.take(dict(self.request.arguments))
        return await super().get_session() if session is None else session


def keep_ready(server: Any, shared: Shared) -> None:
    """Have a server keep a page ready."""
    context = server._tornado.applications["/"]
    ready = Ready(server.io_loop, context, shared)
    door = type("Door", (_Door,), {"ready": ready})
    routes = {"application_context": context, "bokeh_websocket_path": "/ws"}
    server._tornado.add_handlers(r".*", [(r"/", door, routes)])
    ready.begin()
