"""Potential energy of a system: the structure, constant forces and local forces, and the equilibria that follow from it."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.model.equilibria import Equilibrium, dot, landscape_of, product, tangent_stiffness
from snapbeam.model.external_force import ExternalForce
from snapbeam.model.local_force import LocalForce
from snapbeam.model.quantity import quantities
from snapbeam.model.reduced_model import LinearModes, ReducedModel, linear_modes_about
from snapbeam.util.si_prefixes import with_unit
from snapbeam.util.validation import InputError, finite_array, shown

_Array = NDArray[np.float64]
_STARTS = 512, 4096, 32768
"""Starting points of Newton's method, in one search after another until the equilibria are complete."""
_ITERATIONS = 200
_HALVINGS = 40
_RESIDUAL = 1e-11
"""Tolerance of the gradient, over the sum of the magnitudes of its terms."""
_ROUNDING = 8.0 * float(np.finfo(np.float64).eps)
_SAME = 1e-6
"""Distance of two solutions that are one, over the largest amplitude."""
_NEAR = 1e-3
"""Distance from a well, over the largest amplitude, at which a descent has come to it."""
_DESCENT_STEP, _DESCENT_STEPS = 0.02, 2000
"""Largest step of a descent, over the largest amplitude, and the maximum number of steps."""
_TOWARDS, _BESIDE = 40, 1e-9
"""Starting points on the way to the end of the range of a law, up to 1e-6 of it and then to that distance of one end."""
_SETTLINGS = 40
"""Newton's steps of the structure alone towards places that are given."""
_DISTANCES = np.geomspace(1e-9, 1.0, 200)
"""Distances from an end among which the force of a law is looked for, over the displacement of the end."""
_WEAK = 100.0
"""Attraction at that distance, over the forces of the structure, up to which it may have no equilibrium there."""
_SINGULAR = 1e3
"""Growth of a force over the last thousandth of the range of its law, above which it has no bound there."""
_FAR = 20.0
"""Amplitudes, over the size, beyond which equilibria may be missing."""
_REACH = 3.0
"""Extent of the region of starting points, over the largest amplitude of the equilibria without local forces."""


class Saddle(NamedTuple):
    """An equilibrium with one unstable direction, and the wells that the descents from both of its sides end in."""

    equilibrium: Equilibrium
    wells: tuple[int | None, int | None]
    """Numbers of the wells, by the height of mid-span; None if the descent leaves the range of a law (pull-in)."""


def _text_of(law: LocalForce) -> str:
    """A force with its parameters and their units."""
    values = ((name, getattr(law, name), row) for name, row in quantities(type(law)).items())
    told = [
        f"{name.replace('_', ' ')} {with_unit(value, row.unit)}" for name, value, row in values if value is not None
    ]
    return ", ".join([law.name.replace("_", " "), *told])


@dataclass(frozen=True, eq=False)
class Potential:
    """Potential energy of a system at rest.

    It is

        U(alpha) = alpha.K0 alpha/2 + gamma (alpha.S alpha)^2/4 - B.alpha - F.alpha + sum_j U_j(r_j.alpha),

    with the constant forces F and the potential energies U_j of the local forces along their rows r_j.  It is 0 for the
    straight structure, but for what the local forces have there.

    Attributes
    ----------
    model : ReducedModel
    constant : array of shape (N,)
        F.
    local_forces : tuple of LocalForce
    """

    model: ReducedModel
    constant: _Array
    local_forces: tuple[LocalForce, ...]

    @classmethod
    def of(cls, model: ReducedModel, forces: Sequence[LocalForce | ExternalForce]) -> Potential:
        """The potential energy of a structure, of the local forces and of the constant parts of external forces."""
        constant = np.zeros(model.modes)
        for each in forces:
            if each.constant_part != 0.0:
                constant = constant + each.constant_part * each.row(model)
        local = [each for each in forces if not isinstance(each, ExternalForce)]
        return cls(model, constant, tuple(each for each in local if each.is_conservative))

    @cached_property
    def structure(self) -> ReducedModel:
        """The model, with the constant force as a part of its transverse force; the local forces are left out."""
        model = self.model
        if not self.constant.any():
            return model
        load = self.constant if model.transverse_force is None else self.constant + model.transverse_force
        well = landscape_of(
            model.stiffness, model.nonlinear_stiffness, load, model.midspan_shape, model.elongation_matrix
        ).lower.amplitude
        return dataclasses.replace(model, transverse_force=load, well_amplitude=well)

    @cached_property
    def rows(self) -> _Array:
        """r_j, shape (J, N)."""
        return np.array([each.row(self.model) for each in self.local_forces]).reshape(-1, self.model.modes)

    @property
    def is_of_the_structure_alone(self) -> bool:
        """True if no force acts in addition to those of the structure."""
        return not self.local_forces and not self.constant.any()

    def energy(self, alpha: ArrayLike) -> _Array:
        """U, J, of amplitudes of shape (..., N).

        Raises
        ------
        InputError
            As :meth:`terms`.
        """
        return self._of_finite_forces(self._energy, alpha)

    def _energy(self, alpha: _Array) -> _Array:
        found = self.model.potential_energy(alpha)
        if self.is_of_the_structure_alone:
            return found
        found = found - alpha @ self.constant
        for row, law in zip(self.rows, self.local_forces, strict=True):
            found = found + law.energy_at(alpha @ row)
        return np.asarray(found)

    def gradient(self, alpha: ArrayLike) -> _Array:
        """dU/dalpha, shape (..., N): minus the generalised force.

        Raises
        ------
        InputError
            As :meth:`terms`.
        """
        return self.terms(alpha).sum(axis=0)

    def terms(self, alpha: ArrayLike) -> _Array:
        """Terms of the gradient, shape (terms, ..., N), whose magnitudes are the measure of its rounding.

        Raises
        ------
        InputError
            If *alpha* has NaN or infinite numbers or no shape (..., N), or a force is not finite there.
        """
        return self._of_finite_forces(self._terms, alpha)

    def tangent(self, alpha: ArrayLike) -> _Array:
        """Second derivative of U, shape (..., N, N).

        Raises
        ------
        InputError
            As :meth:`terms`.
        """
        return self._of_finite_forces(self._tangent, alpha)

    def _of_finite_forces(self, function: Callable[[_Array], _Array], alpha: ArrayLike) -> _Array:
        there = self._amplitudes(alpha)
        with np.errstate(all="ignore"):
            found = function(there)
        if not np.isfinite(found).all():
            raise InputError(
                f"alpha = {shown(alpha)}: has forces that are not finite, beyond the range of a law or of numbers"
            )
        return found

    def _amplitudes(self, alpha: ArrayLike) -> _Array:
        """Amplitudes of shape (..., N), checked."""
        found = finite_array("alpha", alpha)
        if not found.ndim or found.shape[-1] != self.model.modes:
            raise InputError(
                f"alpha of shape {found.shape}: must have the amplitudes of {self.model.modes} modes along its last axis"
            )
        return found

    # Newton's methods try what is beyond the ranges of numbers: they call the functions without checks.

    def _gradient(self, alpha: _Array) -> _Array:
        return self._terms(alpha).sum(axis=0)

    def _terms(self, alpha: _Array) -> _Array:
        model = self.model
        pulled = product(model.elongation_matrix, alpha)
        bent = model.stiffness * alpha if model.stiffness.ndim == 1 else product(model.stiffness, alpha)
        load = self.constant if model.transverse_force is None else self.constant + model.transverse_force
        forces = [
            -np.asarray(law.force_at(dot(alpha, row)))[..., None] * row
            for row, law in zip(self.rows, self.local_forces, strict=True)
        ]
        tension = (model.nonlinear_stiffness * dot(alpha, pulled))[..., None] * pulled
        return np.array([bent, tension, np.broadcast_to(-load, alpha.shape), *forces])

    def _tangent(self, alpha: _Array) -> _Array:
        model = self.model
        found = tangent_stiffness(model.stiffness, model.nonlinear_stiffness, alpha, model.elongation_matrix)
        for row, law in zip(self.rows, self.local_forces, strict=True):
            stiffness = law.stiffness_at(dot(alpha, row), self._length)
            found = found + np.asarray(stiffness)[..., None, None] * np.outer(row, row)
        return found

    @cached_property
    def _length(self) -> float:
        """A displacement over which laws vary, m: the largest of the equilibria, or the length scale."""
        return max(float(np.abs(self.model.midspan_shape @ self.size)), 1e-30)

    @cached_property
    def size(self) -> _Array:
        """The largest amplitudes of the structure's equilibria, or those that move the centre by its length scale."""
        found = max((each.amplitude for each in self.model.equilibria), key=lambda each: float(each @ each))
        if found.any():
            return found
        shape = self.model.midspan_shape
        scale = self.model.length_scale or (1.0 if self.model.beam is None else self.model.beam.thickness)
        return scale * shape / float(shape @ shape)

    # ------------------------------------------------------------------ equilibria

    @cached_property
    def equilibria(self) -> tuple[Equilibrium, ...]:
        """Equilibria, by energy.

        Without local forces they are in closed form, and all of them.  With local forces Newton's method starts from
        more than 500 points, within the ranges of the laws, of the space that is spanned by the lowest linear modes and
        the static responses to the forces.  The sum of the indices shows a single missing equilibrium, but not a well
        and a saddle that are both missing.  Where a law ends at a finite force, or U falls without bound, the sum is not
        known; then a search from eight times as many points must find no more.

        Raises
        ------
        InputError
            If an equilibrium is missing.
        """
        if not self.local_forces:
            return self.structure.equilibria
        found: list[_Array] = []
        for count in _STARTS:
            before = len(found)
            self._add_solutions(found, self._starts(count))
            listed = [self._equilibrium(each) for each in found]
            if (len(found) == before and count > _STARTS[0]) if self._is_open else self._adds_up(listed):
                return tuple(sorted(listed, key=lambda each: each.energy))
        raise InputError(
            f"forces: {len(found)} equilibria were found, with {[each.unstable_directions for each in listed]} unstable "
            "directions, and at least one is missing; use fewer modes, or make the forces weaker or smoother"
        )

    @cached_property
    def _is_open(self) -> bool:
        """True if a law ends at a finite force, or U falls without bound where the laws are valid."""
        for law in self.local_forces:
            for end, sign in zip(law.displacement_range(law.numbers), (-1.0, 1.0), strict=True):
                if math.isfinite(end):
                    size = max(abs(end), self._length)
                    far, near = (abs(law.force_at(end - sign * d * size)) for d in (1e-3, _BESIDE))
                    if 0.0 < far and near <= _SINGULAR * far:
                        return True
        away = self._starts(_STARTS[0])
        sizes = np.linalg.norm(away, axis=-1)
        away = away[sizes > 0.0] * (float(np.linalg.norm(self.size)) / sizes[sizes > 0.0, None])
        away = away[self._holds(1e3 * _FAR * away)]
        near, far = (self.energy(reach * away) for reach in (_FAR, 1e3 * _FAR))
        return bool(((far < near) & (far < 0.0)).any())

    def _adds_up(self, found: list[Equilibrium]) -> bool:
        """Check the equilibria by their indices: sum of (-1)^(unstable directions) = 1 - chi (Morse).

        chi is the Euler characteristic of the part of the boundary beyond which laws pull, a union of faces of the convex
        set in which all laws are valid: over every group of faces that have a point in common, the sum of
        (-1)^(1 + faces).  Points beyond ``_FAR`` times the size may be left out, and so may those next to a body that
        attracts too weakly to balance the structure farther from it than rounding.
        """
        from scipy.optimize import linprog

        structure = Potential(self.model, self.constant, ())
        ranges, faces, weak = self._ranges, [], []
        for j, end, pull in self._pulls:
            faces.append((j, end / self._length))
            row = self.rows[j]
            terms = structure._terms(end * row / float(row @ row))
            if pull * float(np.abs(row).max()) < _WEAK * float(np.abs(terms).max()):
                weak.append(faces[-1])
        above = np.concatenate((self.rows, -self.rows))
        bounds = np.concatenate((ranges[:, 1], -ranges[:, 0]))
        limited = np.isfinite(bounds)
        scale = float(np.abs(self.size).max()) / self._length

        def meet(group: tuple[tuple[int, float], ...], reach: float | None) -> bool:
            rows = np.array([self.rows[j] for j, _ in group])
            ends = np.array([end for _, end in group])
            solution = linprog(
                np.zeros(self.model.modes),
                A_ub=scale * above[limited],
                b_ub=bounds[limited] / self._length,
                A_eq=scale * rows,
                b_eq=ends,
                bounds=(None if reach is None else -reach, reach),
            )
            return solution.status == 0

        def characteristic(among: list[tuple[int, float]], reach: float | None) -> int:
            return sum(
                (-1) ** (1 + count) * meet(group, reach)
                for count in range(1, 1 + len(among))
                for group in combinations(among, count)
            )

        # faces that meet far away have an equilibrium there, far beyond every motion
        total = sum((-1) ** each.unstable_directions for each in found)
        groups = [faces, [each for each in faces if each not in weak]] if weak else [faces]
        return total in [1 - characteristic(among, reach) for among in groups for reach in (None, _FAR)]

    @cached_property
    def _ranges(self) -> _Array:
        """Minimum and maximum displacements of the laws, shape (J, 2)."""
        found = [law.displacement_range(law.numbers) for law in self.local_forces]
        return np.array(found, dtype=np.float64).reshape(-1, 2)

    @cached_property
    def _pulls(self) -> list[tuple[int, float, float]]:
        """The ends beyond which laws pull: number of the law, displacement, and the force towards it beside it."""
        found = []
        for j, law in enumerate(self.local_forces):
            for end, sign in zip(self._ranges[j].tolist(), (-1.0, 1.0), strict=True):
                if math.isfinite(end):
                    pull = sign * law.force_at(end - sign * _BESIDE * max(abs(end), self._length))
                    if pull > 0.0:
                        found.append((j, end, float(pull)))
        return found

    def _is_same(self, one: _Array, other: _Array) -> bool:
        return bool(np.abs(one - other).max() <= _SAME * np.abs(self.size).max())

    def _equilibrium(self, alpha: _Array) -> Equilibrium:
        alpha.setflags(write=False)
        unstable = int((np.linalg.eigvalsh(self._in_modes(self._tangent(alpha))) < 0.0).sum())
        return Equilibrium(amplitude=alpha, energy=float(self._energy(alpha)), unstable_directions=unstable)

    def in_modes(self, matrix: ArrayLike) -> _Array:
        """A symmetric matrix in the linear modes of the structure, whose mass matrix is the identity.

        Raises
        ------
        InputError
            If *matrix* has NaN or infinite numbers or no shape (..., N, N).
        """
        found, n = finite_array("matrix", matrix), self.model.modes
        if found.shape[-2:] != (n, n):
            raise InputError(f"matrix of shape {found.shape}: must have {n} rows and columns in its last axes")
        return self._in_modes(found)

    def _in_modes(self, matrix: _Array) -> _Array:
        modes = self.model.linear_modes
        return np.asarray(modes.T @ matrix @ modes)

    def _starts(self, count: int) -> _Array:
        """Starting points: the structure's equilibria, and a Sobol sequence about and beyond them; (starts, N)."""
        from scipy.stats import qmc

        model = self.model
        known = [each.amplitude for each in model.equilibria]
        stiff = np.abs(model.stiffness) if model.stiffness.ndim == 1 else None
        directions = [*model.linear_modes.T[: min(3, model.modes)]]
        for row in (*self.rows, self.constant):
            if row.any():
                directions.append(row / np.where(stiff > 0.0, stiff, 1.0) if stiff is not None else row)
        axes = np.linalg.qr(np.array(directions).T)[0].T
        points = 2.0 * qmc.Sobol(len(axes), scramble=False).random(count) - 1.0
        reach = _REACH * float(np.sqrt(self.size @ self.size))
        return np.array([*known, *self._towards_ends(known), *(reach * (points @ axes))])

    def _towards_ends(self, known: list[_Array]) -> list[_Array]:
        """Starting points ever nearer to the ends of the ranges of laws, where a force that grows has its equilibria."""
        stiffness = self.model.stiffness
        compliance = 1.0 / np.abs(stiffness) if stiffness.ndim == 1 and stiffness.all() else 1.0
        ends = [(j, float(end)) for j, both in enumerate(self._ranges) for end in both if math.isfinite(end)]
        pulling = [(j, end) for j, end, _ in self._pulls]
        # towards one end, and towards several at once, where an equilibrium with as many unstable directions can be
        groups = [*combinations(ends, 1), *combinations(ends, 2)]
        groups += [each for count in range(3, 1 + len(pulling)) for each in combinations(pulling, count)]
        found = []
        near, nearer = np.geomspace(1.0, 1e-6, _TOWARDS), np.geomspace(1e-6, _BESIDE, _TOWARDS // 2)
        for group in groups:
            places = np.array([end for _, end in group])
            rows = self.rows[[j for j, _ in group]]
            product = rows @ (compliance * rows).T
            if np.linalg.matrix_rank(product) < len(group):
                continue
            for alpha in known:
                away = np.linalg.solve(product, places - rows @ alpha) @ (compliance * rows)
                distances = np.append(near, nearer) if len(group) == 1 else near
                found += [alpha + share * away for share in 1.0 - distances]
                found += self._balanced(alpha + away, dict(group))
        return found

    def _balanced(self, alpha: _Array, ends: dict[int, float]) -> list[_Array]:
        """The point next to ends of laws, by number, where their forces hold the structure; none if they cannot.

        A law whose range the structure would leave there is held at its end, too, such as a body that repels between two
        that attract.
        """
        alone = Potential(self.model, self.constant, ())

        def settled(alpha: _Array, places: dict[int, float]) -> tuple[_Array, _Array]:
            """The structure at rest with laws at given displacements, by Newton's method, and the forces of the laws."""
            rows, zero = self.rows[list(places)], np.zeros((len(places), len(places)))
            pushed, ends = np.zeros(len(places)), np.array(list(places.values()))
            for _ in range(_SETTLINGS):
                matrix = np.block([[alone._tangent(alpha), rows.T], [rows, zero]])
                missing = np.concatenate((-alone._gradient(alpha), ends - rows @ alpha))
                step = _solved(matrix[None], missing[None])[0]
                alpha, pushed = alpha + step[: alpha.size], -step[alpha.size :]
            return alpha, pushed

        for _ in self.local_forces:
            alpha, pushed = settled(alpha, ends)
            u = self.rows @ alpha
            beyond = np.maximum(self._ranges[:, 0] - u, u - self._ranges[:, 1])
            beyond[list(ends)] = -math.inf
            worst = int(np.argmax(beyond))
            if not beyond[worst] > 0.0:
                break
            ends = {**ends, worst: float(self._ranges[worst, int(u[worst] >= self._ranges[worst, 1])])}
        places = {}
        for (j, end), force in zip(ends.items(), pushed, strict=True):
            law, sign = self.local_forces[j], 1.0 if end == self._ranges[j, 1] else -1.0
            beside = end - sign * _DISTANCES * max(abs(end), self._length)
            beside = beside[(self._ranges[j, 0] < beside) & (beside < self._ranges[j, 1])]
            with np.errstate(all="ignore"):
                off = np.abs(np.log(law.force_at(beside) / force))
            if not np.isfinite(off).any():
                return []
            places[j] = float(beside[np.nanargmin(off)])
        alpha = settled(alpha, places)[0]
        return [alpha] if np.isfinite(alpha).all() else []

    def holds(self, alpha: ArrayLike) -> NDArray[np.bool_]:
        """Return whether the displacement of every local force is within the range of its law, for shape (..., N).

        Raises
        ------
        InputError
            If *alpha* has NaN or infinite numbers or no shape (..., N).
        """
        return self._holds(self._amplitudes(alpha))

    def _holds(self, alpha: _Array) -> NDArray[np.bool_]:
        inside = np.ones(alpha.shape[:-1], dtype=bool)
        for row, law in zip(self.rows, self.local_forces, strict=True):
            (low, high), u = law.displacement_range(law.numbers), dot(alpha, row)
            inside = inside & (low < u) & (u < high)
        return inside

    def _add_solutions(self, found: list[_Array], starts: _Array) -> None:
        """Add the equilibria that Newton's method comes to from some starting points, each once, in their order."""
        solutions = self._newton(starts)
        while len(solutions):
            first = solutions[0]
            if not any(self._is_same(first, each) for each in found):
                found.append(first.copy())
            solutions = solutions[np.abs(solutions - first).max(axis=-1) > _SAME * np.abs(self.size).max()]

    def _newton(self, alpha: _Array) -> _Array:
        """Equilibria by damped Newton steps from starting points, shape (starts, N); without those that come to none."""
        alpha = np.array(alpha)
        solved = np.zeros(len(alpha), dtype=bool)
        runs = np.flatnonzero(self._holds(alpha))
        terms = self._terms(alpha[runs])
        for _ in range(_ITERATIONS):
            gradient, tangent = terms.sum(axis=0), self._tangent(alpha[runs])
            # next to a body that attracts, rounding of the amplitudes changes the force by more than its own rounding
            rounding = _ROUNDING * product(np.abs(tangent), np.abs(alpha[runs]))
            bound = (_RESIDUAL * np.abs(terms).sum(axis=0) + rounding).max(axis=-1)
            ends = np.abs(gradient).max(axis=-1) <= bound
            solved[runs[ends]] = True
            runs, gradient, tangent, terms = runs[~ends], gradient[~ends], tangent[~ends], terms[:, ~ends]
            if not runs.size:
                break
            step = _solved(tangent, gradient)
            size, share = dot(gradient, gradient), 1.0
            searching = np.array(np.isfinite(step).all(axis=-1))
            moved = np.zeros(runs.size, dtype=bool)
            for _ in range(_HALVINGS):
                at = np.flatnonzero(searching)
                tried = alpha[runs[at]] - share * step[at]
                inside = self._holds(tried)
                at, tried = at[inside], tried[inside]
                terms_there = self._terms(tried)
                new = terms_there.sum(axis=0)
                less = dot(new, new) < (1.0 - 0.1 * share) * size[at]
                taken = at[less]
                alpha[runs[taken]], terms[:, taken] = tried[less], terms_there[:, less]
                moved[taken], searching[taken] = True, False
                if not searching.any():
                    break
                share *= 0.5
            runs, terms = runs[moved], terms[:, moved]
        return self._polished(alpha[solved])

    def _polished(self, alpha: _Array) -> _Array:
        for _ in range(2):
            tried = alpha - _solved(self._tangent(alpha), self._gradient(alpha))
            better = np.flatnonzero(self._holds(tried))
            new, old = (np.abs(self._gradient(each[better])).max(axis=-1) for each in (tried, alpha))
            better = better[new < old]
            alpha[better] = tried[better]
        return alpha

    # ------------------------------------------------------------------ wells

    @cached_property
    def wells(self) -> tuple[Equilibrium, ...]:
        """The stable equilibria, by the height of the centre."""
        stable = [each for each in self.equilibria if each.is_stable]
        return tuple(sorted(stable, key=self.center))

    def well(self, name: str | int) -> Equilibrium:
        """A well by its index in :attr:`wells`, or "lower" or "upper" of two.

        Raises
        ------
        InputError
            If there is no such well.
        """
        wells, two = self.wells, ("lower", "upper")
        at = two.index(name) if name in two and len(wells) == 2 else name
        if not isinstance(at, int) or not 0 <= at < len(wells):
            many = ", 'lower' or 'upper'" if len(wells) == 2 else ""
            allowed = f"must be {', '.join(map(str, range(len(wells))))}{many}" if wells else "leave it out"
            count = f"{len(wells) or 'no'} well{'' if len(wells) == 1 else 's'}"
            raise InputError(f"well = {shown(name)}: the system has {count}; {allowed}")
        return wells[at]

    def center(self, equilibrium: Equilibrium) -> float:
        """Displacement of the centre, m."""
        return float(self.model.midspan_shape @ equilibrium.amplitude)

    def linear_modes(self, equilibrium: Equilibrium) -> LinearModes:
        """Linear modes about a well of the system.

        Raises
        ------
        InputError
            If the equilibrium is unstable.
        """
        model, alpha = self.model, equilibrium.amplitude
        parity = None if model.beam is None else model.beam.buckling_modes(model.modes).parity
        magnitude = model.tangent_magnitude(alpha)
        for row, law in zip(self.rows, self.local_forces, strict=True):
            stiffness = law.stiffness_at(float(row @ alpha), self._length)
            magnitude = magnitude + abs(stiffness) * np.abs(np.outer(row, row))
        return linear_modes_about(alpha, model.mass, self._tangent(alpha), magnitude, parity)

    def natural_frequencies(self, equilibrium: Equilibrium) -> _Array:
        """Natural frequencies about a well, Hz, ascending, shape (N,); without circuits and contacts."""
        return self.linear_modes(equilibrium).omega / (2.0 * math.pi)

    @property
    def well_names(self) -> list[str]:
        """Names of the wells: lower and upper, or by their numbers."""
        count = len(self.wells)
        names = {1: ["equilibrium"], 2: ["lower well", "upper well"]}
        return names.get(count, [f"well {i + 1}" for i in range(count)])

    @property
    def force_texts(self) -> list[str]:
        """Description of the additional forces, one sentence for each."""
        found = [f"with {_text_of(law)}" for law in self.local_forces]
        return [*found, "with the constant part of the external force"] if self.constant.any() else found

    @cached_property
    def saddles(self) -> tuple[Saddle, ...]:
        """Equilibria with one unstable direction, by energy, with the wells on their two sides."""
        return tuple(Saddle(each, self._sides(each)) for each in self.equilibria if each.unstable_directions == 1)

    @cached_property
    def dividing_height(self) -> float:
        """Displacement of the centre that divides two wells, m: that of the lowest saddle between them.

        It is that of the structure if the system has another number of wells.
        """
        own = self.structure.dividing_height
        if not self.local_forces or len(self.wells) != 2:
            return own
        between = [each for each in self.saddles if set(each.wells) == {0, 1}]
        if not between:
            return own
        found = self.center(min(between, key=lambda each: each.equilibrium.energy).equilibrium)
        return own if abs(found - own) <= _SAME * self._length else found

    def barrier(self, well: int) -> float:
        """Energy from a well, by number, to the lowest adjacent saddle, J; NaN if there is none."""
        if not self.local_forces:
            return self.structure.saddle_energy - self.wells[well].energy if len(self.wells) > 1 else math.nan
        heights = [each.equilibrium.energy for each in self.saddles if well in each.wells]
        return min(heights) - self.wells[well].energy if heights else math.nan

    def _sides(self, saddle: Equilibrium) -> tuple[int | None, int | None]:
        """Wells that the descents from a saddle along its unstable direction, downwards and upwards, end in."""
        return self.descent(saddle.amplitude, "below"), self.descent(saddle.amplitude, "above")

    def descent(self, alpha: _Array, side: str = "below") -> int | None:
        """Number of the well that a motion without inertia, M alpha' = -dU/dalpha, comes to; None if it leaves a range.

        From an unstable equilibrium the centre leaves downwards (*side* "below") or upwards.
        """
        size, start = np.abs(self.size).max(), self._start_of_descent(alpha)
        bend, modes = self._in_modes(self._tangent(start)), self.model.linear_modes
        rates, axes = np.linalg.eigh(bend) if np.isfinite(bend).all() else (np.ones(len(modes)), np.eye(len(modes)))
        slope = axes.T @ (modes.T @ self._gradient(start)) if rates[0] < 0.0 else rates
        newton = modes @ axes @ np.divide(slope, rates, out=np.zeros_like(slope), where=rates != 0.0)
        if rates[0] < 0.0 and np.abs(newton).max() <= _SAME * size:
            away = modes @ axes[:, 0]
            away *= 1e-3 * size / np.abs(away).max() * math.copysign(1.0, float(self.model.midspan_shape @ away))
            start = start + away if side == "above" else start - away
        for there, _ in self._falling(start):
            for number, well in enumerate(self.wells):
                if np.abs(there - well.amplitude).max() <= _NEAR * size:
                    return number
        return None

    def settles(self, alpha: _Array) -> bool:
        """Return whether a motion without inertia comes to rest within the ranges of all laws, in a well that need not be known."""
        return any(arrived for _, arrived in self._falling(self._start_of_descent(alpha)))

    def _start_of_descent(self, alpha: ArrayLike) -> _Array:
        found = self._amplitudes(alpha)
        if found.ndim != 1:
            raise InputError(f"alpha of shape {found.shape}: must have 1 dimension")
        return found

    def _falling(self, alpha: _Array) -> Iterator[tuple[_Array, bool]]:
        """Amplitudes of a motion without inertia up to where it leaves a range, and whether they are those of a well.

        Implicit Euler steps, q = q - (H + 1/h)^-1 dU/dq with the second derivative H of U, in coordinates q whose mass
        matrix is the identity; 1/h is raised until a step is short.  In a well H is positive and a step without 1/h is short.
        """
        modes = self.model.linear_modes
        size = np.abs(self.size).max()
        identity = np.eye(len(modes))
        for _ in range(_DESCENT_STEPS):
            slope, bend = modes.T @ self._gradient(alpha), self._in_modes(self._tangent(alpha))
            if not (np.isfinite(slope).all() and np.isfinite(bend).all()):  # no step would ever be short
                return
            lowest = float(np.linalg.eigvalsh(bend)[0])
            shift = max(-2.0 * lowest, 1e-6 * float(np.abs(bend).max()))
            while True:
                step = modes @ np.linalg.solve(bend + shift * identity, slope)
                tried = alpha - step
                if np.abs(step).max() <= _DESCENT_STEP * size:
                    break
                shift *= 4.0
            if not self._holds(tried):
                return
            arrived = (
                lowest > 1e-12 * float(np.abs(bend).max())
                and np.abs(modes @ np.linalg.solve(bend, slope)).max() <= _SAME * size
            )
            yield alpha, bool(arrived)
            alpha = tried


def _solved(matrix: _Array, vector: _Array) -> _Array:
    """Solutions of systems, shape (..., N); NaN where the matrix is singular."""
    try:
        return np.asarray(np.linalg.solve(matrix, vector[..., None])[..., 0])
    except np.linalg.LinAlgError:
        if len(matrix) == 1:
            return np.full(vector.shape, np.nan)
        half = len(matrix) // 2
        return np.concatenate((_solved(matrix[:half], vector[:half]), _solved(matrix[half:], vector[half:])))
