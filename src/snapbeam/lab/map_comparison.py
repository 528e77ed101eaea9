"""Comparison of measured responses with a simulated map."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.lab.diagnostics import KINDS_COMPARISON
from snapbeam.sweeps.measured_points import MeasuredPoints
from snapbeam.util.diagnostics import Diagnostic
from snapbeam.util.proportions import proportion
from snapbeam.util.status_codes import ResponseClass
from snapbeam.util.validation import InputError, axis, finite, instance

if TYPE_CHECKING:
    import xarray as xr


_Array = NDArray[np.float64]
_AXES = ("frequency_ratio", "velocity_amplitude", "location")
_FEW = 5  # points from which another unit is told
_NEAR = 0.02  # a measured point belongs to a map if its fixed coordinate is within this share of the map's
_CLASSES = tuple(kind for kind in ResponseClass if kind is not ResponseClass.UNKNOWN)


@dataclass(frozen=True)
class MapComparison:
    """Measured responses compared with a map.

    ``table`` has one entry per measured point: its coordinates, ``measured`` and ``simulated`` class (that of
    the nearest point of the map), ``used`` (1 if it counts) and ``distance``, in steps of the map, to the
    nearest point that has the measured class (NaN if none has).  ``confusion[i, j]`` counts points of measured
    class i and simulated class j, in the order of ``classes``.  ``diagnostics`` contains the diagnostics.

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import lab, paper
    >>> model = sb.ReducedModel.from_beam(paper.BEAM, modes=1, damping_ratio=0.005)
    >>> shaker = sb.Shaker(frequency_ratio=1.2, velocity_amplitude=0.18)
    >>> system = sb.System(model, contacts=[sb.Contact(paper.CONTACT, shaker)])
    >>> axes = {"frequency_ratio": [1.0, 1.2], "velocity_amplitude": [0.02, 0.1, 0.2]}
    >>> dataset = sb.sweep(system, axes, sb.Integration(cycles=20))
    >>> measured = sb.MeasuredPoints(
    ...     frequency_ratio=[1.0, 1.2], velocity_amplitude=[0.02, 0.02], location=[0.4762, 0.4762], response_class=[0, 3]
    ... )
    >>> comparison = lab.compare_measured_points(measured, dataset)
    >>> comparison.agreement
    0.5
    """

    table: xr.Dataset
    confusion: NDArray[np.int64]
    classes: tuple[ResponseClass, ...]
    notes: tuple[str, ...]
    diagnostics: tuple[Diagnostic, ...] = ()

    @property
    def used(self) -> int:
        """Number of points that count."""
        return int(self.confusion.sum())

    @property
    def agreement(self) -> float:
        """Share of the points that count whose class is that of the map; NaN if none counts."""
        return float(np.trace(self.confusion)) / self.used if self.used else math.nan

    @property
    def agreement_interval(self) -> tuple[float, float]:
        """Wilson's 95 % interval of the agreement; 0 to 1 if no point counts."""
        _, low, high = proportion(int(np.trace(self.confusion)), self.used)
        return float(low), float(high)

    @property
    def snap_agreement(self) -> float:
        """Share of the points that count for which map and measurement agree whether the beam snaps at all."""
        quiet = self.classes.index(ResponseClass.INTRAWELL)
        snaps = np.delete(np.delete(self.confusion, quiet, 0), quiet, 1)
        return float(self.confusion[quiet, quiet] + snaps.sum()) / self.used if self.used else math.nan

    def summary(self) -> dict[str, Any]:
        """The comparison as plain numbers and words."""
        low, high = self.agreement_interval
        return {
            "points": int(self.table.sizes["point"]),
            "used": self.used,
            "agreement": self.agreement,
            "agreement_low": low,
            "agreement_high": high,
            "snap_agreement": self.snap_agreement,
            "classes": [kind.label for kind in self.classes],
            "confusion": self.confusion.tolist(),
            "notes": list(self.notes),
            "diagnostics": [one.plain() for one in self.diagnostics],
        }


def compare_measured_points(measurements: MeasuredPoints, dataset: xr.Dataset) -> MapComparison:
    """Compare measured responses with a simulated map.

    Parameters
    ----------
    measurements : MeasuredPoints
    dataset : xarray.Dataset
        A map: ``response_class`` over some of frequency_ratio, velocity_amplitude and location; the others are
        scalar coordinates or attributes.

    Notes
    -----
    A point does not count if it lies more than half a step outside the map, was measured at another value of a
    coordinate that is fixed in the map (by more than 2 %), or has no class on either side.  Of several points
    with the same coordinates and class only the first counts.  Points with the same coordinates and different
    classes do not count.

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import lab, paper
    >>> model = sb.ReducedModel.from_beam(paper.BEAM, modes=1, damping_ratio=0.005)
    >>> shaker = sb.Shaker(frequency_ratio=1.2, velocity_amplitude=0.18)
    >>> system = sb.System(model, contacts=[sb.Contact(paper.CONTACT, shaker)])
    >>> axes = {"frequency_ratio": [1.0, 1.2], "velocity_amplitude": [0.02, 0.1, 0.2]}
    >>> dataset = sb.sweep(system, axes, sb.Integration(cycles=20))
    >>> measured = sb.MeasuredPoints(
    ...     frequency_ratio=[1.0, 1.2], velocity_amplitude=[0.02, 0.2], location=[0.4762, 0.4762], response_class=[0, 3]
    ... )
    >>> comparison = lab.compare_measured_points(measured, dataset)
    >>> comparison.used
    2
    """
    from snapbeam.util.datasets import xr

    if not isinstance(dataset, xr.Dataset) or "response_class" not in dataset:
        raise InputError("dataset: must be a map with the variable response_class")
    instance("measurements", measurements, MeasuredPoints, "MeasuredPoints")
    response = dataset["response_class"]
    dims = [str(name) for name in response.dims]
    if not dims or any(name not in _AXES for name in dims):
        raise InputError(f"response_class with dimensions {dims}: must be among {', '.join(_AXES)}")
    if not np.isin(response.values, [int(kind) for kind in ResponseClass]).all():
        raise InputError("response_class: must contain the numbers of response classes only")
    where = {name: np.asarray(getattr(measurements, name), dtype=np.float64) for name in _AXES}
    measured = np.asarray(measurements.response_class, dtype=np.int8)
    count = measured.size
    belongs = np.ones(count, dtype=bool)
    axes = {name: axis(name, dataset[name].values, -math.inf, math.inf) for name in dims}
    place, inside, simulated = _on_map(response, axes, where)
    for name in (name for name in _AXES if name not in dims):
        fixed = dataset.coords[name].item() if name in dataset.coords else dataset.attrs.get(name)
        if fixed is not None:
            fixed = finite(name, fixed)
            belongs &= np.isnan(where[name]) | (np.abs(where[name] - fixed) <= _NEAR * abs(fixed))
    known = (measured != ResponseClass.UNKNOWN) & (simulated != ResponseClass.UNKNOWN)
    repeated, contradicting = _repeated(where, measured)
    used = inside & belongs & known & ~repeated & ~contradicting
    diagnostics = _units(response, axes, where, measured, dataset.attrs)
    if contradicting.any():
        diagnostics.append(KINDS_COMPARISON["contradicting"].found(points=float(contradicting.sum())))
    confusion = np.zeros((len(_CLASSES), len(_CLASSES)), dtype=np.int64)
    np.add.at(confusion, (measured[used], simulated[used]), 1)
    notes = []
    for mask, text in (
        (~inside, "outside the map"),
        (inside & ~belongs, "measured at another value of a coordinate the map holds fixed"),
        (inside & belongs & ~known, "without a class, measured or simulated"),
        (inside & belongs & known & repeated, "repeated from an earlier row"),
    ):
        if mask.any():
            notes.append(f"{int(mask.sum())} of {count} measured points do not count: {text}")
    distance = np.where(used, _distance(response.values, dims, place, measured), np.nan)
    data: dict[str, Any] = {name: ("point", where[name]) for name in _AXES}
    data |= {
        "measured": ("point", measured),
        "simulated": ("point", np.where(inside & belongs, simulated, ResponseClass.UNKNOWN).astype(np.int8)),
        "used": ("point", used.astype(np.int8)),
        "distance": ("point", distance, {"long_name": "steps to the nearest point alike"}),
    }
    return MapComparison(xr.Dataset(data), confusion, _CLASSES, tuple(notes), tuple(diagnostics))


def _on_map(
    response: xr.DataArray, axes: dict[str, _Array], where: dict[str, _Array]
) -> tuple[dict[str, _Array], NDArray[np.bool_], NDArray[np.int8]]:
    """Positions of points in steps of the map, whether they lie on it, and the class of the nearest point of it."""
    from snapbeam.util.datasets import xr

    place = {name: _steps(points, where[name]) for name, points in axes.items()}
    inside = np.ones(where[_AXES[0]].size, dtype=bool)
    pick = {}
    for name, points in axes.items():
        inside &= (place[name] >= -0.5) & (place[name] <= points.size - 0.5)
        nearest = np.clip(np.nan_to_num(np.round(place[name])), 0, points.size - 1)
        pick[name] = xr.DataArray(nearest.astype(np.int64), dims="point")
    return place, inside, response.isel(pick).values.astype(np.int8)


def _repeated(where: dict[str, _Array], measured: NDArray[np.int8]) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Which points repeat an earlier one, and which have the coordinates of another one of another class."""
    repeated, contradicting = np.zeros(measured.size, dtype=bool), np.zeros(measured.size, dtype=bool)
    groups: dict[tuple[str, ...], list[int]] = {}
    for i in np.flatnonzero(measured != ResponseClass.UNKNOWN):
        groups.setdefault(tuple(f"{where[name][i]:.9g}" for name in _AXES), []).append(int(i))
    for group in groups.values():
        if np.unique(measured[group]).size > 1:
            contradicting[group] = True
        else:
            repeated[group[1:]] = True
    return repeated, contradicting


def _units(
    response: xr.DataArray,
    axes: dict[str, _Array],
    where: dict[str, _Array],
    measured: NDArray[np.int8],
    attrs: dict[str, Any],
) -> list[Diagnostic]:
    """Diagnostics for points that fit the map far better in another unit or with exchanged columns."""
    count = int((measured != ResponseClass.UNKNOWN).sum())
    if count < _FEW:
        return []

    def fits(points: dict[str, _Array]) -> tuple[int, int]:
        _, inside, simulated = _on_map(response, axes, where | points)
        known = inside & (measured != ResponseClass.UNKNOWN)
        return int(known.sum()), int((known & (simulated == measured)).sum())

    names = ("frequency_ratio", "velocity_amplitude")
    frequency, velocity = (where[name] for name in names)
    turn = 2.0 * math.pi
    others = {
        "the frequency is in rad/s": {"frequency_ratio": frequency / turn},
        "the velocity is in mm/s": {"velocity_amplitude": velocity / 1e3},
        "the velocity is in km/s": {"velocity_amplitude": velocity * 1e3},
        "the frequency is in rad/s and the velocity in mm/s": dict(
            zip(names, (frequency / turn, velocity / 1e3), strict=True)
        ),
        "the columns of frequency and velocity are exchanged": dict(zip(names, (velocity, frequency), strict=True)),
    }
    level, first = attrs.get("beam_buckling_level"), attrs.get("reference_frequency")
    if level is not None:  # exchanged in Hz and m/s
        scale = turn * float(level)
        others["the columns of frequency (Hz) and velocity (m/s) are exchanged"] = dict(
            zip(names, (velocity * scale, frequency / scale), strict=True)
        )
    if first is not None:
        others["the frequency ratio is a frequency in Hz"] = {"frequency_ratio": frequency / float(first)}
    inside, alike = fits({})
    tried = {words: fits(points) for words, points in others.items()}
    best, (found, agree) = max(tried.items(), key=lambda one: one[1])
    off_map = inside < 0.5 * count and found > 0.8 * count
    disagree = agree > 0.6 * count and alike < 0.5 * agree
    if not (off_map or disagree):
        return []
    numbers = {"inside": float(inside), "fitting": float(found), "points": float(count)}
    return [KINDS_COMPARISON["units"].found(None, best, **numbers)]


def _steps(axis: _Array, value: _Array) -> _Array:
    """Position of values on an axis counted in its points, going on evenly beyond its ends."""
    if axis.size == 1:
        return np.where(np.abs(value - axis[0]) <= _NEAR * abs(axis[0]), 0.0, np.nan)
    position = np.interp(value, axis, np.arange(axis.size))
    low, high = axis[1] - axis[0], axis[-1] - axis[-2]
    position = np.where(value < axis[0], (value - axis[0]) / low, position)
    return np.where(value > axis[-1], axis.size - 1 + (value - axis[-1]) / high, position)


def _distance(
    response: NDArray[np.integer], dims: list[str], place: dict[str, _Array], measured: NDArray[np.int8]
) -> _Array:
    grid = np.stack(np.meshgrid(*(np.arange(n) for n in response.shape), indexing="ij"), axis=-1)
    points = np.stack([place[name] for name in dims], axis=-1)
    distance = np.full(measured.size, np.nan)
    for kind in np.unique(measured):
        alike = grid[response == kind]
        if alike.size:
            for i in np.flatnonzero(measured == kind):
                rounded = np.round(points[i])
                distance[i] = np.sqrt(((alike - rounded) ** 2).sum(axis=1).min())
    return distance
