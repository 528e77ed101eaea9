"""A synthetic camera: recordings of known motions, together with the true motions.

An ideal scene of a beam and a rounded shaker with a sticker is drawn as sharp edges, blurred by the optics,
integrated over each pixel and over the exposure, lit unevenly, spoiled as requested, and given noise and a finite
bit depth.  The optics are a Gaussian, as the tracker assumes, or a lens out of focus, as it does not.  The
truth is the mean of the displacement over each exposure, exactly, for motion that is linear between the given
samples.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import make_interp_spline

from snapbeam.lab.camera import write_photron, write_video
from snapbeam.lab.signals import make_signal
from snapbeam.lab.tracking.edges import Floats
from snapbeam.lab.tracking.settings import SIDES, Orientation
from snapbeam.simulation.dataset import check_trajectory, trajectory_dataset
from snapbeam.util.packages import needing
from snapbeam.util.validation import (
    InputError,
    axis,
    choice,
    finite,
    finite_array,
    integer,
    nonnegative,
    or_default,
    positive,
    seed_of,
    shown,
    within,
)

if TYPE_CHECKING:
    import xarray as xr


CELLS_PER_PIXEL = 4  # cells to a pixel, each way
FRAME_LISTS = ("glare_frames", "blurred_frames", "repeated_frames", "blank_frames", "hidden_frames")
_FINE = 8  # rows of light drawn for a row of pixels


def _noise(snr_db: float, level: float) -> float:
    """Standard deviation of the noise below a *level*, none at an infinite ratio."""
    if isinstance(snr_db, float) and snr_db == math.inf:
        return 0.0
    return float(level / 10.0 ** (within("snr_db", snr_db, -20.0, 200.0, closed="both", unit="dB") / 20.0))


@dataclass(frozen=True)
class SyntheticCamera:
    """The camera: sampling, optics, light and noise.

    ``frame_rate`` [Hz], ``pixel_size`` [m], ``shape`` (height, width) of the region [px]; ``exposure`` [s], half a frame
    unless given; ``bit_depth`` from 8 to 16; ``snr_db`` is 20 log10(contrast of the beam's edge / standard deviation of
    the pixel noise), infinite for no noise.  ``blur`` is the standard deviation [px] of the optics; a "gaussian" ``lens``
    has the edges that the tracker fits, a "disk" is out of focus and sees areas.  ``light`` changes by these shares from
    left to right and from top to bottom.

    Examples
    --------
    >>> from snapbeam import lab
    >>> lab.SyntheticCamera(frame_rate=20e3, shape=(160, 64)).exposure  # s
    2.5e-05
    """

    frame_rate: float = 10_000.0
    pixel_size: float = 12e-6
    shape: tuple[int, int] = (384, 384)
    exposure: float | None = None
    bit_depth: int = 12
    snr_db: float = 30.0
    blur: float = 0.8
    lens: str = "gaussian"
    light: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        rate = positive("frame_rate", self.frame_rate, "Hz")
        positive("pixel_size", self.pixel_size, "m")
        for name, pair in (("shape", self.shape), ("light", self.light)):
            if not isinstance(pair, (tuple, list)) or len(pair) != 2:
                raise InputError(f"{name} = {shown(pair)}: must be a pair of numbers")
        exposure = 0.5 / rate if self.exposure is None else self.exposure
        exposure = within("exposure", exposure, 0.0, 1.0 / rate * (1 + 1e-9), closed="right", unit="s")
        object.__setattr__(self, "exposure", exposure)
        integer("bit_depth", self.bit_depth, 8, 16)
        _noise(self.snr_db, 1.0)
        choice("lens", self.lens, ("gaussian", "disk"))
        within("blur", self.blur, 0.0, 20.0, closed="left", unit="px")
        for i in (0, 1):
            integer(f"shape[{i}]", self.shape[i], 16, 8192)
            within(f"light[{i}]", self.light[i], -1.0, 1.0)


@dataclass(frozen=True)
class SyntheticStage:
    """The scene: sizes in metres, grey levels from 0 (black) to 1 (saturated).

    ``marker_distance`` is from the tip to the sticker, ``marker_thickness`` its height along the motion; 0
    for no sticker.  ``slope`` is the beam's at the contact.  A dark beam before bright light is
    ``background`` above ``beam``.

    Examples
    --------
    >>> from snapbeam import lab
    >>> lab.SyntheticStage(shaker_width=0.4e-3, side="above").beam_thickness  # m
    0.0004
    """

    beam_thickness: float = 0.4e-3
    slope: float = 0.0
    tip_radius: float = 2.5e-3
    shaker_width: float = 2.0e-3
    marker_distance: float = 0.35e-3
    marker_thickness: float = 0.25e-3
    side: str = "below"
    background: float = 0.12
    beam: float = 0.72
    shaker: float = 0.66
    marker: float = 0.2

    def __post_init__(self) -> None:
        for name in ("beam_thickness", "tip_radius", "shaker_width"):
            positive(name, getattr(self, name), "m")
        for name in ("marker_distance", "marker_thickness"):
            nonnegative(name, getattr(self, name), "m")
        within("slope", self.slope, -1.0, 1.0)
        choice("side", self.side, SIDES)
        for name in ("background", "beam", "shaker", "marker"):
            within(name, getattr(self, name), 0.0, 1.0, closed="both")
        if self.beam == self.background:
            raise InputError(f"beam = {self.beam!r}: must differ from background = {self.background!r}")


# Every shape covers an exact share of each cell of a grid four times finer than the pixels, averaged over the
# exposure; the cells are spread by the lens and summed into pixels.  Nothing here knows of error functions, so a
# tracker that fits them is not tested against itself.


def covered(rows: Floats, height: int) -> Floats:
    """Change of coverage by cell, shape (height, columns), by what lies below *rows* (instants, columns; cells from the top)."""
    inside, columns = np.maximum(rows, 0.0), rows.shape[-1]
    at = np.floor(inside).astype(np.int64)
    share = at + 1.0 - inside
    total = np.zeros((height + 1) * columns)  # what lies below the last row is counted in one more, which is left out
    for k, part in ((at, share), (at + 1, 1.0 - share)):
        place = np.clip(k, 0, height) * columns + np.arange(columns)
        total += np.bincount(place.ravel(), part.ravel(), total.size)
    return np.asarray(total.reshape(height + 1, columns)[:height] / len(rows), dtype=np.float64)


@functools.cache
def disk_kernel(radius: float) -> NDArray[np.float32]:
    """A disk of *radius* cells, each cell weighted by the part of it inside, of sum 1."""
    reach = int(np.ceil(radius + 0.5))
    fine = (np.arange((2 * reach + 1) * 8) + 0.5) / 8.0 - reach - 0.5
    inside = (fine[:, None] ** 2 + fine[None, :] ** 2 <= radius * radius).astype(np.float64)
    kernel = inside.reshape(2 * reach + 1, 8, 2 * reach + 1, 8).sum((1, 3))
    if not kernel.sum() > 0.0:
        kernel[reach, reach] = 1.0
    return np.asarray(kernel / kernel.sum(), dtype=np.float32)


class Picture:
    """Draws the turned scene, shaker below, in turned pixels; columns are counted from the contact in the middle.

    The lens has a standard deviation of the camera's ``blur`` along each axis; so the radius of a disk of confusion is
    twice that.
    """

    def __init__(self, camera: SyntheticCamera, stage: SyntheticStage, texture: float = 0.0, seed: int = 0) -> None:
        with needing("a synthetic recording", "lab"):
            import cv2

        self.camera, self.stage = camera, stage
        self.height, self.width = camera.shape if stage.side in ("below", "above") else camera.shape[::-1]
        cell = camera.pixel_size / CELLS_PER_PIXEL
        self.thickness, self.upper = stage.beam_thickness / cell, stage.marker_distance / cell
        self.lower, radius = self.upper + stage.marker_thickness / cell, stage.tip_radius / cell
        self.margin = int(np.ceil(2.0 * camera.blur)) + 1
        columns, self.rows = ((size + 2 * self.margin) * CELLS_PER_PIXEL for size in (self.width, self.height))
        x = np.arange(columns) - 0.5 * (columns - 1)
        self.slope = stage.slope * x
        # of the rounded tip, below its apex
        self.profile = radius - np.sqrt(radius * radius - np.minimum(np.abs(x), radius) ** 2)
        self.rod = np.clip(0.5 * stage.shaker_width / cell - np.abs(x) + 0.5, 0.0, 1.0)
        self.grain: NDArray[np.float32] | None = None
        if texture:
            raw = np.random.default_rng([seed, 7]).standard_normal((2 * self.rows, columns)).astype(np.float32)
            size = 3 * CELLS_PER_PIXEL
            self.grain = 1.0 + 3.0 * CELLS_PER_PIXEL * texture * cv2.blur(raw, (size, size))

    def draw(self, beam: Floats, tip: Floats, *, blurred: bool) -> NDArray[np.float32]:
        """Light of one exposure without noise; rows of beam and tip as for :func:`render_recording`."""
        import cv2

        stage, rows = self.stage, self.rows
        # row r of a pixel's centre is the cell border (r + 1/2 + margin) CELLS_PER_PIXEL
        far = (beam + 0.5 + self.margin) * CELLS_PER_PIXEL - 0.5 * self.thickness
        top = (tip + 0.5 + self.margin) * CELLS_PER_PIXEL + 0.5 * self.thickness
        beam_rows, tips = far[:, None] + self.slope, top[:, None]
        light = (stage.beam - stage.background) * (covered(beam_rows, rows) - covered(beam_rows + self.thickness, rows))
        rod = np.zeros_like(light)
        seen = np.flatnonzero(self.rod)
        if seen.size:
            below, upper, lower = (
                covered(np.maximum(tips + from_tip, beam_rows[:, seen] + self.thickness), rows)
                for from_tip in (self.profile[seen], self.upper, self.lower)
            )
            mark = (stage.marker - stage.shaker) * (upper - lower)
            rod[:, seen] = self.rod[seen] * ((stage.shaker - stage.background) * below + mark)
        layers = [np.cumsum(layer, axis=0).astype(np.float32) for layer in (light, rod)]
        if self.grain is not None:  # which moves with what it is on
            for layer, rows_of in zip(layers, (far, top), strict=True):
                shift = round(float(rows_of.mean())) % rows
                layer *= self.grain[rows - shift : 2 * rows - shift]
        fine: NDArray[Any] = np.float32(stage.background) + layers[0] + layers[1]
        spread = CELLS_PER_PIXEL * (self.camera.blur + (4.0 if blurred else 0.0))
        if self.camera.lens == "disk":
            fine = cv2.filter2D(fine, -1, disk_kernel(2.0 * spread), borderType=cv2.BORDER_REPLICATE)
        else:
            size = 2 * math.ceil(4.0 * spread) + 1
            fine = cv2.GaussianBlur(fine, (size, size), spread, borderType=cv2.BORDER_REPLICATE)
        edge = self.margin * CELLS_PER_PIXEL
        cells = fine[edge:-edge, edge:-edge].reshape(self.height, CELLS_PER_PIXEL, self.width, CELLS_PER_PIXEL)
        return np.asarray(cells.mean((1, 3), dtype=np.float32))


@dataclass(frozen=True)
class Fixture:
    """A bar that crosses the picture and never moves.

    ``row`` of its middle in the turned picture and ``thickness`` [px], grey ``level`` from 0 to 1.
    """

    row: float
    thickness: float
    level: float

    def __post_init__(self) -> None:
        within("row", self.row, -1e4, 1e4, unit="px")
        positive("thickness", self.thickness, "px")
        within("level", self.level, 0.0, 1.0, closed="both")


@dataclass(frozen=True)
class Defects:
    """Departures from the ideal camera and scene.

    The numbers of frames with a reflection, with 4 px more blur, that repeat the frame before, that are black, or whose
    beam is hidden by something of the background's grey; the light of the reflection over full scale, and whether it
    spans all columns.  The grey level is light**``gamma``; ``gain`` is light over full scale, ``flicker`` its relative
    change at 100 Hz (mains), ``texture`` the relative unevenness of the surfaces, ``shot`` the standard deviation at full
    scale of noise that grows with the root of the light, ``fixture`` a bar that never moves, and ``drift`` the rows by
    which the picture has sunk at the end [px], evenly over time.

    Examples
    --------
    >>> from snapbeam import lab
    >>> defects = lab.Defects(repeated_frames=(10, 11), flicker=0.02)
    """

    glare_frames: Sequence[int] = ()
    blurred_frames: Sequence[int] = ()
    repeated_frames: Sequence[int] = ()
    blank_frames: Sequence[int] = ()
    hidden_frames: Sequence[int] = ()
    glare_strength: float = 4.0
    glare_wide: bool = False
    gamma: float = 1.0
    gain: float = 1.0
    flicker: float = 0.0
    texture: float = 0.0
    shot: float = 0.0
    fixture: Fixture | None = None
    drift: float = 0.0

    def __post_init__(self) -> None:
        positive("gamma", self.gamma)
        positive("gain", self.gain)
        for name in ("glare_strength", "flicker", "texture", "shot"):
            nonnegative(name, getattr(self, name))
        within("drift", self.drift, -1e3, 1e3, unit="px")

    def frames(self, count: int) -> dict[str, frozenset[int]]:
        """The spoiled frames by kind, of a recording of *count* frames."""
        chosen = {}
        for name in FRAME_LISTS:
            values = getattr(self, name)
            if isinstance(values, (str, int)):
                raise InputError(f"{name} = {shown(values)}: must be a list of frame numbers")
            chosen[name.removesuffix("_frames")] = frozenset(
                integer(f"{name}[{i}]", value, 0, count - 1) for i, value in enumerate(values)
            )
        return chosen


def with_fixture(light: NDArray[np.float32], fixture: Fixture, shift: float, blur: float) -> NDArray[np.float32]:
    """Lay a bar behind which nothing shows over a picture; *shift* [px] moves it with the camera.

    Its edges are ramps as wide as a disk of confusion of standard deviation *blur* [px].
    """
    within_pixel = (np.arange(_FINE) + 0.5) / _FINE - 0.5
    rows = np.arange(light.shape[0])[:, None] + within_pixel
    ramp = max(1.0, 2.0 * math.sqrt(3.0) * blur)
    inside = 0.5 * fixture.thickness - np.abs(rows - fixture.row - shift)
    cover = np.clip(0.5 + inside / ramp, 0.0, 1.0).mean(1).astype(np.float32)[:, None]
    return np.asarray(light * (1.0 - cover) + np.float32(fixture.level) * cover, dtype=np.float32)


def read_out(
    light: NDArray[np.float32],
    camera: SyntheticCamera,
    stage: SyntheticStage,
    defects: Defects,
    rng: np.random.Generator,
) -> NDArray[np.uint16]:
    """Grey levels of a picture of *light* (shares of full scale)."""
    light = light * np.float32(defects.gain)
    if noise := _noise(camera.snr_db, abs(stage.beam - stage.background)):
        light = light + np.float32(noise) * rng.standard_normal(light.shape, dtype=np.float32)
    if defects.shot:
        root = np.sqrt(np.clip(light, 0.0, None))
        light = light + np.float32(defects.shot) * root * rng.standard_normal(light.shape, dtype=np.float32)
    level = np.clip(light, 0.0, 1.0) ** np.float32(defects.gamma)
    return np.asarray(np.rint(level * (2**camera.bit_depth - 1)), dtype=np.uint16)


@dataclass(eq=False)
class SyntheticRecording:
    """Frames drawn on demand; made by :func:`render_recording`.

    ``truth`` has ``displacement_mm``, ``shaker_displacement_mm`` and ``penetration_mm`` over ``time``, means over each
    exposure, and ``disturbed``, 1 where a frame was spoiled on purpose.
    """

    camera: SyntheticCamera
    stage: SyntheticStage
    defects: Defects
    truth: xr.Dataset
    motion: tuple[Floats, Floats, Floats] = field(
        repr=False
    )  # instants [s], beam and tip towards the shaker's push [m]
    seed: int

    def __post_init__(self) -> None:
        self._picture = Picture(self.camera, self.stage, self.defects.texture, self.seed)
        self._spoiled = self.defects.frames(len(self))

    def __len__(self) -> int:
        return int(self.truth.sizes["time"])

    def frame(self, index: int) -> NDArray[np.uint16]:
        """One frame, integers (height, width)."""
        index = integer("index", index, 0, len(self) - 1)
        if index in self._spoiled["blank"]:
            return np.zeros(self.camera.shape, dtype=np.uint16)
        if index > 0 and index in self._spoiled["repeated"]:
            return self.frame(index - 1)
        rng = np.random.default_rng([self.seed, index])
        grey = read_out(self._light(index), self.camera, self.stage, self.defects, rng)
        grey = grey[::-1] if self.stage.side in ("above", "left") else grey
        return np.ascontiguousarray(grey.T if self.stage.side in ("left", "right") else grey)

    def _light(self, index: int) -> NDArray[np.float32]:
        """Light of one frame on the sensor, shares of full scale, shaker below."""
        defects, shape = self.defects, self._picture
        beam, tip = self._rows(index)
        shift = defects.drift * index / max(len(self) - 1, 1)
        if index in self._spoiled["hidden"]:
            beam = beam - 10.0 * shape.height
        light = self._picture.draw(beam + shift, tip + shift, blurred=index in self._spoiled["blurred"])
        if defects.fixture is not None:
            light = with_fixture(light, defects.fixture, shift, self.camera.blur)
        rows, columns = np.arange(shape.height)[:, None], np.arange(shape.width) - (shape.width - 1) / 2.0
        across, down = self.camera.light
        lamp = (1.0 + down * (rows / shape.height - 0.5)) * (1.0 + across * (columns / shape.width))
        light = light * lamp.astype(np.float32)
        if index in self._spoiled["glare"]:
            beside = 0.0 * columns if defects.glare_wide else columns / (0.3 * shape.width)
            about = ((rows - float(beam.mean())) / (0.12 * shape.height)) ** 2 + beside**2
            light = light + (defects.glare_strength * np.exp(-about)).astype(np.float32)
        if defects.flicker:
            turn = 2.0 * math.pi * 100.0 * index / self.camera.frame_rate
            light = light * np.float32(1.0 + defects.flicker * math.sin(turn))
        return light

    def _rows(self, index: int) -> list[Floats]:
        """Rows of the beam's middle and of the tip less half a thickness, at instants of one exposure."""
        size, exposure = self.camera.pixel_size, float(self.camera.exposure or 0.0)
        time, *moving = self.motion
        opened = float(time[0]) - self.truth.attrs["rest_frames"] / self.camera.frame_rate
        opened += index / self.camera.frame_rate
        ends = np.array([opened, opened + 0.5 * exposure, opened + exposure])
        travel = max(np.ptp(np.interp(ends, time, values)) for values in moving) / size
        count = int(np.clip(np.ceil(travel / 0.2), 4, 40))
        at = opened + exposure * (np.arange(count) + 0.5) / count
        return [self.truth.attrs["zero_row"] - np.interp(at, time, values) / size for values in moving]

    def __iter__(self) -> Iterator[NDArray[np.uint16]]:
        return (self.frame(index) for index in range(len(self)))

    def write(self, path: str | Path) -> Path:
        """Write the recording: ``.cihx`` (12-bit), ``.cih`` (16-bit), ``.avi`` or ``.mkv`` (8-bit).

        A Photron file of an 8-bit camera holds 8 bits, one of more than 12 bits holds 16.
        """
        path = Path(path)
        if path.suffix.lower() in (".avi", ".mkv"):
            return write_video(path, self, max_value=2**self.camera.bit_depth - 1)
        depth = self.camera.bit_depth
        stored = 8 if depth == 8 else 12 if depth <= 12 and path.suffix.lower() == ".cihx" else 16
        camera = self.camera
        scales: dict[str, Any] = {name: getattr(camera, name) for name in ("frame_rate", "pixel_size", "exposure")}
        comment = f"synthetic, seed {self.seed}"
        return write_photron(path, self, **scales, bit_depth=stored, effective_bits=depth, comment=comment)


def _means(time: Floats, motion: Floats, opened: Floats, exposure: float) -> Floats:
    """Means over exposures of a motion that is linear between its samples, at rest before, held after."""
    first, last = min(time[0], opened[0]) - exposure, max(time[-1], opened[-1]) + 2.0 * exposure
    integral = make_interp_spline([first, *time, last], np.pad(motion, 1, "edge"), 1).antiderivative()
    return np.asarray((integral(opened + exposure) - integral(opened)) / exposure)


def render_recording(
    time: ArrayLike,
    beam_displacement: ArrayLike,
    striker_displacement: ArrayLike,
    *,
    camera: SyntheticCamera | None = None,
    stage: SyntheticStage | None = None,
    defects: Defects | None = None,
    rest_frames: int = 10,
    zero_row: float | None = None,
    rng: int | np.random.Generator | None = 0,
    **spoiled: Any,
) -> SyntheticRecording:
    """Render the recording of a high-speed camera for a known motion.

    Parameters
    ----------
    time
        Instants [s], shape (samples,), strictly increasing; several to a frame, for the motion is taken as
        linear between them.
    beam_displacement, striker_displacement
        Displacement of the beam at the contact and of the shaker's tip [m], shape (samples,); they touch
        where equal.
    camera, stage
        The camera and the scene; the paper's camera at 384 x 384 pixels unless given.
    defects
        Simulated defects; none by default.
    rest_frames
        Frames before the motion begins, at the first displacement.
    zero_row
        Row of the middle of the beam at zero displacement, in the picture turned so that the shaker is below;
        chosen so that everything stays in the region unless given.
    rng
        Of the noise: a seed, a generator, which gives one, or None for one from the system.  Each frame's noise depends on the
        seed and its number only.
    **spoiled
        Fields of :class:`Defects`, such as ``blank_frames``, to change in *defects*.

    Returns
    -------
    SyntheticRecording
        Frames on demand, the truth, and :meth:`SyntheticRecording.write`.

    Raises
    ------
    InputError
        If arrays disagree or the scene does not fit in the region, with the number of rows it takes.

    Examples
    --------
    >>> import numpy as np
    >>> from snapbeam import lab
    >>> time = np.arange(60) / 10e3  # s
    >>> beam = -0.335e-3 * np.ones(60)  # m: at rest in the lower well
    >>> tip = -0.6e-3 + 0.1e-3 * np.sin(2 * np.pi * 100 * time)
    >>> camera, stage = lab.SyntheticCamera(shape=(160, 64)), lab.SyntheticStage(shaker_width=0.4e-3)
    >>> synthetic = lab.render_recording(time, beam, tip, camera=camera, stage=stage)
    >>> dict(synthetic.truth["displacement_mm"].sizes)
    {'time': 69}
    """
    camera = or_default("camera", camera, SyntheticCamera, "a SyntheticCamera")
    stage = or_default("stage", stage, SyntheticStage, "a SyntheticStage")
    for name in spoiled:
        choice("defect", name, tuple(one.name for one in dataclasses.fields(Defects)))
    defects = dataclasses.replace(or_default("defects", defects, Defects, "Defects"), **spoiled)
    instants = axis("time", time, -math.inf, math.inf)
    if instants.size < 2:
        raise InputError(f"time of {instants.size} sample: must hold at least 2")
    beam = finite_array("beam_displacement", beam_displacement, 1)
    shaker = finite_array("striker_displacement", striker_displacement, 1)
    for name, values in (("beam_displacement", beam), ("striker_displacement", shaker)):
        if values.size != instants.size:
            raise InputError(f"{name} of {values.size} samples: time has {instants.size}")
    rest = integer("rest_frames", rest_frames, 0)
    seed = seed_of(rng)
    sign = Orientation(stage.side, camera.shape).sign
    moving = (instants, sign * beam, sign * shaker)
    row = _fitting_row(camera, stage, *moving[1:]) if zero_row is None else finite("zero_row", zero_row)
    span, exposure = instants[-1] - instants[0], float(camera.exposure or 0.0)
    count = rest + math.floor((span - exposure) * camera.frame_rate + 1e-9) + 1
    if count <= rest:
        raise InputError(f"time spans {span:g} s: must hold at least one exposure")
    opened = float(instants[0]) + (np.arange(count) - rest) / camera.frame_rate
    at_beam, at_tip = (_means(instants, values, opened, exposure) for values in moving[1:])
    disturbed = np.zeros(count, dtype=np.int8)
    for frames in defects.frames(count).values():
        disturbed[list(frames)] = 1
    attrs: dict[str, Any] = {
        f"{kind}_{name}": list(value) if isinstance(value, tuple) else value
        for kind, one in (("camera", camera), ("stage", stage))
        for name, value in vars(one).items()
    }
    attrs |= {"rest_frames": rest, "zero_row": row, "seed": seed, "title": "truth of a synthetic recording"}
    truth = trajectory_dataset(np.arange(count) / camera.frame_rate, attrs=attrs)
    for name, motion, words in (
        ("displacement_mm", sign * at_beam, "beam displacement"),
        ("shaker_displacement_mm", sign * at_tip, "shaker displacement"),
        ("penetration_mm", at_tip - at_beam, "penetration"),
    ):
        truth[name] = ("time", 1e3 * motion, {"units": "mm", "long_name": f"{words}, mean over the exposure"})
    truth["disturbed"] = ("time", disturbed, {"units": "1", "long_name": "whether the frame was spoiled"})
    return SyntheticRecording(camera, stage, defects, truth, moving, seed)


def _fitting_row(camera: SyntheticCamera, stage: SyntheticStage, beam: Floats, shaker: Floats) -> float:
    """Row of zero displacement that centres what must be seen: beam, and sticker or tip."""
    size = camera.pixel_size
    height, width = camera.shape if stage.side in ("below", "above") else camera.shape[::-1]
    margin = 8.0 + 3.0 * camera.blur
    lean = abs(stage.slope) * width / 2.0
    above = beam.max() / size + 0.5 * stage.beam_thickness / size + lean + margin
    mark = stage.marker_distance + stage.marker_thickness if stage.marker_thickness > 0.0 else 8.0 * size
    below = max(
        -shaker.min() / size + (0.5 * stage.beam_thickness + mark) / size + margin,
        -beam.min() / size + 0.5 * stage.beam_thickness / size + lean + margin,
    )
    need = math.ceil(above + below)
    if need > height:
        raise InputError(
            f"shape = {camera.shape}: beam, shaker and their motion take {need} pixels along it; use a "
            f"taller region, larger pixels than {size * 1e6:g} um, or give zero_row"
        )
    return (height - 1) / 2.0 + 0.5 * (above - below)


def render_run(
    run: Any,
    *,
    camera: SyntheticCamera | None = None,
    stage: SyntheticStage | None = None,
    rng: int | np.random.Generator | None = 0,
    **options: Any,
) -> SyntheticRecording:
    """Render the recording of a high-speed camera for a simulated run, near the shaker.

    Parameters
    ----------
    run
        A run, or its dataset, with ``displacement_at_striker``, ``striker_displacement`` and the attribute
        ``length_scale``, the buckling level b [m].
    camera, stage, rng, **options
        As for :func:`render_recording`.  Unless a stage is given, its beam is as thick as the run's and the
        shaker is on the side of the run.

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import lab, paper
    >>> model = sb.ReducedModel.from_beam(paper.BEAM, modes=1, damping_ratio=0.005)
    >>> shaker = sb.Shaker(frequency_ratio=1.2, velocity_amplitude=0.18)
    >>> system = sb.System(model, contacts=[sb.Contact(paper.CONTACT, shaker)])
    >>> run = sb.simulate(system, sb.Integration(cycles=20))
    >>> synthetic = lab.render_run(run, camera=lab.SyntheticCamera(shape=(192, 64)))
    """
    dataset = check_trajectory(getattr(run, "dataset", run), ("displacement_at_striker", "striker_displacement"))
    attrs = dataset.attrs
    if "length_scale" not in attrs:
        raise InputError("run without the attribute length_scale: must say how many metres its unit b is")
    scale = positive("length_scale", attrs["length_scale"], "m")
    if stage is None:
        plain = SyntheticStage()
        thickness = attrs.get("beam_thickness", plain.beam_thickness)
        stage = SyntheticStage(side=attrs.get("side", plain.side), beam_thickness=thickness)
    recording = render_recording(
        dataset["time"].values,
        scale * dataset["displacement_at_striker"].values,
        scale * dataset["striker_displacement"].values,
        camera=camera,
        stage=stage,
        rng=rng,
        **options,
    )
    measured = ("displacement_mm", "shaker_displacement_mm", "penetration_mm")
    scaled = ("displacement_at_striker", "striker_displacement", "penetration_normalised")
    for name, values in zip(scaled, (recording.truth[one] for one in measured), strict=True):
        recording.truth[name] = ("time", values.values / (scale * 1e3), {**values.attrs, "units": "1"})
    recording.truth.attrs["buckling_level"] = scale
    return recording


def render_vibrometer(
    frequency: float,
    velocity_amplitude: float,
    *,
    duration: float,
    sampling_frequency: float = 20_000.0,
    onset: float = 0.1,
    start_up: float = 0.05,
    start_up_share: float = 0.4,
    phase: float = 0.0,
    distortion: float = 0.0,
    snr_db: float = 30.0,
    rng: int | np.random.Generator | None = 0,
) -> xr.DataArray:
    """Synthetic laser vibrometer signal of the shaker: rest, start-up transient, sine, and noise.

    From the onset t0 on the velocity is V [1 - s exp(-(t - t0)/T)] cos(omega (t - t0) + phase), with the
    share s and the time T of the start-up, and a second harmonic of relative size ``distortion``.

    Parameters
    ----------
    frequency, velocity_amplitude
        Of the steady motion [Hz], [m/s].
    duration, sampling_frequency
        Length [s] and rate [Hz] of the record.
    onset, start_up, start_up_share
        t0 [s], T [s] and s; 0 for a start-up that is over at once.
    phase, distortion
        Phase [rad] at the onset, and amplitude of the second harmonic over the first.
    snr_db
        20 log10(rms of the steady sine / standard deviation of the noise); infinite for none.
    rng
        Of the noise: a seed, a generator, which gives one, or None for one from the system.

    Returns
    -------
    xarray.DataArray
        The signal [m/s] with the truth in its attributes; write it with :func:`write_signal`.

    Examples
    --------
    >>> from snapbeam import lab
    >>> velocity = lab.render_vibrometer(100.0, 7e-3, duration=0.5)  # 100 Hz, 7 mm/s
    >>> velocity.attrs["units"]
    'm/s'
    """
    freq = positive("frequency", frequency, "Hz")
    amplitude = positive("velocity_amplitude", velocity_amplitude, "m/s")
    rate = positive("sampling_frequency", sampling_frequency, "Hz")
    if rate <= 4.0 * freq:
        raise InputError(f"sampling_frequency = {rate:g}: must be more than 4 times the frequency, {4 * freq:g} Hz")
    length = positive("duration", duration, "s")
    begin = within("onset", onset, 0.0, length, closed="left", unit="s")
    time_constant = nonnegative("start_up", start_up, "s")
    share = within("start_up_share", start_up_share, -1.0, 1.0, closed="both")
    second = within("distortion", distortion, 0.0, 1.0, closed="left")
    noise = _noise(snr_db, amplitude / math.sqrt(2.0))
    seed = seed_of(rng)
    time = np.arange(round(length * rate)) / rate
    since = np.maximum(time - begin, 0.0)
    envelope = 1.0 - share * np.exp(-since / time_constant) if time_constant > 0.0 else np.ones_like(since)
    angle = 2.0 * math.pi * freq * since + within("phase", phase, -1e6, 1e6, unit="rad")
    velocity = amplitude * envelope * (np.cos(angle) + second * np.cos(2.0 * angle)) * (time >= begin)
    truth = {
        "frequency": freq,
        "velocity_amplitude": amplitude,
        "onset": begin,
        "start_up": time_constant,
        "noise": noise,
    }
    attrs = {f"true_{name}": value for name, value in truth.items()} | {"seed": seed}
    values = velocity + noise * np.random.default_rng(seed).standard_normal(time.size)
    return make_signal(values, "m/s", rate, name="shaker velocity", attrs=attrs)
