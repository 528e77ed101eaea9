"""Diagnostics of a measurement in its picture: a box of words below, red where the numbers are doubtful."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable

from matplotlib.figure import Figure

from snapbeam.core.findings import Diagnostic, Severity
from snapbeam.figures.style import SHAKER_COLOR

__all__ = ["draw_findings", "findings_height"]

_LINE = 2.9  # mm
_COLORS = {Severity.INFO: "0.35", Severity.WARNING: SHAKER_COLOR, Severity.ERROR: SHAKER_COLOR}


def _lines(diagnostics: Iterable[Diagnostic], width: float, most: int) -> list[tuple[str, str]]:
    """Wrapped lines and their colours, the gravest diagnostics first, at most so many diagnostics."""
    order = {Severity.ERROR: 0, Severity.WARNING: 1, Severity.INFO: 2}
    chosen = sorted(diagnostics, key=lambda one: order[one.severity])
    out: list[tuple[str, str]] = []
    for one in chosen[:most]:
        text = f"{one.severity.value}: {one.message}"
        for k, line in enumerate(textwrap.wrap(text, int(width / 1.02))):
            out.append((line if k == 0 else f"    {line}", _COLORS[one.severity]))
    if len(chosen) > most:
        out.append((f"and {len(chosen) - most} more", "0.35"))
    return out


def findings_height(diagnostics: Iterable[Diagnostic], width: float, most: int = 6) -> float:
    """Height [mm] that the diagnostics take below a picture of *width* [mm]; 0 if there are none."""
    lines = _lines(diagnostics, width, most)
    return _LINE * len(lines) + 2.0 if lines else 0.0


def draw_findings(figure: Figure, diagnostics: Iterable[Diagnostic], most: int = 6) -> None:
    """Write diagnostics along the lower edge of a figure made *findings_height* taller, and keep axes off it."""
    width, height = (25.4 * float(size) for size in figure.get_size_inches())
    lines = _lines(diagnostics, width, most)
    if not lines:
        return
    share = (_LINE * len(lines) + 2.0) / height
    engine = figure.get_layout_engine()
    if engine is not None:
        engine.set(rect=(0.0, share, 1.0, 1.0 - share))  # type: ignore[call-arg]
    for k, (text, color) in enumerate(lines):
        figure.text(
            1.5 / width, share - (k + 0.9) * _LINE / height, text, color=color, fontsize=5.5, va="baseline"
        )
