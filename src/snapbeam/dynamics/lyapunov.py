"""Lyapunov exponents: tangents, made orthogonal once a period (Benettin's method), and two trajectories as a check."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.dynamics.flow import AdvancedStates, Flow
from snapbeam.dynamics.results import fixed_parameters, in_unit, labelled, reported
from snapbeam.dynamics.stroboscope import Stroboscope, flow_of, settling_periods
from snapbeam.model.integration import Integration
from snapbeam.model.parameters import lookup
from snapbeam.model.state import State
from snapbeam.model.system import System
from snapbeam.simulation.request import cycle_of
from snapbeam.sweeps.points import Points, points_of
from snapbeam.util.diagnostics import Diagnostic, tell, to_json
from snapbeam.util.validation import InputError, InputTypeError, checked, finite_array, integer, shown, within

if TYPE_CHECKING:
    import xarray as xr

_Array = NDArray[np.float64]
_BLOCKS = 20
"""Number of blocks from whose means the standard error follows."""
_TOGETHER = 64
"""Runs times periods of one call.  Few runs go on for many periods; then the derivatives of all these periods follow together."""
_DISTANCES = (1e-12, 1e-3)
"""Bounds of the distance of two trajectories: rounding below, the curvature of the flow above."""


@checked
def lyapunov_spectrum(
    system: System | Flow,
    k: int = 1,
    periods: int = 500,
    *,
    transient: int | None = None,
    states: State | ArrayLike | None = None,
    axes: Mapping[str, Any] | None = None,
    integration: Integration | None = None,
    progress: Callable[[int, int], object] | bool | None = None,
) -> xr.Dataset:
    """The largest Lyapunov exponents, by tangents with a QR factorisation at every whole period.

    The exponents are the rates of logarithmic growth of k small changes (Benettin, Galgani, Giorgilli and Strelcyn,
    Meccanica 15 (1980) 9). Of a run that snaps and then settles, ``transient=0`` gives those of both parts.

    Parameters
    ----------
    system : System, or a Flow
        System, or any other flow.
    k : int
        Number of exponents, largest first; at most the dimension of the state.
    periods : int
        Periods of the drive to average over.
    transient : int, optional
        Periods before them; by default 16 time constants of the slowest mode, in [200, 20,000].
    states : State or array_like of shape (runs, d), optional
        Starts of the runs; the system's start by default.
    axes : mapping, optional
        Parameters that may differ between runs, each with its values: a map of exponents, all from the first state.
    integration, progress : optional
        Solver settings, and report of periods as in :func:`snapbeam.sweep`.

    Returns
    -------
    xarray.Dataset
        ``exponent`` (1/s, over ``exponent_number`` and the axes or runs) with ``exponent_error``, one standard error
        from the means of blocks. ``exponent_snapping`` and ``exponent_settled`` are of the periods before and after the
        last crossing (NaN if none), with ``periods_snapping``. Without axes, ``running`` is the estimate after each
        period and the attribute ``period`` is in s; with axes ``excitation_period`` (s) is that of each point.

    Raises
    ------
    InputError
        If a number is out of range.

    See Also
    --------
    snapbeam.dynamics.largest_lyapunov, snapbeam.plot.plot_exponents

    Examples
    --------
    >>> import snapbeam as sb
    >>> system = sb.paper.struck_beam(frequency_ratio=1.6, velocity_amplitude=0.03, damping_ratio=0.05)
    >>> result = sb.dynamics.lyapunov_spectrum(system, 2, periods=40, transient=20)
    >>> result.exponent.dims, result.exponent.attrs["units"]
    (('run', 'exponent_number'), '1/s')
    """
    flow = flow_of(system, integration)
    count = integer("k", k, 1, flow.dimension)
    total = integer("periods", periods, _BLOCKS, 10**7)
    before, rule = settling_periods(flow, transient)
    begun, points, columns = _runs(flow, states, axes)
    advanced = flow.advance(begun, before, points=columns) if before else flow.advance(begun, 1, points=columns)
    runs = advanced.states.shape[0]
    frame = np.tile(np.eye(flow.dimension)[:count], (runs, 1, 1))
    growth, crossed = np.empty((total, runs, count)), np.zeros((total, runs), dtype=bool)
    report = reported(progress, "Lyapunov spectrum", "periods")
    together = max(1, _TOGETHER // runs)
    done = 0
    while done < total:
        some = min(together, total - done)
        if some == 1:
            advanced = flow.advance(advanced, 1, tangents=frame, points=columns)
            frame, growth[done] = _orthogonal(advanced.tangents)
            crossed[done] = _crossed(advanced)
        else:
            ahead = flow.advance(advanced, some, every=True, points=columns)
            slopes, crossed[done : done + some] = _derivatives(flow, advanced.beginnings(ahead), columns, some)
            for i, slope in enumerate(slopes, done):
                frame, growth[i] = _orthogonal(frame @ slope)
            advanced = ahead
        done += some
        report(done, total)
    dataset = _dataset(flow, growth, crossed, points, before)
    dataset.attrs["termination_reason"] = _stopped(total, before, rule)
    return dataset


def _stopped(total: int, before: int, rule: str) -> str:
    return f"{total} periods after a transient of {before} periods ({rule})"


def _runs(
    flow: Flow, states: State | ArrayLike | None, axes: Mapping[str, Any] | None
) -> tuple[_Array, Points | None, dict[str, _Array] | None]:
    """Initial states of the runs, the points of a map, and its columns."""
    if states is None or isinstance(states, State):
        if not isinstance(flow, Stroboscope):
            raise InputTypeError(f"states = {shown(states)}: must be an array of shape (runs, {flow.dimension})")
        begun = flow.coordinates(states)
    else:
        begun = np.atleast_2d(finite_array("states", states))
    if axes is None:
        return begun, None, None
    points = points_of(axes, getattr(flow, "system", None))
    for name in points.names:
        if not lookup(name).is_run:
            raise InputError(f"axes {name}: needs another structure at each value; ask for each by itself")
    columns = points.take(np.arange(points.size))
    return np.repeat(begun[:1], points.size, axis=0), points, columns


def _derivatives(
    flow: Flow, begun: AdvancedStates, columns: dict[str, _Array] | None, periods: int
) -> tuple[_Array, NDArray[np.bool_]]:
    """Derivatives of the map over some periods, row i the change by the unit vector i, and the runs that crossed."""
    count, size = begun.states.shape
    unit = np.tile(np.eye(size), (count, 1, 1))
    points = None if columns is None else {name: np.tile(each, periods) for name, each in columns.items()}
    found = flow.advance(begun, 1, tangents=unit, points=points)
    assert found.tangents is not None
    crossed = np.broadcast_to(_crossed(found), count)
    return found.tangents.reshape(periods, -1, size, size), crossed.reshape(periods, -1)


def _crossed(advanced: AdvancedStates) -> NDArray[np.bool_] | bool:
    """Mask of the runs in which mid-span crossed zero in the period."""
    found = advanced.statistics.get("zero_crossings")
    return False if found is None else found > 0


def _orthogonal(tangents: _Array | None) -> tuple[_Array, _Array]:
    """An orthonormal frame, and the logarithm of what each of its directions grew by."""
    assert tangents is not None
    lost = ~np.asarray(np.isfinite(tangents).all(axis=(1, 2)))
    vectors = np.where(lost[:, None, None], 1.0, tangents).transpose(0, 2, 1)
    q, r = np.linalg.qr(vectors)
    grown = np.abs(np.diagonal(r, axis1=1, axis2=2))
    with np.errstate(divide="ignore"):
        logs = np.log(grown)
    logs[lost] = np.nan
    return np.ascontiguousarray(q.transpose(0, 2, 1)), logs


def _dataset(flow: Flow, growth: _Array, crossed: NDArray[np.bool_], points: Points | None, before: int) -> xr.Dataset:
    total, _, count = growth.shape
    periods = np.array([flow.period]) if points is None else _periods(flow, points)
    rate = growth / np.reshape(periods, (1, -1, 1))
    number = np.arange(total)[:, None]
    last = np.where(crossed.any(axis=0), total - np.argmax(crossed[::-1], axis=0), 0)
    dims = ("run",) if points is None else points.dims

    def arranged(values: NDArray[Any]) -> NDArray[Any]:
        return values if points is None else points.arranged(values)

    def during(which: NDArray[np.bool_]) -> _Array:
        """Mean over some of the periods."""
        known = which[..., None] & np.isfinite(rate)
        many = known.sum(axis=0)
        return np.where(many > 0, _sums(np.where(known, rate, 0.0)) / np.maximum(many, 1), np.nan)

    unit, own = _unit(flow), (*dims, "exponent_number")
    variables: dict[str, tuple[Any, Any, Any]] = {
        name: (own, arranged(values), in_unit(unit, words))
        for name, values, words in (
            ("exponent", _sums(rate) / total, "Lyapunov exponent"),
            ("exponent_error", _error(rate), "standard error of the exponent"),
            ("exponent_snapping", during(number < last), "finite-time exponent while it snaps"),
            ("exponent_settled", during(number >= last), "finite-time exponent once it snaps no more"),
        )
    }
    words = "periods from the first to the last with a crossing"
    variables["periods_snapping"] = (dims, arranged(last), words)
    coords: dict[str, Any] = {"exponent_number": np.arange(1, count + 1)}
    coords |= {} if points is None else points.coordinates()
    attrs = {name: value for name, value in fixed_parameters(flow).items() if name not in coords}
    attrs |= {"title": "Lyapunov exponents", "periods": total, "transient": before}
    if points is None:
        running = np.cumsum(rate, axis=0) / np.arange(1, total + 1)[:, None, None]
        variables["running"] = (("period", *own), running, in_unit(unit, "exponent so far"))
        attrs["period"] = flow.period
    else:
        variables["excitation_period"] = (dims, arranged(periods), in_unit("s", "period of the excitation"))
    return labelled(variables, coords, attrs)


def _unit(flow: Flow) -> str:
    """Unit of an exponent."""
    return "1/s" if isinstance(flow, Stroboscope) else "1"


def _sums(values: _Array) -> _Array:
    """Sums over the first axis, each run by itself: numpy's order of adding depends on the shape of the whole."""
    return np.ascontiguousarray(np.moveaxis(values, 0, -1)).sum(axis=-1)


def _error(rate: _Array) -> _Array:
    """Standard error of the mean over periods, from the means of blocks."""
    edges = np.linspace(0, len(rate), _BLOCKS + 1).astype(int)
    means = np.array([_sums(rate[a:b]) / (b - a) for a, b in pairwise(edges)])
    off = means - _sums(means) / len(means)
    return np.sqrt(_sums(off * off) / (len(means) * (len(means) - 1)))


def _periods(flow: Flow, points: Points) -> _Array:
    """Seconds of a period at each point; it follows from the parameters of the primary excitation."""
    if not isinstance(flow, Stroboscope) or flow.system.primary_excitation is None:
        return np.full(points.size, flow.period)
    leads = flow.system.primary_excitation[0]
    names = [name for name in points.names if name.startswith(f"{leads}.") and not name.endswith(".phase")]
    if not names:
        return np.full(points.size, flow.period)
    columns = points.take(np.arange(points.size))
    rows, which = np.unique(np.stack([columns[name] for name in names], axis=1), axis=0, return_inverse=True)
    systems = [flow.system.replace(**dict(zip(names, map(float, row), strict=True))) for row in rows]
    return flow.clock.cycles_per_period * np.array([cycle_of(system) for system in systems])[which.ravel()]


@checked
def largest_lyapunov(
    system: System | Flow,
    periods: int = 500,
    *,
    transient: int | None = None,
    states: State | ArrayLike | None = None,
    distance: float = 1e-8,
    integration: Integration | None = None,
    progress: Callable[[int, int], object] | bool | None = None,
) -> xr.Dataset:
    """The largest exponent from two trajectories, brought back to a small distance at every whole period.

    An independent check of :func:`lyapunov_spectrum`.

    Parameters
    ----------
    system, periods, transient, states, integration, progress
        System, run lengths, start and settings, as in :func:`lyapunov_spectrum`.
    distance : float
        Distance that is restored, in units of the well's amplitude; in [1e-12, 1e-3].

    Returns
    -------
    xarray.Dataset
        ``exponent`` (1/s) and ``exponent_error`` over ``run``; NaN, with a warning, if the trajectories become equal to
        rounding within a period. The attribute ``merged`` counts such runs.

    See Also
    --------
    snapbeam.dynamics.lyapunov_spectrum

    Examples
    --------
    >>> import snapbeam as sb
    >>> system = sb.paper.struck_beam(frequency_ratio=1.6, velocity_amplitude=0.03, damping_ratio=0.05)
    >>> result = sb.dynamics.largest_lyapunov(system, 40, transient=20)
    >>> bool(result.exponent < 0.0)
    True
    """
    flow = flow_of(system, integration)
    total = integer("periods", periods, _BLOCKS, 10**7)
    before, rule = settling_periods(flow, transient, low=1)
    size = within("distance", distance, *_DISTANCES, closed="both")
    begun, _, _ = _runs(flow, states, None)
    here = flow.advance(begun, before).states
    runs = here.shape[0]
    along = np.tile(np.ones(flow.dimension) / np.sqrt(flow.dimension), (runs, 1))
    growth = np.empty((total, runs))
    report = reported(progress, "largest Lyapunov exponent", "periods")
    for period in range(total):
        both = flow.advance(np.concatenate([here, here + size * along]), 1).states
        here, apart = both[:runs], both[runs:] - both[:runs]
        away = np.sqrt((apart * apart).sum(axis=1))
        with np.errstate(divide="ignore", invalid="ignore"):
            growth[period] = np.where(away > 0.0, np.log(away / size), np.nan)
            along = np.where((away > 0.0)[:, None], apart / away[:, None], along)
        report(period + 1, total)
    rate = growth / flow.period
    lost, unit = int(np.isnan(growth).any(axis=0).sum()), _unit(flow)
    message = (
        f"distance = {size:g}: the two trajectories become equal to rounding within a period, or fail, in {lost} of {runs} "
        "runs, whose exponents are NaN; increase distance, or use lyapunov_spectrum"
    )
    numbers = {"merged": float(lost), "runs": float(runs)}
    told = (Diagnostic("dynamics.trajectories_merged", message, numbers),) if lost else ()
    tell(told)
    return labelled(
        {
            "exponent": ("run", _sums(rate) / total, in_unit(unit, "largest Lyapunov exponent")),
            "exponent_error": ("run", _error(rate), in_unit(unit, "standard error")),
        },
        None,
        fixed_parameters(flow) | {
            "title": "largest Lyapunov exponent from two trajectories", "periods": total, "period": flow.period,
            "transient": before, "termination_reason": _stopped(total, before, rule), "merged": lost,
            "diagnostics": to_json(told),
        },
    )  # fmt: skip
