"""Force-displacement curves under a static point force: every branch, its stability, snap-through and snap-back.

In the eigenvectors of K0 the equilibria under the force F on the row c = phi(x_s) are

    alpha_i = (B_i + F c_i)/(kappa_i + mu),    mu = gamma alpha . alpha.

At a given mu the second equation is quadratic in F, so that mu is the parameter of all branches: for every mu there are
two forces, one or none.  A mode without a force of its own (B_i = c_i = 0) may branch off at mu = -kappa_i, where F and
its amplitude lie on an ellipse.  No branch is missed, closed ones included, which a path that starts at a well does not
reach.  Points are then placed by arc length.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.equilibria import condensed, tangent_stiffness
from snapbeam.model.reduced_model import ReducedModel
from snapbeam.model.system import System
from snapbeam.util.validation import InputError, InputTypeError, checked, choice, interval, shown, within

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["force_displacement"]


_Array = NDArray[np.float64]

_SAMPLES = 400
"""Values of mu between two poles at which solutions are looked for."""
_SPACING = 1.0 / 80.0
"""Greatest distance of two points of a branch; force, displacement and amplitudes over their largest values."""
_END = 1e-3
"""Distance of the first point of a secondary branch, an ellipse, from the bifurcation point, rad."""
_HALVINGS = 30
_COARSE = 241
_MARGIN = 0.25
"""Of the default range beyond the outermost equilibrium and critical point, over the distance of the two."""
_UNCOUPLED = 1e-12
"""Row of a force over its largest entry, up to which a mode is not driven by it."""
_RESIDUAL = 1e-11


@dataclass(frozen=True, eq=False)
class _Structure:
    """A structure in the coordinates in which K0 is diagonal and the elongation is alpha . alpha."""

    kappa: _Array
    load: _Array
    """B."""
    row: _Array
    """c."""
    gamma: float
    back: _Array
    """Amplitudes of the model per unit of each coordinate."""
    rest: _Array
    rest_of_force: _Array
    """Amplitudes of the model that do not change the elongation, at F = 0 and per newton."""
    shape: _Array
    """Displacement at the location per unit of each amplitude of the model."""
    model: ReducedModel

    @classmethod
    def of(cls, model: ReducedModel, location: float) -> _Structure:
        shape = np.asarray(model.shape_at(location), dtype=np.float64)
        count = model.modes
        load = np.zeros(count) if model.transverse_force is None else model.transverse_force
        stiffness, nothing = model.stiffness, np.zeros(count)
        back, rest, rest_of_force = np.eye(count), nothing, nothing
        own_load, own_row = load, shape
        if model.elongation_matrix is not None:
            first = condensed(stiffness, load, model.elongation_matrix)
            second = condensed(stiffness, shape, model.elongation_matrix)
            stiffness, back, rest, rest_of_force = first.stiffness, first.back, first.rest, second.rest
            own_load, own_row = first.force, second.force
        if stiffness.ndim == 2:
            kappa, axes = np.linalg.eigh(stiffness)
            back, own_load, own_row = back @ axes, axes.T @ own_load, axes.T @ own_row
        else:
            kappa = stiffness
        near = np.diff(np.sort(kappa[kappa < 0.0]))
        if near.size and near.min() <= 1e-12 * np.abs(kappa[kappa < 0.0]).max():
            raise InputError(
                "stiffness: has two equal negative eigenvalues, whose branches cannot be told apart; change one of them"
            )
        return cls(
            kappa=kappa,
            load=_without_rounding(own_load),
            row=_without_rounding(own_row),
            gamma=model.nonlinear_stiffness,
            back=back,
            rest=rest,
            rest_of_force=rest_of_force,
            shape=shape,
            model=model,
        )

    @cached_property
    def driven(self) -> NDArray[np.bool_]:
        """Modes that the constant load or the force acts on."""
        found: NDArray[np.bool_] = (self.load != 0.0) | (self.row != 0.0)
        return found

    @cached_property
    def coupled(self) -> NDArray[np.bool_]:
        """Modes that the force acts on: the way along a branch passes their poles."""
        found: NDArray[np.bool_] = self.row != 0.0
        return found

    def gap(self, mu: float) -> _Array:
        """kappa_i + mu of the modes with a load, never 0."""
        gap = self.kappa[self.driven] + mu
        tiny = 1e-300 + np.finfo(np.float64).eps * np.abs(self.kappa[self.driven])
        return np.where(np.abs(gap) < tiny, tiny, gap)

    def least(self, mu: float) -> tuple[float, float, float]:
        """The force of least amplitude, the margin mu/gamma less its square, and A, the sum of (c_i/(kappa_i + mu))^2."""
        gap = self.gap(mu)
        c, b = self.row[self.driven] / gap, self.load[self.driven] / gap
        a = float(c @ c)
        force = -float(c @ b) / a
        rest = b + force * c
        return force, mu / self.gamma - float(rest @ rest), a

    def solution(self, mu: float, side: float) -> tuple[float, _Array]:
        """Force and coordinates at mu; *side* is which of the two roots, +1 or -1."""
        force, margin, a = self.least(mu)
        sign = float(np.prod(np.sign(self.gap(mu)[self.coupled[self.driven]])))
        force += side * sign * math.sqrt(max(margin, 0.0) / a)
        found = np.zeros_like(self.kappa)
        found[self.driven] = (self.load + force * self.row)[self.driven] / self.gap(mu)
        return force, found

    def amplitudes(self, force: _Array, own: _Array) -> _Array:
        """Amplitudes of the model, shape (points, N)."""
        found: _Array = own @ self.back.T + self.rest + force[:, None] * self.rest_of_force
        return found

    def displacement(self, force: float, own: _Array) -> float:
        """At the location, m."""
        return float(self.shape @ (self.back @ own + self.rest + force * self.rest_of_force))


def _without_rounding(row: _Array) -> _Array:
    largest = float(np.abs(row).max()) if row.size else 0.0
    return np.where(np.abs(row) <= _UNCOUPLED * largest, 0.0, row)


# ----------------------------------------------------------------------------------------------------
# Branches.


_Point = tuple[float, _Array]


@dataclass(frozen=True, eq=False)
class _Branch:
    """A smooth branch: force and coordinates as a function of one parameter."""

    at: Callable[[float], _Point]
    low: float
    high: float
    mode: int | None
    """The mode that branched off, of a secondary branch."""
    closed: bool
    turns: tuple[float, ...] = ()
    """Parameters where it passes a pole or meets a secondary branch."""


def _intervals(own: _Structure) -> list[tuple[float, float]]:
    """Where the margin of :meth:`_Structure.least` is positive; the last one has no end."""
    from scipy.optimize import brentq, minimize_scalar

    driven = own.kappa[own.driven]
    poles = np.unique(-driven[driven < 0.0])
    top = 2.0 * float(poles[-1]) if poles.size else 1.0
    edges = [0.0, *poles.tolist()]
    scale = float(np.sum(own.load * own.load)) ** (1.0 / 3.0) * own.gamma ** (1.0 / 3.0)
    top = max(top, 4.0 * scale)

    def margin(mu: float) -> float:
        return own.least(mu)[1]

    while margin(top) <= 0.0:
        top *= 2.0
    edges.append(top)
    spread = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, _SAMPLES))
    spaced = np.unique(np.concatenate([a + (b - a) * spread for a, b in pairwise(edges)]))
    nodes = spaced[~np.isin(spaced, poles)].tolist()
    values = [margin(mu) for mu in nodes]
    # a peak or a dip between nodes of the same sign
    for i in range(1, len(nodes) - 1):
        low, mid, high = values[i - 1 : i + 2]
        dips = mid > 0.0 and mid < low and mid < high and min(low, high) > 0.0
        peaks = mid < 0.0 and mid > low and mid > high and max(low, high) < 0.0
        if dips or peaks:
            sign = 1.0 if dips else -1.0
            best = minimize_scalar(
                lambda mu, sign=sign: sign * margin(mu),
                bounds=(nodes[i - 1], nodes[i + 1]),
                method="bounded",
                options={"xatol": 1e-13 * top},
            )
            nodes.append(float(best.x))
            values.append(margin(float(best.x)))
    order = np.argsort(nodes)
    nodes, values = [nodes[i] for i in order], [values[i] for i in order]
    found: list[tuple[float, float]] = []
    # without a constant load, or with one on the row of the force, every mu has its two forces
    begin = 0.0 if values[1] > 0.0 else None
    for i in range(1, len(nodes) - 1):
        if values[i] > 0.0 >= values[i + 1]:
            end = float(brentq(margin, nodes[i], nodes[i + 1], xtol=1e-300, rtol=1e-15))
            assert begin is not None
            found.append((begin, end))
            begin = None
        elif values[i] <= 0.0 < values[i + 1]:
            begin = float(brentq(margin, nodes[i], nodes[i + 1], xtol=1e-300, rtol=1e-15))
    assert begin is not None
    found.append((begin, math.inf))
    return found


def _primary(own: _Structure, low: float, high: float) -> _Branch:
    """The branch over an interval of mu, both roots: closed, or open if the interval has no end."""
    scale = float(max(-own.kappa.min(), 0.0)) + low or 1.0
    inside = [-k for k in own.kappa.tolist() if k < 0.0 and low < -k < high]
    if math.isinf(high):

        def opened(t: float) -> _Point:
            return own.solution(low + scale * t * t, 1.0 if t >= 0.0 else -1.0)

        last = math.sqrt(max(max(-own.kappa.min(), 0.0) - low, 0.0) / scale) + 1.0
        turns = [s * math.sqrt((mu - low) / scale) for mu in inside for s in (-1.0, 1.0)]
        return _Branch(opened, -last, last, None, False, tuple(sorted(turns)))
    middle, half = 0.5 * (low + high), 0.5 * (high - low)

    def closed(t: float) -> _Point:
        return own.solution(middle - half * math.cos(t), 1.0 if math.sin(t) >= 0.0 else -1.0)

    turns = [s * math.acos((middle - mu) / half) for mu in inside for s in (-1.0, 1.0)]
    return _Branch(closed, -math.pi, math.pi, None, True, tuple(sorted(turns)))


def _secondary(own: _Structure) -> list[_Branch]:
    """The two halves of the ellipse of every mode that branches off."""
    found = []
    for j in np.flatnonzero(~own.driven & (own.kappa < 0.0)).tolist():
        mu = -float(own.kappa[j])
        middle, margin, a = own.least(mu)
        if margin <= 0.0:
            continue
        reach, most = math.sqrt(margin / a), math.sqrt(margin)

        def half(
            t: float, j: int = j, mu: float = mu, ellipse: tuple[float, float, float] = (middle, reach, most)
        ) -> _Point:
            force = ellipse[0] - ellipse[1] * math.cos(t)
            amplitude = np.zeros_like(own.kappa)
            gap = own.gap(mu)
            amplitude[own.driven] = (own.load + force * own.row)[own.driven] / gap
            amplitude[j] = ellipse[2] * math.sin(t)
            return force, amplitude

        near = _END, math.pi - _END
        found += [_Branch(half, *near, j, False), _Branch(half, -near[1], -near[0], j, False)]
    return found


# ----------------------------------------------------------------------------------------------------
# Critical points.


def _singularity(own: _Structure, point: _Point) -> float:
    """A number with the sign of the determinant of the tangent stiffness of the driven modes, in [-1, 1]."""
    amplitude = point[1]
    gap = own.gap(own.gamma * float(amplitude @ amplitude))
    q = 1.0 + 2.0 * own.gamma * float(np.sum(amplitude[own.driven] ** 2 / gap))
    return float(np.prod(np.sign(gap))) * q / (1.0 + abs(q))


def _limit_points(own: _Structure, branch: _Branch) -> list[float]:
    """Where the force turns round."""
    from scipy.optimize import brentq, minimize_scalar

    def value(t: float) -> float:
        return _singularity(own, branch.at(t))

    edges = np.unique([branch.low, *branch.turns, 0.0, branch.high])
    spread = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, _COARSE))
    nodes = np.unique(np.concatenate([a + (b - a) * spread[1:-1] for a, b in pairwise(edges)])).tolist()
    values = [value(t) for t in nodes]
    for i in range(1, len(nodes) - 1):
        low, mid, high = values[i - 1 : i + 2]
        if low * mid > 0.0 and mid * high > 0.0 and abs(mid) < abs(low) and abs(mid) < abs(high):
            sign = math.copysign(1.0, mid)
            best = minimize_scalar(
                lambda t, sign=sign: sign * value(t), bounds=(nodes[i - 1], nodes[i + 1]), method="bounded"
            )
            nodes.append(float(best.x))
            values.append(value(float(best.x)))
    order = np.argsort(nodes)
    nodes, values = [nodes[i] for i in order], [values[i] for i in order]
    return [
        float(brentq(value, nodes[i], nodes[i + 1], xtol=1e-300, rtol=1e-14))
        for i in range(len(nodes) - 1)
        if values[i] * values[i + 1] < 0.0
    ]


def _bifurcation_points(own: _Structure, branch: _Branch) -> list[float]:
    """Where a secondary branch meets a primary one."""
    free = -own.kappa[~own.driven & (own.kappa < 0.0)]
    found = []
    for t in branch.turns:
        amplitude = branch.at(t)[1]
        mu = own.gamma * float(amplitude @ amplitude)
        if free.size and np.abs(free - mu).min() <= 1e-9 * mu:
            found.append(t)
    return found


def _unstable(own: _Structure, alpha: _Array, fixed: bool = False) -> NDArray[np.int_]:
    """Negative eigenvalues of the tangent stiffness at amplitudes of shape (points, N).

    *fixed*: with the displacement at the location held.
    """
    model = own.model
    if fixed and alpha.shape[1] == 1:
        return np.zeros(alpha.shape[0], dtype=np.int_)
    tangent = np.stack(
        [tangent_stiffness(model.stiffness, own.gamma, each, model.elongation_matrix) for each in alpha]
    )
    if fixed:
        free = np.linalg.svd(own.shape[None, :])[2][1:]
        tangent = free @ tangent @ free.T
    value = np.linalg.eigvalsh(tangent)
    return np.asarray((value < -1e-12 * np.abs(value).max(axis=1)[:, None]).sum(axis=1))


# ----------------------------------------------------------------------------------------------------
# Points by arc length.


def _parameters(
    own: _Structure, branch: _Branch, special: list[float], window: tuple[float, float]
) -> _Array:
    """Parameters of the points in the window of displacement, close enough to each other."""
    low, high = branch.low, branch.high

    def place(t: float) -> float:
        return own.displacement(*branch.at(t))

    if branch.mode is None and not branch.closed:
        while window[0] < place(low) < window[1]:
            low *= 1.5
        while window[0] < place(high) < window[1]:
            high *= 1.5
    at = np.unique(np.concatenate((np.linspace(low, high, _COARSE), special, branch.turns))).tolist()
    points = [branch.at(t) for t in at]
    largest = np.array([1e-300, 1e-300, 1e-300])
    for force, own_amplitude in points:
        d = own.displacement(force, own_amplitude)
        if window[0] <= d <= window[1]:
            size = math.sqrt(float(own_amplitude @ own_amplitude))
            largest = np.maximum(largest, [abs(force), abs(d), size])
    scale = 1.0 / largest

    def inside(point: _Point) -> bool:
        return window[0] <= own.displacement(*point) <= window[1]

    def far(a: _Point, b: _Point) -> bool:
        if not (inside(a) or inside(b)):
            return False
        moved = (b[0] - a[0]) * scale[0], *((b[1] - a[1]) * scale[2])
        return math.sqrt(sum(each * each for each in moved)) > _SPACING

    for _ in range(_HALVINGS):
        wide = [i for i in range(len(at) - 1) if far(points[i], points[i + 1])]
        wide = [i for i in wide if at[i] < 0.5 * (at[i] + at[i + 1]) < at[i + 1]]
        if not wide:
            break
        for i in reversed(wide):
            middle = 0.5 * (at[i] + at[i + 1])
            at.insert(i + 1, middle)
            points.insert(i + 1, branch.at(middle))
    kept = np.array([inside(point) for point in points])
    return np.asarray(at)[kept]


def _corrected(own: _Structure, force: _Array, amplitude: _Array) -> tuple[_Array, _Array]:
    """Points put back on the equations by Newton steps of least norm where rounding near a pole moved them."""
    size = np.abs(own.kappa) + own.gamma * np.sum(amplitude**2, axis=1)[:, None]
    for _ in range(4):
        gap = own.kappa + own.gamma * np.sum(amplitude**2, axis=1)[:, None]
        residual = gap * amplitude - own.load - force[:, None] * own.row
        weight = np.sqrt(np.sum((size * amplitude) ** 2, axis=1))[:, None] + 1e-300
        wrong = np.flatnonzero(np.abs(residual / weight).max(axis=1) > _RESIDUAL)
        if not wrong.size:
            break
        for i in wrong.tolist():
            tangent = np.diag(gap[i]) + 2.0 * own.gamma * np.outer(amplitude[i], amplitude[i])
            unit = max(abs(float(force[i])), 1e-300) / max(float(np.abs(amplitude[i]).max()), 1e-300)
            step = np.linalg.lstsq(np.column_stack((tangent, -unit * own.row)), -residual[i], rcond=None)[0]
            amplitude[i] += step[:-1]
            force[i] += unit * step[-1]
    return force, amplitude


# ----------------------------------------------------------------------------------------------------


@checked
def force_displacement(
    system: System | ReducedModel,
    location: float | None = None,
    *,
    well: str | None = None,
    displacement_range: tuple[float, float] | None = None,
) -> xr.Dataset:
    r"""Compute the static force-displacement curve of a point force: every branch and its stability.

    The force F acts on the beam at *location*, positive towards the upper well.  The displacement w is that of the same
    point, from the straight line through the ends.  With c = phi(x_s) the equilibria solve

        K0 alpha + gamma (alpha . alpha) alpha = B + F c.

    All branches of the reduced model are found, symmetric, antisymmetric and closed ones, because the equations have a
    closed form with one parameter (Qiu, Lang and Slocum, J. Microelectromech. Syst. 13, 2004, 137, for a central force).
    Structures with one equilibrium, such as a shallow arch, have a curve too.

    Parameters
    ----------
    system : System or ReducedModel
        The striker, the drive, the contact and forces that change in time do not matter; a constant part of the external
        force acts.
    location : float, optional
        x_s in (0, 1); that of the striker by default.  A structure given by matrices has its own.
    well : {"lower", "upper"}, optional
        The well from which the force pushes the beam.  By default the as-fabricated one, on the side of the initial
        shape; of a beam without an initial shape the lower one.
    displacement_range : (float, float), optional
        Range of w, m.  By default all equilibria and critical points, and a quarter more at both ends.

    Returns
    -------
    xarray.Dataset
        Over ``point``: ``displacement`` (m), ``force`` (N), ``energy`` (J, potential energy without the work of the
        force), ``branch``, ``unstable_directions`` under a given force (0: stable),
        ``unstable_directions_at_fixed_displacement``, and ``amplitude`` (alpha, over ``mode``).  Over ``branch_number``:
        ``branch_kind``, "primary" or "secondary".  Over ``critical_point``: ``critical_kind`` ("limit" or
        "bifurcation"), ``critical_displacement`` (m), ``critical_force`` (N), ``critical_branch``.
        ``snap_through_force`` (N) is where the stable path from the well ends under a force towards the other side.
        ``snap_back_force`` is where the stable path of the other well ends on the way back; with one well, where the path
        that comes from a large force does.  ``snap_through_displacement`` and ``snap_back_displacement`` (m) belong to
        them.  They are NaN if the beam does not snap.
        ``energy_barrier`` (J) is that from the well to the saddle without a force, ``energy_barrier_back`` that from the
        other well; NaN with one well.  The attributes name the well, how it was chosen, and the kind of the critical
        points.

    Raises
    ------
    InputError
        For a location at a node of all modes, a structure without a nonlinear stiffness, or a well that does not exist.

    Examples
    --------
    The bistable arch of Qiu, Lang and Slocum has a rise of six thicknesses:

    >>> import snapbeam as sb
    >>> beam = sb.Beam(length=3e-3, thickness=1e-5, width=5e-4, density=2330, young_modulus=169e9, axial_load=0.0)
    >>> arch = sb.ReducedModel.from_beam(beam, modes=3, imperfection=sb.Imperfection(midspan_amplitude=6e-5))
    >>> curve = sb.force_displacement(arch, 0.5)
    >>> print(f"{float(curve.snap_through_force) * 1e3:.2f} mN, {curve.attrs['snap_through_kind']}")
    -6.11 mN, bifurcation
    """
    from snapbeam.util.datasets import xr

    if not isinstance(system, (System, ReducedModel)):
        raise InputTypeError(f"system = {shown(system)}: must be a System or a ReducedModel")
    if isinstance(system, System) and system.potential.local_forces:
        raise InputError(
            f"local_force = {shown(system.local_force)}: the force-displacement curve has a closed form for the structure and "
            "constant forces only; leave it out (system.replace(local_force=None)), or use system.potential for its equilibria"
        )
    model = system.potential.structure if isinstance(system, System) else system
    if location is None:
        if isinstance(system, System) and system.striker is not None:
            location = system.striker.location
        elif model.beam is not None:
            raise InputError("location = None: must be given, in (0, 1), for a system without a striker")
        else:
            location = 0.5
    location = within("location", location, 0.0, 1.0)
    if not model.nonlinear_stiffness > 0.0:
        raise InputError(
            "nonlinear_stiffness = 0: must be greater than 0; a linear structure has a straight line"
        )
    own = _Structure.of(model, location)
    if not own.coupled.any():
        raise InputError(f"location = {location:g}: no mode moves there; use another location or more modes")
    side, chosen = _well(model, well)
    primary = [_primary(own, *interval) for interval in _intervals(own)]
    branches = primary + _secondary(own)
    critical: list[list[tuple[float, str]]] = []
    for branch in branches:
        found = [(t, "limit") for t in _limit_points(own, branch)] if branch.mode is None else []
        found += [(t, "bifurcation") for t in _bifurcation_points(own, branch)]
        critical.append(sorted(found))
    window = _window(own, model, branches, critical, displacement_range)

    rows: dict[str, list[Any]] = {"force": [], "own": [], "branch": []}
    for number, branch in enumerate(branches):
        for t in _parameters(own, branch, [each for each, _ in critical[number]], window).tolist():
            one_force, one = branch.at(t)
            rows["force"].append(one_force)
            rows["own"].append(one)
            rows["branch"].append(number)
    if not rows["force"]:
        raise InputError(
            f"displacement_range = {displacement_range!r}: must contain a part of the curve, which has equilibria "
            f"without a force at {', '.join(f'{own.shape @ each.amplitude:.4g}' for each in model.equilibria)} m"
        )
    force, amplitude = _corrected(own, np.array(rows["force"]), np.array(rows["own"]))
    alpha = own.amplitudes(force, amplitude)
    special = [(number, t, kind) for number, each in enumerate(critical) for t, kind in each]
    special_points = [branches[number].at(t) for number, t, _ in special]
    snaps = _snaps(own, primary, critical, model, side)
    barriers = {"energy_barrier": math.nan, "energy_barrier_back": math.nan}
    if model.is_bistable:
        energies = [model.saddle_energy - float(model.potential_energy(each)) for each in model.wells]
        at = 0 if side == "lower" else 1
        barriers = {"energy_barrier": energies[at], "energy_barrier_back": energies[1 - at]}
    variables: dict[str, Any] = {
        "displacement": ("point", alpha @ own.shape, _attributes("m", "displacement at the force")),
        "force": ("point", force, _attributes("N", "force")),
        "energy": (
            "point",
            model.potential_energy(alpha),
            _attributes("J", "potential energy without the force"),
        ),
        "unstable_directions": (
            "point",
            _unstable(own, alpha),
            _attributes("1", "unstable directions under the force; 0 is stable"),
        ),
        "unstable_directions_at_fixed_displacement": (
            "point",
            _unstable(own, alpha, fixed=True),
            _attributes("1", "unstable directions if the displacement at the force is held"),
        ),
        "branch": ("point", np.array(rows["branch"]), _attributes("1", "number of the branch")),
        "amplitude": (
            ("point", "mode"),
            alpha,
            _attributes("m^0.5" if model.beam is not None else "1", "amplitudes of the modes"),
        ),
        "branch_kind": (
            "branch_number",
            np.array(["primary" if each.mode is None else "secondary" for each in branches]),
            {"long_name": "kind of the branch"},
        ),
        "critical_kind": (
            "critical_point",
            np.array([kind for _, _, kind in special], dtype="<U11"),
            {"long_name": "kind of the critical point"},
        ),
        "critical_branch": (
            "critical_point",
            np.array([number for number, _, _ in special], dtype=np.int64),
            _attributes("1", "branch of the critical point"),
        ),
        "critical_displacement": (
            "critical_point",
            np.array([own.displacement(*each) for each in special_points]),
            _attributes("m", "displacement at the critical point"),
        ),
        "critical_force": (
            "critical_point",
            np.array([each[0] for each in special_points]),
            _attributes("N", "force at the critical point"),
        ),
    }
    for name in ("snap_through", "snap_back"):
        words = name.replace("_", "-")
        variables[f"{name}_force"] = ((), snaps[name][0], _attributes("N", f"{words} force"))
        variables[f"{name}_displacement"] = ((), snaps[name][1], _attributes("m", f"displacement at {words}"))
    origins = {"energy_barrier": "from the well", "energy_barrier_back": "from the other well"}
    for name, value in barriers.items():
        variables[name] = ((), value, _attributes("J", f"energy barrier {origins[name]}, without a force"))
    return xr.Dataset(
        variables,
        coords={"branch_number": np.arange(len(branches)), "mode": np.arange(1, model.modes + 1)},
        attrs={
            "description": "static force-displacement curve of a point force",
            "location": location,
            "well": side,
            "well_chosen_as": chosen,
            "wells": 2 if model.is_bistable else 1,
            "snap_through_kind": snaps["snap_through"][2],
            "snap_back_kind": snaps["snap_back"][2],
            "modes": model.modes,
        },
    )


def _attributes(unit: str, words: str) -> dict[str, str]:
    return {"units": unit, "long_name": words}


def _well(model: ReducedModel, given: str | None) -> tuple[str, str]:
    """Name of the well that the force pushes from, and how it was chosen."""
    if given is not None:
        name = choice("well", given, ("lower", "upper"))
        if not model.is_bistable and name != (only := _only_side(model)):
            raise InputError(f"well = {name!r}: this structure has one well, the {only} one; leave well out")
        return name, "given"
    if not model.is_bistable:
        return _only_side(model), "the only equilibrium"
    side = model.as_fabricated_well
    return ("lower", "lower by default; no initial shape") if side is None else (side, "as fabricated")


def _only_side(model: ReducedModel) -> str:
    return "upper" if float(model.midspan_shape @ model.well_amplitude) > 0.0 else "lower"


def _window(
    own: _Structure,
    model: ReducedModel,
    branches: list[_Branch],
    critical: list[list[tuple[float, str]]],
    given: tuple[float, float] | None,
) -> tuple[float, float]:
    """Range of the displacement, m."""
    if given is not None:
        return interval("displacement_range", given)
    places = [float(own.shape @ each.amplitude) for each in model.equilibria]
    for branch, found in zip(branches, critical, strict=True):
        places += [own.displacement(*branch.at(t)) for t, _ in found]
    low, high = min(places), max(places)
    margin = _MARGIN * (high - low)
    if margin == 0.0:
        size = model.beam.thickness if model.beam is not None else model.length_scale or 1.0
        margin = max(size, abs(high))
    return low - margin, high + margin


_Segment = tuple[_Branch, tuple[tuple[float, str], ...], tuple[float, float]]
"""A stable part of a primary branch, the critical points at its ends, and its range of the parameter."""


def _snaps(
    own: _Structure,
    primary: list[_Branch],
    critical: list[list[tuple[float, str]]],
    model: ReducedModel,
    side: str,
) -> dict[str, tuple[float, float, str]]:
    """Force, displacement and kind of the critical points where the stable paths of the two sides end."""
    none = math.nan, math.nan, "none"
    stable: list[_Segment] = []
    for branch, special in zip(primary, critical, strict=False):
        ends = [branch.low, *(t for t, _ in special), branch.high]
        for i, (a, b) in enumerate(pairwise(ends)):
            force, amplitude = branch.at(0.5 * (a + b))
            if _unstable(own, own.amplitudes(np.array([force]), amplitude[None, :]))[0] == 0:
                stable.append((branch, tuple(special[max(i - 1, 0) : i + 1]), (a, b)))
    push = 1.0 if side == "lower" else -1.0
    wells = model.wells if side == "lower" else model.wells[::-1]
    home = min(stable, key=lambda each: _distance_to(own, each, wells[0]))
    if model.is_bistable:
        away = min(stable, key=lambda each: _distance_to(own, each, wells[1]))
    else:
        tails = [each for each in stable if not each[0].closed]
        away = next(each for each in tails if _reaches(each, push))
    if home is away or not np.any(wells[0]):
        return {"snap_through": none, "snap_back": none}

    def ends_of(segment: _Segment) -> list[tuple[float, float, str]]:
        branch, special, _ = segment
        return [
            (p[0], own.displacement(*p), kind) for p, kind in ((branch.at(t), kind) for t, kind in special)
        ]

    return {
        "snap_through": max(ends_of(home), key=lambda each: push * each[0], default=none),
        "snap_back": min(ends_of(away), key=lambda each: push * each[0], default=none),
    }


def _reaches(segment: _Segment, push: float) -> bool:
    """Whether a stable part of an open branch goes on to any force in the direction of *push*."""
    branch, _, ends = segment
    outer = [t for t in ends if t in (branch.low, branch.high)]
    return any(math.copysign(1.0, branch.at(1e3 * t)[0]) == push for t in outer)


def _distance_to(own: _Structure, segment: _Segment, well: _Array) -> float:
    """Least distance of the equilibria without a force on a stable part from a well."""
    from scipy.optimize import brentq

    branch, _, (a, b) = segment
    reach = branch.high - branch.low
    low, high = a, b
    if not branch.closed:
        low -= 4.0 * reach if a == branch.low else 0.0
        high += 4.0 * reach if b == branch.high else 0.0
    nodes = np.linspace(low, high, 65).tolist()
    values = [branch.at(t)[0] for t in nodes]
    found = math.inf
    for i in range(64):
        if values[i] * values[i + 1] <= 0.0:
            t = brentq(lambda t: branch.at(t)[0], nodes[i], nodes[i + 1], xtol=1e-14 * reach)
            force, amplitude = branch.at(float(t))
            alpha = own.amplitudes(np.array([force]), amplitude[None, :])[0]
            found = min(found, float(np.abs(alpha - well).max()))
    return found
