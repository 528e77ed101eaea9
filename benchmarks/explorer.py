"""The explorer in a browser: address to map, first and later clicks to the waveform, a dragged slider, 20 pages at once.

Both are taken by the browser's own clock, after the frame that shows them has been drawn.  A page of HoloViews and
SciPy (:mod:`benchmarks.peers.scipy_page`) is timed by the same script on the same map.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

import snapbeam as sb
from benchmarks.timing import machine
from snapbeam.model.parameter_file import Config

__all__ = ["measured", "run"]

_STAND = """() => { const d = window.Bokeh && Bokeh.documents[0]; const m = d && d.get_model_by_name('map');
  const s = m && d.get_model_by_name('map-base');
  const view = s && s.data.image.length === 1 && Bokeh.index.find_one(m);
  return view && view.frame.bbox.width > 10; }"""
_WATCH = """() => {
  const source = Bokeh.documents[0].get_model_by_name('waveform');
  window.shown = [];
  document.addEventListener('pointerdown', () => { window.pressed = performance.now(); }, true);
  source.properties.data.change.connect(() => {
    const pressed = window.pressed;
    requestAnimationFrame(() => setTimeout(() => window.shown.push(performance.now() - pressed), 0));
  });
}"""
_PLACE = """([x, y]) => { const p = Bokeh.index.find_one(Bokeh.documents[0].get_model_by_name('map'));
  const b = p.el.getBoundingClientRect();
  return [b.left + p.frame.x_scale.compute(x), b.top + p.frame.y_scale.compute(y)]; }"""


_DRAG = """(share) => { for (const model of Bokeh.documents[0]._all_models.values()) {
  if (model.type === 'Slider' && model.title.includes('thickness')) {
    window.pressed = performance.now(); model.value = model.start + share * (model.end - model.start); return true; } } return false; }"""
_BETWEEN = 8.0
"""Seconds between two pages, in which the server ends what it still does for the one before."""


def run(folder: Path, quick: bool) -> None:
    """Measure, print, and write ``explorer.json``."""
    browser = os.environ.get("CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")
    try:
        import panel  # noqa: F401
        import playwright  # noqa: F401
    except ImportError as error:
        print(f"explorer left out: {error}; make explorer-deps")
        return
    if browser is None:
        print("explorer left out: there is no Chromium")
        return
    modes, cycles = (4, 20) if quick else (32, 200)
    found = measured(browser, modes, cycles, clicks=5 if quick else 20, paints=3 if quick else 8)
    for name, values in found.items():
        print(f"explorer, {name}: {json.dumps(values)}")
    folder.mkdir(parents=True, exist_ok=True)
    text = json.dumps({"machine": machine(), "explorer": found}, indent=1)
    (folder / "explorer.json").write_text(text + "\n", encoding="utf-8")


def measured(browser: str, modes: int, cycles: int, clicks: int, paints: int) -> dict[str, Any]:
    """Milliseconds of first paints and of clicks, of the explorer and of its peer, and the load of the machine."""
    from playwright.sync_api import sync_playwright

    system = Config().system.replace(**{"model.modes": modes})
    axes = {"frequency_ratio": np.linspace(0.4, 2.4, 12), "velocity_amplitude": np.linspace(0.05, 0.45, 8)}
    before = list(os.getloadavg()) if hasattr(os, "getloadavg") else []
    dataset = sb.sweep(system, axes, sb.Integration(cycles=cycles))
    sb.simulate(system, sb.Integration(cycles=cycles))  # the compile aside
    own = ["-c", "from snapbeam.cli import main; main()", "explore", "map.nc", "--no-browser"]
    peer = ["-m", "benchmarks.peers.scipy_page", "map.nc", str(modes), str(cycles)]
    found: dict[str, Any] = {
        "case": {
            "modes": modes, "cycles": cycles, "load before": before, "cores": os.cpu_count(),
            "peer": f"holoviews {_version('holoviews')}, panel {_version('panel')}, scipy {_version('scipy')} (odeint)",
        }
    }  # fmt: skip
    with tempfile.TemporaryDirectory() as where, sync_playwright() as driver:
        dataset.to_netcdf(Path(where) / "map.nc", engine="h5netcdf")
        opened = driver.chromium.launch(executable_path=browser, args=["--no-sandbox"])
        try:
            for name, command, pause, count in (
                ("explorer", own, 3.0, clicks), ("HoloViews and SciPy", peer, 0.5, min(clicks, 5)),
            ):  # fmt: skip
                if command is peer and find_spec("holoviews") is None:
                    print("the peer's page left out: holoviews is not installed", flush=True)
                    continue
                process, url = _served(where, command)
                try:
                    first = [_paint(opened, url) for _ in range(paints)]
                    times = _clicks(opened, url, dataset, count, pause)
                    more = {} if command is peer else {
                        "slider frame, ms": _summary(_frames(opened, url, dataset)),
                        "20 pages at once, first paint, ms": _summary(_crowd(opened, url, 20)),
                    }  # fmt: skip
                finally:
                    process.terminate()
                    process.wait()
                found[name] = {"first paint, ms": _summary(first), "click to waveform, ms": _summary(times[2:])}
                if command is own:
                    found[name]["first click, ms"] = round(times[0], 1)
                    found[name] |= more
        finally:
            opened.close()
    found["case"]["load after"] = list(os.getloadavg()) if hasattr(os, "getloadavg") else []
    return found


def _version(package: str) -> str:
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"


def _summary(values: list[float]) -> dict[str, float]:
    return {
        "least": round(min(values), 1), "median": round(float(np.median(values)), 1), "most": round(max(values), 1),
        "of": len(values),
    }  # fmt: skip


def _served(where: str, command: list[str]) -> tuple[subprocess.Popen[str], str]:
    here = os.pathsep.join(filter(None, (str(Path(__file__).parents[1]), os.environ.get("PYTHONPATH"))))
    process = subprocess.Popen(
        [sys.executable, "-u", *command], cwd=where, stdout=subprocess.PIPE, text=True,
        env=dict(os.environ, COLUMNS="400", PYTHONPATH=here),
    )  # fmt: skip
    assert process.stdout is not None
    for line in process.stdout:
        address = re.search(r"http://\S+", line)
        if address is not None:
            threading.Thread(target=process.stdout.read, daemon=True).start()
            return process, address[0]
    raise RuntimeError(f"{' '.join(command)}: did not start")


def _paint(browser: Any, url: str) -> float:
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    page.set_default_timeout(120_000.0)
    page.goto(url)
    page.wait_for_function(_STAND, polling="raf")
    spent = float(page.evaluate("() => performance.now()"))
    page.close()
    time.sleep(_BETWEEN)
    return spent


def _clicks(browser: Any, url: str, dataset: Any, clicks: int, pause: float) -> list[float]:
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    page.set_default_timeout(600_000.0)  # of a peer that takes its time
    page.goto(url)
    page.wait_for_function(_STAND)
    page.wait_for_function("() => Bokeh.documents[0].get_model_by_name('waveform')")
    page.evaluate(_WATCH)
    rng, times = np.random.default_rng(1), []
    x, y = dataset["frequency_ratio"].values, dataset["velocity_amplitude"].values
    for _ in range(clicks + 2):  # the first two warm the server up
        page.evaluate("() => { window.shown = []; }")
        place = [float(x[rng.integers(x.size)]), float(y[rng.integers(y.size)])]
        page.mouse.click(*page.evaluate(_PLACE, place))
        page.wait_for_function("() => window.shown.length > 0")
        times.append(float(page.evaluate("() => window.shown[0]")))
        time.sleep(pause)  # until the samples that follow, and the neighbour, are computed too
    page.close()
    return times


def _frames(browser: Any, url: str, dataset: Any, frames: int = 8) -> list[float]:
    """From a move of the slider of the thickness to the waveform of its first cycles."""
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    page.set_default_timeout(120_000.0)
    page.goto(url)
    page.wait_for_function(_STAND)
    page.wait_for_function("() => Bokeh.documents[0].get_model_by_name('waveform')")
    page.evaluate(_WATCH)
    page.mouse.click(
        *page.evaluate(_PLACE, [float(dataset[name][3]) for name in ("frequency_ratio", "velocity_amplitude")])
    )
    page.wait_for_function("() => window.shown.length > 0")
    page.locator('.bk-tab:has-text("System")').first.click()
    page.get_by_label("Vary by a slider").select_option(label="beam.thickness")
    page.wait_for_function(_DRAG, arg=0.4)
    time.sleep(3.0)
    times = []
    for share in np.linspace(0.42, 0.6, frames):
        page.evaluate("() => { window.shown = []; }")
        page.evaluate(_DRAG, float(share))
        page.wait_for_function("() => window.shown.length > 0")
        times.append(float(page.evaluate("() => window.shown[0]")))
        time.sleep(0.3)
    page.close()
    return times


def _crowd(browser: Any, url: str, pages: int) -> list[float]:
    """First paints of pages that are opened at the same time."""
    opened = [browser.new_page(viewport={"width": 1280, "height": 720}) for _ in range(pages)]
    for page in opened:
        page.set_default_timeout(120_000.0)
        page.goto(url, wait_until="commit")
    begun = []
    for page in opened:
        page.wait_for_function(_STAND, polling=50)
        begun.append(float(page.evaluate("() => performance.now()")))
    for page in opened:
        page.close()
    return begun
