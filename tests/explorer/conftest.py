"""A browser, a map, and servers of pages, for the tests of the explorer."""

from __future__ import annotations

import contextlib
import os
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model.parameter_file import Config

pytest.importorskip("panel", reason="the explorer's extra is not installed: make explorer-deps")

CHROMIUM = os.environ.get("CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")
FIRST = "Click on the map, use the arrow keys, or type numbers, to see the run of a point."
TOKENS: dict[str, str] = {}
"""Token of each server by its address; a page opened without a token gets it here."""
PATIENCE = 180_000
"""Milliseconds that a page may take on a busy machine; a test of what a page does is no test of how fast."""


def pytest_collection_modifyitems(items):
    """Tests in a browser are skipped, with a line, where there is none."""
    try:
        import playwright  # noqa: F401
    except ImportError:
        why = "playwright is not installed: make explorer-deps"
    else:
        why = "" if CHROMIUM else "there is no Chromium: make explorer-deps"
    for item in items:
        if why and "browser" in getattr(item, "fixturenames", ()):
            item.add_marker(pytest.mark.skip(reason=why))


@pytest.fixture(scope="session")
def system():
    """The paper's system with few modes."""
    return Config().system.replace(**{"model.modes": 6})


@pytest.fixture(scope="session")
def small_map(system):
    """A map of 24 by 16 points."""
    axes = {"frequency_ratio": np.linspace(0.4, 2.3, 24), "velocity_amplitude": np.linspace(0.03, 0.5, 16)}
    return sb.sweep(system, axes, sb.Integration(cycles=30))


@pytest.fixture(scope="session")
def folder(tmp_path_factory, small_map):
    """A folder with the map in a file."""
    found = tmp_path_factory.mktemp("explorer")
    small_map.to_netcdf(found / "map.nc", engine="h5netcdf")
    return found


class Served:
    """A server in a process of its own, as a person starts it."""

    def __init__(self, folder: Path, *arguments: str, state: Path | None = None, command: str = "explore") -> None:
        code = "from snapbeam.cli import main; main()"
        self.process = subprocess.Popen(
            [sys.executable, "-u", "-c", code, command, "--port", "0", *arguments, "--no-browser"],
            cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
            env=dict(os.environ, COLUMNS="400", XDG_STATE_HOME=str(state or tempfile.mkdtemp(dir=folder))),
        )  # fmt: skip
        self.lines: list[str] = []
        self.url = ""
        self.listener = threading.Thread(target=self._listen, daemon=True)
        self.listener.start()
        limit = time.monotonic() + PATIENCE / 1000
        while not self.url and self.process.poll() is None and time.monotonic() < limit:
            time.sleep(0.05)
        assert self.url, self.text
        self.url, _, self.token = self.url.partition("?token=")
        TOKENS[self.url] = self.token

    def _listen(self) -> None:
        with self.process.stdout as lines:
            for line in lines:
                self.lines.append(line)
                if line.startswith("Explorer at"):
                    self.url = line.split()[-1]

    @property
    def text(self) -> str:
        """All that it said."""
        return "".join(self.lines)

    def stop(self) -> None:
        """End it."""
        self.process.terminate()
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.process.wait(20)
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        self.listener.join()


@pytest.fixture(scope="session")
def serve(folder):
    """Start servers; all are ended in the end."""
    started = []

    def start(*arguments: str, where: Path = folder, **how) -> Served:
        started.append(Served(where, *arguments, **how))
        return started[-1]

    yield start
    for each in started:
        each.stop()


@pytest.fixture(scope="session")
def served(serve):
    """A server of the map."""
    return serve("map.nc")


@pytest.fixture(scope="session")
def browser():
    """Chromium."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        opened = driver.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield opened
        opened.close()


class Tab:
    """One page in the browser, and what a person does with it."""

    _PLACE = """([name, x, y]) => {
      const plot = Bokeh.index.find_one(Bokeh.documents[0].get_model_by_name(name));
      const box = plot.el.getBoundingClientRect();
      return [box.left + plot.frame.x_scale.compute(x), box.top + plot.frame.y_scale.compute(y)];
    }"""

    def __init__(self, browser, url: str, plot: str = "map", **options) -> None:
        self.plot = plot
        still = {"viewport": {"width": 1280, "height": 720}, "reduced_motion": "reduce"}
        self.context = browser.new_context(accept_downloads=True, **(still | options))
        self.page = self.context.new_page()
        self.page.set_default_timeout(PATIENCE)
        self.errors: list[str] = []
        self.foreign: list[str] = []
        self.page.on("console", lambda message: self.errors.append(message.text))
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on("request", self._asked)
        self.open(url)

    def _asked(self, request) -> None:
        if not request.url.startswith(("http://127.0.0.1", "blob:", "data:")):
            self.foreign.append(request.url)

    def open(self, url: str) -> None:
        """Load a page and wait until its map, or the plot of another result, stands."""
        base, _, search = url.partition("?")
        if base in TOKENS:
            search = f"token={TOKENS[base]}" + (f"&{search}" if search else "")
        self.page.goto(f"{base}?{search}")
        assert "token" not in self.page.url
        self.page.wait_for_function(
            """(name) => { const d = window.Bokeh && Bokeh.documents[0]; const m = d && d.get_model_by_name(name);
                       return m && Bokeh.index.find_one(m) && Bokeh.index.find_one(m).frame.bbox.width > 10; }""",
            arg=self.plot,
        )
        self.wait(lambda: self.head() not in ("", FIRST), "the first run")
        limit = time.monotonic() + 2.0  # not every run has notes
        self.wait(lambda: self.notes() or time.monotonic() > limit, "what is said of it")

    def js(self, code: str, argument=None):
        """Evaluate something in the page."""
        return self.page.evaluate(code, argument)

    def data(self, name: str, column: str) -> list:
        """A column of a source of the page."""
        return self.js(
            """([name, column]) => { const m = Bokeh.documents[0].get_model_by_name(name);
                                     return m ? Array.from(m.data[column] || []) : []; }""",
            [name, column],
        )

    def place(self, x: float, y: float, plot: str = "map") -> list[float]:
        """Where a point of a plot is on the screen."""
        return self.js(self._PLACE, [plot, x, y])

    def click(self, x: float, y: float) -> None:
        """Click on the map or the plot of the page."""
        before, url = (self.head(0), self.head(1)), self.page.url
        self.page.mouse.click(*self.place(x, y, self.plot))
        limit = time.monotonic() + 2.0  # of a click on the point that is shown
        self.wait(
            lambda: (self.head(0), self.head(1)) != before or (self.page.url == url and time.monotonic() > limit),
            "another run",
        )

    _TEXT = """([name, which]) => {
      const found = [];
      for (const model of Bokeh.documents[0]?._all_models.values() ?? []) {  // none while the page is loaded again
        if (!(model.css_classes || []).includes(name)) { continue; }
        const view = Bokeh.index.find_one(model);
        if (!view) { continue; }
        const parts = [...view.shadow_el.children].filter((e) => e.tagName === 'DIV');
        found.push(parts.map((e) => e.innerText).join(' '));
      }
      return found[which] || '';
    }"""

    def text(self, name: str, which: int = 0) -> str:
        """What stands in the part of the page of a name."""
        return self.js(self._TEXT, [name, which]).replace("\xa0", " ")

    def head(self, which: int = 0) -> str:
        """What is said of a run."""
        return self.text("run-head", which)

    def notes(self, which: int = 0) -> str:
        """What is said below it."""
        return self.text("run-note", which)

    def state(self) -> str:
        """What is said of the map."""
        return self.text("map-state")

    def wait(self, true, what: str = "") -> None:
        """Wait until something is true."""
        limit = time.monotonic() + PATIENCE / 1000
        while time.monotonic() < limit:
            if true():
                return
            self.page.wait_for_timeout(40)
        raise AssertionError(
            f"waited in vain for {what}; head {self.head()!r}, notes {self.notes()!r}, state {self.state()!r}"
        )

    def close(self) -> None:
        """Close it."""
        self.context.close()


@pytest.fixture
def tab(browser):
    """Open pages; each must have ended with nothing said in its console, and without asking another machine."""
    opened: list[Tab] = []

    def open_one(url: str, **options) -> Tab:
        opened.append(Tab(browser, url, **options))
        return opened[-1]

    yield open_one
    for each in opened:
        each.close()
        assert each.errors == [], each.errors
        assert each.foreign == [], each.foreign
