"""Mean over the seeds of a random motion: what a map says of any realisation, and not of the most favourable one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from snapbeam.util.status_codes import ResponseClass
from snapbeam.util.validation import InputError, checked, instance, within

if TYPE_CHECKING:
    import xarray as xr

_LIMITS = (("", ""), ("_low", "lower limit: "), ("_high", "upper limit: "))


def seed_axes(dataset: xr.Dataset) -> list[str]:
    """Axes of a map along which only seeds of random motions vary."""
    return [
        str(name)
        for name in dataset.dims
        if name in dataset.coords and str(dataset[name].attrs.get("parameter", "")).endswith(".seed")
    ]


@checked
def mean_over_seeds(dataset: xr.Dataset, confidence: float = 0.95) -> xr.Dataset:
    """Compute the mean of each statistic of a map over its axes of seeds, with an interval.

    Parameters
    ----------
    dataset : xarray.Dataset
        A map of :func:`snapbeam.sweep` with an axis of seeds, such as ``base_excitation.seed``.
    confidence : float
        Confidence level of the intervals, in (0, 1).

    Returns
    -------
    xarray.Dataset
        Mean of each real statistic over the seeds with Student's interval, as ``peak_voltage``, ``peak_voltage_low``
        and ``peak_voltage_high``: infinite with one seed, where a run has no value or where all have the same. That of a statistic which is
        positive stays so: it is of the logarithm of the mean. ``snap``, the fraction of runs
        that snap through, with Wilson's interval; ``runs``, ``runs_failed``.

    Raises
    ------
    InputError
        If the map has no axis of seeds.

    See Also
    --------
    snapbeam.sweep, snapbeam.uncertainty.probability_map

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> motion = sb.RecordedAcceleration.from_psd([(20, 0.01), (200, 0.01)], duration_s=1.0, ramp_up_s=0.05)
    >>> shaken = sb.System(
    ...     sb.ReducedModel.from_beam(paper.BEAM, modes=1, damping_ratio=0.02),
    ...     base_excitation=sb.BaseExcitation(motion=motion),
    ... )
    >>> axes = {"base_excitation.rms_g": [0.1, 0.3], "base_excitation.seed": [0, 1, 2]}
    >>> found = sb.mean_over_seeds(sb.sweep(shaken, axes, sb.Integration(cycles=10)))
    >>> found.peak_midspan_displacement.dims
    ('base_excitation_rms_g',)
    """
    from snapbeam.sweeps.setup import is_positive
    from snapbeam.util.datasets import xr
    from snapbeam.util.proportions import mean_interval, proportion

    instance("dataset", dataset, xr.Dataset, "an xarray.Dataset")
    within("confidence", confidence, 0.0, 1.0)
    axes = seed_axes(dataset)
    if not axes or "response_class" not in dataset:
        raise InputError("dataset: is no map with an axis of seeds, such as base_excitation.seed")
    kinds = dataset["response_class"]
    over = [str(name) for name in kinds.dims if name not in axes]
    found = dataset.drop_vars([*axes, *dataset.data_vars]).assign_attrs(
        confidence=confidence, seeds=int(np.prod([dataset.sizes[name] for name in axes]))
    )
    for name, item in dataset.data_vars.items():
        if item.dtype.kind == "f" and set(item.dims) == set(kinds.dims):
            runs = item.transpose(*over, *axes).values.reshape(*(item.sizes[each] for each in over), -1)
            words = str(item.attrs.get("long_name", name))
            words = f"mean {words}, {runs.shape[-1]} seeds"
            for (ending, limit), values in zip(
                _LIMITS, mean_interval(runs, confidence, is_positive(str(name))), strict=True
            ):
                found[f"{name}{ending}"] = over, values, item.attrs | {"long_name": f"{limit}{words}"}
    failed = (kinds == ResponseClass.UNKNOWN).sum(axes)
    count = (kinds != ResponseClass.UNKNOWN).sum(axes)
    share = proportion((kinds >= ResponseClass.TRANSIENT_1).sum(axes), count, confidence, failed)
    for (ending, limit), values in zip(_LIMITS, share, strict=True):
        found[f"snap{ending}"] = over, values, {"units": "1", "long_name": f"{limit}fraction of runs that snap through"}
    found["runs"] = count.assign_attrs(units="1", long_name="runs that came to an end")
    found["runs_failed"] = failed.assign_attrs(units="1", long_name="runs that failed")
    return found
