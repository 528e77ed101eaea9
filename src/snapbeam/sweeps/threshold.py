"""Thresholds: the smallest value of a parameter that makes a beam snap through, over any others."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.config.parameters import lookup
from snapbeam.core.reporting import counting
from snapbeam.core.validate import InputError, choice, shown, within
from snapbeam.model.integration import Integration
from snapbeam.model.system import System
from snapbeam.sweeps.points import Grid, points_of
from snapbeam.sweeps.search import Responses, search_everything_below, search_fast
from snapbeam.sweeps.setup import Progress, SweepSetup, sweep_setup, variable_attributes

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["KINDS_OF_SEARCH", "threshold"]

KINDS_OF_SEARCH = ("fast", "exhaustive")
_BLOCKS = 16
"""Blocks that the exhaustive search cuts the values into."""
_CONFIRM = 8
"""It stops in a column when the interwell rows that follow each other are this share of all, 1/8."""
_MISSES = {
    "fast": "isolated interwell points below first_interwell and intrawell points above always_interwell, "
    "between the values that were run (computed)",
    "exhaustive": "nothing below first_interwell on the grid; intrawell points above the run of interwell "
    "ones that ended the search of a column",
}
_OUTCOMES = "band_found no_interwell_in_range lowest_value_is_interwell highest_run_is_intrawell"


def threshold(
    system: System,
    along: str,
    values: ArrayLike,
    over: Mapping[str, ArrayLike],
    integration: Integration | None = None,
    *,
    search: str = "fast",
    share: float = 0.1,
    progress: Progress | bool | None = None,
) -> xr.Dataset:
    """The threshold of interwell response, sought along one parameter over any others, as a band.

    The boundary is fractal in places: interwell values may lie below intrawell ones.  So two
    curves are given, the lowest value found to snap through and the one above which every value that
    was run does.

    Parameters
    ----------
    system : System
    along : str
        Parameter to raise, such as ``"velocity_amplitude"``: one that may differ between the runs of an ensemble.
    values : array_like
        What to choose from, strictly increasing: the range and the resolution.
    over : mapping of str to array_like
        Axes, as of :func:`snapbeam.sweep`; neighbours along the last one guide the fast search.
    integration : Integration, optional
        Runs end once their class is certain, whatever it says.
    search : {"fast", "exhaustive"}
        ``"fast"``: at most *share* of the runs of the full map; may miss isolated interwell points below
        the band.
        ``"exhaustive"``: every value up to the first interwell one, which is so the first of the grid.
    share : float
        Runs of the fast search over those of the full map.
    progress : callable, optional
        Called as ``progress(done, total)`` with runs, of which the total is what the search may take at most; True
        writes a line to standard error.

    Returns
    -------
    xarray.Dataset
        ``first_interwell`` and ``always_interwell`` over the axes; NaN where no value of the range is, as ``outcome``
        says.  ``last_intrawell``, the highest value known not to snap below the first; ``runs``; and what was
        run: ``response`` with ``computed`` along the values too.

    Raises
    ------
    InputError
        For bad input, such as a parameter that needs another structure to be raised along.
    """
    choice("search", search, KINDS_OF_SEARCH)
    within("share", share, 0.0, 1.0, closed="right")
    row = lookup(along)
    if not row.is_run or row.quantity.kind is not float:
        raise InputError(
            f"along = {shown(along)}: must be a number that may differ between runs, such as velocity_amplitude"
        )
    if not isinstance(over, Mapping) or not over:
        raise InputError(f"over = {shown(over)}: must map at least one parameter to an array of values")
    if np.size(values) < 2:
        raise InputError(f"{along}: must be an array of at least two values to choose from")
    asked = Integration() if integration is None else integration
    if not isinstance(asked, Integration):
        raise InputError(f"integration = {shown(integration)}: must be an Integration")
    points = points_of({**over, row.name: values})
    assert isinstance(points, Grid)
    setup = sweep_setup(system, points, asked.replace(early_decision=True))
    return _searched(setup, row.name, search, share, counting(progress, "threshold", "runs"))


def _searched(
    setup: SweepSetup, along: str, search: str, share: float, progress: Progress | None
) -> xr.Dataset:
    points = setup.points
    assert isinstance(points, Grid)
    axes = {name: values for name, values in points.axes.items() if name != along}
    lines = list(axes)[:-1]
    rows = points.axes[along].size
    columns = axes[list(axes)[-1]].size
    shape = tuple(axes[name].size for name in lines)
    count = int(np.prod(shape, dtype=np.int64))
    most = max(1, int(share * columns * rows)) if search == "fast" else columns * rows
    classes = np.full((*shape, columns, rows), -1, dtype=np.int8)
    known = np.zeros(classes.shape, dtype=bool)
    found = []
    for number, at in enumerate(np.ndindex(shape)):
        fixed = {name: axes[name][i] for name, i in zip(lines, at, strict=True)}
        responses = _line(
            setup, along, list(axes)[-1], fixed, search, most, progress, (number * most, count * most)
        )
        classes[at], known[at] = responses.classes, responses.known
        found.append(responses)
    return _dataset(setup, along, list(axes), found, classes, known, search, share)


def _line(
    setup: SweepSetup,
    along: str,
    across: str,
    fixed: dict[str, Any],
    search: str,
    most: int,
    progress: Progress | None,
    counted: tuple[int, int],
) -> Responses:
    """Search the columns of one line of the grid."""
    axes = setup.points.axes

    def ask(columns: NDArray[np.int64], rows: NDArray[np.int64]) -> NDArray[np.int8]:
        points = {name: np.full(columns.size, value) for name, value in fixed.items()}
        points |= {across: axes[across][columns], along: axes[along][rows]}
        before = counted[0] + responses.runs

        def report(done: int, _: int) -> None:
            if progress is not None:
                progress(before + done, counted[1])

        return setup.march(points, setup.integration.threads, report)["response"].astype(np.int8)

    rows = axes[along].size
    responses = Responses(axes[across].size, rows, ask)
    if search == "fast":
        search_fast(responses, most)
    else:
        search_everything_below(responses, max(1, -(-rows // _BLOCKS)), max(1, -(-rows // _CONFIRM)))
    if progress is not None:
        progress(counted[0] + most, counted[1])
    return responses


def _dataset(
    setup: SweepSetup,
    along: str,
    over: list[str],
    found: list[Responses],
    classes: NDArray[np.int8],
    known: NDArray[np.bool_],
    search: str,
    share: float,
) -> xr.Dataset:
    import xarray as xr

    values = setup.points.axes[along]
    row = lookup(along)
    shape = classes.shape[:-1]
    dims = tuple(lookup(name).short for name in over)
    padded = np.append(values, np.nan)
    first = np.array([responses.first() for responses in found]).reshape(shape)
    top = np.array([responses.top() for responses in found]).reshape(shape)
    below = known & ~(classes > 0) & (np.arange(values.size) < first[..., None])
    last = np.where(below.any(axis=-1), values.size - 1 - below[..., ::-1].argmax(axis=-1), values.size)
    outcome = np.where(first == values.size, 1, np.where(first == 0, 2, np.where(top == values.size, 3, 0)))
    attrs = setup.attributes("threshold of the interwell response of a struck bistable beam")
    attrs.pop("early_decision")
    attrs |= {"along": row.short, "search": search, "may_miss": _MISSES[search], "runs": int(known.sum())}
    attrs["runs_of_full_map"] = int(known.size)
    if search == "fast":
        attrs["share"] = float(share)
    dataset = xr.Dataset(coords=setup.coordinates(), attrs=attrs)
    words = row.quantity.words
    symbol = f" {row.quantity.symbol}" if row.quantity.symbol else ""

    def curve(name: str, data: NDArray[Any], text: str, **more: Any) -> None:
        dataset[name] = (dims, data, {"units": "1", "long_name": text} | more)

    unit = {"units": row.quantity.unit}
    curve(
        "first_interwell", padded[first], f"lowest {words}{symbol} that makes an interwell response", **unit
    )
    curve("always_interwell", padded[top], f"{words}{symbol} above which all runs are interwell", **unit)
    curve(
        "last_intrawell", padded[last], f"highest {words}{symbol} run below that without snap-through", **unit
    )
    curve("runs", known.sum(axis=-1), "runs made")
    flags = {"flag_values": np.arange(4, dtype=np.int8), "flag_meanings": _OUTCOMES}
    curve("outcome", outcome.astype(np.int8), "what was found", **flags)
    whole = (*dims, row.short)
    dataset["response"] = (whole, classes, variable_attributes("response"))
    labels = {"units": "1", "long_name": "whether the point was run"}
    dataset["computed"] = (whole, known, labels)
    return dataset
