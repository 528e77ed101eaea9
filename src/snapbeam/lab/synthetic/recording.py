"""A synthetic laboratory camera: what a recording of a known motion would look like, with the truth beside
it.

An ideal scene of a beam and a rounded shaker with a sticker is drawn as sharp edges, blurred by the optics,
integrated over each pixel and over the exposure, lit unevenly, spoiled as asked, and given noise and a finite
bit depth.  The optics are a Gaussian, as the tracker assumes, or a lens out of focus, as it does not.  The
truth is the mean of the displacement over each exposure, exactly, for motion that is linear between the given
samples.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.core.validate import InputError, axis, choice, finite, finite_array, instance, integer
from snapbeam.lab.camera.write import write_photron, write_video
from snapbeam.lab.synthetic.area import AreaPicture
from snapbeam.lab.synthetic.defects import Defects
from snapbeam.lab.synthetic.picture import GaussianPicture, glare_light, lamp_light
from snapbeam.lab.synthetic.sensor import read_out, with_fixture
from snapbeam.lab.synthetic.setup import SyntheticCamera, SyntheticStage
from snapbeam.lab.tracking.edges import Floats
from snapbeam.lab.tracking.geometry import Orientation
from snapbeam.runs.schema import trajectory_dataset

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Defects", "SyntheticCamera", "SyntheticRecording", "SyntheticStage", "render_recording"]


class SyntheticRecording:
    """Frames drawn on demand; made by :func:`render_recording`.

    Attributes
    ----------
    truth
        Dataset over ``time`` with ``displacement_mm``, ``shaker_displacement_mm`` and ``penetration_mm``,
        means over each exposure, and ``disturbed``, 1 where a frame was spoiled on purpose.
    """

    def __init__(
        self,
        camera: SyntheticCamera,
        stage: SyntheticStage,
        defects: Defects,
        truth: xr.Dataset,
        instants: _Instants,
        seed: int,
    ) -> None:
        self.camera = camera
        self.stage = stage
        self.defects = defects
        self.truth = truth
        self.seed = seed
        self._instants = instants
        self._turn = Orientation(stage.side, camera.shape)
        self._picture = (
            GaussianPicture(camera, stage)
            if camera.lens == "gaussian"
            else AreaPicture(camera, stage, defects.texture, seed)
        )
        shape = self._picture.outline
        self._lamp = lamp_light(camera, shape.height, shape.width)
        self._spoiled = defects.frames(len(self))

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
        return _turn_back(self._turn, grey)

    def _light(self, index: int) -> NDArray[np.float32]:
        """Light of one frame on the sensor, shares of full scale, shaker below."""
        defects, shape = self.defects, self._picture.outline
        beam, tip = self._instants.rows(index)
        shift = defects.drift * index / max(len(self) - 1, 1)
        if index in self._spoiled["hidden"]:
            beam = beam - 10.0 * shape.height
        light = self._picture.draw(beam + shift, tip + shift, blurred=index in self._spoiled["blurred"])
        if defects.fixture is not None:
            light = with_fixture(light, defects.fixture, shift, self.camera.blur)
        light = light * self._lamp
        if index in self._spoiled["glare"]:
            light = light + glare_light(
                shape.height, shape.width, float(beam.mean()), defects.glare_strength, defects.glare_wide
            )
        if defects.flicker:
            turn = 2.0 * math.pi * 100.0 * index / self.camera.frame_rate
            light = light * np.float32(1.0 + defects.flicker * math.sin(turn))
        return light

    def __iter__(self) -> Iterator[NDArray[np.uint16]]:
        for index in range(len(self)):
            yield self.frame(index)

    def write(self, path: str | Path) -> Path:
        """Write the recording: ``.cihx`` (12-bit), ``.cih`` (16-bit), ``.avi`` or ``.mkv`` (8-bit).

        A Photron file of an 8-bit camera holds 8 bits, one of more than 12 bits holds 16.
        """
        path = Path(path)
        if path.suffix.lower() in (".avi", ".mkv"):
            return write_video(path, self, max_value=2**self.camera.bit_depth - 1)
        depth = self.camera.bit_depth
        stored = 8 if depth == 8 else 12 if depth <= 12 and path.suffix.lower() == ".cihx" else 16
        return write_photron(
            path,
            self,
            frame_rate=self.camera.frame_rate,
            pixel_size=self.camera.pixel_size,
            exposure=self.camera.exposure,
            bit_depth=stored,
            effective_bits=depth,
            comment=f"synthetic, seed {self.seed}",
        )


class _Instants:
    """Rows of beam and tip at instants spread over each exposure, and their exact means."""

    def __init__(
        self,
        time: Floats,
        beam: Floats,
        shaker: Floats,
        camera: SyntheticCamera,
        start: float,
        zero_row: float,
    ) -> None:
        self.time, self.beam, self.shaker = time, beam, shaker
        self.camera, self.start, self.zero_row = camera, start, zero_row
        self.exposure = float(camera.exposure or 0.0)

    def means(self, opened: Floats) -> tuple[Floats, Floats]:
        """Mean displacements over the exposures that start at *opened*."""
        closed = opened + self.exposure
        out = []
        for values in (self.beam, self.shaker):
            total = np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(self.time))])
            gained = self._integral(closed, values, total) - self._integral(opened, values, total)
            out.append(gained / self.exposure)
        return out[0], out[1]

    def _integral(self, at: Floats, values: Floats, total: Floats) -> Floats:
        """Integral of the piecewise linear motion from its first sample; at rest before, held after."""
        inside = np.clip(at, self.time[0], self.time[-1])
        k = np.clip(np.searchsorted(self.time, inside, side="right") - 1, 0, self.time.size - 2)
        step = inside - self.time[k]
        slope = (values[k + 1] - values[k]) / (self.time[k + 1] - self.time[k])
        part = total[k] + step * (values[k] + 0.5 * slope * step)
        return (
            part
            + np.minimum(at - self.time[0], 0.0) * values[0]
            + np.maximum(at - self.time[-1], 0.0) * values[-1]
        )

    def rows(self, index: int) -> tuple[Floats, Floats]:
        """Rows of the beam's middle and of the tip less half a thickness, at instants of one exposure."""
        opened = self.start + index / self.camera.frame_rate
        ends = np.array([opened, opened + 0.5 * self.exposure, opened + self.exposure])
        size = self.camera.pixel_size
        travel = max(np.ptp(np.interp(ends, self.time, values)) for values in (self.beam, self.shaker)) / size
        count = int(np.clip(np.ceil(travel / 0.2), 4, 40))
        at = opened + self.exposure * (np.arange(count) + 0.5) / count
        beam = self.zero_row - np.interp(at, self.time, self.beam) / size
        return beam, self.zero_row - np.interp(at, self.time, self.shaker) / size


def _turn_back(turn: Orientation, picture: NDArray[np.uint16]) -> NDArray[np.uint16]:
    if turn.side in ("above", "left"):
        picture = picture[::-1]
    return np.ascontiguousarray(picture.T if turn.side in ("left", "right") else picture)


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
    seed: int = 0,
    **spoiled: Any,
) -> SyntheticRecording:
    """Draw what a high-speed camera would see of a known motion.

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
        What goes wrong; nothing unless given.
    rest_frames
        Frames before the motion begins, at the first displacement.
    zero_row
        Row of the middle of the beam at zero displacement, in the picture turned so that the shaker is below;
        chosen so that everything stays in the region unless given.
    seed
        Of the noise; each frame's noise depends on the seed and its number only.
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
    """
    for name, value, kind in (("camera", camera, SyntheticCamera), ("stage", stage, SyntheticStage)):
        if value is not None:
            instance(name, value, kind, f"a {kind.__name__}")
    if defects is not None:
        instance("defects", defects, Defects, "Defects")
    camera = SyntheticCamera() if camera is None else camera
    stage = SyntheticStage() if stage is None else stage
    known = [field.name for field in dataclasses.fields(Defects)]
    for name in spoiled:
        choice("defect", name, tuple(known))
    defects = dataclasses.replace(Defects() if defects is None else defects, **spoiled)
    instants = axis("time", time, -math.inf, math.inf)
    if instants.size < 2:
        raise InputError(f"time of {instants.size} sample: must hold at least 2")
    beam = finite_array("beam_displacement", beam_displacement, 1)
    shaker = finite_array("striker_displacement", striker_displacement, 1)
    for name, values in (("beam_displacement", beam), ("striker_displacement", shaker)):
        if values.size != instants.size:
            raise InputError(f"{name} of {values.size} samples: time has {instants.size}")
    rest = integer("rest_frames", rest_frames, 0)
    seed = integer("seed", seed, 0)
    sign = Orientation(stage.side, camera.shape).sign
    row = (
        _fitting_row(camera, stage, sign * beam, sign * shaker)
        if zero_row is None
        else finite("zero_row", zero_row)
    )
    span = instants[-1] - instants[0]
    count = rest + math.floor((span - float(camera.exposure or 0.0)) * camera.frame_rate + 1e-9) + 1
    if count <= rest:
        raise InputError(f"time spans {span:g} s: must hold at least one exposure")
    start = float(instants[0]) - rest / camera.frame_rate
    moving = _Instants(instants, sign * beam, sign * shaker, camera, start, row)
    means = moving.means(start + np.arange(count) / camera.frame_rate)
    disturbed = np.zeros(count, dtype=np.int8)
    for frames in defects.frames(count).values():
        disturbed[list(frames)] = 1
    truth = trajectory_dataset(
        np.arange(count) / camera.frame_rate, attrs=_attributes(camera, stage, rest, row, seed)
    )
    for name, motion, long_name in (
        ("displacement_mm", sign * means[0], "beam displacement, mean over the exposure"),
        ("shaker_displacement_mm", sign * means[1], "shaker displacement, mean over the exposure"),
        ("penetration_mm", means[1] - means[0], "penetration, mean over the exposure"),
    ):
        truth[name] = ("time", 1e3 * motion, {"units": "mm", "long_name": long_name})
    truth["disturbed"] = ("time", disturbed, {"units": "1", "long_name": "whether the frame was spoiled"})
    return SyntheticRecording(camera, stage, defects, truth, moving, seed)


def _attributes(
    camera: SyntheticCamera, stage: SyntheticStage, rest: int, row: float, seed: int
) -> dict[str, Any]:
    values = {f"camera_{name}": getattr(camera, name) for name in camera.__dataclass_fields__}
    values |= {f"stage_{name}": getattr(stage, name) for name in stage.__dataclass_fields__}
    plain = {name: list(value) if isinstance(value, tuple) else value for name, value in values.items()}
    return plain | {
        "rest_frames": rest,
        "zero_row": row,
        "seed": seed,
        "title": "truth of a synthetic recording",
    }


def _fitting_row(camera: SyntheticCamera, stage: SyntheticStage, beam: Floats, shaker: Floats) -> float:
    """Row of zero displacement that centres what must be seen: beam, and sticker or tip."""
    size = camera.pixel_size
    height = camera.shape[0] if stage.side in ("below", "above") else camera.shape[1]
    width = camera.shape[1] if stage.side in ("below", "above") else camera.shape[0]
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
