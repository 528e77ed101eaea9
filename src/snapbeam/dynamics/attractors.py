"""The attractors of a system: found by integrating many states, and verified one by one."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import solve_discrete_lyapunov
from scipy.spatial import cKDTree
from scipy.stats import beta

from snapbeam.dynamics.flow import AdvancedStates, Flow, minimal_period
from snapbeam.dynamics.lyapunov import lyapunov_spectrum
from snapbeam.dynamics.periodic_orbits import PeriodicOrbit, shoot
from snapbeam.dynamics.results import in_unit, of_flow, reported
from snapbeam.dynamics.shooting import Family, OrbitNotFoundError, jacobian, orbit_tolerance, require_isolated_orbits
from snapbeam.dynamics.stroboscope import Stroboscope, flow_of, settling_periods
from snapbeam.model.integration import Integration
from snapbeam.model.system import System
from snapbeam.util.display import plotter
from snapbeam.util.validation import InputError, checked, finite_array, integer, seed_of, within

if TYPE_CHECKING:
    import xarray as xr

_TRIED = 48
"""States on each shell that are tried."""
_SHELLS = 9
_LARGEST = 0.5
"""Radius of the largest shell, in units of the well's amplitude along the longest axis."""
_SHARE = 0.5
"""Fraction of the tested radius within which a state counts as captured."""
_SEED = 20240817
_Array = NDArray[np.float64]
UNDECIDED = -1
"""Label of a state of which it is not certain where it goes."""
KINDS = ("periodic", "chaotic")
_REPEATS = 2e-3
"""Maximum coordinate by which states may differ that are taken to repeat before they are shot at."""
_SAME = 1e-5
_SIGMAS = 3.0
_TRANSIENT = 1000
"""Minimum number of periods to leave out."""
_PARTS = 4
_FEW = 8
"""Irregular runs of a group that exponents are taken of."""


# When a state is certainly on its way to an attractor: norms in which orbits contract, and clouds of chaotic ones.


@dataclass(frozen=True, eq=False)
class Ball:
    """States about a point of a stable orbit that come nearer with every return, by |e|_Q^2 = e.Q e.

    Q - M^T Q M = 1 for the derivative M of the return map.  Up to the radius 48 states on every shell came back nearer:
    tried, not proved; half of it is used.
    """

    center: _Array
    factor: _Array
    """L of Q = L L^T, shape (d, d)."""
    radius: float

    def holds(self, rows: _Array) -> NDArray[np.bool_]:
        """Mask of the states of shape (runs, d) that are within, each by itself."""
        away = rows - self.center
        total = sum((away * column).sum(axis=1) ** 2 for column in self.factor.T)
        return np.asarray(total <= (_SHARE * self.radius) ** 2)


def balls_of(orbit: PeriodicOrbit) -> list[Ball]:
    """A ball about every point of a stable orbit, in the order of its points; radius 0 where none was found."""
    size = orbit.coordinates.size
    directions = np.random.Generator(np.random.Philox(_SEED)).standard_normal((_TRIED, size))
    directions /= np.sqrt((directions**2).sum(axis=1))[:, None]
    others = (jacobian(Family(orbit.flow), point, orbit.period).jacobian for point in orbit.points[1:])
    slopes = [orbit.jacobian, *others]
    return [_ball(orbit, point, slope, directions) for point, slope in zip(orbit.points, slopes, strict=True)]


def _ball(orbit: PeriodicOrbit, point: _Array, slope: _Array, directions: _Array) -> Ball:
    metric = solve_discrete_lyapunov(slope.T, np.eye(point.size))
    metric = 0.5 * (metric + metric.T)
    factor = np.linalg.cholesky(metric)
    # on a shell of |e|_Q = r: e = r L^-T u for unit vectors u
    shell = np.linalg.solve(factor.T, directions.T).T
    longest = float(np.sqrt((shell**2).sum(axis=1)).max())
    radius = 0.0
    for level in range(_SHELLS, -1, -1):
        size = _LARGEST / longest * 0.5**level
        came = orbit.flow.advance(point + size * shell, orbit.period).states
        away = (came - point) @ factor
        if not (np.sqrt((away**2).sum(axis=1)) < size).all():
            break
        radius = size
    return Ball(point, factor, radius)


@dataclass(frozen=True, eq=False)
class Cloud:
    """Points of a chaotic attractor, and how far from them its own points lie."""

    points: _Array
    tree: cKDTree
    reach: float

    def holds(self, rows: _Array) -> NDArray[np.bool_]:
        """Mask of the states that lie among the points."""
        known = np.asarray(np.isfinite(rows).all(axis=1))
        away, _ = self.tree.query(np.where(known[:, None], rows, 0.0))
        return np.asarray(known & (away <= self.reach))


@dataclass(frozen=True, eq=False)
class Attractor:
    """One attractor: a periodic orbit or a chaotic set, with its states and its verification.

    See Also
    --------
    snapbeam.dynamics.find_attractors, snapbeam.dynamics.Attractors

    Examples
    --------
    >>> import snapbeam as sb
    >>> system = sb.paper.struck_beam(frequency_ratio=1.6, velocity_amplitude=0.03, damping_ratio=0.05)
    >>> found = sb.dynamics.find_attractors(system, 12)
    >>> [(each.kind, each.period) for each in found.attractors]
    [('periodic', 1), ('periodic', 1), ('periodic', 1)]
    """

    kind: str
    """One of :data:`KINDS`."""
    points: _Array
    """States once a period: all of a periodic orbit, some of a chaotic attractor, shape (points, d)."""
    orbit: PeriodicOrbit | None
    exponent: float
    """Largest Lyapunov exponent, 1/s (per period of a map)."""
    exponent_error: float
    verification: PeriodicOrbit | None = None
    """The orbit at accuracy level "reference", whose multipliers are inside the unit circle."""

    @property
    def period(self) -> int:
        """Periods of the drive; 0 of a chaotic one."""
        return self.orbit.period if self.orbit is not None else 0

    @cached_property
    def trapping_region(self) -> list[Ball] | Cloud:
        """Region from which a state is known to converge to the attractor."""
        if self.orbit is not None:
            return balls_of(self.orbit)
        # one half determines the distance of the other
        away, _ = cKDTree(self.points[::2]).query(self.points[1::2])
        return Cloud(self.points, cKDTree(self.points), 1.5 * float(np.quantile(away, 0.99)))

    def __repr__(self) -> str:
        if self.orbit is not None:
            return f"<Attractor: period {self.period}, exponent {self.exponent:.4g} from its multipliers>"
        return f"<Attractor: chaotic, exponent {self.exponent:.4g} +- {self.exponent_error:.2g}>"


@dataclass(frozen=True, eq=False)
class Attractors:
    """The verified attractors, and the attractor that each state goes to.

    See Also
    --------
    snapbeam.dynamics.find_attractors, snapbeam.dynamics.basins_of_attraction

    Examples
    --------
    >>> import snapbeam as sb
    >>> system = sb.paper.struck_beam(frequency_ratio=1.6, velocity_amplitude=0.03, damping_ratio=0.05)
    >>> found = sb.dynamics.find_attractors(system, 12)
    >>> found.undecided
    0.0
    """

    flow: Flow
    attractors: list[Attractor]
    """Periodic ones first, by period, then by the coordinates of their points."""
    labels: NDArray[np.int64]
    """Number of the attractor of every state, or :data:`UNDECIDED`."""
    check_periods: int
    """Periods over which a chaotic attractor was seen not to end."""
    termination_reason: str
    """Periods after which the search stopped, the rule that stopped it, and the reason why states are undecided."""

    @property
    def shares(self) -> _Array:
        """Fractions of the states that converge to each attractor."""
        return np.array([float((self.labels == i).mean()) for i in range(len(self.attractors))])

    @property
    def undecided(self) -> float:
        """Fraction of undecided states."""
        return float((self.labels == UNDECIDED).mean())

    def unseen_share(self, confidence: float = 0.95) -> float:
        """Upper bound of the share of initial states that go to attractors that were not found.

        It bounds the volume of basins in the region of random states, by Clopper and Pearson: about 3/n at 95 % if all
        *n* states are decided (the rule of three). Undecided states count as unseen.
        """
        level = within("confidence", confidence, 0.0, 1.0)
        lost, count = int((self.labels == UNDECIDED).sum()), self.labels.size
        return 1.0 if lost == count else float(beta.ppf(level, lost + 1, count - lost))

    def __repr__(self) -> str:
        return (
            f"<{len(self.attractors)} attractors, {100 * self.undecided:.3g} % of {self.labels.size} states undecided, "
            f"others have less than {100 * self.unseen_share():.2g} % of the sampled states at 95 %>"
        )

    def plot(self, ax: Any = None, **options: Any) -> Any:
        """Draw the attractors once a period, with the share of the states that go to each; returns the axes."""
        return plotter("plot_dataset")(self.to_dataset(), None, ax, **options)

    def to_dataset(self) -> xr.Dataset:
        """Kinds, periods, exponents, shares and points, labelled."""
        unit = "1/s" if isinstance(self.flow, Stroboscope) else "1"
        of, every = "attractor", self.attractors
        attrs = {
            "title": "attractors", "undecided": self.undecided, "check_periods": self.check_periods,
            "unseen_share_95": self.unseen_share(), "termination_reason": self.termination_reason,
        }  # fmt: skip
        variables = {
            "kind": (of, [each.kind for each in every], {"long_name": "kind of attractor"}),
            "period": (of, [each.period for each in every], "periods; 0: chaotic"),
            "exponent": (of, [each.exponent for each in every], in_unit(unit, "largest exponent")),
            "exponent_error": (of, [each.exponent_error for each in every], in_unit(unit, "standard error")),
            "share": (of, self.shares, "fraction of the states that converge to it"),
            "points": ((of, "point", "coordinate"), self.every_point, "the attractor once a period"),
            "label": ("state", self.labels, "attractor that a state goes to; -1: undecided"),
        }  # fmt: skip
        return of_flow(self.flow, variables, attrs)

    @property
    def every_point(self) -> _Array:
        """Points of every attractor, shape (attractors, points, d), NaN beyond those that it has."""
        size = max((len(each.points) for each in self.attractors), default=1)
        found = np.full((len(self.attractors), size, self.flow.dimension), np.nan)
        for i, each in enumerate(self.attractors):
            found[i, : len(each.points)] = each.points
        return found


def spread_states(flow: Stroboscope, count: int, seed: int = 0) -> _Array:
    """Random states of the region of :func:`find_attractors`; state s comes from Philox with key (seed, s) alone."""
    model, n = flow.system.struck_model, flow.space.modes
    rows = np.zeros((count, flow.dimension))
    reach = 0.2 * flow.space.scales[0] / np.sqrt((model.linear_modes**2).sum(axis=0))
    reach = reach * np.stack([model.omega[0] / model.omega, np.full(n, model.omega[0])])
    for s in range(count):
        draw = np.random.Generator(np.random.Philox(key=[seed, s]))
        modal = draw.uniform(-1.0, 1.0, (2, n)) * reach
        rows[s, : 2 * n] = (modal @ model.linear_modes.T).ravel() / flow.space.scales[: 2 * n]
        rows[s, 0] += draw.uniform(-1.4, 1.4)
        rows[s, n] += draw.uniform(-0.6, 0.6)
    return rows


@checked
def find_attractors(
    system: System | Flow,
    states: ArrayLike | int = 200,
    *,
    transient: int | None = None,
    max_periods: int = 8,
    check_periods: int = 1000,
    rng: int | np.random.Generator | None = 0,
    tolerance: float = 1e-10,
    integration: Integration | None = None,
    progress: Callable[[int, int], object] | bool | None = None,
) -> Attractors:
    """Find the attractors that many states lead to, and verify each; other states are undecided.

    A periodic attractor is verified if shooting converges from the last state of a run and every multiplier is inside
    the unit circle, at accuracy level "reference" too. A chaotic attractor is verified if its largest exponent exceeds
    0 by three standard errors and none of its states leaves it in *check_periods* more periods.

    For a number of *states* the sampled region is, in the dimensionless coordinates of the flow: ``amplitude[1]``
    uniform in [-1.4, 1.4] and ``velocity[1]`` in [-0.6, 0.6], plus a random vibration of each linear mode j of at most
    0.2 omega_1/omega_j in amplitude and 0.2 in velocity. ``unseen_share`` is a bound for this region.

    Parameters
    ----------
    system : System, or a Flow
        System, or any other flow.
    states : array_like of shape (states, d), or int
        Initial states, or their number in the region above.
    transient : int, optional
        Periods to leave out; by default 16 time constants of the slowest mode, in [1000, 20,000].
    max_periods : int
        Longest period to look for, in periods of the drive.
    check_periods : int
        Periods over which a chaotic attractor must not end.
    rng : int, numpy.random.Generator or None
        Seed of the initial states, or a generator that gives one.
    tolerance : float
        Tolerance of the orbits, as in :func:`periodic_orbit`.
    integration, progress : optional
        Solver settings, and report of parts of the work as in :func:`snapbeam.sweep`.

    Returns
    -------
    Attractors
        The attractors, with ``unseen_share()`` and ``termination_reason``, why states are undecided.

    See Also
    --------
    snapbeam.dynamics.basins_of_attraction, snapbeam.dynamics.periodic_orbit

    Examples
    --------
    >>> import snapbeam as sb
    >>> system = sb.paper.struck_beam(frequency_ratio=1.6, velocity_amplitude=0.03, damping_ratio=0.05)
    >>> found = sb.dynamics.find_attractors(system, 12)
    >>> f"{found.unseen_share():.2f}"  # upper bound at 95 % of the fraction of states that go to other attractors
    '0.22'
    """
    flow = flow_of(system, integration)
    require_isolated_orbits(flow)
    leave, rule = settling_periods(flow, transient, least=_TRANSIENT, low=1)
    most, lasts = (integer("max_periods", max_periods, 1, 512), integer("check_periods", check_periods, 20, 10**7))
    rows = _states_of(flow, states, seed_of(rng))
    allowed = orbit_tolerance(tolerance)

    report = reported(progress, "attractors", "parts")
    report(0, _PARTS)
    there = flow.advance(rows, leave)
    seen = flow.advance(there, 2 * most, every=True)
    report(1, _PARTS)
    assert seen.every is not None
    known = np.asarray(np.isfinite(seen.states).all(axis=1))
    repeats = np.where(known, minimal_period(np.where(known[:, None, None], seen.every, 0.0), _REPEATS), 0)
    verified, reasons = _orbits(flow, seen, repeats, allowed)
    report(2, _PARTS)
    regular = [_periodic(*each) for each in verified.items()]
    labels = np.full(len(rows), UNDECIDED)
    for s in np.flatnonzero(repeats > 0):
        labels[s] = _nearest(verified, seen.states[s])
    irregular = np.flatnonzero(known & (repeats == 0))
    chaotic, members = _chaotic(flow, seen, irregular, most, lasts)
    report(3, _PARTS)
    found, order = _ordered([*regular, *chaotic])
    for number, group in enumerate(members):
        labels[group] = len(regular) + number
    labels = np.append(order, UNDECIDED)[labels]
    report(4, _PARTS)
    reason = "; ".join([f"{leave} periods left out ({rule})", *_undecided(labels, known, repeats, most, reasons)])
    return Attractors(flow, found, labels, lasts, reason)


def _undecided(
    labels: NDArray[np.int64], known: NDArray[np.bool_], repeats: NDArray[np.int64], most: int, reasons: list[str]
) -> list[str]:
    """Reasons why states are undecided."""
    why = "; ".join(dict.fromkeys(reasons)) or "another orbit is nearby"
    groups = {
        "failed": ~known,
        f"repeat after none of 1 to {most} periods and are not verified as chaotic": known & (repeats == 0),
        f"repeat, but their orbit is not verified ({why})": repeats > 0,
    }
    counts = {text: int(((labels == UNDECIDED) & group).sum()) for text, group in groups.items()}
    return [f"{count} states {text}" for text, count in counts.items() if count]


def _states_of(flow: Flow, states: ArrayLike | int, seed: int) -> _Array:
    if isinstance(states, (int, np.integer)) and not isinstance(states, bool):
        if not isinstance(flow, Stroboscope):
            raise InputError(f"states = {states}: must be an array of states for a flow that is not a System")
        return spread_states(flow, integer("states", states, 1, 10**7), seed)
    rows = finite_array("states", states, 2)
    if rows.shape[1] != flow.dimension or not len(rows):
        raise InputError(f"states of shape {rows.shape}: must have the shape (states, {flow.dimension})")
    return rows


def _orbits(
    flow: Flow, seen: AdvancedStates, repeats: NDArray[np.int64], tolerance: float
) -> tuple[dict[PeriodicOrbit, PeriodicOrbit], list[str]]:
    """The stable orbits that states which repeat are on, each once and with its verification; why others are none."""
    found: dict[PeriodicOrbit, PeriodicOrbit] = {}
    missed: list[_Array] = []
    reasons: list[str] = []
    for s in np.flatnonzero(repeats > 0):
        x = seen.states[s]
        if _nearest(found, x) != UNDECIDED or any(np.abs(x - other).max() < _REPEATS for other in missed):
            continue
        try:
            orbit = shoot(flow, x, int(repeats[s]), tolerance)
            if orbit.minimal_period != orbit.period:
                orbit = shoot(flow, orbit.coordinates, orbit.minimal_period, tolerance)
        except OrbitNotFoundError as error:
            missed.append(x)
            reasons.append(str(error))
            continue
        near = np.abs(orbit.points - x).max(axis=1).min() < 10.0 * _REPEATS
        verification = _verify(orbit, tolerance) if near and orbit.is_stable else None
        if verification is None:
            missed.append(x)
            reasons.append("it is unstable, far away, or not confirmed at accuracy = 'reference'")
        elif not any(_is_same(orbit, other) for other in found):
            found[orbit] = verification
    return found, reasons


def _verify(orbit: PeriodicOrbit, tolerance: float) -> PeriodicOrbit | None:
    """The same orbit by fine steps, if it is there and stable: tangents of coarse ones are a per cent off."""
    if not isinstance(orbit.flow, Stroboscope) or orbit.flow.integration.accuracy == "reference":
        return orbit
    settings = orbit.flow.integration.replace(accuracy="reference", step=None)
    try:
        fine = shoot(replace(orbit.flow, integration=settings), orbit.coordinates, orbit.period, tolerance)
    except OrbitNotFoundError:
        return None
    near = float(np.abs(fine.coordinates - orbit.coordinates).max()) < 10.0 * _REPEATS
    return fine if near and fine.is_stable else None


def _is_same(one: PeriodicOrbit, other: PeriodicOrbit) -> bool:
    return one.period == other.period and float(np.abs(other.points - one.coordinates).max(axis=1).min()) < _SAME


def _nearest(orbits: Iterable[PeriodicOrbit], x: _Array) -> int:
    """Orbit of a state, within the tolerance of repeating states."""
    near = (float(np.abs(orbit.points - x).max(axis=1).min()) < 10.0 * _REPEATS for orbit in orbits)
    return next((number for number, is_near in enumerate(near) if is_near), UNDECIDED)


def _periodic(orbit: PeriodicOrbit, verification: PeriodicOrbit) -> Attractor:
    size = max(float(np.abs(verification.multipliers[0])), 1e-300)
    exponent = float(np.log(size)) / (orbit.period * orbit.flow.period)
    return Attractor("periodic", orbit.points, orbit, exponent, 0.0, verification)


def _chaotic(
    flow: Flow, seen: AdvancedStates, which: NDArray[np.int64], most: int, lasts: int
) -> tuple[list[Attractor], list[NDArray[np.int64]]]:
    """Groups of runs that never repeat, those of them that last and diverge."""
    if not which.size:
        return [], []
    later = flow.advance(flow.advance(seen.states[which], lasts), 2 * most + 62, every=True)
    assert later.every is not None
    rest = minimal_period(np.nan_to_num(later.every[:, : 2 * most], nan=0.0), _REPEATS)
    left = (rest > 0) | ~np.isfinite(later.states).all(axis=1)
    found, members = [], []
    for group in _groups(later.every):
        if left[group].any():
            continue
        exponents = lyapunov_spectrum(flow, 1, max(lasts // 2, 100), transient=0, states=later.states[group[:_FEW]])
        value = float(exponents["exponent"].mean())
        error = float(exponents["exponent_error"].max())
        if not value > _SIGMAS * error:
            continue
        points = later.every[group].reshape(-1, flow.dimension)
        found.append(Attractor("chaotic", points, None, value, error))
        members.append(which[group])
    return found, members


def _groups(every: _Array) -> list[NDArray[np.int64]]:
    """Runs whose points lie among each other's, shape (runs, periods, d); in the order of their first run."""
    count, trees = len(every), [cKDTree(run[np.isfinite(run).all(axis=1)]) for run in every]
    group = np.arange(count)
    for i in range(count):
        like = (j for j in range(i) if group[j] == j and trees[i].n and trees[j].n and _mingle(trees[i], trees[j]))
        group[i] = next(like, i)
    return [np.flatnonzero(group == i) for i in range(count) if group[i] == i]


def _mingle(tree_one: Any, tree_other: Any) -> bool:
    """Return whether each run comes as close to the points of the other as to its own."""
    own = max(float(np.median(tree.query(tree.data, 2)[0][:, 1])) for tree in (tree_one, tree_other))
    across = min(
        float(np.median(tree_one.query(tree_other.data)[0])), float(np.median(tree_other.query(tree_one.data)[0]))
    )
    return across < 3.0 * own


def _ordered(found: list[Attractor]) -> tuple[list[Attractor], NDArray[np.int64]]:
    """Attractors in a fixed order, independent of the states that led to them, and the position of each."""

    def key(i: int) -> tuple[Any, ...]:
        each = found[i]
        lowest = each.points[np.lexsort(np.round(each.points, 6).T[::-1])[0]]
        return (KINDS.index(each.kind), each.period, *np.round(lowest, 6).tolist())

    order = sorted(range(len(found)), key=key)
    return [found[i] for i in order], np.argsort(np.array(order, dtype=np.int64))
