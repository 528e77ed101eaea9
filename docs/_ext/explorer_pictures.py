"""Draw the pictures of the explorer in docs/images from its page in Chromium: ``python docs/_ext/explorer_pictures.py``."""

from __future__ import annotations

import io
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from example_figures import DOCS, save
from PIL import Image

import snapbeam as sb
from snapbeam import lab
from snapbeam.model.parameter_file import Config

_SHOWN = """() => { const s = window.Bokeh && Bokeh.documents[0] && Bokeh.documents[0].get_model_by_name('waveform');
  return s && s.data.x.length > 0; }"""
_POINT = "at=drive.frequency_ratio:1.21,drive.velocity_amplitude:0.3"
PICTURES = {
    "explore-map": _POINT,
    "explore-window": f"{_POINT}&view=1.0,1.5,0.08,0.25",
    "explore-beam": f"{_POINT}&tab=Beam",
}
"""Query string of each picture."""
_WAIT = 60_000
"""Milliseconds for windows and the neighbour of the run."""


def main() -> None:
    """Compute a map of the paper's beam with 4 modes, open it and save each picture."""
    from playwright.sync_api import sync_playwright

    system = Config().system.replace(**{"model.modes": 4})
    axes = {"frequency_ratio": np.linspace(0.4, 2.4, 40), "velocity_amplitude": np.linspace(0.02, 0.5, 25)}
    chromium = os.environ.get("CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")
    with tempfile.TemporaryDirectory() as where, sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        look_at(browser, where)
        sb.write_netcdf(sb.sweep(system, axes, sb.Integration(cycles=60)), Path(where) / "map.nc")
        with _served(where, "explore", "map.nc") as url:
            for name, search in PICTURES.items():
                save(_seen(browser, f"{url}&{search}"), DOCS / "images" / f"{name}.png")
        browser.close()


def look_at(browser: Any, where: str) -> None:
    """Draw the page of ``snapbeam look`` of a synthetic recording."""
    time = np.arange(200) / 10e3  # s
    beam, tip = np.full(200, -0.335e-3), -0.6e-3 + 0.1e-3 * np.sin(2.0 * np.pi * 100.0 * time)  # m
    camera, stage = lab.SyntheticCamera(shape=(150, 220), snr_db=50.0), lab.SyntheticStage(shaker_width=0.5e-3)
    lab.render_recording(time, beam, tip, camera=camera, stage=stage).write(Path(where) / "test.cihx")
    settings = "[camera]\nregion = [8, 140, 20, 205]\n[tracking]\nbuckling_level = 0.335e-3\ncontact_column = 90\n"
    (Path(where) / "test.toml").write_text(settings, encoding="utf-8")
    with _served(where, "look", "test.cihx", "--settings", "test.toml", "-o", "look.toml") as url:
        save(_seen(browser, url, ready="() => window.Bokeh && Bokeh.documents[0]"), DOCS / "images" / "look.png")


@contextmanager
def _served(where: str, *words: str) -> Iterator[str]:
    process = subprocess.Popen(
        [sys.executable, "-um", "snapbeam", *words, "--port", "0", "--no-browser"],
        cwd=where, stdout=subprocess.PIPE, text=True, env=dict(os.environ, COLUMNS="400"),
    )  # fmt: skip
    try:
        assert process.stdout is not None
        yield next(found[0] for line in process.stdout if (found := re.search(r"http://\S+", line)))
    finally:
        process.terminate()
        process.wait()


def _seen(browser: Any, url: str, ready: str = _SHOWN) -> Image.Image:
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    page.set_default_timeout(10.0 * _WAIT)
    page.goto(url)
    page.wait_for_function(ready if "tab=" not in url else "() => window.Bokeh && Bokeh.documents[0]")
    page.wait_for_timeout(_WAIT / 4)
    picture = Image.open(io.BytesIO(page.screenshot()))
    page.close()
    return picture


if __name__ == "__main__":
    main()
