"""An animation of a run as MP4 or GIF: beam and striker, next to their waveform."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.gridspec import GridSpec
from numpy.typing import NDArray

from snapbeam.model.boundary_conditions import BoundaryConditions, modes_between
from snapbeam.model.parameters import lookup
from snapbeam.model.reduced_model import displacement_along
from snapbeam.plot.run import across, cut, hardest_impact
from snapbeam.plot.style import BEAM_COLOR, SHAKER_COLOR, caption, figure_style, fix_ticks, new_figure
from snapbeam.simulation.dataset import check_trajectory
from snapbeam.util.files import MADE_BY, atomic_path, check_writable
from snapbeam.util.packages import needing
from snapbeam.util.validation import InputError, integer, nonnegative, positive

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["ANIMATION_SUFFIXES", "animate_run", "frame_times", "write_frames", "write_mp4"]


_Array = NDArray[np.float64]

ANIMATION_SUFFIXES = (".mp4", ".gif")
_DOTS_PER_INCH = 100
_WIDTH, _HEIGHT = 6.4 * 25.4, 3.6 * 25.4  # mm
_VIDEO_DOTS = 200  # 1280 x 720 pixels
_GIF_COLORS = 64
_POSITIONS = 161


def frame_times(
    dataset: xr.Dataset,
    window: tuple[float, float] | None = None,
    *,
    duration: float = 10.0,
    slow_motion: float = 4.0,
    fps: float = 25.0,
) -> _Array:
    """Times of a run, s, that the frames of an animation show.

    The window passes evenly in *duration* seconds, but that the hardest impact in it, with half its length
    before and after, is stretched to *slow_motion* seconds of its own.

    Parameters
    ----------
    dataset : xarray.Dataset
        A run that follows :data:`snapbeam.simulation.dataset.SCHEMA`.
    window : pair of float, optional
        First and last cycle; everything by default.
    duration : float
        Length at even speed, s.
    slow_motion : float
        Length of the slow motion, s; 0 for none.  A run without a contact force has none.
    fps : float
        Frames a second.
    """
    time = check_trajectory(dataset)["time"].values
    start, stop = _span(dataset, window)
    rate, length = positive("fps", fps, "Hz"), positive("duration", duration, "s")
    slow = nonnegative("slow_motion", slow_motion, "s")
    even = np.linspace(start, stop, max(round(length * rate), 2))
    impact = _hardest_impact(dataset, time, start, stop) if slow > 0.0 else None
    if impact is None:
        return even
    stretched = np.linspace(*impact, max(round(slow * rate), 2))
    outside = (even < impact[0]) | (even > impact[1])
    return np.unique(np.concatenate((even[outside], stretched)))


def animate_run(
    dataset: xr.Dataset,
    path: str | os.PathLike[str],
    window: tuple[float, float] | None = None,
    *,
    duration: float = 10.0,
    slow_motion: float = 4.0,
    fps: float = 25.0,
    progress: Callable[[int, int], object] | None = None,
) -> Path:
    """Write an animation of a run: beam and striker, and their waveform with the present instant.

    An MP4 has 1280 by 720 pixels, a GIF half of each.  The frames show the parameters, the response class and the slow-down factor.

    Parameters are those of :func:`frame_times`, and *path*, ending in ``.mp4`` (H.264) or ``.gif``, and
    *progress*, called as ``progress(frames done, frames in all)``.  The shape of the beam is the sum of its
    modal amplitudes times the buckling modes, interpolated between samples; a run without amplitudes (a
    measured one) shows the points of the beam and the shaker that meet.

    Returns
    -------
    pathlib.Path
        The file, written whole or not at all.
    """
    target = check_writable(path, "animate", ANIMATION_SUFFIXES)
    times = frame_times(dataset, window, duration=duration, slow_motion=slow_motion, fps=fps)
    scene = _Scene(dataset, times, fps)

    def frames() -> Iterator[Figure]:
        for done, at in enumerate(times, 1):
            yield scene.draw(float(at))
            if progress is not None:
                progress(done, times.size)

    dots = _DOTS_PER_INCH if target.suffix.lower() == ".gif" else _VIDEO_DOTS
    return write_frames(frames(), target, fps=fps, dots_per_inch=dots)


def write_frames(
    frames: Iterable[Figure], path: str | os.PathLike[str], *, fps: float = 25.0, dots_per_inch: float = _DOTS_PER_INCH
) -> Path:
    """Write figures of one size, one after the other, as the frames of an MP4 (H.264) or a GIF."""
    target = check_writable(path, "animate", ANIMATION_SUFFIXES)
    rate = positive("fps", fps, "Hz")
    with figure_style(), atomic_path(target) as temporary:
        pictures = _pictures(frames, dots_per_inch)
        if target.suffix.lower() == ".gif":
            _write_gif(pictures, temporary, rate)
        else:
            write_mp4(pictures, temporary, rate)
    return target


def _pictures(frames: Iterable[Figure], dots_per_inch: float) -> Iterator[NDArray[np.uint8]]:
    import matplotlib.pyplot as plt
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    last: Figure | None = None
    for figure in frames:
        if last is not None and figure is not last:
            plt.close(last)
        canvas = FigureCanvasAgg(figure)
        if figure is not last:
            figure.set_dpi(dots_per_inch)
            canvas.draw()
            figure.set_layout_engine("none")  # what is laid out stays where it is
        last = figure
        canvas.draw()
        picture = np.asarray(canvas.buffer_rgba())[..., :3]
        yield np.ascontiguousarray(picture[: picture.shape[0] // 2 * 2, : picture.shape[1] // 2 * 2])
    if last is not None:
        plt.close(last)


def write_mp4(pictures: Iterable[NDArray[np.uint8]], path: Path, rate: float) -> None:
    """Write pictures of one size (height, width, 3), both sides even, as H.264 video of *rate* pictures a second.

    The container (MP4, MOV, AVI) follows from the suffix of *path*.  Below 5 Hz each picture is written several times.
    """
    with needing(f"{path}: a video", "video"):
        import imageio_ffmpeg

    writer: Any = None
    shown = max(rate, 5.0)  # players skip through files of less than a few frames a second
    repeat = integer("repeat", round(shown / rate), 1)
    try:
        for picture in pictures:
            if writer is None:
                writer = imageio_ffmpeg.write_frames(
                    str(path), picture.shape[1::-1], fps=rate * repeat, codec="libx264", quality=7,
                    macro_block_size=2, ffmpeg_log_level="error",
                    output_params=["-metadata", f"comment={MADE_BY}"],
                )  # fmt: skip
                writer.send(None)
            for _ in range(repeat):
                writer.send(picture)
    finally:
        if writer is not None:
            writer.close()


def _write_gif(pictures: Iterator[NDArray[np.uint8]], path: Path, rate: float) -> None:
    from PIL import Image

    images = [Image.fromarray(picture).quantize(_GIF_COLORS, dither=Image.Dither.NONE) for picture in pictures]
    if not images:
        raise InputError("frames: must hold at least one figure")
    look: dict[str, Any] = {"duration": 1000.0 / rate, "loop": 0, "optimize": True, "comment": MADE_BY.encode()}
    images[0].save(path, save_all=True, append_images=images[1:], **look)


def _span(dataset: xr.Dataset, window: tuple[float, float] | None) -> tuple[float, float]:
    if window is not None and "cycle" not in dataset.variables:
        raise InputError(f"window = {window}: this run has no cycles of excitation")
    time = cut(dataset, "cycle", window)["time"].values
    return float(time[0]), float(time[-1])


def _hardest_impact(dataset: xr.Dataset, time: _Array, start: float, stop: float) -> tuple[float, float] | None:
    """From half its length before the impact with the maximum force to half its length after."""
    if "contact_force" not in dataset:
        return None
    force = np.where((time >= start) & (time <= stop), dataset["contact_force"].values, 0.0)
    if not (force > 0.0).any():
        return None
    first, last = hardest_impact(force)
    margin = 0.5 * (time[last] - time[first])
    return max(float(time[first] - margin), start), min(float(time[last] + margin), stop)


class _Scene:
    """One figure whose artists move."""

    def __init__(self, dataset: xr.Dataset, times: _Array, fps: float) -> None:
        self.fps = fps
        self.time = dataset["time"].values
        inside = (self.time >= times[0]) & (self.time <= times[-1])
        name, self.label = across(dataset)
        self.across = dataset[name].values
        self.shape = _BeamShape(dataset) if "modal_amplitude" in dataset else None
        self.beam = dataset["displacement_at_striker"].values
        self.shaker = dataset["striker_displacement"].values if "striker_displacement" in dataset else None
        self.location = float(dataset.attrs.get("location", 0.5))
        self.rate = np.median(np.diff(times))
        self.times = times
        with figure_style():
            self.figure = new_figure("single", _HEIGHT)
            self.figure.set_size_inches(_WIDTH / 25.4, _HEIGHT / 25.4)
            self.figure.suptitle(caption(dataset, 2), x=0.02, ha="left", fontsize=8)
            grid = self.figure.add_gridspec(1, 2, width_ratios=(1.0, 1.15))
            self._beam_axes(grid, inside)
            self._wave_axes(grid, inside)

    def _beam_axes(self, grid: GridSpec, inside: NDArray[np.bool_]) -> None:
        ax = self.figure.add_subplot(grid[0, 0])
        curves = [self.beam[inside]] + ([] if self.shaker is None else [self.shaker[inside]])
        low, high = min(c.min() for c in curves), max(c.max() for c in curves)
        low, high = min(low, -1.0), max(high, 1.0)
        pad = 0.12 * (high - low)
        ax.set(xlim=(-0.02, 1.02), ylim=(low - 2.0 * pad, high + pad))
        ax.set(xlabel="Position $x/L$", ylabel="Displacement $w/b$")
        ax.axhline(0.0, color="0.75", linewidth=0.5)
        (self.rod,) = ax.plot([], [], color=SHAKER_COLOR, linewidth=5, solid_capstyle="butt")
        (self.curve,) = ax.plot([], [], color=BEAM_COLOR, linewidth=1.6, marker="" if self.shape else "o")
        self.words = ax.text(0.02, 0.98, "", transform=ax.transAxes, va="top", fontsize=7)
        self.bottom = low - 2.0 * pad
        fix_ticks(ax)

    def _wave_axes(self, grid: GridSpec, inside: NDArray[np.bool_]) -> None:
        ax = self.figure.add_subplot(grid[0, 1])
        x = self.across[inside]
        ax.plot(x, self.beam[inside], color=BEAM_COLOR, label="beam, at the striker")
        if self.shaker is not None:
            ax.plot(x, self.shaker[inside], color=SHAKER_COLOR, label="striker")
        (self.now,) = ax.plot([], [], color="0.5", linewidth=0.6)
        (self.dot,) = ax.plot([], [], "o", color=BEAM_COLOR, markersize=3)
        low, high = ax.get_ylim()
        ax.set(xlim=(x[0], x[-1]), ylim=(low, high + 0.15 * (high - low)), ylabel="Displacement $w/b$")
        ax.set_xlabel(self.label)
        ax.legend(loc="upper right", ncols=2)
        fix_ticks(ax)

    def draw(self, at: float) -> Figure:
        """The figure as it is at one instant."""
        beam = float(np.interp(at, self.time, self.beam))
        if self.shape is None:
            self.curve.set_data([self.location], [beam])
        else:
            self.curve.set_data(self.shape.position, self.shape.at(at))
        if self.shaker is not None:
            tip = float(np.interp(at, self.time, self.shaker))
            self.rod.set_data([self.location] * 2, [self.bottom, tip])
        now = float(np.interp(at, self.time, self.across))
        self.now.set_data([now, now], [-1e3, 1e3])
        self.dot.set_data([now], [beam])
        passing = float(np.interp(at, self.times[:-1], np.diff(self.times)))
        slower = 1.0 / (self.fps * passing)
        impact = "  (impact)" if passing < 0.5 * self.rate else ""
        self.words.set_text(
            f"{1e3 * at:.2f} ms, {slower:.2g} times slower{impact}"
            if slower < 10
            else f"{1e3 * at:.2f} ms, {round(slower, 1 - len(str(int(slower)))):,.0f} times slower{impact}"
        )
        return self.figure


class _BeamShape:
    """The deflection along the beam, over b, at any instant between two samples."""

    def __init__(self, dataset: xr.Dataset) -> None:
        for name in ("beam_length", "length_scale"):
            if name not in dataset.attrs:
                raise InputError(f"run without the attribute {name}: it is of no beam, whose shape could be drawn")
        self.position = np.linspace(0.0, 1.0, _POSITIONS)
        self.length, self.scale = (float(dataset.attrs[name]) for name in ("beam_length", "length_scale"))
        self.time = dataset["time"].values
        self.alpha = dataset["modal_amplitude"].values
        given = {
            name: dataset.attrs.get(lookup(f"boundary.{name}").short)
            for name in ("left_rotational_stiffness", "right_rotational_stiffness")
        }
        self.modes = None
        if any(each is not None for each in given.values()):
            young, width, thickness = (
                float(dataset.attrs[f"beam_{name}"]) for name in ("young_modulus", "width", "thickness")
            )
            stiff = young * width * thickness**3 / 12.0
            self.modes = modes_between(BoundaryConditions(**given), self.length, stiff, self.alpha.shape[-1])

    def at(self, time: float) -> _Array:
        after = int(np.clip(np.searchsorted(self.time, time), 1, self.time.size - 1))
        share = (time - self.time[after - 1]) / (self.time[after] - self.time[after - 1])
        alpha = (1.0 - share) * self.alpha[after - 1] + share * self.alpha[after]
        return displacement_along(self.length, alpha, self.position, self.modes) / self.scale
