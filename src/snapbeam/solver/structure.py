"""A structure as engines see it: modal numbers about a well, in no layout and without time."""

from __future__ import annotations

import dataclasses
import hashlib
import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.base_excitation import BaseExcitation, rigid_mass
from snapbeam.model.external_force import ExternalForce
from snapbeam.model.harvester import Harvester
from snapbeam.model.local_force import LocalForce
from snapbeam.model.reduced_model import ReducedModel
from snapbeam.model.striker import Striker

_Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class UnequalWells:
    """Terms of unequal wells: a constant force about the mirror image of the first well.

    With B the side force and a the first well, K0 a + gamma (a . a) a = B.  At alpha = -a + V q the same linear modes
    and the same tension terms, g negated, hold exactly, and 2 V^T B is left over: the origin of q on the far side is
    -a, near the second well, wherever that is.
    """

    force: _Array
    """2 V^T B, shape (N,), on the far side."""
    lift: float
    """Potential energy of -a above that of a, 2 B . a, J."""
    second: _Array
    """The second well about -a, as q."""
    level: float
    """Displacement of the centre that divides the wells, m."""


@dataclass(frozen=True, eq=False)
class LocalForceRow:
    """A local force as the solver sees it."""

    row: _Array
    """r = V^T shape, shape (N,)."""
    rest: float
    """u in the well."""
    law: Any
    """Constants of the law."""


@dataclass(frozen=True, eq=False)
class CircuitRow:
    """The circuit of a harvester."""

    row: _Array
    """t, the coupling, scaled so that half the square of the circuit's coordinate is its energy; shape (N,)."""
    mode: int | None
    """Mode whose displacement is the charge; None of a circuit without inertia."""


@dataclass(frozen=True)
class StrikerBody:
    """A striker with mass."""

    contact: int
    """Number of the contact, from 0."""
    mass: float
    """kg."""
    sign: float
    """+1 if it strikes from below."""

    @property
    def of_hash(self) -> tuple[float, ...]:
        """Numbers that tell it from others; of the first striker its mass alone."""
        return (self.mass, float(self.contact), self.sign) if self.contact else (self.mass,)


@dataclass(frozen=True, eq=False)
class Structure:
    """Linear modes about the well that a striker pushes away from, and the tension that couples them.

    Positive is the direction in which the striker pushes: a structure with the striker above is the mirror image of the
    one with the striker below.  Arrays have shape (N,) unless said otherwise.
    """

    omega: _Array
    """Natural frequencies, rad/s."""
    damping_ratio: _Array
    """Damping ratios of the modes by themselves; what a damping matrix has beyond it is sum_k c_k u_k u_k^T."""
    damping_rows: _Array
    """u_k, shape (K, N)."""
    damping_coefficients: _Array
    """c_k, 1/s, shape (K,)."""
    coupling: _Array
    """G = V^T V, shape (N, N), exactly 0 between modes that the tension does not couple."""
    nonlinear_stiffness: float
    """gamma, Eq. (15)."""
    well: _Array
    """g = V^T alpha_eq."""
    center: _Array
    """V^T phi(1/2)."""
    shift: _Array
    """Vector from this well to its mirror image, as q: the other well, where the two are equal."""
    stretch: float
    """Squared slopes in the well, alpha_eq . alpha_eq; 0 if there is one well only."""
    center_rest: float
    """Displacement of the centre in the well, m."""
    sign: float
    """+1 with the striker below, -1 above."""
    equilibrium: _Array
    """alpha in the well, as it is in space."""
    model: ReducedModel
    unequal_wells: UnequalWells | None = None
    """Terms of unequal wells."""
    base_load: _Array | None = None
    """Load vector of a moving base for an upward acceleration, -V^T rho S integral(phi)."""
    force_rows: tuple[_Array, ...] = ()
    """Row V^T h of each external force F(t) along a row h."""
    local_forces: tuple[LocalForceRow, ...] = ()
    circuits: tuple[CircuitRow, ...] = ()
    """Circuits of harvesters; the modes of their charges are last."""
    bodies: tuple[StrikerBody, ...] = ()
    """Strikers with mass, whose modes follow those of the beam."""
    indentations: tuple[int, ...] = ()
    """Contacts, from 0, whose residual indentation is the displacement of a mode of its own, behind those of the bodies."""
    strikers: int = 0

    def rests(self, shapes: _Array) -> _Array:
        """Displacement at rest of points with these *shapes*, m: each by itself, so that none depends on the others."""
        return np.array([(shape[None, :] @ self.equilibrium)[0] for shape in shapes])

    def row(self, shape: _Array, contact: int = 0, sign: float = 1.0) -> _Array:
        """The contact row of a striker: *sign* V^T shape, and what its own mode adds.

        *sign* is +1 if it pushes as the first one does.
        """
        row = np.asarray(sign * self.sign * (self.model.linear_modes.T @ shape))
        own = [-1.0 / math.sqrt(each.mass) if each.contact == contact else 0.0 for each in self.bodies]
        return np.concatenate((row, own, np.zeros(self.omega.size - row.size - len(own))))

    def row_of_beam(self, row: _Array) -> _Array:
        """A contact row without the parts of strikers' own modes: the beam's displacement at that location."""
        beam = row.copy()
        beam[self.modes_of_bodies] = 0.0
        return beam

    @property
    def modes_of_bodies(self) -> slice:
        """Places of the strikers' own modes among all."""
        return slice(self.equilibrium.size, self.equilibrium.size + len(self.bodies))

    @property
    def wells_are_mirror_images(self) -> bool:
        """True if the two wells are mirror images, or if there is only one."""
        return self.unequal_wells is None

    @property
    def dividing_height(self) -> float:
        """Displacement of the centre that divides the wells, m."""
        return 0.0 if self.unequal_wells is None else self.unequal_wells.level

    def about_second_well(self) -> tuple[_Array, _Array, _Array]:
        """About the mirror image of the first well: g, the second well as q, and the force that is left over there."""
        if self.unequal_wells is None:
            return -self.well, np.zeros(self.omega.size), np.zeros(self.omega.size)
        return -self.well, self.unequal_wells.second, self.unequal_wells.force

    def high_modes(self, omega: float) -> NDArray[np.bool_]:
        """Mask of the modes that are vibration modes of the beam above an angular frequency, rad/s; shape (N,)."""
        return (self.omega > omega) & (np.arange(self.omega.size) < self.equilibrium.size)

    def bodies_of(self, values: _Array) -> _Array:
        """The strikers' own parts of q or p of shape (..., N), in space and SI units; NaN of those without mass.

        Shape (...), or (..., strikers) of several strikers.
        """
        bodies = enumerate(self.bodies, self.equilibrium.size)
        own = {each.contact: each.sign * values[..., mode] / math.sqrt(each.mass) for mode, each in bodies}
        return _by_part(own, self.strikers, values)

    def mode_of_indentation(self, contact: int) -> int | None:
        """Place of the mode that holds the residual indentation of a contact, from 0; None without one."""
        if contact not in self.indentations:
            return None
        return self.modes_of_bodies.stop + self.indentations.index(contact)

    def indentations_of(self, q: _Array) -> _Array:
        """Residual indentations in q of shape (..., N), m; NaN of contacts that leave none.

        Shape (...), or (..., strikers) of several strikers.
        """
        return _by_part({each: q[..., self.mode_of_indentation(each)] for each in self.indentations}, self.strikers, q)

    def circuits_of(self, q: _Array) -> _Array:
        """The coordinates y = Q - t.q of the circuits in q of shape (..., N); NaN of those without inertia.

        Shape (...), or (..., circuits) of several circuits.
        """
        circuits = enumerate(self.circuits)
        own = {i: q[..., each.mode] - q @ each.row for i, each in circuits if each.mode is not None}
        return _by_part(own, len(self.circuits), q)

    def to_modal(
        self,
        alpha: _Array,
        velocity: _Array,
        shift: float | _Array = np.nan,
        rate: float | _Array = np.nan,
        indentation: float | _Array = np.nan,
        circuit: float | _Array = np.nan,
    ) -> tuple[_Array, _Array]:
        """Amplitudes of shape (N,) and their velocities as q and p about the well, and those of the strikers' bodies.

        *indentation* is that of each contact, *circuit* holds the coordinates of circuits.
        """
        back = self.model.linear_modes.T @ self.model.mass
        q, p = back @ (alpha - self.equilibrium), back @ velocity
        for each in self.bodies:
            scale = each.sign * math.sqrt(each.mass)
            own = [scale * _number(value, self.strikers, each.contact) + 0.0 for value in (shift, rate)]
            q, p = np.append(q, own[0]), np.append(p, own[1])
        for contact in self.indentations:
            q, p = np.append(q, _number(indentation, self.strikers, contact)), np.append(p, 0.0)
        for i, row in enumerate(self.circuits):
            if row.mode is not None:
                charge = _number(circuit, len(self.circuits), i) + row.row[: q.size] @ q
                q, p = np.append(q, charge), np.append(p, 0.0)
        return q, p

    def amplitudes(self, q: _Array) -> _Array:
        """alpha of q of shape (..., N) about the well."""
        return np.asarray(self.equilibrium + q[..., : self.equilibrium.size] @ self.model.linear_modes.T)

    def velocities(self, p: _Array) -> _Array:
        """Velocities of alpha, of p of shape (..., N)."""
        return np.asarray(p[..., : self.equilibrium.size] @ self.model.linear_modes.T)

    @cached_property
    def hash(self) -> str:
        """SHA-256 of its numbers, which linear algebra may round otherwise on another type of processor."""
        wells, digest = self.unequal_wells, hashlib.sha256()
        parts: list[Any] = [self.omega, self.damping_ratio, self.coupling, self.well, self.center, self.equilibrium]
        parts.append([self.nonlinear_stiffness, self.sign])
        if self.damping_coefficients.size:
            parts.append(np.column_stack((self.damping_coefficients, self.damping_rows)))
        parts += [] if wells is None else [wells.force]
        parts += [each.row for each in self.circuits]
        parts += [] if self.base_load is None else [self.base_load]
        parts += [*self.force_rows, [value for each in self.bodies for value in each.of_hash]]
        parts.append(np.array(self.indentations, dtype=np.int64))
        for force in self.local_forces:
            kind = type(force.law).owner
            parts += [f"{kind.__module__}.{kind.__qualname__}".encode(), force.row, [*force.law]]
        for part in parts:
            digest.update(part if isinstance(part, bytes) else np.ascontiguousarray(part).tobytes())
        return digest.hexdigest()


def _number(value: float | _Array, parts: int, part: int) -> float:
    """The number of one of several parts, 0 if it is not given."""
    return float(np.nan_to_num(np.broadcast_to(value, max(1, parts))[part]))


def _by_part(own: dict[int, _Array], parts: int, values: _Array) -> _Array:
    """Numbers of parts as a column each, NaN of those that have none; of one part without an axis of its own."""
    found = np.full((*values.shape[:-1], max(1, parts)), np.nan)
    for part, value in own.items():
        found[..., part] = value
    return found if parts > 1 else found[..., 0]


def structure_of(
    model: ReducedModel,
    side: str,
    strikers: tuple[Striker, ...] = (),
    base: BaseExcitation | None = None,
    harvesters: tuple[Harvester, ...] = (),
    forces: tuple[ExternalForce, ...] = (),
    local_forces: tuple[LocalForce, ...] = (),
    dividing_height: float | None = None,
    indentations: tuple[int, ...] = (),
) -> Structure:
    """The structure of a reduced model, about the well that a striker from *side* pushes away from.

    Each striker that is a body of mass m_s on a spring k_s is one more linear mode, q_s = sqrt(m_s) times its displacement
    beyond the motion that its drive gives it: no tension, contact row -1/sqrt(m_s).  The *dividing_height*, in space, is
    that of the model by default; where local forces move it, the wells count as unequal.  *indentations* are the contacts,
    from 0, whose law has a residual indentation.
    """
    sign = 1.0 if side == "below" else -1.0
    model = model if sign > 0.0 else model.mirrored
    equilibrium = sign * model.well_amplitude
    modes = model.linear_modes
    structure = Structure(
        strikers=len(strikers),
        omega=model.omega,
        damping_ratio=model.modal_damping.ratio,
        damping_rows=model.modal_damping.rows,
        damping_coefficients=model.modal_damping.coefficients,
        coupling=model.tension_matrix,
        nonlinear_stiffness=float(model.nonlinear_stiffness),
        well=modes.T @ model.pulled(equilibrium),
        center=sign * (modes.T @ model.midspan_shape),
        shift=-2.0 * (modes.T @ model.mass @ equilibrium),
        stretch=float(equilibrium @ model.pulled(equilibrium)) if model.is_bistable else 0.0,
        center_rest=sign * float(model.midspan_shape @ equilibrium),
        sign=sign,
        equilibrium=equilibrium,
        model=model,
        unequal_wells=_uneven(model, sign, dividing_height),
        base_load=None if base is None else -(modes.T @ rigid_mass(model)),
        force_rows=tuple(np.asarray(modes.T @ each.row(model)) for each in forces),
        local_forces=tuple(
            LocalForceRow(modes.T @ shape, float(shape @ equilibrium), each.numbers)
            for each in local_forces
            for shape in [each.row(model)]
        ),
    )
    for contact, striker in enumerate(strikers):
        if striker.mass is not None:
            structure = _with_body(structure, striker, contact, base is not None and base.striker_on_base)
    for contact in indentations:
        structure = dataclasses.replace(_with_mode(structure), indentations=(*structure.indentations, contact))
    for harvester in harvesters:
        structure = _with_circuit(structure, harvester)
    return structure


def _uneven(model: ReducedModel, sign: float, dividing_height: float | None) -> UnequalWells | None:
    """Terms of unequal wells for a model that is positive in the direction of the striker; None if there are none."""
    if not model.is_bistable:
        return None
    level = model.dividing_height if dividing_height is None else sign * dividing_height
    load, landscape = model.transverse_force, model.landscape
    if load is None or landscape is None:
        if level == model.dividing_height:
            return None
        load = lower = away = np.zeros(model.modes)
    else:
        lower, away = landscape.lower.amplitude, landscape.upper.amplitude + landscape.lower.amplitude
    return UnequalWells(
        force=sign * 2.0 * (model.linear_modes.T @ load),
        lift=2.0 * float(load @ lower),
        second=sign * (model.linear_modes.T @ (model.mass @ away)),
        level=level,
    )


def _with_mode(
    structure: Structure, omega: float = 0.0, damping_ratio: float = 0.0, base_load: float = 0.0, shift: float = 0.0
) -> Structure:
    """The structure with one more mode, which the tension does not couple with the others."""
    count = structure.omega.size + 1
    coupling = np.zeros((count, count))
    coupling[:-1, :-1] = structure.coupling
    wells = structure.unequal_wells
    return dataclasses.replace(
        structure,
        omega=np.append(structure.omega, omega),
        damping_ratio=np.append(structure.damping_ratio, damping_ratio),
        damping_rows=np.pad(structure.damping_rows, ((0, 0), (0, 1))),
        coupling=coupling,
        well=np.append(structure.well, 0.0),
        center=np.append(structure.center, 0.0),
        shift=np.append(structure.shift, shift),
        unequal_wells=None if wells is None else _longer(wells, "force", "second"),
        base_load=None if structure.base_load is None else np.append(structure.base_load, base_load),
        force_rows=tuple(np.append(each, 0.0) for each in structure.force_rows),
        local_forces=tuple(_longer(each, "row") for each in structure.local_forces),
        circuits=tuple(_longer(each, "row") for each in structure.circuits),
    )


def _longer(part: Any, *rows: str) -> Any:
    """A part whose rows have one more mode."""
    return dataclasses.replace(part, **{name: np.append(getattr(part, name), 0.0) for name in rows})


def _with_body(structure: Structure, striker: Striker, contact: int, carried_by_base: bool) -> Structure:
    """The structure with the mode of a striker that is a body, which a base shakes too if it carries it."""
    assert striker.mass is not None
    body = StrikerBody(contact, striker.mass, 1.0 if striker.side == "below" else -1.0)
    own = -body.sign * math.sqrt(striker.mass) if carried_by_base else 0.0
    omega = math.sqrt(striker.suspension_stiffness / striker.mass)
    structure = _with_mode(structure, omega, striker.damping_ratio, own)
    return dataclasses.replace(structure, bodies=(*structure.bodies, body))


def _with_circuit(structure: Structure, harvester: Harvester) -> Structure:
    """The structure with a harvester, and with the mode of its charge if the circuit has inertia.

    That mode has no frequency, no tension and no velocity.  The charge y + t.q changes with the origin of q.
    """
    modes = structure.model.linear_modes.shape[1]
    row = np.zeros(structure.omega.size)
    row[:modes] = structure.model.linear_modes.T @ harvester.row(structure.model)
    mode = None
    if harvester.inertia > 0.0:
        row, mode = row / math.sqrt(harvester.inertia), structure.omega.size
        structure, row = _with_mode(structure, shift=float(row @ structure.shift)), np.append(row, 0.0)
    return dataclasses.replace(structure, circuits=(*structure.circuits, CircuitRow(row, mode)))
