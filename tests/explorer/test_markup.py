"""Text from files, addresses and messages is shown as text and never becomes part of the page."""

from __future__ import annotations

import numpy as np
import pytest
from markupsafe import Markup

import snapbeam as sb
from snapbeam.explorer.style import Html
from snapbeam.model.parameter_file import Config

SCRIPT = "<img src=x onerror='window.hit=1'><script>window.hit=1</script>"


def test_only_markup_becomes_html():
    """What Panel gives the browser is escaped once for transport; the browser undoes that."""
    given = {
        "<b>&": "&amp;lt;b&amp;gt;&amp;amp;",
        Markup("<b>{}</b>").format("<i>"): "&lt;b&gt;&amp;lt;i&amp;gt;&lt;/b&gt;",
        None: "",
    }
    for text, sent in given.items():
        assert Html(text).get_root().text == sent


@pytest.fixture(scope="module")
def hostile(tmp_path_factory):
    """A map with markup in its attributes and in the name of a variable and of its file."""
    axes = {
        "frequency_ratio": np.linspace(0.4, 2.3, 6),
        "velocity_amplitude": np.linspace(0.03, 0.5, 5),
        "location": np.array([0.4, 0.5]),
    }
    held = sb.sweep(Config().system.replace(**{"model.modes": 1}), axes, sb.Integration(cycles=5))
    held["foreign" + SCRIPT.replace("/", "|")] = held["peak_force"]
    for item in (held, *held.variables.values()):
        for name in set(item.attrs) & {"title", "history", "comment"} | {"long_name", "units", "title"}:
            item.attrs[name] = SCRIPT
    path = tmp_path_factory.mktemp("hostile") / f"{SCRIPT.replace('/', '|')}.nc"
    held.to_netcdf(path, engine="h5netcdf")
    return path


def test_markup_in_a_foreign_map_does_not_run(tab, serve, hostile):
    """Move over the map, run a point, look at each variable and each tab, and refuse an address and a file."""
    served = serve(hostile.name, where=hostile.parent)
    page = tab(served.url + "?x=" + SCRIPT.replace("/", "%2F") + "&show=" + SCRIPT.replace("/", "%2F"))
    x, y = 1.16, 0.265
    where = page.place(x, y)
    page.page.mouse.move(where[0] - 40, where[1])
    page.page.wait_for_timeout(100)
    page.page.mouse.move(*where)
    page.wait(lambda: "<script>" in page.text("hover"), "the unit below the pointer, as text")
    assert "must be a name" in page.state()
    page.click(x, y)
    page.wait(lambda: "crossings" in page.head(), "the run")
    shown = page.page.get_by_label("Shown")
    for option in shown.locator("option").all():
        shown.select_option(label=option.inner_text())
        page.page.mouse.move(where[0] - 40, where[1])
        page.page.mouse.move(*where)
        page.page.wait_for_timeout(200)
    for title in ("System", "Export"):
        page.page.get_by_text(title, exact=True).first.click()
        page.page.wait_for_timeout(500)
    for field in page.page.locator("input[type=file]").all():
        field.set_input_files({"name": SCRIPT, "mimeType": "text/plain", "buffer": f"{SCRIPT} = 1".encode()})
        page.page.wait_for_timeout(500)
    assert page.js("() => window.hit") is None
    assert page.js(_FOREIGN) == 0


_FOREIGN = """() => {
  const count = (root) => [...root.querySelectorAll('*')].reduce(
    (sum, e) => sum + (e.getAttribute('onerror') ? 1 : 0) + (e.shadowRoot ? count(e.shadowRoot) : 0), 0);
  return count(document);
}"""
