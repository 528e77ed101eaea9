"""When contact begins and ends, from a tracked recording."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from snapbeam.core.validate import InputError, InputTypeError, integer, positive

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["contact_onsets"]


def contact_onsets(
    dataset: xr.Dataset, *, tolerance: float | None = None, minimum_frames: int = 1
) -> xr.Dataset:
    """Impacts in a tracked recording: where the tip reaches the beam and leaves it again.

    Contact begins when the penetration rises above ``-tolerance`` and ends when it falls below twice that,
    which keeps noise from cutting one contact into many.  The instant follows from a straight line through
    the last frames of the approach (and the first of the parting), continued to zero; a frame stands for
    the middle of its exposure where that is known.  Frames that were not
    measured end what is known: a contact that begins or ends in such a gap has ``bounded`` = 0.

    Parameters
    ----------
    dataset
        From :func:`snapbeam.lab.track`, with a shaker.
    tolerance
        Penetration below zero that still counts as contact [mm]; unless given, three standard deviations of
        the frame-to-frame noise of the penetration, and at least 0.1 pixel.
    minimum_frames
        Shortest contact to report, in frames.

    Returns
    -------
    xarray.Dataset
        Over ``impact``: ``onset`` and ``duration`` [s] with their standard errors, ``frames`` in contact,
        ``closing_speed`` [m/s] before the onset (NaN where fewer than two frames precede it), ``bounded``.

    Raises
    ------
    InputError
        If the dataset holds no penetration.
    """
    import xarray as xr

    if not isinstance(dataset, xr.Dataset):
        raise InputTypeError(f"dataset: must be an xarray.Dataset, not {type(dataset).__name__}")
    missing = [name for name in ("time", "penetration_mm") if name not in dataset.variables]
    if missing:
        raise InputError(f"dataset without {', '.join(missing)}: must come from track() with a shaker")
    minimum_frames = integer("minimum_frames", minimum_frames, 1)
    time, gap = dataset["time"].values, dataset["penetration_mm"].values
    pixel = float(dataset.attrs.get("pixel_size", 0.0)) * 1e3
    noise = _noise(dataset)
    if tolerance is None:
        limit = max(3.0 * noise, 0.1 * pixel, 1e-9)
    else:
        limit = positive("tolerance", tolerance, "mm")
    exposure = float(dataset.attrs.get("exposure", math.nan))
    middle = 0.5 * exposure if math.isfinite(exposure) else 0.0
    rows = []
    for start, stop, bounded in _contacts(gap, limit):
        if stop - start < minimum_frames:
            continue
        onset, speed, onset_error = _crossing(time, gap, start, -1, limit, noise)
        end, _, end_error = _crossing(time, gap, stop - 1, +1, limit, noise)
        span = math.hypot(onset_error, end_error)
        rows.append((onset + middle, onset_error, max(end - onset, 0.0), span, stop - start, speed, bounded))
    table = np.array(rows, dtype=np.float64).reshape(-1, 7)
    names = {
        "onset": ("s", "time at which contact begins"),
        "onset_stderr": ("s", "standard error of the onset"),
        "duration": ("s", "duration of the contact"),
        "duration_stderr": ("s", "standard error of the duration"),
        "frames": ("1", "frames in contact"),
        "closing_speed": ("m/s", "speed at which tip and beam close"),
        "bounded": ("1", "whether both ends of the contact were seen"),
    }
    data = {
        name: (
            "impact",
            table[:, i].astype(np.int64 if name in ("frames", "bounded") else np.float64),
            _label(*text),
        )
        for i, (name, text) in enumerate(names.items())
    }
    return xr.Dataset(data, attrs={"tolerance_mm": limit})


def _label(units: str, long_name: str) -> dict[str, str]:
    return {"units": units, "long_name": long_name}


def _noise(dataset: xr.Dataset) -> float:
    """Standard deviation of the penetration [mm] from the noise of both edges."""
    scale = float(dataset.attrs.get("pixel_size", 0.0)) * 1e3
    errors = [
        scale * float(np.nanmedian(dataset[name].values))
        for name in ("beam_row_stderr", "tip_row_stderr")
        if name in dataset and np.isfinite(dataset[name].values).any()
    ]
    return float(np.hypot(errors[0], errors[1])) if len(errors) == 2 else 0.0


def _contacts(gap: np.ndarray, limit: float) -> list[tuple[int, int, bool]]:
    """First frame, one past the last, and whether both ends were seen, for each contact."""
    found: list[tuple[int, int, bool]] = []
    start, clean = -1, True
    for k, value in enumerate(gap):
        if not np.isfinite(value):
            if start >= 0:
                found.append((start, k, False))
            start, clean = -1, False
        elif start < 0 and value > -limit:
            start, clean = k, clean and k > 0
        elif start >= 0 and value < -2.0 * limit:
            found.append((start, k, clean))
            start, clean = -1, True
        elif start < 0:
            clean = True
    if start >= 0:
        found.append((start, gap.size, False))
    return found


def _crossing(
    time: np.ndarray, gap: np.ndarray, edge: int, step: int, limit: float, noise: float
) -> tuple[float, float, float]:
    """Time at which a line through the frames beyond *edge* meets zero, its speed [m/s], the time's error.

    As few frames as the noise allows, two to five, since beam and tip do not move in straight lines.

    ``edge`` is the first (``step`` = -1, approach) or last (+1, parting) frame of the contact.  The crossing
    is sought from the nearest frame outside to the first inside that has closed to within the noise.
    """
    outside: list[int] = []
    k = edge + step
    while 0 <= k < gap.size and len(outside) < 5 and gap[k] <= -limit:
        if outside and gap[k] > gap[outside[-1]] + limit:
            break
        outside.append(k)
        k += step
    usual = float(np.median(np.diff(time)))
    if len(outside) < 2:
        return float(time[edge]), float("nan"), 0.5 * usual
    frame = abs(float(time[outside[0]] - time[edge]))
    for count in range(2, len(outside) + 1):
        slope, level = np.polyfit(time[outside[:count]] - time[edge], gap[outside[:count]], 1)
        # The line's error where it is continued to, about 2 noise/sqrt(count), in frames of the approach.
        if slope * step < 0.0 and 2.0 * noise / math.sqrt(count) < 0.2 * abs(slope) * frame:
            break
    if slope * step >= 0.0:
        return float(time[edge]), float("nan"), 0.5 * usual
    inside = edge
    while 0 <= inside - step < gap.size and gap[inside] < -noise and gap[inside - step] > -limit:
        inside -= step
    low, high = sorted((float(time[outside[0]]), float(time[inside])))
    at = float(np.clip(time[edge] - level / slope, low, high))
    used = time[outside[:count]]
    lever = (at - float(used.mean())) ** 2 / float(np.sum((used - used.mean()) ** 2))
    # the motion bends within a frame, so no onset is known better than to a tenth of one
    error = math.hypot(noise / abs(slope) * math.sqrt(1.0 / count + lever), 0.1 * usual)
    return at, float(abs(slope) * 1e-3), error
