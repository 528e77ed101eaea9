"""Measured responses judged by how likely a probability map makes them, instead of right or wrong."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from snapbeam.simulation.save import code_flags
from snapbeam.util.proportions import proportion
from snapbeam.util.status_codes import ResponseClass
from snapbeam.util.validation import InputError, InputTypeError, checked, integer, seed_of

if TYPE_CHECKING:
    import xarray as xr

    from snapbeam.sweeps.measured_points import MeasuredPoints

KNOWN_CLASSES = (
    ResponseClass.INTRAWELL,
    ResponseClass.TRANSIENT_1,
    ResponseClass.TRANSIENT_2,
    ResponseClass.CONTINUOUS,
)
PSEUDOCOUNT = 0.5
"""Pseudocount of each class (Jeffreys): a class without runs is unlikely, not impossible."""
_COORDINATES = ("frequency_ratio", "velocity_amplitude", "location")


def class_counts(dataset: xr.Dataset) -> NDArray[np.int64]:
    """Runs of each response class at every point of a probability map, of shape (points..., 4)."""
    if "hits" not in dataset or "outcome" not in dataset["hits"].dims:
        raise InputError("dataset: is not a probability map")
    hits = dataset["hits"].transpose(..., "outcome")
    of = {str(name): hits.sel(outcome=name).values for name in hits["outcome"].values}
    intrawell = dataset["runs"].transpose(*hits.dims[:-1]).values - of["snap"]
    return np.stack([intrawell, of["first_well"] - intrawell, of["other_well"], of["continuous"]], axis=-1).astype(
        np.int64
    )


@checked
def score_measurements(
    dataset: xr.Dataset,
    measurements: MeasuredPoints,
    *,
    samples: int = 10_000,
    rng: int | np.random.Generator | None = 0,
) -> xr.Dataset:
    """Likelihood of measured response classes under a probability map, for each and for all together.

    Parameters
    ----------
    dataset : xarray.Dataset
        Result of :func:`probability_map` over some of frequency ratio, velocity amplitude and location, as a grid. A
        measured point belongs to the nearest point of the grid, at most half a spacing outside it.
    measurements : MeasuredPoints
        Measured points; those of unknown class are left out.
    samples : int
        Sets of responses sampled from the map for comparison.
    rng : int, numpy.random.Generator or None
        Seed, or a generator that gives one; None: random.

    Returns
    -------
    xarray.Dataset
        Variables over ``measurement``: ``response_class``, its ``probability`` with 95 % limits, the ``most_likely``
        class and its probability ``best``. Attributes: ``log_likelihood`` of all measurements; ``log_likelihood_low``,
        ``log_likelihood_mean`` and ``log_likelihood_high``, the 95 % range of responses sampled from the map;
        ``p_value``, the share of those that are no likelier than the measured ones; ``agree``, measurements of the most
        likely class, and ``agree_expected`` under a right map.

    See Also
    --------
    snapbeam.uncertainty.probability_map, snapbeam.read_measured_points

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> system = paper.struck_beam(frequency_ratio=1.2, velocity_amplitude=0.18)
    >>> uncertainty = sb.uncertainty.ParameterUncertainty(
    ...     of={"contact.stiffness": sb.uncertainty.LogNormal(0.2), "location": sb.uncertainty.Normal(0.005)}
    ... )
    >>> axes = {"velocity_amplitude": [0.02, 0.1, 0.2], "frequency_ratio": [1.0, 1.2]}
    >>> integration = sb.Integration(cycles=5)
    >>> ds = sb.uncertainty.probability_map(system, axes, uncertainty, 16, integration=integration)
    >>> measurements = sb.MeasuredPoints(
    ...     frequency_ratio=[1.0, 1.2], velocity_amplitude=[0.02, 0.2], location=[0.4762, 0.4762], response_class=[0, 3]
    ... )
    >>> score = sb.uncertainty.score_measurements(ds, measurements)
    >>> int(score.attrs["agree"])
    2
    """
    from snapbeam.util.datasets import xr

    if not hasattr(measurements, "response_class") or not hasattr(measurements, "frequency_ratio"):
        raise InputTypeError("measurements: must be MeasuredPoints, as read_measured_points reads them")
    integer("samples", samples, 100, 10**7)
    seed = seed_of(rng)
    counts = class_counts(dataset)
    known = np.isin(measurements.response_class, KNOWN_CLASSES)
    if not known.any():
        raise InputError("measurements: none has a known class")
    at = _nearest(dataset, measurements, known)
    mine = counts[at]
    total = mine.sum(axis=-1)
    share = (mine + PSEUDOCOUNT) / (total + PSEUDOCOUNT * len(KNOWN_CLASSES))[:, None]
    kind = np.searchsorted(KNOWN_CLASSES, measurements.response_class[known])
    rows = np.arange(kind.size)
    _, low, high = proportion(mine[rows, kind], total)
    generator = np.random.Generator(np.random.Philox(key=[seed, 0]))
    ranks = generator.random((samples, kind.size))
    drawn = (ranks[..., None] > np.cumsum(share, axis=-1)[None, :, :-1]).sum(axis=-1)
    logs = np.log(share)
    likelihood = logs[rows[None, :], drawn].sum(axis=1)
    measured = float(logs[rows, kind].sum())
    limits = np.quantile(likelihood, [0.025, 0.975])
    best = share.argmax(axis=-1)
    labels = {"units": "1"}
    flags = code_flags(ResponseClass)
    return xr.Dataset(
        {
            "response_class": ("measurement", measurements.response_class[known], labels | {"long_name": "measured response class"} | flags),
            "probability": ("measurement", share[rows, kind], labels | {"long_name": "probability of that class"}),
            "probability_low": ("measurement", low, labels | {"long_name": "its lower limit"}),
            "probability_high": ("measurement", high, labels | {"long_name": "its upper limit"}),
            "most_likely": (
                "measurement", np.array(KNOWN_CLASSES, dtype=np.int8)[best], labels | {"long_name": "most likely class"} | flags
            ),
            "best": ("measurement", share[rows, best], labels | {"long_name": "probability of the most likely class"}),
        },
        {name: ("measurement", getattr(measurements, name)[known]) for name in _COORDINATES},
        {
            "title": "measured responses under a probability map",
            "log_likelihood": measured,
            "log_likelihood_low": float(limits[0]),
            "log_likelihood_mean": float(likelihood.mean()),
            "log_likelihood_high": float(limits[1]),
            "p_value": float(((likelihood <= measured).sum() + 1) / (samples + 1)),
            "agree": int((best == kind).sum()),
            "agree_expected": float(share[rows, best].sum()),
            "measurements": int(kind.size),
        },
    )  # fmt: skip


def _nearest(
    dataset: xr.Dataset, measurements: MeasuredPoints, known: NDArray[np.bool_]
) -> tuple[NDArray[np.int64], ...]:
    """Return the point of the grid that each measurement belongs to."""
    dims = [str(name) for name in dataset["runs"].dims]
    found = []
    for name in dims:
        if name not in _COORDINATES:
            raise InputError(f"dataset over {name}: the measurements do not contain it; choose one of its points")
        axis, values = dataset[name].values, getattr(measurements, name)[known]
        if np.isnan(values).any():
            raise InputError(f"measurements: {name} is not given for all of them, but is an axis of the map")
        index = np.abs(values[:, None] - axis[None, :]).argmin(axis=1)
        spacing = np.gradient(axis) if axis.size > 1 else np.array([np.inf])
        away = np.abs(values - axis[index]) > 0.5001 * np.abs(spacing[index])
        if away.any():
            raise InputError(
                f"measurements: {name} = {values[away][0]:g} lies outside the map, {axis[0]:g} to {axis[-1]:g}"
            )
        found.append(index)
    return tuple(found)
