"""Scenes whose frames are changed after they are drawn: errors of camera, file and settings, and harmless oddities."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import random_scenes
from random_scenes import LEVEL, good_scene, motion
from scipy.ndimage import rotate

from snapbeam.lab import Defects, SyntheticCamera, SyntheticStage, open_recording, render_recording, track
from snapbeam.lab.camera import write_photron
from snapbeam.lab.tracking.settings import Orientation

ERRORS = (
    "white bar at the edge", "curved edge", "striker seldom seen", "one repeated frame",
    "every tenth lost", "every seventh a copy", "frames lost now and then", "rest in motion", "pixel size in inches",
    "pixel size ten percent off", "image lag", "pixel size ten times off", "gauge out of plane",
    "lamp pulse", "rotated camera", "swinging sticker", "tapered beam", "dropped bits", "rod at the border",
)  # fmt: skip
UNTOLD = ("sticker near a black tip",)
"""A sticker within some four pixels of a tip that is not seen may be taken for the tip without a message."""
SCALES = {
    "pixel size in inches": (25.4, 1.0 / 25.4), "pixel size ten percent off": (1.1, 1.0 / 1.1),
    "pixel size ten times off": (10.0, 0.1), "gauge out of plane": (1.015, 0.985), "gauge": (1.0,),
    "three rulers": (1.0,),
}  # fmt: skip
FAIR = ("gauge", "three rulers", "noise of rows", "fixed rows", "uneven light", "dark rod", "lossless")


def _rows(recording, frames):
    """Rows of the beam's near edge and of the sticker's lower end, in turned frames."""
    attrs = recording.truth.attrs
    size = recording.camera.pixel_size * 1e3
    sign = 1.0 if recording.stage.side in ("below", "left") else -1.0
    half = 0.5 * recording.stage.beam_thickness * 1e3 / size
    beam = attrs["zero_row"] - sign * recording.truth["displacement_mm"].values / size
    tip = attrs["zero_row"] - sign * recording.truth["shaker_displacement_mm"].values / size
    return beam + half, tip + half


def changed(kind, frames, recording, rng):
    """Turned *frames* with one thing done to them, and the numbers of the frames that they show."""
    count, height, width = frames.shape
    full = float(2**recording.camera.bit_depth - 1)
    stage = recording.stage
    shown = np.arange(count)
    noise = max(frames[:, :6].std(0).mean(), 0.3)
    rest = 30
    if kind == "white bar at the edge":
        level = full * stage.beam
        frames[:, : int(rng.integers(3, 9))] = level
        frames[:, :9] += noise * rng.standard_normal((count, 9, width))
    elif kind == "curved edge":
        bend = float(rng.choice([-1.0, 1.0])) * rng.uniform(0.001, 0.004)
        columns = np.arange(width)
        rows = np.arange(height)
        down = 0.5 * bend * (columns - (width - 1) / 2.0) ** 2
        near, _ = _rows(recording, frames)
        for k in range(count):
            share = np.clip(near[k] + 1.0 - rows, 0.0, 1.0)  # the beam bends, the shaker does not
            for c in columns:
                frames[k, :, c] = np.interp(rows - down[c] * share, rows, frames[k, :, c])
    elif kind == "striker seldom seen":
        near, _ = _rows(recording, frames)
        hidden = rng.random(count) < 0.9
        hidden[:rest] = False
        for k in np.flatnonzero(hidden):
            top, half = int(near[k]), 0.5 * stage.shaker_width / recording.camera.pixel_size
            rod = np.abs(np.arange(width) - (width - 1) / 2.0) < half  # oil hides the sticker and fills the gap
            level = full * (stage.beam if stage.marker_thickness == 0.0 else stage.shaker)
            frames[k, top:, rod] = level + noise * rng.standard_normal((rod.sum(), height - top))
    elif kind == "one repeated frame":
        at = int(rng.integers(rest, count - 5))
        shown[at] = at - 1
    elif kind == "every seventh a copy":
        shown[rest::7] -= 1
    elif kind == "every tenth lost":
        shown = np.delete(shown, np.arange(rest, count, 10))
    elif kind == "frames lost now and then":
        shown = np.delete(shown, rng.choice(np.arange(rest, count - 5), 3, replace=False))
    elif kind == "image lag":
        share = rng.uniform(0.1, 0.3)
        grain = noise * rng.standard_normal(frames.shape)
        for k in range(1, count):
            frames[k] = (1.0 - share) * frames[k] + share * frames[k - 1]
        frames += grain
    elif kind == "rotated camera":
        angle = float(rng.choice([-1.0, 1.0])) * rng.uniform(2.0, 5.0)
        frames = np.stack([rotate(one, angle, reshape=False, order=3, mode="nearest") for one in frames])
        frames += noise * rng.standard_normal(frames.shape)
    elif kind == "swinging sticker":
        size, half = recording.camera.pixel_size, 0.5 * stage.shaker_width / recording.camera.pixel_size
        rows = np.arange(height)
        rod = np.flatnonzero(np.abs(np.arange(width) - (width - 1) / 2.0) < half)
        swing = rng.uniform(0.5, 2.0) * np.sin(2.0 * np.pi * np.arange(count) / rng.uniform(8.0, 30.0))
        swing[:rest] = 0.0
        _, tip = _rows(recording, frames)
        for k in range(count):
            first = tip[k] + 0.5 * stage.marker_distance / size
            share = np.clip((rows - first) / (0.4 * stage.marker_distance / size), 0.0, 1.0)
            for c in rod:
                frames[k, :, c] = np.interp(rows - swing[k] * share, rows, frames[k, :, c])
    elif kind == "tapered beam":
        near, tip = _rows(recording, frames)
        rows, taper = np.arange(height), float(rng.choice([-1.0, 1.0])) * rng.uniform(0.01, 0.03)
        for k in range(count):  # the near edge leans, the far one does not, nor the rod beyond half of its gap
            share = np.clip((rows - near[k] + 0.6 * stage.beam_thickness / recording.camera.pixel_size) / 4.0, 0, 1)
            over_rod = np.minimum(share, np.clip(2.0 * (tip[k] - rows) / max(tip[k] - near[k], 1e-3), 0.0, 1.0))
            for c in range(width):
                x = c - (width - 1) / 2.0
                rod = abs(x) * recording.camera.pixel_size <= 0.5 * stage.shaker_width
                frames[k, :, c] = np.interp(rows - taper * x * (over_rod if rod else share), rows, frames[k, :, c])
        frames = frames[:, :, : -int(rng.integers(8, 12))]
    elif kind == "dropped bits":
        step = 2.0 ** np.floor(np.log2(full * abs(stage.beam - stage.background) / rng.uniform(6.0, 12.0)))
        frames = np.floor(np.clip(frames, 0, full) / step) * step
    elif kind == "rod at the border":
        half = 0.5 * stage.shaker_width / recording.camera.pixel_size
        cut = int((width - 1) / 2.0 + rng.uniform(-0.2, 0.5) * half)
        frames = frames[:, :, :cut]
    elif kind == "noise of rows":
        frames += rng.uniform(0.003, 0.008) * full * rng.standard_normal((count, height, 1))
    elif kind == "fixed rows":
        frames += 0.006 * full * rng.standard_normal((height, 1))
    if kind in ("one repeated frame", "every seventh a copy"):  # the copy is encoded by itself
        frames = frames[shown] + 0.3 * noise * (shown != np.arange(count))[:, None, None] * rng.standard_normal(
            frames.shape
        )
        shown = np.arange(count)
    elif shown.size < count:
        frames = frames[shown]
    return np.clip(np.rint(frames), 0, full).astype(np.uint16)


def prepared(kind, rng):
    """A good scene in which *kind* can be seen, and by how much the pixel size is off."""
    scene, scale = good_scene(rng), 1.0
    dark = scene.stage["background"] > scene.stage["beam"]
    if kind == "sticker near a black tip":
        scene.stage |= {
            "shaker": scene.stage["background"], "marker": scene.stage["beam"], "shaker_width": 0.7e-3,
            "marker_thickness": 0.25e-3, "tip_radius": 2.5e-3,
            "marker_distance": rng.uniform(1.5, 6.0) * scene.camera["pixel_size"],
        }  # fmt: skip
    elif kind == "rest in motion":
        scene.rest_frames, scene.skip = 0, int(rng.integers(25, 60))
        first = int(rng.integers(0, 20))
        scene.settings["rest_frames"] = int(rng.integers(1, 4)) if rng.random() < 0.6 else (first, first + 2)
    elif kind in SCALES:
        scene.settings["beam_thickness"] = 0.4e-3 * (1.0 + 0.01 * rng.standard_normal())
        scale = float(rng.choice(SCALES[kind])) if len(SCALES[kind]) > 1 else 1.0
        if kind in ("gauge out of plane", "three rulers", "pixel size ten times off"):
            scene.settings["tip_diameter"] = scene.stage["shaker_width"] * (1.0 + 0.01 * rng.standard_normal())
            scene.cycles = rng.uniform(6.0, 10.0)
    elif kind == "lamp pulse":
        scene.camera["exposure"] = 0.9 / scene.camera["frame_rate"]
    elif kind == "swinging sticker":
        scene.stage |= {"shaker_width": rng.uniform(0.5e-3, 0.8e-3), "tip_radius": 2.5e-3, "marker_thickness": 0.25e-3}
        scene.stage["marker_distance"] = 0.35e-3
    elif kind == "uneven light":
        scene.camera["light"] = (rng.uniform(0.3, 0.6), rng.uniform(-0.5, 0.5))
    elif kind == "dark rod" and not dark:
        scene.stage["shaker"] = 0.5 * (scene.stage["background"] + scene.stage["beam"])
    if kind == "lossless":
        scene.camera["bit_depth"] = 8
    return scene, scale


def _lossless(path, frames):
    import imageio_ffmpeg

    height, width = frames.shape[1:]
    writer = imageio_ffmpeg.write_frames(
        str(path), (width, height), fps=25, quality=None, codec="libx264", output_params=["-qp", "0", "-pix_fmt", "gray"],
        macro_block_size=2, pix_fmt_in="gray", ffmpeg_log_level="error",
    )  # fmt: skip
    writer.send(None)
    for frame in frames:
        writer.send(np.ascontiguousarray(frame.astype(np.uint8)))
    writer.close()


def measured(kind, rng, folder, **asked):
    """Draw, change, write, read and track a scene; the tracked dataset and the truth."""
    scene, scale = prepared(kind, rng)
    camera, stage = SyntheticCamera(**scene.camera), SyntheticStage(**scene.stage)
    sign = 1.0 if stage.side in ("below", "left") else -1.0
    time, beam, shaker = motion(rng, camera.pixel_size, camera.frame_rate, scene.cycles)
    if scene.cycles:
        scene.settings["drive_amplitude"] = 0.5 * np.ptp(shaker) * (1.0 + 0.002 * rng.standard_normal())
    first = int(scene.skip * 40)
    recording = render_recording(
        time[first:] - time[first], sign * beam[first:], sign * shaker[first:], camera=camera, stage=stage,
        defects=Defects(**scene.defects), rest_frames=scene.rest_frames, rng=int(rng.integers(2**31)),
    )  # fmt: skip
    turn = Orientation(stage.side, camera.shape)
    shown = recording
    if kind == "lamp pulse":  # the light of the last tenth of an exposure of 0.9 frames
        late = [np.interp(time + 0.81 / camera.frame_rate, time, one) for one in (beam, shaker)]
        late[0][0], late[1][0] = beam[0], shaker[0]  # the rest before is drawn from the first value
        shown = render_recording(
            time, *(sign * one for one in late), camera=dataclasses.replace(camera, exposure=0.09 / camera.frame_rate),
            stage=stage, defects=Defects(**scene.defects), rest_frames=scene.rest_frames, rng=1,
            zero_row=recording.truth.attrs["zero_row"],
        )  # fmt: skip
    frames = turn.turn(np.stack(list(shown)[: len(recording)]).astype(np.float64)).copy()
    frames = changed(kind, frames, recording, rng)
    if stage.side in ("above", "left"):
        frames = frames[:, ::-1]
    if stage.side in ("left", "right"):
        frames = frames.transpose(0, 2, 1)
    if kind == "lossless":
        path = Path(folder) / "scene.mp4"
        _lossless(path, frames)
    else:
        stored = 8 if camera.bit_depth == 8 else 12 if camera.bit_depth <= 12 else 16
        path = write_photron(
            Path(folder) / "scene.cihx", list(np.ascontiguousarray(frames)), frame_rate=camera.frame_rate,
            pixel_size=camera.pixel_size * scale, exposure=camera.exposure, bit_depth=stored,
            effective_bits=camera.bit_depth,
        )  # fmt: skip
    settings = {"rest_displacement": -sign * LEVEL, "side": stage.side, **scene.settings, **asked}
    with open_recording(path, frame_rate=camera.frame_rate, pixel_size=camera.pixel_size * scale) as opened:
        return track(opened, **settings), recording


def judged(kind, rng, folder):
    """The outcome of a scene."""
    return random_scenes.outcome(lambda: measured(kind, rng, folder))
