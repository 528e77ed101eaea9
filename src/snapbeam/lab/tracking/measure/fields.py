"""Whether a picture was taken at one instant: interlaced video holds its odd and even rows half a frame apart."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from snapbeam.lab.camera.recording import Recording
from snapbeam.lab.tracking.edges import Floats, edge_profile, fit_edges
from snapbeam.lab.tracking.geometry import HALF, gather
from snapbeam.lab.tracking.measure.follower import TrackedRows
from snapbeam.lab.tracking.scene import BeamView, Fields

__all__ = ["alternation", "fields_apart", "seen_fields"]

_FRAMES = 32  # the fastest, that are looked at
_PIXELS = 5_000_000  # of these together
_MOVES = 0.1  # px a frame that count as motion
_LEAST = 12  # frames
_CERTAIN = 6.0  # standard errors
_PART = 0.15  # of the step from frame to frame by which rows must differ; fields differ by a half
_SHIFT = 0.02  # px


def seen_fields(
    recording: Recording,
    prepare: Callable[[NDArray[np.integer]], NDArray[np.float32]],
    view: BeamView,
    rows: TrackedRows,
    along_rows: bool,
) -> Fields:
    """What a tracked recording shows of fields; *along_rows* if the beam lies along the picture's rows.

    *prepare* turns frames as they were tracked.
    """
    return Fields(fields_apart(recording, prepare, view, rows, along_rows), alternation(rows.row))


def fields_apart(
    recording: Recording,
    prepare: Callable[[NDArray[np.integer]], NDArray[np.float32]],
    view: BeamView,
    rows: TrackedRows,
    along_rows: bool,
) -> float:
    """By what share of the step from frame to frame odd and even rows of the picture differ; 0 where they do not.

    In the fastest frames the edge is sought in odd and in even rows: with d_k the difference and v_k the step a frame,
    the share is the slope of d over v through 0.  Rows taken together differ by nothing, fields half a frame apart by
    half a step, whatever the sign.
    """
    row = rows.row
    speed = np.full(row.size, np.nan)
    speed[1:-1] = 0.5 * (row[2:] - row[:-2])
    speed[~np.isfinite(row)] = np.nan
    at = np.searchsorted(recording.numbers, np.arange(row.size))
    seen = recording.numbers[np.minimum(at, recording.numbers.size - 1)] == np.arange(row.size)
    moving = np.flatnonzero(seen & (np.abs(np.nan_to_num(speed)) > _MOVES))
    if moving.size < _LEAST:
        return 0.0
    count = int(np.clip(_PIXELS // (recording.shape[0] * recording.shape[1]), _LEAST, _FRAMES))
    chosen = np.sort(moving[np.argsort(-np.abs(speed[moving]))[:count]])
    frames = prepare(np.stack([recording.frame(int(at[k])) for k in chosen]))
    columns = view.columns if along_rows else np.arange(view.columns.min(), view.columns.max() + 1)
    lines = row[chosen][:, None] + rows.slope[chosen][:, None] * (columns - view.contact_column)
    half = int(np.clip(view.thickness // 2, 2, HALF))
    windows, inside = gather(frames, lines, columns, half)
    fit = fit_edges(windows, view.edge_width, sign=view.sign)
    good = inside & np.isfinite(fit.position) & (fit.contrast > 0.4 * view.contrast)
    if along_rows:
        apart = _within_windows(windows * view.sign, fit.position, view.edge_width, np.rint(lines))
    else:
        parity = np.where(columns % 2 == 0, 1.0, -1.0)
        apart = 2.0 * parity * (np.rint(lines) + fit.position - lines)
    with np.errstate(invalid="ignore", divide="ignore"):
        difference = np.where(good, apart, 0.0).sum(1) / good.sum(1)
    known = np.isfinite(difference)
    if known.sum() < _LEAST:
        return 0.0
    v, d = speed[chosen][known], difference[known]
    slope = float((v * d).sum() / (v * v).sum())
    error = math.sqrt(float(((d - slope * v) ** 2).sum()) / (v.size - 1) / float((v * v).sum()))
    return abs(slope) if abs(slope) > max(_CERTAIN * error, _PART) else 0.0


def _within_windows(windows: Floats, position: Floats, width: float, centre: Floats) -> Floats:
    """Rows by which the edge in even rows lies beyond that in odd ones, to first order, for each window."""
    rows = windows.shape[-1]
    offset = np.arange(rows) - (rows - 1) / 2.0
    away = offset - np.nan_to_num(position)[..., None]
    profile = edge_profile(away, width)
    slope = edge_profile(away + 0.05, width) - edge_profile(away - 0.05, width)
    slope = -10.0 * slope  # by the position of the edge
    comb = np.where((centre[..., None] + offset) % 2 == 0, 0.5, -0.5) * slope
    basis = np.stack([np.ones_like(profile), profile, slope, comb], axis=-1)
    gram = np.einsum("...ri,...rj->...ij", basis, basis) + 1e-9 * np.eye(4)
    solved = np.linalg.solve(gram, np.einsum("...ri,...r->...i", basis, windows)[..., None])[..., 0]
    out: Floats = solved[..., 3] / np.where(np.abs(solved[..., 1]) > 0.0, solved[..., 1], np.nan)
    return out


def alternation(row: Floats) -> float:
    """By how much every other frame is shifted [px]; 0 if by no more than chance.

    Each frame against the mean of its neighbours, with turning sign: no motion that a camera can follow does that.
    """
    bend = row[1:-1] - 0.5 * (row[2:] + row[:-2])
    turned = np.where(np.arange(bend.size) % 2 == 0, 0.5, -0.5) * bend
    turned = turned[np.isfinite(turned)]
    if turned.size < 4 * _LEAST:
        return 0.0
    shift = float(np.median(turned))
    spread = 1.4826 * float(np.median(np.abs(turned - shift)))
    # neighbouring values share frames; the median of as many as these is known to 1.25 spread / sqrt(n)
    return abs(shift) if abs(shift) > max(_CERTAIN * 2.0 * spread / math.sqrt(turned.size), _SHIFT) else 0.0
