"""Pictures of a tracked recording: a frame with the edges that were found, the quality, and a video."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter

from snapbeam.lab.signals import stretches
from snapbeam.lab.tracking.settings import FrameFlag, Orientation
from snapbeam.lab.tracking.track import check_tracked, tracking_quality
from snapbeam.plot.animation import write_mp4
from snapbeam.plot.style import BEAM_COLOR, SHAKER_COLOR, figure_style, figure_with
from snapbeam.util.diagnostics import Diagnostic, diagnostics_of, doubtful
from snapbeam.util.files import atomic_path, check_writable
from snapbeam.util.packages import needing
from snapbeam.util.validation import InputError, integer, positive

if TYPE_CHECKING:
    import xarray as xr

    from snapbeam.lab.camera import Recording
    from snapbeam.lab.tracking.first_look import FirstLook
    from snapbeam.lab.tracking.settings import TrackingSettings

__all__ = ["annotated_video", "found_edges", "plot_first_look", "plot_frame", "plot_tracking_quality"]


# Bright colours that stand out on grey pictures and differ for every kind of colour vision (Okabe and Ito).
BEAM_MARK, NEAR_MARK, SHAKER_MARK, STICKER_MARK = "#E69F00", "#F0E442", "#56B4E9", "#CC79A7"

Line = tuple[str, str, str, NDArray[np.floating], NDArray[np.floating]]
_STRIP = 96  # height of the waveform under the picture, pixels


def found_edges(dataset: xr.Dataset, index: int, shape: tuple[int, int]) -> list[Line]:
    """The edges found in one frame: (name, colour, line style, rows, columns) in the picture as recorded."""
    names = ("beam_row", "beam_slope", "tip_row", "marker_row")
    return edge_lines(dataset.attrs, {name: float(dataset[name][index]) for name in names if name in dataset}, shape)


def edge_lines(attrs: Mapping[str, Any], rows: Mapping[str, float], shape: tuple[int, int]) -> list[Line]:
    """The edges of a frame from attributes and variables of a tracked recording."""
    turn = Orientation(attrs["side"], shape)
    centre = float(attrs["contact_column"])
    x = np.array([min(attrs["beam_columns"]), max(attrs["beam_columns"])], dtype=float)
    lines: list[Line] = []

    def add(name: str, color: str, style: str, at: NDArray, columns: NDArray) -> None:
        if np.isfinite(at).all():
            lines.append((name, color, style, *turn.back(at, columns)))

    far = rows["beam_row"] + rows["beam_slope"] * (x - centre)
    add("beam, far edge", BEAM_MARK, "-", far, x)
    add("beam, near edge (far edge + thickness)", NEAR_MARK, "--", far + attrs["beam_thickness_px"], x)
    if "tip_row" in rows:
        reach = np.array([-0.25, 0.25]) * (x[1] - x[0]) + centre
        add("shaker tip", SHAKER_MARK, "-", np.full(2, rows["tip_row"]), reach)
    if "marker_row" in rows:
        middle, half = rows["marker_row"], 0.5 * attrs["marker_thickness"]
        columns = np.asarray(attrs["marker_columns"], dtype=float)[[0, -1]]
        add("sticker", STICKER_MARK, "-", np.full(2, middle - half), columns)
        add("sticker", STICKER_MARK, "-", np.full(2, middle + half), columns)
    return lines


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
    told = doubtful(diagnostics_of(dataset))
    with figure_style():
        figure, axes = _frame_axes(recording, picture, told)
        seen: set[str] = set()
        for name, color, style, rows, columns in found_edges(dataset, index, recording.shape):
            axes.plot(columns, rows, style, color=color, lw=1.2, label=None if name in seen else name)
            seen.add(name)
        flags = int(dataset["flags"][index])
        axes.set_title(f"frame {index}, {1e3 * float(dataset['time'][index]):.2f} ms: {FrameFlag(flags).words}")
        if seen:
            figure.legend(loc="outside upper center", ncols=2, handlelength=1.8)
    return figure


def plot_first_look(recording: Recording, look: FirstLook, settings: TrackingSettings, index: int = 0) -> Figure:
    """One frame that was not tracked: objects at the threshold, and the regions in which a beam was found."""
    picture = recording.frame(index)
    with figure_style():
        figure, axes = _frame_axes(recording, picture, (), scale=False)
        smooth = uniform_filter(picture.astype(float), 3)
        axes.contour(smooth, [look.level], colors=SHAKER_MARK, linewidths=0.4)
        axes.plot([], [], color=SHAKER_MARK, label=f"threshold {look.level:.4g}")
        for (top, bottom, left, right), words in look.options.items():
            x, y = (np.array([left, right]) - recording.region[2], np.array([top, bottom]) - recording.region[0])
            axes.plot(x[[0, 1, 1, 0, 0]] - 0.5, y[[0, 0, 1, 1, 0]] - 0.5, color=BEAM_MARK, lw=1.2, label=words)
        axes.set_title(f"frame {index}, not tracked, side = {settings.side}")
        figure.legend(loc="outside lower center", handlelength=1.8)
    return figure


def _frame_axes(
    recording: Recording, picture: NDArray[Any], told: tuple[Diagnostic, ...], scale: bool = True
) -> tuple[Figure, Any]:
    """A figure of a frame with its scale bar and diagnostics, and its axes."""
    height, width = picture.shape
    size = 77.0 * min(max(height / width, 0.12), 1.4) + 26.0
    figure = figure_with(told, "single", size, 3)
    axes = figure.subplots()
    low, high = np.percentile(picture, (0.2, 99.8))
    axes.imshow(picture, cmap="gray", vmin=low, vmax=max(high, low + 1), interpolation="nearest")
    axes.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5), xlabel="column (px)", ylabel="row (px)")
    axes.autoscale(False)
    if scale:
        _scale_bar(axes, recording, width, height)
    return figure, axes


def _scale_bar(axes: Any, recording: Recording, width: int, height: int) -> None:
    across = width * recording.pixel_width * 1e3
    power = 10.0 ** np.floor(np.log10(0.3 * across))
    length = float(max(step for step in (1.0, 2.0, 5.0) if step * power <= 0.3 * across) * power)
    pixels = length / (recording.pixel_width * 1e3)
    right, row = 0.96 * width, 0.95 * height
    outline = {"facecolor": "black", "alpha": 0.55, "edgecolor": "none", "pad": 1.5}
    axes.plot([right - pixels, right], [row, row], color="white", lw=2.0, solid_capstyle="butt")
    place = {"ha": "right", "va": "bottom", "fontsize": 6, "bbox": outline}
    axes.text(right, row - 0.02 * height, f"{length:g} mm", color="white", **place)


def plot_tracking_quality(dataset: xr.Dataset) -> Figure:
    """A page on how well a recording was tracked: displacement, standard error, and flags, over time."""
    dataset = check_tracked(dataset)
    quality = tracking_quality(dataset)
    time = 1e3 * dataset["time"].values
    pixel = dataset.attrs["pixel_size"] * 1e3
    shaker = "shaker_displacement_mm" in dataset
    with figure_style():
        figure = figure_with(diagnostics_of(dataset), "double", 120.0)
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
        for level, flag in enumerate(one for one in FrameFlag if one):
            at = time[(flags & int(flag)) != 0]
            bottom.plot(at, np.full(at.size, level), "|", color=SHAKER_COLOR, ms=7, mew=0.8)
            names[level] += f": {at.size}"
        bottom.set_yticks(range(len(names)), names)
        bottom.set(ylim=(len(names) - 0.4, -0.6), xlabel="time (ms)", ylabel="flags: frames")
        bottom.grid(axis="y", lw=0.3, color="0.85")
        bottom.set_xlim(time[0], time[-1] if time.size > 1 else time[0] + 1.0)
        figure.align_ylabels()
    return figure


def annotated_video(
    recording: Recording,
    dataset: xr.Dataset,
    path: str | os.PathLike[str],
    *,
    play_rate: float = 25.0,
    every: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> Path:
    """Write a video of a recording with the found edges drawn in, time and flags, and the waveform below.

    Parameters
    ----------
    recording, dataset
        An open recording and what :func:`snapbeam.lab.track` made of it.
    path
        File to write, ``.mp4``, ``.mov`` or ``.avi`` (H.264).
    play_rate
        Frames shown per second [Hz]; below 5 Hz each is written several times.
    every
        Show every so many-th frame.
    progress
        Called with (frames done, frames in all).
    """
    with needing(f"path = {str(path)!r}: a video", "lab,video"):
        import cv2  # noqa: F401
        import imageio_ffmpeg  # noqa: F401
    target = check_writable(path, "path", (".mp4", ".mov", ".avi"))
    rate = positive("play_rate", play_rate, "Hz")
    every = integer("every", every, 1)
    dataset = check_tracked(dataset)
    if int(recording.numbers[-1]) + 1 != dataset.sizes["time"]:
        raise InputError(
            f"dataset of {dataset.sizes['time']} frames: {recording.path} ends with frame {recording.numbers[-1]}"
        )
    low, high = (float(level) for level in np.percentile(recording.frame(0), (0.2, 99.8)))
    canvas = _Canvas(recording.shape, dataset, low, max(high, low + 1.0))

    def pictures() -> Iterator[NDArray[np.uint8]]:
        for done, picture in enumerate(recording):
            if done % every == 0:
                yield canvas.draw(picture, int(recording.numbers[done]))
            if progress is not None:
                progress(done + 1, len(recording))

    with atomic_path(target) as temporary:
        write_mp4(pictures(), temporary, rate)
    return target


class _Canvas:
    """Draws one picture after another at a size that can be watched."""

    def __init__(self, shape: tuple[int, int], dataset: xr.Dataset, low: float, high: float) -> None:
        self.shape, self.dataset, self.low, self.high = shape, dataset, low, high
        self.scale = int(np.clip(np.ceil(480 / max(shape)), 1, 8))
        width = max(shape[1] * self.scale, 320)
        height = shape[0] * self.scale + 24 + _STRIP
        self.size = (width + width % 2, height + height % 2)
        self.strip = self._waveform()

    def _waveform(self) -> NDArray[np.uint8]:
        import cv2

        strip = np.full((_STRIP, self.size[0], 3), 255, dtype=np.uint8)
        names = [("displacement_mm", (0, 0, 0)), ("shaker_displacement_mm", (176, 58, 39))]
        values = [self.dataset[name].values for name, _ in names if name in self.dataset]
        both = np.concatenate(values)
        low, high = (np.nanmin(both), np.nanmax(both)) if np.isfinite(both).any() else (0.0, 1.0)
        x = np.linspace(4, self.size[0] - 5, values[0].size)
        for line, (_, color) in zip(values, names, strict=False):
            y = 8.0 + (_STRIP - 16.0) * (high - line) / max(float(high - low), 1e-9)
            points = np.stack([x, y], axis=1) * 16.0
            runs = [np.rint(points[first:last]).astype(np.int32) for first, last in stretches(np.isfinite(line))]
            cv2.polylines(strip, [run for run in runs if len(run) > 1], False, color, 1, cv2.LINE_AA, 4)
        return strip

    def draw(self, picture: NDArray[np.integer], index: int) -> NDArray[np.uint8]:
        """One picture of the video, (height, width, 3), red green blue."""
        import cv2

        grey = np.clip((picture - self.low) * (255.0 / (self.high - self.low)), 0, 255).astype(np.uint8)
        large = cv2.resize(grey, None, fx=self.scale, fy=self.scale, interpolation=cv2.INTER_NEAREST)
        image = np.full((self.size[1], self.size[0], 3), 255, dtype=np.uint8)
        image[24 : 24 + large.shape[0], : large.shape[1]] = large[..., None]
        for _, color, _, rows, columns in found_edges(self.dataset, index, self.shape):
            ends = (np.stack([columns, rows], axis=1) + 0.5) * self.scale + (0, 24)
            rgb = tuple(int(color[i : i + 2], 16) for i in (1, 3, 5))
            first, last = np.rint(ends * 16.0).astype(int).tolist()
            cv2.line(image, first, last, rgb, 2, cv2.LINE_AA, 4)
        time = 1e3 * float(self.dataset["time"][index])
        words = FrameFlag(int(self.dataset["flags"][index])).words
        text = f"frame {index}  {time:.2f} ms  {words}"
        cv2.putText(image, text, (4, 17), cv2.FONT_HERSHEY_SIMPLEX, 0.45, (0, 0, 0), 1, cv2.LINE_AA)
        top = 24 + large.shape[0]
        image[top : top + _STRIP] = self.strip
        x = round(4 + (self.size[0] - 9) * index / max(self.dataset.sizes["time"] - 1, 1))
        cv2.line(image, (x, top + 2), (x, top + _STRIP - 3), (86, 180, 233), 2)
        return image
