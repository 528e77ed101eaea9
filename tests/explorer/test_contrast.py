"""Contrast of the two looks of the page; without a browser."""

from __future__ import annotations

import re

import matplotlib.pyplot as plt
import pytest

pytest.importorskip("panel")

from snapbeam import ResponseClass
from snapbeam.explorer.drawn import Drawn
from snapbeam.explorer.style import DARK, LIGHT, class_chip, sheet


def _luminance(color: str) -> float:
    digits = color.lstrip("#")
    digits = digits if len(digits) == 6 else "".join(2 * each for each in digits)
    parts = [int(digits[at : at + 2], 16) / 255.0 for at in (0, 2, 4)]
    linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one: str, other: str) -> float:
    """Contrast of two colours as WCAG 2 defines it."""
    low, high = sorted((_luminance(one), _luminance(other)))
    return (high + 0.05) / (low + 0.05)


def test_contrast_of_black_and_white_is_21():
    assert contrast("#000", "#ffffff") == pytest.approx(21.0)


@pytest.mark.parametrize("look", [LIGHT, DARK], ids=lambda look: look.name)
def test_text_and_lines_stand_out(look):
    for ground in (look.page, look.card):
        for name in ("text", "faint", "striker", "accent"):
            assert contrast(getattr(look, name), ground) >= 4.5, (name, ground)
    for name in ("beam", "center", "striker", "second"):
        assert contrast(getattr(look, name), look.card) >= 3.0, name


@pytest.mark.parametrize("look", [LIGHT, DARK], ids=lambda look: look.name)
def test_every_class_stands_out_from_the_card(look):
    """Each chip and each field of the legend has a border of 3 to 1; text on a chip has 4.5 to 1."""
    assert contrast(look.faint, look.card) >= 3.0
    for part in ("chip", "swatch"):
        rule = re.search(rf"\.{part} {{([^}}]*)}}", sheet(look))[1]
        assert "1px solid var(--sb-faint)" in rule
    for kind in ResponseClass:
        ground, ink = re.search(r"background:(#\w+);color:(#\w+)", class_chip(kind)).groups()
        assert contrast(ground, ink) >= 4.5, kind


def test_dark_colours_of_a_printed_figure_stand_out_on_a_dark_page():
    figure, axes = plt.subplots()
    for color in ("#14235f", "black", "#b03a27", "0.3", "#70bbf0"):
        axes.plot([0.0, 1.0], [0.0, 1.0], "o-", color=color)
    plot = Drawn(axes, DARK).plots[0][0]
    plt.close(figure)
    colors = [each.glyph.line_color for each in plot.renderers]
    assert len(colors) == 10 and all(contrast(color[:7], DARK.card) >= 3.0 for color in colors)
