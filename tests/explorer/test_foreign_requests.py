"""Which requests the explorer answers: those of its own pages, and those that bring the token."""

from __future__ import annotations

import asyncio
import contextlib
import http.client
import http.server
import os
import re
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from http.cookies import SimpleCookie
from urllib.parse import urlparse

import pytest
from tornado.httpclient import HTTPClientError, HTTPRequest
from tornado.websocket import websocket_connect

import snapbeam as sb
from snapbeam.explorer import server

FOREIGN = [
    {"Host": "evil.example"},
    {"Origin": "http://evil.example"},
    {"Origin": "null"},
    {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "no-cors"},
    {"Sec-Fetch-Site": "same-site", "Sec-Fetch-Mode": "navigate"},
]


def asked(url, path=None, **headers):
    """Status, body and headers of a request; underscores in the names of headers are hyphens."""
    where = urlparse(url)
    connection = http.client.HTTPConnection(where.hostname, where.port, timeout=60)
    named = {name.replace("_", "-"): value for name, value in headers.items()}
    connection.request("GET", where.path if path is None else path, headers=named)
    response = connection.getresponse()
    body = response.read().decode(errors="replace")
    connection.close()
    return response.status, body, dict(response.getheaders())


@pytest.fixture
def cookie(served):
    """The cookie that a first visit with the token gives."""
    status, _, headers = asked(served.url, f"{urlparse(served.url).path}?token={served.token}&theme=dark")
    assert status == 302
    assert headers["Location"] == f"{urlparse(served.url).path}?theme=dark"  # the address without the token
    (held,) = SimpleCookie(headers["Set-Cookie"]).values()
    assert held["httponly"] and held["samesite"] == "Strict"
    assert held["path"] == urlparse(served.url).path != "/"
    assert served.token not in held.value
    return f"{held.key}={held.value}"


def test_a_page_needs_the_token(served, cookie):
    assert asked(served.url)[0] == 403
    assert asked(served.url, f"{urlparse(served.url).path}?token=wrong")[0] == 403
    assert asked(served.url, Cookie=cookie[:-1])[0] == 403
    status, body, headers = asked(served.url, Cookie=cookie)
    assert status == 200 and "Bokeh" in body
    assert served.token not in body
    assert headers["Referrer-Policy"] == "no-referrer"


@pytest.mark.parametrize("headers", FOREIGN, ids=str)
def test_other_names_and_origins_are_refused_everywhere(served, cookie, headers):
    """Also with the cookie, which a browser sends to every port of a host."""
    base = urlparse(served.url).path
    for path in (base, f"{base}ws", f"{base}autoload.js", f"{base}static/js/bokeh.min.js", "/"):
        assert asked(served.url, path, **({"Cookie": cookie} | headers))[0] == 403, path


def test_there_is_nothing_but_the_page(served, cookie):
    """No script that puts the page, with a session, into other pages."""
    base = urlparse(served.url).path
    for path in ("/", "/autoload.js", f"{base}autoload.js?bokeh-autoload-element=1", f"{base}metadata"):
        assert asked(served.url, path, Cookie=cookie)[0] == 404, path


@pytest.mark.parametrize("name", ["%00", "js/a%00.js", "js/%1b", "%0a"])
def test_control_characters_in_a_path_are_no_file(served, name, caplog):
    assert asked(served.url, f"{urlparse(served.url).path}static/extensions/panel/{name}")[0] == 404
    assert not [each for each in caplog.records if each.exc_info]


def test_a_socket_needs_the_origin_and_the_cookie(served, cookie):
    body = asked(served.url, Cookie=cookie)[1]
    token = re.search(r'"token":"([^"]+)"', body)[1]
    where = urlparse(served.url)

    async def knock(origin, **headers):
        request = HTTPRequest(f"ws://{where.netloc}{where.path}ws", headers={"Origin": origin} | headers)
        try:
            connection = await websocket_connect(request, subprotocols=["bokeh", token])
        except HTTPClientError as error:
            return error.code
        connection.close()
        return 101

    with ThreadPoolExecutor(1) as other:  # this thread has the browser's own loop
        for status, origin, headers in (
            (403, "http://evil.example", {"Cookie": cookie}),
            (403, f"http://{where.netloc}", {}),
            (101, f"http://{where.netloc}", {"Cookie": cookie}),
        ):
            assert other.submit(asyncio.run, knock(origin, **headers)).result() == status


@pytest.mark.filterwarnings("ignore::PendingDeprecationWarning")
def test_sessions_have_a_limit_and_end_unused(small_map, monkeypatch):
    """Requests without a socket keep the owner out for 20 s, here for 8.5 s, not for good."""
    monkeypatch.setattr(server, "SESSIONS", 3)
    monkeypatch.setattr(server, "UNUSED", 8000)
    monkeypatch.setattr(server, "CHECKED", 500)
    shown = sb.explorer.explore(small_map)
    try:
        base, _, search = shown.url.partition("?")
        path = f"{urlparse(base).path}?{search}"
        found = [asked(base, path, Sec_Fetch_Dest="iframe") for _ in range(5)]
        assert [status for status, _, _ in found] == [200, 200, 200, 503, 503]
        assert "close one" in found[-1][1]
        status = 503
        for _ in range(120):
            threading.Event().wait(0.5)
            status = asked(base, path, Sec_Fetch_Dest="iframe")[0]
            if status == 200:
                break
        assert status == 200
    finally:
        shown.stop()


@contextlib.contextmanager
def other_site(host, html):
    """A page of another server of this machine; gives its address."""

    class Page(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(html.encode())

        def log_message(self, *_):
            """Nothing."""

    found = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Page)
    thread = threading.Thread(target=found.serve_forever)
    thread.start()
    try:
        yield f"http://{host}:{found.server_port}/"
    finally:
        found.shutdown()
        found.server_close()
        thread.join()


def test_a_page_of_another_port_gets_nothing(browser, served):
    """Its requests are of the same site, so that the browser could send the cookie along."""
    page = f"""<!doctype html><script>window.heard = [];</script>
      <script src="{served.url}autoload.js" onload="heard.push('script')"></script>
      <iframe src="{served.url}"></iframe>
      <script>fetch('{served.url}', {{credentials: 'include', mode: 'no-cors'}});
      const s = new WebSocket('{served.url.replace("http", "ws")}ws'); s.onopen = () => heard.push('socket');
      </script>"""
    context = browser.new_context()
    with other_site("127.0.0.1", page) as address:
        own, foreign, answers = context.new_page(), context.new_page(), []
        own.goto(f"{served.url}?token={served.token}")
        own.wait_for_function("() => window.Bokeh && Bokeh.documents.length")
        (held,) = context.cookies(served.url)
        assert held["path"] == urlparse(served.url).path
        assert not context.cookies(address)
        foreign.on("response", lambda response: answers.append((response.status, response.url)))
        foreign.goto(address)
        foreign.wait_for_timeout(2000)
        asked_for = [status for status, url in answers if url.startswith(served.url)]
        assert asked_for and set(asked_for) == {403}, answers
        assert foreign.evaluate("() => heard") == []
    context.close()


@pytest.mark.filterwarnings("ignore::PendingDeprecationWarning")
def test_the_same_in_a_notebook(browser, small_map):
    """A frame in a page of another site has no cookies: its address keeps the token."""
    shown = sb.explorer.explore(small_map)
    context = browser.new_context(viewport={"width": 1280, "height": 900})
    try:
        assert f'"{shown.url}"' in shown._repr_html_()
        with other_site("localhost", shown._repr_html_()) as address:
            page = context.new_page()
            page.goto(address)
            frame = page.frame_locator("iframe")
            frame.get_by_label("frequency ratio").fill(repr(float(small_map["frequency_ratio"][4])))
            frame.get_by_label("velocity amplitude").fill(repr(float(small_map["velocity_amplitude"][4])))
            frame.get_by_role("button", name="Run", exact=True).click()
            frame.get_by_text("bitwise identical").wait_for()
    finally:
        context.close()
        shown.stop()


def test_markup_that_becomes_part_of_the_page_cannot_run_scripts(tab, served):
    """The Content-Security-Policy stops what escaping would let through."""
    page = tab(served.url)
    refused = page.js(
        """async () => {
          const seen = [];
          document.addEventListener('securitypolicyviolation', (e) => seen.push(e.effectiveDirective));
          const part = document.createElement('div');
          part.innerHTML = `<img src="/x" onerror="window.hit=1"><iframe srcdoc="<script>parent.hit=1</script>"></iframe>
            <a href="javascript:window.hit=1">a</a><form action="http://evil.example"><button>b</button></form>
            <img src="http://evil.example/x.png">`;
          document.body.appendChild(part);
          const script = document.createElement('script');
          script.textContent = 'window.hit=1';
          document.body.appendChild(script);
          part.querySelector('a').click();
          part.querySelector('button').click();
          await new Promise((done) => setTimeout(done, 1500));
          return seen;
        }"""
    )
    assert page.js("() => window.hit") is None
    assert {"script-src-attr", "script-src-elem", "img-src", "form-action"} <= set(refused)
    page.errors.clear()  # the browser reports each of them
    page.foreign.clear()


@pytest.mark.slow
def test_other_addresses_need_a_flag(folder):
    code = "from snapbeam.cli import main; main()"
    found = subprocess.run(
        [sys.executable, "-c", code, "explore", "map.nc", "--no-browser", "--address", "0.0.0.0"],
        cwd=folder, capture_output=True, text=True, env=dict(os.environ), check=False,
    )  # fmt: skip
    assert found.returncode == 2
    assert "--allow-remote" in found.stderr


def test_without_a_home_folder_no_token_is_kept(monkeypatch):
    def no_home():
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.delenv("XDG_STATE_HOME", raising=False)
    monkeypatch.setattr(server.Path, "home", no_home)
    assert server.kept_token() is None
