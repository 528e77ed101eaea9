"""The labels of the fields of a system stand apart."""

from __future__ import annotations

_CUT = """() => {
  const found = [];
  const walk = (root) => {
    for (const e of root.querySelectorAll('*')) {
      if (e.shadowRoot) { walk(e.shadowRoot); }
      if (e.tagName === 'LABEL' && e.offsetWidth && e.innerText.trim()) {
        const range = document.createRange();
        range.selectNodeContents(e);
        const text = range.getBoundingClientRect(), host = e.getRootNode().host.getBoundingClientRect();
        if (host.width) { found.push([e.innerText.trim(), text.left, text.right, host.left, host.right]); }
      }
    }
  };
  walk(document);
  return found;
}"""


def test_the_labels_of_a_suspension_do_not_run_into_each_other(tab, serve, folder):
    (folder / "moving.toml").write_text(
        'extends = "paper"\n[model]\nmodes = 1\n[contact]\nmass = 0.01\nsuspension_stiffness = 100.0\n'
        "suspension_damping = 0.1\n",
        encoding="utf-8",
    )
    page = tab(serve("--config", "moving.toml").url + "?card=System")
    page.wait(lambda: any("suspension damping" in each[0] for each in page.js(_CUT)), "the fields")
    found = page.js(_CUT)
    assert sum("suspension" in each[0] for each in found) == 2
    wide = [name for name, left, right, host_left, host_right in found if right > host_right or left < host_left]
    assert not wide, wide
