"""Scenes drawn at random, good ones and ones with one thing wrong, and how far off a measurement of them is."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from snapbeam import InputError
from snapbeam.lab import Defects, SyntheticCamera, SyntheticStage, open_recording, render_recording, track
from snapbeam.lab.synthetic import Fixture
from snapbeam.util.diagnostics import diagnostics_of, doubtful

LEVEL = 0.335e-3

DEFECTS = (
    "gamma",
    "overexposed",
    "glare",
    "hidden",
    "camera faults",
    "blurred",
    "begins in motion",
    "fixture",
    "dark shaker, bright sticker",
    "shaker in view, not followed",
    "lossy video",
    "twelve bits in sixteen",
    "sticker taken for the tip",
    "wrong thickness",
)


ORDER_DEFECTS = ("frames exchanged", "frame copied", "uneven trigger", "recordings joined", "camera knocked")


@dataclass
class Scene:
    """What is needed to draw a scene and to track it."""

    camera: dict = field(default_factory=dict)
    stage: dict = field(default_factory=dict)
    defects: dict = field(default_factory=dict)
    settings: dict = field(default_factory=dict)
    rest_frames: int = 24
    skip: int = 0
    name: str = "scene.cihx"
    cycles: float = 0.0
    order: str = ""


@dataclass
class Outcome:
    """How a scene came out: the worst error in standard errors, the worst error in pixels, what was said."""

    ratio: float
    error_px: float
    codes: tuple[str, ...]
    refusal: str = ""
    unmeasured: float = 0.0

    @property
    def flagged(self) -> bool:
        return bool(self.codes) or bool(self.refusal)


def motion(rng, pixel, rate, cycles=0.0):
    """A beam struck again and again: it rides on the shaker for a while and flies off in between.

    With *cycles* the shaker makes so many of them.
    """
    contact, flight = rng.uniform(4.5, 9.0) / rate, rng.uniform(35.0, 60.0) / rate
    period, count = contact + flight, int(rng.integers(3, 5))
    time = np.arange(round((count * period + 0.5 * contact) * rate * 40)) / (rate * 40)
    period_of_drive = rng.uniform(2.1, 3.5) * period
    if cycles:
        period_of_drive = time[-1] / cycles
    shaker = -LEVEL + rng.uniform(3.0, 7.0) * pixel * np.sin(2.0 * np.pi * time / period_of_drive)
    share = np.clip((np.mod(time, period) - contact) / flight, 0.0, 1.0)
    return time, shaker + 4.0 * rng.uniform(7.0, 12.0) * pixel * share * (1.0 - share), shaker


def good_scene(rng):
    """A scene as the documentation asks for."""
    upright = rng.random() < 0.7
    side = rng.choice(["below", "above"] if upright else ["left", "right"])
    pixel, rate = rng.uniform(16e-6, 28e-6), 5000.0
    dark = rng.random() < 0.25
    sticker = rng.random() < 0.7
    levels = (
        {
            "background": rng.uniform(0.7, 0.85),
            "beam": rng.uniform(0.1, 0.2),
            "shaker": rng.uniform(0.1, 0.25),
            "marker": 0.65,
        }
        if dark
        else {
            "background": rng.uniform(0.06, 0.2),
            "beam": rng.uniform(0.55, 0.8),
            "shaker": rng.uniform(0.5, 0.75),
            "marker": 0.15,
        }
    )
    camera = {
        "frame_rate": rate,
        "pixel_size": pixel,
        "shape": (152, 80) if upright else (80, 152),
        "exposure": rng.uniform(0.2, 0.9) / rate,
        "bit_depth": int(rng.choice([8, 10, 12, 14])),
        "snr_db": rng.uniform(22.0, 42.0),
        "blur": rng.uniform(0.5, 1.4),
        "lens": rng.choice(["disk", "gaussian"], p=[0.8, 0.2]),
        "light": (rng.uniform(-0.2, 0.2), rng.uniform(-0.15, 0.15)),
    }
    stage = {
        "side": str(side),
        "slope": rng.uniform(-0.03, 0.03),
        "shaker_width": (rng.uniform(0.5e-3, 0.8e-3) if sticker else 1.0e-3),
        "tip_radius": (2.5e-3 if sticker else rng.uniform(0.6e-3, 0.8e-3)),
        "marker_thickness": (0.25e-3 if sticker else 0.0),
        "beam_thickness": 0.4e-3,
        **levels,
    }
    defects = {"flicker": rng.uniform(0.0, 0.05), "texture": rng.uniform(0.0, 0.03), "shot": rng.uniform(0.0, 0.01)}
    return Scene(camera=camera, stage=stage, defects=defects)


def spoiled_scene(rng, kind):
    """A good scene with one thing wrong."""
    scene = good_scene(rng)
    if kind in ORDER_DEFECTS or kind == "long":
        scene.cycles, scene.order = rng.uniform(6.0, 10.0), kind
        return scene
    frames = sorted({int(k) for k in rng.integers(30, 130, 25)})
    dark = scene.stage["background"] > scene.stage["beam"]
    if kind == "gamma":
        scene.defects["gamma"] = float(rng.choice([rng.uniform(0.4, 0.75), rng.uniform(1.35, 2.4)]))
    elif kind == "overexposed":
        scene.defects["gain"] = rng.uniform(1.3, 2.6) / max(scene.stage["beam"], scene.stage["background"])
    elif kind == "glare":
        scene.defects |= {
            "glare_frames": tuple(range(40, int(rng.integers(60, 130)))),
            "glare_strength": float(np.exp(rng.uniform(np.log(0.1), np.log(4.0)))),
            "glare_wide": bool(rng.random() < 0.5),
        }
    elif kind == "hidden":
        scene.defects["hidden_frames"] = tuple(frames)
    elif kind == "camera faults":
        scene.defects |= {"blank_frames": tuple(frames[:8]), "repeated_frames": tuple(frames[8:16])}
    elif kind == "blurred":
        scene.defects["blurred_frames"] = tuple(frames)
    elif kind == "begins in motion":
        scene.rest_frames, scene.skip = 0, int(rng.integers(25, 60))
    elif kind == "fixture":
        level = 0.15 if dark else 0.8
        scene.defects["fixture"] = Fixture(rng.uniform(8.0, 14.0), rng.uniform(4.0, 8.0), level)
        scene.camera["shape"] = (190, 80) if scene.camera["shape"][0] > 100 else (80, 190)
    elif kind == "dark shaker, bright sticker":
        scene.stage |= {
            "shaker": scene.stage["background"],
            "marker": scene.stage["beam"],
            "marker_thickness": 0.25e-3,
            "marker_distance": rng.uniform(0.25e-3, 0.45e-3),
            "shaker_width": 0.7e-3,
        }
        scene.camera["shape"] = (190, 80) if scene.camera["shape"][0] > 100 else (80, 190)
    elif kind == "shaker in view, not followed":
        scene.settings["shaker"] = False
    elif kind == "lossy video":
        scene.name = "scene.mp4"
    elif kind == "twelve bits in sixteen":
        scene.camera["bit_depth"] = 12
        scene.defects["gain"] = rng.uniform(1.3, 2.2) / max(scene.stage["beam"], scene.stage["background"])
        scene.name = "scene.tif"
    elif kind == "sticker taken for the tip":
        scene.stage |= {"marker_thickness": 0.25e-3, "shaker": scene.stage["background"], "marker": scene.stage["beam"]}
        scene.stage |= {"shaker_width": 0.7e-3, "marker_distance": rng.uniform(0.2e-3, 0.45e-3)}
        scene.settings["marker"] = False
        scene.camera["shape"] = (190, 80) if scene.camera["shape"][0] > 100 else (80, 190)
    elif kind == "wrong thickness":
        scene.settings["beam_thickness"] = 0.4e-3 * float(rng.choice([0.75, 1.3]))
    return scene


def write(recording, path):
    """Write a recording by the suffix of *path*: Photron, lossy video, or TIFF of 16 bits."""
    if path.suffix == ".tif":
        import tifffile

        with tifffile.TiffWriter(path) as file:
            for frame in recording:
                file.write(frame.astype(np.uint16), contiguous=True)
        return path
    if path.suffix == ".mp4":
        import imageio_ffmpeg

        height, width = recording.camera.shape
        writer = imageio_ffmpeg.write_frames(
            str(path), (width, height), fps=25, codec="libx264", quality=7, macro_block_size=2, pix_fmt_in="gray",
            ffmpeg_log_level="error",
        )  # fmt: skip
        writer.send(None)
        for frame in recording:
            writer.send(np.ascontiguousarray((frame >> max(recording.camera.bit_depth - 8, 0)).astype(np.uint8)))
        writer.close()
        return path
    return recording.write(path)


def measured(scene, folder, rng):
    """Draw, write, read and track a scene; the tracked dataset (or the refusal) and the truth."""
    camera, stage = SyntheticCamera(**scene.camera), SyntheticStage(**scene.stage)
    sign = 1.0 if stage.side in ("below", "left") else -1.0
    time, beam, shaker = motion(rng, camera.pixel_size, camera.frame_rate, scene.cycles)
    first = int(scene.skip * 40)
    if scene.order in ("uneven trigger", "recordings joined"):
        taken = time.copy()
        middle = time.size // 2
        if scene.order == "recordings joined":
            taken[middle:] += rng.uniform(3.0, 8.0) / camera.frame_rate
        else:
            knots = np.arange(0.0, time[-1] + 1.0 / camera.frame_rate, 1.0 / camera.frame_rate)
            taken += np.interp(time, knots, rng.normal(0.0, 0.3 / camera.frame_rate, knots.size))
        beam, shaker = np.interp(taken, time, beam), np.interp(taken, time, shaker)
    recording = render_recording(
        time[first:] - time[first], sign * beam[first:], sign * shaker[first:], camera=camera, stage=stage,
        defects=Defects(**scene.defects), rest_frames=scene.rest_frames, rng=int(rng.integers(2**31)),
    )  # fmt: skip
    path = write(_reordered(recording, scene.order, rng), Path(folder) / scene.name)
    rest = -sign * LEVEL  # what a person knows of the beam at rest
    with open_recording(path, frame_rate=camera.frame_rate, pixel_size=camera.pixel_size) as opened:
        settings = {"rest_displacement": rest, "side": stage.side, **scene.settings}
        return track(opened, **settings), recording


def _reordered(recording, kind, rng):
    """A recording with its frames in another order, or of a camera that was knocked."""
    half = len(recording) // 2
    k = int(rng.integers(min(60, half), max(len(recording) - 40, half + 1)))
    k += int(np.argmax(np.abs(np.diff(recording.truth["shaker_displacement_mm"].values[k : k + 30]))))
    as_taken, shift = recording.frame, int(rng.integers(1, 5))

    def frame(index):
        if kind == "frames exchanged":
            return as_taken({k: k + 1, k + 1: k}.get(index, index))
        if kind == "frame copied" and index == k:
            before = as_taken(k - 1)
            return np.clip(before + rng.integers(0, 3, before.shape), 1, before.max()).astype(np.uint16)
        if kind == "camera knocked" and index >= k:
            return np.roll(as_taken(index), shift, axis=int(recording.camera.shape[1] > recording.camera.shape[0]))
        return as_taken(index)

    if kind in ORDER_DEFECTS:
        object.__setattr__(recording, "frame", frame)
    return recording


def judged(scene, folder, rng):
    """The outcome of a scene."""
    return outcome(lambda: measured(scene, folder, rng))


def outcome(measure):
    """The outcome of what *measure* tracks, beside the truth that it returns too."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        try:
            tracked, recording = measure()
        except InputError as error:
            return Outcome(0.0, 0.0, (), str(error))
    worst, far, lost = 0.0, 0.0, 0.0
    pixel = recording.camera.pixel_size * 1e3
    count = min(tracked.sizes["time"], len(recording))
    for name, error in (("displacement_mm", "displacement_stderr_mm"), ("shaker_displacement_mm", "shaker_stderr_mm")):
        if name not in tracked:
            continue
        miss = tracked[name].values[:count] - recording.truth[name].values[:count]
        known = np.isfinite(miss)
        if not known.any():
            continue
        ratio = np.abs(miss[known]) / tracked[error].values[:count][known]
        worst, far = max(worst, float(ratio.max())), max(far, float(np.abs(miss[known]).max() / pixel))
        lost = max(lost, 1.0 - float(known.mean()))
    return Outcome(worst, far, tuple(one.code for one in doubtful(diagnostics_of(tracked))), "", lost)
