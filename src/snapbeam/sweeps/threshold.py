"""Threshold curves: the smallest velocity amplitude that makes a beam snap through."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.core.provenance import made_by
from snapbeam.core.validate import InputError, InputTypeError, choice, integer, within
from snapbeam.model.contact import HertzContact
from snapbeam.model.reduction import ReducedModel
from snapbeam.sweeps.search import Samples, search_everything_below, search_fast
from snapbeam.sweeps.sweep import AXES, MapSetup, Progress, map_setup, variable_attributes

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["MODES_OF_SEARCH", "threshold_curve"]

MODES_OF_SEARCH = ("fast", "exhaustive")
_BLOCKS = 16
"""Blocks that the exhaustive search cuts the amplitudes into."""
_CONFIRM = 8
"""It stops in a column when the interwell rows that follow each other are this share of all, 1/8."""
_MISSES = {
    "fast": "isolated interwell points below first_interwell and intrawell points above always_interwell, "
    "between the amplitudes that were run (computed)",
    "exhaustive": "nothing below first_interwell on the grid; intrawell points above the run of interwell "
    "ones that ended the search of a column",
}


def threshold_curve(
    model: ReducedModel | Sequence[ReducedModel],
    contact: HertzContact,
    *,
    frequency_ratio: ArrayLike,
    velocity_amplitude: ArrayLike,
    location: ArrayLike = 1.0 / 2.1,
    cycles: int = 200,
    search: str = "fast",
    share: float = 0.1,
    side: str = "below",
    reference_freq: float | None = None,
    step: float | None = None,
    accuracy: str = "map",
    engine: str = "auto",
    threads: int | None = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """The threshold of interwell response along frequency ratio or location, as a band.

    The boundary is fractal in places: interwell amplitudes may lie below intrawell ones.  So two
    curves are given, the lowest amplitude found to snap through and the one above which every amplitude that
    was run does.

    Parameters
    ----------
    model : ReducedModel or sequence of them
        One curve for each; several must differ in their number of modes.
    contact : HertzContact
    frequency_ratio, location : float or array_like
        One of the two is an array, along which the threshold is found.
    velocity_amplitude : array_like
        The amplitudes to choose from, strictly increasing: the range and the resolution.
    cycles : int
        Cycles of excitation of each run.
    search : {"fast", "exhaustive"}
        ``"fast"``: at most *share* of the runs of the full map; may miss isolated interwell points below
        the band.
        ``"exhaustive"``: every amplitude up to the first interwell one, which is so the first of the grid.
    share : float
        Runs of the fast search over those of the full map.
    side, reference_freq, step, accuracy, engine, threads
        As in :func:`snapbeam.response_map`.
    progress : callable, optional
        Called as ``progress(done, total)`` with runs; the total is what the search may take at most.

    Returns
    -------
    xarray.Dataset
        ``first_interwell`` and ``always_interwell`` along the axis that is an array (and ``modes``, if
        several models were given); NaN where no amplitude of the range is, as ``outcome`` says.
        ``last_intrawell``, the highest amplitude known not to snap below the first; ``runs``; and what was
        run: ``response`` with ``computed`` over the velocity amplitude too.

    Raises
    ------
    InputError
        For bad input, such as neither or both of frequency ratio and location as arrays.
    """
    import xarray as xr

    choice("search", search, MODES_OF_SEARCH)
    within("share", share, 0.0, 1.0, closed="right")
    models = [model] if isinstance(model, ReducedModel) else _several(model)
    if threads is not None:
        threads = integer("threads", threads, 1, 4096)
    setups = [
        map_setup(
            each,
            contact,
            frequency_ratio=frequency_ratio,
            velocity_amplitude=velocity_amplitude,
            location=location,
            cycles=cycles,
            side=side,
            reference_freq=reference_freq,
            step=step,
            accuracy=accuracy,
            engine=engine,
            early_decision=True,
        )
        for each in models
    ]
    along = _along(setups[0])
    shape = tuple(setups[0].grid.axes[name].size for name in (along, "velocity_amplitude"))
    most = max(1, int(share * shape[0] * shape[1])) if search == "fast" else shape[0] * shape[1]
    curves = []
    for at, setup in enumerate(setups):
        samples = _search(
            setup, along, shape, search, most, threads, progress, (at * most, len(setups) * most)
        )
        curves.append(_curve(setup, along, samples, alone=isinstance(model, ReducedModel)))
    if isinstance(model, ReducedModel):
        result = curves[0]
    else:
        labels = {"units": "1", "long_name": "number of modes N"}
        coordinate = xr.DataArray([each.modes for each in models], dims="modes", attrs=labels)
        result = xr.concat(curves, coordinate.rename("modes"), combine_attrs="drop_conflicts")
    attrs: dict[str, Any] = {"title": "threshold of the interwell response of a struck bistable beam"}
    attrs |= {key: value for key, value in result.attrs.items() if key != "early_decision"}
    attrs |= {"search": search, "may_miss": _MISSES[search], "runs": int(result["runs"].sum())}
    attrs["runs_of_full_map"] = shape[0] * shape[1] * len(models)
    if search == "fast":
        attrs["share"] = float(share)
    result.attrs = attrs | made_by(attrs)
    return result


def _several(models: Any) -> list[ReducedModel]:
    listed = list(models) if isinstance(models, Sequence) else []
    if not listed or not all(isinstance(each, ReducedModel) for each in listed):
        raise InputTypeError(f"model = {models!r}: must be a ReducedModel or a list of them")
    modes = [each.modes for each in listed]
    if len(set(modes)) < len(modes):
        raise InputError(f"model: the numbers of modes {modes} must differ from each other")
    return listed


def _along(setup: MapSetup) -> str:
    axes = setup.grid.axes
    if "velocity_amplitude" not in axes or axes["velocity_amplitude"].size < 2:
        raise InputError("velocity_amplitude: must be an array of at least two amplitudes to choose from")
    others = [name for name in axes if name != "velocity_amplitude"]
    if len(others) != 1:
        raise InputError(
            "frequency_ratio, location: one of them must be an array, the other a number, "
            f"not {len(others)} arrays"
        )
    return others[0]


def _search(
    setup: MapSetup,
    along: str,
    shape: tuple[int, ...],
    search: str,
    most: int,
    threads: int | None,
    progress: Progress | None,
    counted: tuple[int, int],
) -> Samples:
    axes = setup.grid.axes

    def ask(columns: NDArray[np.int64], rows: NDArray[np.int64]) -> NDArray[np.int8]:
        points = {along: axes[along][columns], "velocity_amplitude": axes["velocity_amplitude"][rows]}
        points |= {name: np.full(columns.size, value) for name, value in setup.grid.scalars.items()}
        before = counted[0] + samples.runs

        def report(done: int, _: int) -> None:
            if progress is not None:
                progress(before + done, counted[1])

        ordered = {name: points[name] for name in AXES}
        return setup.march(ordered, threads, report)["response"].astype(np.int8)

    samples = Samples(shape[0], shape[1], ask)
    if search == "fast":
        search_fast(samples, most)
    else:
        search_everything_below(samples, max(1, -(-shape[1] // _BLOCKS)), max(1, -(-shape[1] // _CONFIRM)))
    if progress is not None:
        progress(counted[0] + most, counted[1])
    return samples


def _curve(setup: MapSetup, along: str, samples: Samples, alone: bool) -> xr.Dataset:
    import xarray as xr

    amplitudes = setup.grid.axes["velocity_amplitude"]
    padded = np.append(amplitudes, np.nan)
    first, top = samples.first(), samples.top()
    rows = np.arange(amplitudes.size)
    below = samples.known & ~samples.interwell & (rows < first[:, None])
    last = np.where(below.any(axis=1), amplitudes.size - 1 - below[:, ::-1].argmax(axis=1), amplitudes.size)
    outcome = np.where(
        first == amplitudes.size, 1, np.where(first == 0, 2, np.where(top == amplitudes.size, 3, 0))
    )
    coords = setup.grid.coordinates()
    dataset = xr.Dataset(coords=coords, attrs=setup.description() | setup.grid.scalars)

    def curve(name: str, values: NDArray[Any], words: str, **more: Any) -> None:
        dataset[name] = ((along,), values, {"units": "1", "long_name": words} | more)

    curve("first_interwell", padded[first], "lowest velocity amplitude V that makes an interwell response")
    curve("always_interwell", padded[top], "velocity amplitude V above which all runs are interwell")
    curve("last_intrawell", padded[last], "highest velocity amplitude V run below that without snap-through")
    curve("runs", samples.known.sum(axis=1), "runs made")
    curve(
        "outcome",
        outcome.astype(np.int8),
        "what was found",
        flag_values=np.arange(4, dtype=np.int8),
        flag_meanings="band_found no_interwell_in_range lowest_amplitude_is_interwell "
        "highest_run_is_intrawell",
    )
    over = (along, "velocity_amplitude")
    dataset["response"] = (over, samples.classes, variable_attributes("response"))
    labels = {"units": "1", "long_name": "whether the point was run"}
    dataset["computed"] = (over, samples.known, labels)
    if not alone:
        words = {"units": "Hz", "long_name": "frequency that Omega and V are normalised by"}
        dataset["reference_freq"] = ((), setup.reference_freq, words)
        dataset["step"] = ((), setup.plan.step, {"units": "s", "long_name": "step in free flight"})
    return dataset
