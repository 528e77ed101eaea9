"""Pictures of a tracked recording: a frame with the edges that were found, the quality, and a video."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from snapbeam.core.findings import doubtful, diagnostics_of
from snapbeam.core.validate import InputError, integer
from snapbeam.figures.findings import draw_findings, findings_height
from snapbeam.figures.style import BEAM_COLOR, COLUMN_WIDTHS, SHAKER_COLOR, house_style, new_figure
from snapbeam.lab.tracking.flags import FrameFlag
from snapbeam.lab.tracking.geometry import Orientation
from snapbeam.lab.tracking.quality import check_tracked, tracking_quality

if TYPE_CHECKING:
    import xarray as xr

    from snapbeam.lab.camera.recording import Recording

__all__ = ["found_edges", "plot_frame", "plot_tracking_quality"]

# Bright colours that stand out on grey pictures and differ for every kind of colour vision (Okabe and Ito).
BEAM_MARK, NEAR_MARK, SHAKER_MARK, STICKER_MARK = "#E69F00", "#F0E442", "#56B4E9", "#CC79A7"

Line = tuple[str, str, str, NDArray[np.floating], NDArray[np.floating]]


def found_edges(dataset: xr.Dataset, index: int, shape: tuple[int, int]) -> list[Line]:
    """The edges found in one frame: (name, colour, line style, rows, columns) in the picture as recorded."""
    attrs = dataset.attrs
    turn = Orientation(attrs["side"], shape)
    centre = float(attrs["contact_column"])
    x = np.array([min(attrs["beam_columns"]), max(attrs["beam_columns"])], dtype=float)
    row, slope = float(dataset["beam_row"][index]), float(dataset["beam_slope"][index])
    lines: list[Line] = []

    def add(name: str, color: str, style: str, rows: NDArray, columns: NDArray) -> None:
        if np.isfinite(rows).all():
            lines.append((name, color, style, *turn.back(rows, columns)))

    far = row + slope * (x - centre)
    add("beam, far edge", BEAM_MARK, "-", far, x)
    add("beam, near edge (far edge + thickness)", NEAR_MARK, "--", far + attrs["beam_thickness_px"], x)
    if "tip_row" in dataset:
        reach = np.array([-0.25, 0.25]) * (x[1] - x[0]) + centre
        add("shaker tip", SHAKER_MARK, "-", np.full(2, float(dataset["tip_row"][index])), reach)
    if "marker_row" in dataset:
        middle, half = float(dataset["marker_row"][index]), 0.5 * attrs["marker_thickness"]
        columns = np.asarray(attrs["marker_columns"], dtype=float)[[0, -1]]
        add("sticker", STICKER_MARK, "-", np.full(2, middle - half), columns)
        add("sticker", STICKER_MARK, "-", np.full(2, middle + half), columns)
    return lines


def flag_words(flags: int) -> str:
    """The flags of a frame in words."""
    names = [
        str(flag.name).lower().replace("_", " ") for flag in FrameFlag if flag and flag in FrameFlag(flags)
    ]
    return ", ".join(names) or "measured"


def _check_pair(recording: Recording, dataset: xr.Dataset, index: int) -> tuple[int, int]:
    """The dataset's index and the recording's for one frame of the dataset."""
    index = integer("frame", index, 0, dataset.sizes["time"] - 1)
    at = int(np.searchsorted(recording.numbers, index))
    if at >= len(recording) or recording.numbers[at] != index:
        raise InputError(f"frame = {index}: is missing from {recording.path}")
    return index, at


def plot_frame(recording: Recording, dataset: xr.Dataset, frame: int = 0) -> Figure:
    """One frame of a recording with the edges that were found in it.

    Parameters
    ----------
    recording, dataset
        An open recording and what :func:`snapbeam.lab.track` made of it.
    frame
        Number of the frame, counted from 0.
    """
    dataset = check_tracked(dataset)
    index, at = _check_pair(recording, dataset, frame)
    picture = recording.frame(at)
    height, width = picture.shape
    told = doubtful(diagnostics_of(dataset))
    size = (
        77.0 * min(max(height / width, 0.12), 1.4) + 26.0 + findings_height(told, COLUMN_WIDTHS["single"], 3)
    )
    with house_style():
        figure = new_figure("single", size)
        draw_findings(figure, told, 3)
        axes = figure.subplots()
        low, high = np.percentile(picture, (0.2, 99.8))
        axes.imshow(picture, cmap="gray", vmin=low, vmax=max(high, low + 1), interpolation="nearest")
        seen: set[str] = set()
        for name, color, style, rows, columns in found_edges(dataset, index, recording.shape):
            axes.plot(columns, rows, style, color=color, lw=1.2, label=None if name in seen else name)
            seen.add(name)
        axes.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5), xlabel="column (px)", ylabel="row (px)")
        flags = int(dataset["flags"][index])
        axes.set_title(f"frame {index}, {1e3 * float(dataset['time'][index]):.2f} ms: {flag_words(flags)}")
        _scale_bar(axes, recording, width, height)
        if seen:
            figure.legend(loc="outside upper center", ncols=2, handlelength=1.8)
    return figure


def _scale_bar(axes: Any, recording: Recording, width: int, height: int) -> None:
    across = width * recording.pixel_size * 1e3
    power = 10.0 ** np.floor(np.log10(0.3 * across))
    length = float(max(step for step in (1.0, 2.0, 5.0) if step * power <= 0.3 * across) * power)
    pixels = length / (recording.pixel_size * 1e3)
    right, row = 0.96 * width, 0.95 * height
    outline = {"facecolor": "black", "alpha": 0.55, "edgecolor": "none", "pad": 1.5}
    axes.plot([right - pixels, right], [row, row], color="white", lw=2.0, solid_capstyle="butt")
    axes.text(
        right, row - 0.02 * height, f"{length:g} mm", color="white", ha="right", va="bottom",
        fontsize=6, bbox=outline,
    )  # fmt: skip


def plot_tracking_quality(dataset: xr.Dataset) -> Figure:
    """A page on how well a recording was tracked: displacement, standard error, and flags, over time."""
    dataset = check_tracked(dataset)
    quality = tracking_quality(dataset)
    time = 1e3 * dataset["time"].values
    pixel = dataset.attrs["pixel_size"] * 1e3
    shaker = "shaker_displacement_mm" in dataset
    told = diagnostics_of(dataset)
    with house_style():
        figure = new_figure("double", 120.0 + findings_height(told, COLUMN_WIDTHS["double"]))
        draw_findings(figure, told)
        top, middle, bottom = figure.subplots(3, 1, sharex=True, height_ratios=(3.0, 1.6, 1.8))
        top.plot(time, dataset["displacement_mm"], color=BEAM_COLOR, label="beam at the shaker")
        if shaker:
            top.plot(time, dataset["shaker_displacement_mm"], color=SHAKER_COLOR, label="shaker")
        top.set_ylabel("displacement (mm)")
        top.legend(loc="upper right", ncols=2)
        top.margins(y=0.15)
        top.set_title(
            f"{quality['frames']} frames, {100 * quality['flagged_share']:.2f} % flagged; signal to noise "
            f"{quality['snr_db']:.1f} dB; edge width {quality['edge_width']:.2f} px"
            + (f"; shaker by its {dataset.attrs['shaker_mark']}" if shaker else "")
        )
        middle.plot(time, dataset["displacement_stderr_mm"] / pixel, color=BEAM_COLOR, lw=0.6)
        if shaker:
            middle.plot(time, dataset["shaker_stderr_mm"] / pixel, color=SHAKER_COLOR, lw=0.6)
        middle.set_ylabel("standard error (px)")
        middle.set_ylim(bottom=0.0)
        flags = dataset["flags"].values.astype(int)
        names = list(quality["counts"])
        for level, (flag, name) in enumerate(zip([flag for flag in FrameFlag if flag], names, strict=True)):
            at = time[(flags & int(flag)) != 0]
            bottom.plot(at, np.full(at.size, level), "|", color=SHAKER_COLOR, ms=7, mew=0.8)
            names[level] = f"{name}: {at.size}"
        bottom.set_yticks(range(len(names)), names)
        bottom.set(ylim=(len(names) - 0.4, -0.6), xlabel="time (ms)", ylabel="flags: frames")
        bottom.grid(axis="y", lw=0.3, color="0.85")
        bottom.set_xlim(time[0], time[-1] if time.size > 1 else time[0] + 1.0)
        figure.align_ylabels()
    return figure
