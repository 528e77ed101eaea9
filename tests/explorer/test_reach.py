"""Who has no mouse, and who has a small screen: every control is reached, seen to be reached, and uncovered."""

from __future__ import annotations

import numpy as np
import pytest

import snapbeam as sb

_CONTROLS = """
const within = (root) => {
  const found = [];
  for (const e of root.querySelectorAll('*')) {
    if (e.matches('button, select, input, textarea, a[href], [tabindex]:not([tabindex="-1"])')
        && !e.disabled && e.tabIndex >= 0) { found.push(e); }
    if (e.shadowRoot) { found.push(...within(e.shadowRoot)); }
  }
  return found;
};
const seen = (e) => { const r = e.getBoundingClientRect(), s = getComputedStyle(e);
  return r.width > 1 && r.height > 1 && s.visibility !== 'hidden' && s.display !== 'none'; };
const named = (e) => {
  const r = e.getBoundingClientRect();
  const words = e.innerText || e.getAttribute('aria-label') || e.title || e.name || e.className;
  const short = String(words).split('\\n')[0].slice(0, 40);
  return e.tagName + ' ' + short + ' ' + Math.round(r.left) + ',' + Math.round(r.top);
};
"""
_ALL = f"() => {{ {_CONTROLS} return within(document).filter(seen).map(named); }}"
_FOCUSED = f"""() => {{ {_CONTROLS}
  let e = document.activeElement;
  while (e && e.shadowRoot && e.shadowRoot.activeElement) {{ e = e.shadowRoot.activeElement; }}
  if (!e || e === document.body) {{ return null; }}
  const s = getComputedStyle(e);
  return [named(e), s.outlineStyle, parseFloat(s.outlineWidth), s.outlineColor];
}}"""
_LAID_OUT = f"""() => {{ {_CONTROLS}
  const wrong = [], wide = document.scrollingElement.scrollWidth;
  if (wide > window.innerWidth) {{ wrong.push('the page is ' + wide + ' pixels wide'); }}
  const deepest = (x, y) => {{
    let e = document.elementFromPoint(x, y);
    while (e && e.shadowRoot) {{
      const inner = e.shadowRoot.elementFromPoint(x, y);
      if (!inner || inner === e) {{ break; }}
      e = inner;
    }}
    return e;
  }};
  const up = (e) => e.parentNode || (e instanceof ShadowRoot ? e.host : null);
  const holds = (a, b) => {{ for (let e = b; e; e = up(e)) {{ if (e === a) {{ return true; }} }} return false; }};
  for (const e of within(document).filter(seen)) {{
    e.scrollIntoView({{block: 'center', behavior: 'instant'}});
    const r = e.getBoundingClientRect();
    if (r.left < -1 || r.right > window.innerWidth + 1) {{ wrong.push('cut off: ' + named(e)); }}
    const over = deepest(r.left + r.width / 2, r.top + r.height / 2);
    if (over && !holds(e, over) && !holds(over, e)) {{ wrong.push('covered: ' + named(e) + ' by ' + named(over)); }}
    if (e.tagName === 'BUTTON' && e.scrollWidth > e.clientWidth + 1) {{ wrong.push('words cut off: ' + named(e)); }}
  }}
  window.scrollTo(0, 0);
  return wrong;
}}"""


_SCREENS = [
    (1280, 720),
    (820, 1180),
    pytest.param(768, 1024, marks=pytest.mark.slow),
    pytest.param(1920, 1080, marks=pytest.mark.slow),
]


def _turn(page, title):
    page.page.locator(f'.bk-tab:has-text("{title}")').first.click()


@pytest.mark.parametrize("theme", ["", pytest.param("?theme=dark", marks=pytest.mark.slow)])
def test_every_control_is_reached_by_tab_and_says_so(tab, served, small_map, theme):
    page = tab(served.url + theme)
    page.click(float(small_map["frequency_ratio"][9]), float(small_map["velocity_amplitude"][12]))
    page.wait(lambda: "neighbour" in page.notes(), "the run, with all that is said of it")
    wanted, reached, faint = set(page.js(_ALL)), set(), []
    page.js("() => document.activeElement && document.activeElement.blur()")
    for _ in range(2 * len(wanted) + 5):
        page.page.keyboard.press("Tab")
        found = page.js(_FOCUSED)
        if found is None:
            continue
        name, style, width, color = found
        reached.add(name)
        if style == "none" or width < 2 or color.endswith(", 0)"):
            faint.append(f"{name}: {style} {width} px {color}")
    assert len(wanted) > 30
    assert not wanted - reached, sorted(wanted - reached)
    assert not faint, faint


def test_a_page_is_used_without_a_mouse(tab, served, small_map):
    page = tab(served.url)
    press = page.page.keyboard.press
    ratio, velocity = small_map["frequency_ratio"].values, small_map["velocity_amplitude"].values
    press("ArrowRight")  # the middle of what is seen, to begin with
    page.wait(lambda: "bitwise identical" in page.notes(), "a first run")
    page.page.get_by_label("frequency ratio").focus()
    press("Control+A")
    page.page.keyboard.type(repr(float(ratio[9])))
    press("Tab")
    press("Control+A")
    page.page.keyboard.type(repr(float(velocity[12])))
    press("Tab")
    press("Enter")  # Run
    words = f"frequency ratio {ratio[9]:.6g}, velocity amplitude {velocity[12]:.6g}"
    page.wait(lambda: words in page.head() and "bitwise identical" in page.notes(), "what was typed")
    page.page.locator('.bk-tab:has-text("Phase")').first.focus()
    press("Enter")
    page.wait(lambda: len(page.data("section", "w")) > 0, "the section")
    page.page.locator('.bk-tab:has-text("Export")').first.focus()
    press("Enter")
    page.wait(lambda: "snapbeam simulate" in page.text("take-text"), "the command")
    page.page.get_by_role("button", name="Map as NetCDF").focus()
    with page.page.expect_download() as given:
        press("Space")
    assert given.value.suggested_filename.endswith(".nc")


@pytest.mark.parametrize(("width", "height"), _SCREENS)
def test_nothing_is_cut_off_or_covered(tab, served, small_map, width, height):
    page = tab(served.url)
    page.page.set_viewport_size({"width": width, "height": height})
    page.click(float(small_map["frequency_ratio"][9]), float(small_map["velocity_amplitude"][12]))
    page.wait(lambda: "neighbour" in page.notes(), "the run")
    page.page.wait_for_timeout(300)
    assert page.js(_LAID_OUT) == [], "Waveform"
    for title in ("Phase", "Beam", "Impacts", "Numbers", "System", "Export"):
        _turn(page, title)
        page.page.wait_for_timeout(1200)
        assert page.js(_LAID_OUT) == [], title
    if (width, height) == (1280, 720):  # all of the map's card without scrolling
        _turn(page, "Map")
        page.page.wait_for_timeout(300)
        last = page.page.get_by_role("button", name="Run", exact=True).bounding_box()
        assert last["y"] + last["height"] <= height


def test_the_table_of_impacts_is_readable_in_the_dark(tab, served, small_map):
    page = tab(served.url + "?theme=dark")
    page.click(float(small_map["frequency_ratio"][9]), float(small_map["velocity_amplitude"][12]))
    page.wait(lambda: "bitwise identical" in page.notes(), "the run")
    _turn(page, "Impacts")
    page.wait(lambda: page.page.locator(".slick-cell").count() > 4, "the table")
    found = page.page.locator(".slick-cell").evaluate_all(
        "cells => cells.map((c) => [getComputedStyle(c).color, getComputedStyle(c).backgroundColor])"
    )
    for color, ground in found:
        assert _contrast(color, ground) > 4.5, (color, ground)


def _contrast(first: str, second: str) -> float:
    """Ratio of luminances of two CSS colours, as the guidelines for accessible pages define it."""
    found = []
    for text in (first, second):
        numbers = [float(each) for each in text[text.index("(") + 1 : -1].split(",")]
        assert len(numbers) == 3 or numbers[3] == 1.0, text
        linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in np.array(numbers[:3]) / 255.0]
        found.append(float(np.dot(linear, (0.2126, 0.7152, 0.0722))) + 0.05)
    return max(found) / min(found)


def test_pictures_of_a_list_are_taken_away(tab, serve, system, tmp_path):
    import xarray as xr
    from PIL import Image

    rng = np.random.default_rng(5)
    table = xr.Dataset({
        "drive.frequency_ratio": ("point", np.linspace(0.6, 2.0, 12)),
        "drive.velocity_amplitude": ("point", rng.uniform(0.05, 0.4, 12)),
    })  # fmt: skip
    found = sb.sweep(system, table, sb.Integration(cycles=10))
    found.to_netcdf(tmp_path / "list.nc", engine="h5netcdf")
    page = tab(serve("list.nc", where=tmp_path).url)
    _turn(page, "Export")
    files = {}
    for kind in ("png", "pdf", "svg"):
        page.page.get_by_role("button", name=kind, exact=True).click()
        page.page.wait_for_timeout(300)
        with page.page.expect_download() as given:
            page.page.get_by_role("button", name="Map", exact=True).click()
        files[kind] = tmp_path / given.value.suggested_filename
        given.value.save_as(files[kind])
        assert files[kind].suffix == f".{kind}"
    assert files["pdf"].read_bytes().startswith(b"%PDF")
    assert b"<svg" in files["svg"].read_bytes()[:2000]
    drawn = np.asarray(Image.open(files["png"]).convert("RGB")).reshape(-1, 3)
    colors = {tuple(each) for each in np.unique(drawn, axis=0)}
    classes = {sb.ResponseClass(int(kind)) for kind in np.unique(found["response_class"])}
    from snapbeam.plot.style import CLASS_COLORS

    for kind in classes:
        assert tuple(bytes.fromhex(CLASS_COLORS[kind][1:])) in colors, f"no dot of {kind.label}"


def test_the_page_uses_the_height_of_the_window_and_the_width_of_a_phone(tab, served, small_map):
    page = tab(served.url)
    page.page.set_viewport_size({"width": 1920, "height": 1080})
    height = """([name]) => { const model = Bokeh.documents[0].get_model_by_name(name);
        const view = model && Bokeh.index.find_one(model);
        return view ? view.el.getBoundingClientRect().height : 0; }"""
    page.wait(lambda: page.js(height, ["map"]) > 600, "a tall map")
    page.wait(lambda: page.js(height, ["waveform-plot"]) > 350, "a tall waveform")
    page.wait(lambda: page.js(height, ["beam-small"]) > 200, "the beam below it")
    assert page.js("() => document.scrollingElement.scrollHeight <= window.innerHeight")
    page.page.set_viewport_size({"width": 390, "height": 844})
    page.wait(lambda: page.js("() => document.scrollingElement.scrollWidth") <= 390, "no horizontal scroll")
    title, button = page.page.locator("h1"), page.page.get_by_role("button", name="Two points")
    assert title.bounding_box()["y"] + title.bounding_box()["height"] <= button.bounding_box()["y"]
    for name in ("Phase", "Spectrum", "Modes", "Energy", "Impacts"):
        _turn(page, name)
        page.page.wait_for_timeout(600)
        assert page.js("() => document.scrollingElement.scrollWidth") <= 390, name
    for name, shown in (("Beam", "beam-plot"), ("Numbers", "")):
        _turn(page, name)
        page.wait(
            lambda shown=shown: page.js(height, [shown]) > 0 if shown else page.page.locator("table.numbers").count(),
            name,
        )
        page.page.wait_for_timeout(300)
        assert page.js("() => document.scrollingElement.scrollWidth") <= 390, name
    rows = page.page.locator("table.numbers tr")
    assert max(rows.nth(at).bounding_box()["height"] for at in range(8)) < 100, "names in lines, not letter by letter"
    assert page.page.locator('meta[name="viewport"]').count() == 1


def test_the_readout_has_a_fixed_height_and_shows_the_selected_point(tab, served, small_map):
    page = tab(served.url)
    x, y = float(small_map["frequency_ratio"][9]), float(small_map["velocity_amplitude"][12])
    below = page.page.get_by_role("button", name="Compute view")
    before = below.bounding_box()["y"]
    page.click(x, y)
    page.wait(lambda: f"{x:.6g}" in page.text("hover"), "the point below the pointer")
    page.page.mouse.move(5, 5)
    page.wait(lambda: "Selected: " in page.text("hover") and f"{x:.6g}" in page.text("hover"), "the selection")
    assert below.bounding_box()["y"] == before
