"""Mistakes in front of the camera and in it."""

from __future__ import annotations

import itertools

import numpy as np
from lab_waveforms import BUCKLING_LEVEL, FRAME_RATE, PIXEL, impacts
from random_scenes import write

from snapbeam.lab import Defects, SyntheticCamera, SyntheticStage, open_recording, render_recording, track
from snapbeam.lab.synthetic import Fixture
from snapbeam.util.diagnostics import diagnostics_of

from .case import Case, Outcome, off

CAMERA = {"frame_rate": FRAME_RATE, "pixel_size": PIXEL, "shape": (160, 96), "lens": "disk"}
TALL = {"shape": (192, 96)}
DARK = {"shaker": 0.12, "background": 0.12, "marker": 0.9, "marker_distance": 0.35e-3}
STICKER = "Sticker and striker"
SCENE = "Something else in view"
LIGHT = "Light and curve of the camera"
REST = "Recording that begins in motion"
AFTERWARDS = "Pictures that were changed after they were taken"


def scene(
    folder, *, camera=None, stage=None, defects=None, motion=None, rest=24, name="scene.cihx", opened=None, **settings
):
    """Draw a scene with a lens that is not the tracker's, write, read and track it."""
    time, beam, shaker, *_ = impacts(4) if motion is None else motion
    drawn = render_recording(
        time,
        beam,
        shaker,
        camera=SyntheticCamera(**(CAMERA | (camera or {}))),
        stage=SyntheticStage(**({"shaker_width": 0.8e-3} | (stage or {}))),
        defects=Defects(**(defects or {})),
        rest_frames=rest,
    )
    path = write(drawn, folder / name)
    at_rest = {"rest_displacement": -BUCKLING_LEVEL} | settings
    with open_recording(path, **({"frame_rate": FRAME_RATE, "pixel_size": PIXEL} | (opened or {}))) as recording:
        tracked = track(recording, **at_rest)
    truth, ratio = drawn.truth, 0.0
    for value, error in (("displacement_mm", "displacement_stderr_mm"), ("shaker_displacement_mm", "shaker_stderr_mm")):
        if value in tracked:
            ratio = max(ratio, off(tracked[value], truth[value].values, tracked[error].values))
    return Outcome(tuple(diagnostics_of(tracked)), "", ratio)


def changed(change):
    """A scene whose frames a camera's noise reduction or a program has changed."""

    def look(folder):
        time, beam, shaker, *_ = impacts(4)
        drawn = render_recording(
            time, beam, shaker, camera=SyntheticCamera(**CAMERA), stage=SyntheticStage(shaker_width=0.8e-3),
            rest_frames=24,
        )  # fmt: skip
        frames = np.stack(list(drawn)).astype(np.float64)
        whole, pixel = change(frames)
        np.save(folder / "changed.npy", whole)
        with open_recording(folder / "changed.npy", frame_rate=FRAME_RATE, pixel_size=pixel) as recording:
            tracked = track(recording, rest_displacement=-BUCKLING_LEVEL)
        ratio = 0.0
        for value, error in (("displacement_mm", "displacement_stderr_mm"),
                             ("shaker_displacement_mm", "shaker_stderr_mm")):  # fmt: skip
            ratio = max(ratio, off(tracked[value], drawn.truth[value].values, tracked[error].values))
        assert ratio < 5.0, ratio
        return Outcome(tuple(diagnostics_of(tracked)), "", ratio)

    return look


def blended(frames):
    """Each frame the mean of itself and the one before, as programs that change the frame rate make them."""
    frames[1:] = 0.5 * (frames[1:] + frames[:-1])
    return np.rint(frames).astype(np.uint16), PIXEL


def denoised(frames):
    """Noise reduction in time: four tenths of the frame before are kept."""
    for before, after in itertools.pairwise(frames):
        after[:] = 0.6 * after + 0.4 * before
    return np.rint(frames).astype(np.uint16), PIXEL


def enlarged(frames):
    """Twice as many pixels, each between two that were taken."""
    for axis in (1, 2):
        after = np.concatenate([frames.take(range(1, frames.shape[axis]), axis), frames.take([-1], axis)], axis)
        frames = np.stack([frames, 0.5 * (frames + after)], axis + 1)
        shape = list(frames.shape)
        frames = frames.reshape(*shape[:axis], -1, *shape[axis + 2 :])
    return np.rint(frames).astype(np.uint16), 0.5 * PIXEL


def dim(frames):
    """So little light that the beam stands out by a few grey levels."""
    return (frames // 640).astype(np.uint8), PIXEL


def begun_late():
    """The motion from its middle on."""
    time, beam, shaker, *_ = impacts(4)
    first = int(np.searchsorted(time, 0.0105))
    return time[first:] - time[first], beam[first:], shaker[first:]


def sharpened(amount):
    """Edges enhanced by the camera: what a blur of a pixel takes away is added *amount* times."""

    def change(frames):
        from scipy.ndimage import gaussian_filter

        blurred = gaussian_filter(frames, (0.0, 1.0, 1.0))
        return np.clip(np.rint(frames + amount * (frames - blurred)), 0, 4095).astype(np.uint16), PIXEL

    return change


def fields(folder, make):
    """Interlaced video: odd rows of half a frame later, made frames by *make*; held against each field's own time."""
    time, beam, shaker, *_ = impacts(4)
    half = round(0.5 / FRAME_RATE / (time[1] - time[0]))
    drawn, later = (
        render_recording(
            time,
            np.concatenate([np.full(wait, beam[0]), beam])[: time.size],
            np.concatenate([np.full(wait, shaker[0]), shaker])[: time.size],
            camera=SyntheticCamera(**CAMERA),
            stage=SyntheticStage(shaker_width=0.8e-3),
            rest_frames=24,
            rng=wait,
        )
        for wait in (half, 0)
    )
    frames, instants = make(np.stack(list(drawn)), np.stack(list(later)))
    np.save(folder / "fields.npy", frames)
    with open_recording(folder / "fields.npy", frame_rate=FRAME_RATE, pixel_size=PIXEL) as recording:
        tracked = track(recording, rest_displacement=-BUCKLING_LEVEL)
    ratio = 0.0
    for value, error in (("displacement_mm", "displacement_stderr_mm"),
                         ("shaker_displacement_mm", "shaker_stderr_mm")):  # fmt: skip
        true = drawn.truth[value].values
        if instants == 2:
            true = np.stack([true, later.truth[value].values], 1).ravel()
        ratio = max(ratio, off(tracked[value], true, tracked[error].values))
    assert ratio < 5.0, ratio
    return Outcome(tuple(diagnostics_of(tracked)), "", ratio)


def woven(first, second):
    """Frames that hold the even rows of the first instant and the odd ones of the second."""
    first[:, 1::2] = second[:, 1::2]
    return first, 1


def doubled(first, second):
    """A frame for each field, each of its rows twice."""
    pairs = zip(first, second, strict=True)
    return np.stack([np.repeat(one, 2, axis=0) for a, b in pairs for one in (a[0::2], b[1::2])]), 2


def between(first, second):
    """A frame for each field, the rows between made of their neighbours."""
    out = []
    for a, b in zip(first.astype(float), second.astype(float), strict=True):
        rows = np.arange(a.shape[0])
        for one, parity in ((a, 0), (b, 1)):
            field = one[parity::2]
            out.append(np.stack([np.interp(rows, rows[parity::2], line) for line in field.T], 1))
    return np.rint(np.array(out)).astype(np.uint16), 2


def case(group, mistake, end, code="", words="", sees="", **of_the_scene):
    return Case(group, mistake, lambda folder: scene(folder, **of_the_scene), end, code, words, sees)


def light(mistake, end, code="", **of_the_scene):
    return case(LIGHT, mistake, end, code, **of_the_scene)


CASES = (
    case(
        STICKER,
        "dark striker before a dark background, with a white sticker",
        "flagged",
        "camera.sticker_alone",
        camera=TALL,
        stage=DARK,
    ),
    case(
        STICKER,
        "the same, and the distance from sticker to tip is given",
        "right",
        sees="tip_distance (--tip-distance) says where the tip is",
        camera=TALL,
        stage=DARK,
        tip_distance=0.35e-3,
    ),
    case(
        STICKER,
        "the sticker taken for the striker (--no-marker)",
        "flagged",
        "camera.never_touches",
        camera=TALL,
        stage=DARK,
        marker=False,
    ),
    case(
        STICKER,
        "--no-shaker with the striker in view",
        "right",
        code="camera.striker_in_view",
        sees="columns that the striker enters are left out",
        shaker=False,
    ),
    case(
        SCENE,
        "a bright bar, such as a clamp, that crosses the picture and never moves",
        "right",
        code="camera.fixture",
        sees="of the bands that cross the picture, the one that moves is the beam",
        camera=TALL,
        defects={"fixture": Fixture(15.0, 5.0, 0.8)},
    ),
    case(
        SCENE,
        "nothing in the picture moves",
        "flagged",
        "camera.no_motion",
        motion=(np.linspace(0.0, 0.05, 4000), np.full(4000, -BUCKLING_LEVEL), np.full(4000, -BUCKLING_LEVEL - 2e-4)),
    ),
    case(
        SCENE,
        "glare across all columns in 80 frames",
        "flagged",
        "camera.distorted",
        defects={"glare_frames": tuple(range(60, 140)), "glare_strength": 0.5, "glare_wide": True},
    ),
    case(
        SCENE,
        "glare over a part of the beam in 80 frames",
        "flagged",
        "camera.lost",
        defects={"glare_frames": tuple(range(60, 140)), "glare_strength": 1.0, "glare_wide": False},
    ),
    case(
        SCENE,
        "the beam hidden in every seventh frame",
        "right",
        sees="no edge of the beam's contrast: the frame is flagged, and holds no number",
        defects={"hidden_frames": tuple(range(100, 200, 7))},
    ),
    light("12 bits in a file of 16, overexposed by 1.8", "flagged", "camera.overexposed",
          defects={"gain": 2.5}, name="scene.tif"),
    light("overexposed by 1.3", "flagged", "camera.overexposed", defects={"gain": 1.8}),
    light("grey levels that are light to the power of 0.45", "flagged", "camera.gamma", defects={"gamma": 0.45}),
    light("grey levels that are light to the power of 2.2", "flagged", "camera.gamma", defects={"gamma": 2.2}),
    light("the same, undone", "right", sees="gamma (--gamma) 2.2 turns grey levels into light",
          defects={"gamma": 2.2}, gamma=2.2),
    light("video with lossy compression", "flagged", "recording.lossy", name="scene.mp4"),
    Case(AFTERWARDS, "each frame the mean of itself and the one before", changed(blended), "flagged",
         "camera.averaged"),
    Case(AFTERWARDS, "noise reduction in time", changed(denoised), "flagged", "camera.averaged"),
    Case(AFTERWARDS, "pictures enlarged to twice as many pixels", changed(enlarged), "flagged", "camera.smoothed"),
    Case(AFTERWARDS, "so little light that the beam stands out by a few grey levels", changed(dim), "flagged",
         "camera.few_levels"),
    Case(AFTERWARDS, "interlaced video: odd rows half a frame later than even ones",
         lambda folder: fields(folder, woven), "flagged", "camera.interlaced"),
    Case(AFTERWARDS, "a frame made of each field, each row twice", lambda folder: fields(folder, doubled), "flagged",
         "camera.fields"),
    Case(AFTERWARDS, "a frame made of each field, the rows between made of their neighbours",
         lambda folder: fields(folder, between), "flagged", "camera.smoothed"),
    Case(AFTERWARDS, "edges enhanced by the camera: differences from a blur of a pixel added once",
         changed(sharpened(1.0)), "right", sees="the mean shape of an edge; what it differs from a blurred step by is "
         "in the standard errors"),
    Case(AFTERWARDS, "the same, added twice", changed(sharpened(2.0)), "flagged", "camera.edge_shape"),
    case(REST, "the beam moves in the first frame", "flagged", "camera.no_rest", motion=begun_late(), rest=0),
    case(
        "Pixel size",
        "--pixel-size 12 for 12 um",
        "refused",
        words=r"pixel_size \(--pixel-size\) = 12: a pixel of 12 m; must be at most 0.01 m",
        sees="a pixel larger than any beam",
        opened={"pixel_size": 12.0},
    ),
    case(
        "Pixel size",
        "a pixel size twice the true one, beside a gauge",
        "flagged",
        "camera.rulers",
        opened={"pixel_size": 2 * PIXEL},
        beam_thickness=0.4e-3,
    ),
)  # fmt: skip
