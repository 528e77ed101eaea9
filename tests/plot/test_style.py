"""The colours of the classes: told apart by everyone, and in grey."""

from __future__ import annotations

import os
import subprocess
import sys
from itertools import combinations

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.colors import to_rgb

import snapbeam as sb
from snapbeam.plot.style import CLASS_COLORS, new_figure, save_figure
from snapbeam.util.status_codes import ResponseClass
from snapbeam.util.validation import InputError

# Machado, Oliveira and Fernandes, IEEE Trans. Vis. Comput. Graph. 15 (2009) 1291, severity 1, on linear RGB.
VISION = {
    "normal": np.eye(3),
    "protanopia": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "deuteranopia": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
    "tritanopia": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]],
}
TO_XYZ = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
)


def lab(color, vision):
    """CIE L*a*b* of an sRGB colour (white D65) as an eye with that vision takes it."""
    rgb = np.array(to_rgb(color))
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    ratio = TO_XYZ @ np.clip(np.array(vision) @ linear, 0.0, 1.0) / [0.95047, 1.0, 1.08883]
    f = np.where(ratio > 0.008856, np.cbrt(ratio), 7.787 * ratio + 16.0 / 116.0)
    return np.array([116.0 * f[1] - 16.0, 500.0 * (f[0] - f[1]), 200.0 * (f[1] - f[2])])


@pytest.mark.parametrize("vision", VISION)
def test_classes_are_told_apart(vision):
    seen = {kind: lab(color, VISION[vision]) for kind, color in CLASS_COLORS.items()}
    differences = {(a.name, b.name): np.linalg.norm(seen[a] - seen[b]) for a, b in combinations(ResponseClass, 2)}
    assert min(differences.values()) > 28.0, differences
    lightness = sorted(value[0] for value in seen.values())
    assert min(np.diff(lightness)) > 8.0, lightness


def test_colours_keep_the_meaning_of_the_paper():
    red, green, blue = np.array([to_rgb(CLASS_COLORS[kind]) for kind in sorted(ResponseClass) if kind >= 0]).T
    assert red[0] > 2.0 * max(green[0], blue[0])
    assert blue[1] > red[1] and blue[2] > red[2]
    assert green[3] > max(red[3], blue[3])


@pytest.mark.parametrize("suffix", ["png", pytest.param("pdf", marks=pytest.mark.slow), "svg"])
def test_saved_whole_and_the_same_again(tmp_path, suffix):
    figure = new_figure("single", 50.0)
    figure.add_subplot().plot([0, 1], [0, 1])
    files = [save_figure(figure, tmp_path / f"{name}.{suffix}") for name in "ab"]
    plt.close(figure)
    assert files[0].read_bytes() == files[1].read_bytes()
    assert sorted(file.name for file in tmp_path.iterdir()) == [f"a.{suffix}", f"b.{suffix}"]


def test_size_of_a_column(tmp_path):
    figure = new_figure("single", 50.0)
    image = plt.imread(save_figure(figure, tmp_path / "a.png"))
    plt.close(figure)
    assert image.shape[1] == pytest.approx(90.0 / 25.4 * 300.0, abs=1)
    with pytest.raises(InputError, match="must be one of 'single', 'double'"):
        new_figure("wide")
    with pytest.raises(InputError, match=r"must end in \.png or \.pdf or \.svg"):
        save_figure(figure, tmp_path / "a.jpeg")


_BACKEND = """
import matplotlib as mpl
from matplotlib.backends.backend_agg import FigureCanvasAgg as FigureCanvas
from matplotlib.backend_bases import FigureManagerBase as FigureManager

mpl.interactive(True)
"""
"""Behaves as the backend of a notebook does: it switches the interactive mode on when it is loaded."""
_PLOTS = """
import matplotlib as mpl
from snapbeam.plot.style import new_figure

for k in range(3):
    new_figure()
    assert mpl.is_interactive(), k
"""


def test_every_figure_of_a_notebook_is_shown(tmp_path):
    """The interactive mode, by which a notebook shows figures, stays on after the first figure."""
    (tmp_path / "like_a_notebook.py").write_text(_BACKEND, encoding="utf-8")
    path = os.pathsep.join((str(tmp_path), os.environ.get("PYTHONPATH", "")))
    environment = dict(os.environ, MPLBACKEND="module://like_a_notebook", PYTHONPATH=path)
    done = subprocess.run([sys.executable, "-c", _PLOTS], env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(("name", "width"), [("elsevier", 90.0), ("ieee", 88.9), ("nature", 89.0), ("slides", 130.0)])
def test_a_style_sets_widths_and_text_and_can_be_taken_back(name, width):
    from snapbeam.plot.style import figure_style, new_figure

    try:
        sb.plot.plot_style(name)
        with figure_style():
            figure = new_figure("single", 60.0)
            text = figure.text(0.5, 0.5, "text")
            assert 25.4 * figure.get_figwidth() == pytest.approx(width)
            assert text.get_fontsize() == {"slides": 12.0, "nature": 7.0}.get(name, 8.0)
    finally:
        sb.plot.plot_style("elsevier")
    with figure_style():
        assert 25.4 * new_figure("double").get_figwidth() == pytest.approx(190.0)
    with pytest.raises(sb.InputError, match="name"):
        sb.plot.plot_style("poster")


def test_heading_has_the_shock_or_the_random_vibration_of_the_base() -> None:
    import xarray as xr

    from snapbeam.plot.style import base_and_load

    shock = {"base_excitation_acceleration_g": 1000.0, "base_excitation_duration_ms": 0.2}
    assert base_and_load(xr.Dataset(attrs=shock)) == ["shock 1000 $g$, 0.2 ms"]
    assert base_and_load(xr.Dataset(attrs=shock), ["base_excitation_acceleration_g"]) == ["shock 0.2 ms"]
    assert base_and_load(xr.Dataset(attrs={"base_excitation_rms_g": 0.6})) == ["random 0.6 $g$ rms"]


def test_units_are_written_with_their_symbols() -> None:
    from snapbeam.plot.axes import written_unit

    assert [written_unit(each) for each in ("kohm", "ohm", "um", "uW", "mm", "1", "u")] == [
        "kΩ",
        "Ω",
        "µm",
        "µW",
        "mm",
        "1",
        "u",
    ]
