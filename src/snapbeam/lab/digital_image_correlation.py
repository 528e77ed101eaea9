"""Displacement along a beam from its texture or its edges, column by column, and amplitudes of the model's modes."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import spline_filter1d

from snapbeam.lab.camera import Recording
from snapbeam.model.reduced_model import ReducedModel
from snapbeam.util.diagnostics import to_json
from snapbeam.util.singular_values import pinv
from snapbeam.util.validation import InputError, checked, choice, instance, integer, within

if TYPE_CHECKING:
    import xarray as xr

_Array = NDArray[np.float64]
_ITERATIONS = 30
_ACCURATE = 1e-4  # px of the last step
_FARTHEST = 0.75  # px that a step may go, so that the fit stays on the same texture
_LOST = 0.5  # correlation below which a block is lost
_MARGIN = 2  # rows beside a block that the spline needs
_CONDITION = 1e3  # of the shapes of the modes in the view, above which they cannot be told apart


@checked
def full_field(
    recording: Recording,
    rows: tuple[int, int],
    *,
    block: int = 16,
    rest_frames: int = 10,
    motion: str = "rows",
    progress: Callable[[int, int], object] | None = None,
) -> xr.Dataset:
    """Measure the displacement of every block of columns by digital image correlation.

    The picture at rest, shifted, amplified and offset, is fitted to each frame by least squares (Gauss-Newton, cubic
    splines), with the standard error of the noise that it leaves (B. Pan et al., Meas. Sci. Technol. 20, 062001, 2009).
    A block must contain texture such as speckle, or an edge across the motion, and no background with texture.

    Parameters
    ----------
    recording : Recording
    rows : (int, int)
        First row of the blocks, and the row after the last one, in the region, at rest.
    block : int
        Width of a block, px.
    rest_frames : int
        Number of frames at the start whose mean is the reference.
    motion : {"rows", "columns"}
        Axis of the motion; for ``"columns"`` *rows* are columns.
    progress : callable, optional
        Function that receives (frames done, frames).

    Returns
    -------
    xarray.Dataset
        ``displacement`` [m] from the rest, positive towards the first row, ``displacement_se`` and ``correlation``,
        over ``time`` [s] and ``position`` [m]; NaN where the correlation is below 0.5, the block left the region, or
        the frame is missing.

    Raises
    ------
    InputError
        If the rows are too few or outside the region, or no block has texture.

    Examples
    --------
    >>> import numpy as np
    >>> from snapbeam import lab
    >>> time = np.arange(100) / 10e3  # s
    >>> beam = -0.335e-3 + 5e-5 * np.sin(2 * np.pi * 100 * time)
    >>> camera = lab.SyntheticCamera(shape=(192, 96))
    >>> stage = lab.SyntheticStage(shaker_width=0.4e-3)
    >>> synthetic = lab.render_recording(time, beam, beam - 0.6e-3, camera=camera, stage=stage)
    >>> with lab.open_recording(synthetic.write("test.cihx"), pixel_size=12e-6) as recording:
    ...     field = lab.full_field(recording, (20, 70))
    >>> dict(field.sizes)
    {'time': 109, 'position': 6}
    """
    from snapbeam.util.datasets import xr

    instance("recording", recording, Recording, "a Recording")
    choice("motion", motion, ("rows", "columns"))
    height, width = recording.shape if motion == "rows" else recording.shape[::-1]
    try:
        first, last = (int(each) for each in rows)
    except (TypeError, ValueError):
        raise InputError(f"rows = {rows!r}: must be two whole numbers") from None
    if not _MARGIN <= first <= last - 8 or last > height - _MARGIN:
        raise InputError(
            f"rows = {first}, {last}: must be at least 8 rows between {_MARGIN} and {height - _MARGIN} of the {height} of the "
            "region"
        )
    integer("block", block, 4, width)
    integer("rest_frames", rest_frames, 1, len(recording))
    blocks = width // block

    def frame(k: int) -> _Array:
        picture = np.asarray(recording.frame(k), dtype=np.float64)
        return picture if motion == "rows" else picture.T

    at_rest = _Template.of(np.mean([frame(k) for k in range(rest_frames)], axis=0), first, last, block, rest_frames)
    if not at_rest.slope.any():
        raise InputError(f"rows = {first}, {last}: hold no texture and no edge in any block")
    length = int(recording.numbers[-1]) + 1
    found = {name: np.full((length, blocks), np.nan) for name in ("shift", "error", "correlation")}
    shift, at = np.zeros(blocks), np.arange(blocks)
    for k, number in enumerate(recording.numbers):
        fitted = at_rest.fit_shifts(frame(k), shift)
        for name, values in zip(found, fitted, strict=True):
            found[name][number] = values
        # a block that is lost is looked for where its neighbours are
        known = np.isfinite(fitted[0])
        if known.any():
            shift = np.interp(at, at[known], fitted[0][known])
        if progress is not None:
            progress(k + 1, len(recording))
    pixel, across = recording.pixel_size, recording.pixel_width
    if motion == "columns":
        pixel, across = across, pixel
    columns: dict[str, tuple[_Array, str, str]] = {
        "displacement": (-pixel * found["shift"], "m", "displacement from the rest"),
        "displacement_se": (pixel * found["error"], "m", "standard error of the displacement"),
        "correlation": (found["correlation"], "1", "correlation with the picture at rest"),
    }
    return xr.Dataset(
        {name: (("time", "position"), v, {"units": u, "long_name": words}) for name, (v, u, words) in columns.items()},
        {
            "time": ("time", np.arange(length) / recording.frame_rate, {"units": "s"}),
            "position": (
                "position",
                across * ((np.arange(blocks) + 0.5) * block - 0.5),
                {"units": "m", "long_name": "place along the beam, from the first column"},
            ),
        },
        {
            "source": recording.path.name, "pixel_size": pixel, "frame_rate": recording.frame_rate, "block": block,
            "diagnostics": to_json(recording.diagnostics),
        },
    )  # fmt: skip


def _taps(t: _Array) -> _Array:
    """Weights of four neighbouring coefficients of a cubic spline at fraction *t* between the inner two, shape (4, ...)."""
    inner = (3.0 * t**3 - 6.0 * t**2 + 4.0, -3.0 * t**3 + 3.0 * t**2 + 3.0 * t + 1.0)
    return np.stack([(1.0 - t) ** 3, *inner, t**3]) / 6.0


def _kept_noise(t: _Array) -> _Array:
    """Variance of white noise of variance 1 that was interpolated by a cubic spline at fraction *t*."""
    turn = 2.0 * np.pi * (np.arange(64) + 0.5) / 64
    waves = np.exp(1j * np.outer(np.arange(4), turn))
    spectrum = np.tensordot(_taps(t), waves, (0, 0)) / ((4.0 + 2.0 * np.cos(turn)) / 6.0)
    return np.asarray(np.mean(np.abs(spectrum) ** 2, axis=-1))


class _Template(NamedTuple):
    """Blocks at rest: ``level`` and its derivative ``slope`` by the row, each of zero mean, shape (blocks, pixels)."""

    level: _Array
    slope: _Array
    first: int
    rows: int
    frames: int

    @classmethod
    def of(cls, picture: _Array, first: int, last: int, block: int, frames: int) -> _Template:
        """Template of a picture that is the mean of so many frames."""
        coefficients = spline_filter1d(picture, order=3, axis=0, mode="mirror")
        slope = 0.5 * (coefficients[first + 1 : last + 1] - coefficients[first - 1 : last - 1])
        blocks = picture.shape[1] // block
        level, slope = (
            each[:, : blocks * block].reshape(last - first, blocks, block).transpose(1, 0, 2).reshape(blocks, -1)
            for each in (picture[first:last], slope)
        )
        level, slope = (each - each.mean(1, keepdims=True) for each in (level, slope))
        return cls(level, slope, first, last - first, frames)

    def fit_shifts(self, picture: _Array, start: _Array) -> tuple[_Array, _Array, _Array]:
        """Shift of each block [px], its standard error, and the correlation; NaN where it is lost.

        The frame at the shifted rows is a + g T(r + s) = a + g T + g s T' with the levels T at rest and a small
        remaining shift -s: least squares in a, g and g s.  The slope at rest has less noise than that of the frame, and
        none in common with it, so that the noise makes no bias.
        """
        blocks = self.level.shape[0]
        block = self.level.shape[1] // self.rows
        coefficients = spline_filter1d(picture, order=3, axis=0, mode="mirror")
        by_block = coefficients[:, : blocks * block].reshape(-1, blocks, block)
        pairs = ((self.level, self.level), (self.level, self.slope), (self.slope, self.slope))
        tt, ts, ss = ((one * other).sum(1) for one, other in pairs)
        determinant = ss * tt - ts * ts
        shift = start.copy()
        for _ in range(_ITERATIONS):
            whole = np.floor(shift).astype(np.int64)
            top = self.first + whole
            inside = (top >= _MARGIN - 1) & (top + self.rows <= picture.shape[0] - _MARGIN)
            at = np.clip(top, 1, picture.shape[0] - self.rows - 2)[:, None] + np.arange(-1, self.rows + 2)
            part = by_block[at, np.arange(blocks)[:, None]]
            taps = _taps(shift - whole)[:, :, None, None]
            level = sum(w * part[:, j : j + self.rows] for j, w in enumerate(taps)).reshape(blocks, -1)
            level = level - level.mean(1, keepdims=True)
            with np.errstate(divide="ignore", invalid="ignore"):
                lt, ls = (level * self.level).sum(1), (level * self.slope).sum(1)
                gain = (lt * ss - ls * ts) / determinant
                step = (ls * tt - lt * ts) / determinant / gain
            step = np.where(np.isfinite(step), np.clip(step, -_FARTHEST, _FARTHEST), 0.0)
            shift = shift - step
            if np.abs(step[inside]).max(initial=0.0) < _ACCURATE:
                break
        with np.errstate(divide="ignore", invalid="ignore"):
            left = level - gain[:, None] * (self.level + step[:, None] * self.slope)
            variance = (left * left).sum(1) / (self.level.shape[1] - 3.0)
            # interpolation takes the noise that the smooth slope does not meet
            rest = 1.0 / self.frames
            variance *= (1.0 + rest) / (_kept_noise(shift - np.floor(shift)) + rest)
            error = np.sqrt(variance * tt / determinant) / np.abs(gain)
            correlation = lt / np.sqrt((level * level).sum(1) * tt)
        lost = ~inside | ~(correlation > _LOST) | ~np.isfinite(error) | (np.abs(step) > 0.1)
        return tuple(np.where(lost, np.nan, each) for each in (shift, error, correlation))  # type: ignore[return-value]


@checked
def modal_amplitudes(
    field: xr.Dataset, model: ReducedModel, *, contact: float, location: float, modes: int | None = None
) -> xr.Dataset:
    """Project a measured displacement on the buckling modes of a model.

    The amplitudes alpha of w(x, t) = sum of alpha_i(t) phi_i(x) follow by weighted least squares.

    Parameters
    ----------
    field : xarray.Dataset
        Result of :func:`full_field`.
    model : ReducedModel
        Model of the beam.
    contact : float
        Position of a known point in the field [m].
    location : float
        Location of that point, x over the length.
    modes : int, optional
        Number of modes; all by default.

    Returns
    -------
    xarray.Dataset
        ``modal_amplitude`` [m^0.5] from the rest with ``modal_amplitude_se`` over ``time`` and ``mode``, ``residual``
        [m], the root mean square of the rest, and the attribute ``condition`` of the shapes in the view.

    Raises
    ------
    InputError
        If the field extends beyond the beam, or does not tell the modes apart.

    Examples
    --------
    >>> import numpy as np
    >>> import snapbeam as sb
    >>> import xarray as xr
    >>> from snapbeam import lab, paper
    >>> model = sb.ReducedModel.from_beam(paper.BEAM, modes=3, damping_ratio=0.005)
    >>> position = np.linspace(0.01, 0.15, 30)  # m
    >>> shapes = model.shape_at(position / paper.BEAM.length)
    >>> field = xr.Dataset(
    ...     {
    ...         "displacement": (("time", "position"), [1e-5 * shapes[:, 1]]),
    ...         "displacement_se": (("time", "position"), np.full((1, 30), 1e-7)),
    ...     },
    ...     {"time": [0.0], "position": position},
    ... )
    >>> found = lab.modal_amplitudes(field, model, contact=0.0805, location=0.5)
    >>> print(f"{found.modal_amplitude.values[0, 1]:.1e}")
    1.0e-05
    """
    from snapbeam.util.datasets import xr

    instance("model", model, ReducedModel, "a ReducedModel")
    if model.beam is None:
        raise InputError("model: must be that of a beam, whose modes have shapes")
    for name in ("displacement", "displacement_se"):
        if not isinstance(field, xr.Dataset) or name not in field:
            raise InputError(f"field: must have {name} over time and position, as full_field returns it")
    number = model.modes if modes is None else integer("modes", modes, 1, model.modes)
    place = within("location", location, 0.0, 1.0) + (field["position"].values - contact) / model.beam.length
    if place.min() < 0.0 or place.max() > 1.0:
        raise InputError(
            f"contact = {contact:g} m at location = {location:g}: the field then reaches from {place.min():.3g} to "
            f"{place.max():.3g} of the length; must lie in [0, 1]"
        )
    shapes = np.asarray(model.shape_at(place))[:, :number]
    scale = np.linalg.norm(shapes, axis=0)
    condition = float(np.linalg.cond(shapes / scale)) if place.size >= number else np.inf
    if condition > _CONDITION:
        raise InputError(
            f"modes = {number}: their shapes cannot be told apart from {place.min():.3g} to {place.max():.3g} of the "
            f"length with {place.size} blocks (condition {condition:.2g}): give fewer modes, or a wider view"
        )
    seen, error = field["displacement"].values, field["displacement_se"].values
    amplitude, spread = (np.full((seen.shape[0], number), np.nan) for _ in range(2))
    residual = np.full(seen.shape[0], np.nan)
    for k, (w, e) in enumerate(zip(seen, error, strict=True)):
        known = np.isfinite(w) & (e > 0.0)
        if known.sum() < number:
            continue
        design = shapes[known] / e[known, None]
        inverse = pinv(design / scale) / scale[:, None]
        amplitude[k] = inverse @ (w[known] / e[known])
        spread[k] = np.sqrt((inverse * inverse).sum(1))
        residual[k] = np.sqrt(np.mean((w[known] - shapes[known] @ amplitude[k]) ** 2))
    data: dict[str, Any] = {
        "modal_amplitude": (("time", "mode"), amplitude, {"units": "m^0.5", "long_name": "amplitude from the rest"}),
        "modal_amplitude_se": (("time", "mode"), spread, {"units": "m^0.5", "long_name": "standard error"}),
        "residual": ("time", residual, {"units": "m", "long_name": "root mean square of the residual"}),
    }  # fmt: skip
    coords = {"time": field["time"], "mode": np.arange(1, number + 1)}
    return xr.Dataset(data, coords, {"condition": condition})
