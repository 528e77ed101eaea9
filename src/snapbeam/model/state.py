"""State of a run: all quantities that determine its future."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.model.equilibria import Equilibrium
from snapbeam.model.reduced_model import ReducedModel
from snapbeam.model.striker import Striker
from snapbeam.util.status_codes import RunStatus
from snapbeam.util.validation import InputError, finite_array, integer, mapping, shown

_Array = NDArray[np.float64]
_REACHED = (int(RunStatus.OK), int(RunStatus.EARLY_STOP))
OWN_FIELDS = ("striker_shift", "striker_rate", "indentation", "circuit")
"""Arrays of a state that belong to strikers and circuits."""
FIELDS = ("amplitude", "velocity", "phase", "striker_position", "contact_time", *OWN_FIELDS)
"""Arrays of a state."""


class ModalState(NamedTuple):
    """A state in the coordinates of an engine, so that going on loses no bit."""

    q: _Array
    """Linear modes about the well, shape (..., N)."""
    p: _Array
    well_sign: _Array
    """+1 about the well that the striker pushes away from, -1 about the other, shape (...)."""
    offset: _Array
    """Penetration of the tip at mid-stroke into the beam at rest in the first well, m."""
    structure: str
    """Hash of the structure that the coordinates belong to."""


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class State:
    """A state of the beam and its striker, or a batch of them along leading dimensions.

    Parameters
    ----------
    amplitude : array_like of shape (..., N), or Equilibrium
        Amplitudes alpha of the buckling modes, m^0.5, or an equilibrium, such as one of ``potential.wells``.
    velocity : array_like of shape (..., N), optional
        Their velocities, m^0.5/s; zeros by default.
    phase : array_like of shape (...), optional
        Phase of the drive, rad; NaN or None: that at the start.
    striker_position : array_like of shape (...), optional
        Mid-position of the tip in space, m; NaN or None: the tip touches the beam.
    contact_time : array_like of shape (..., strikers), optional
        Duration of the present contact of each striker, s; negative where tip and beam are apart. NaN or None: the
        penetration decides.
    striker_shift, striker_rate : array_like of shape (...) or (..., strikers)
        Displacement (m) and velocity (m/s) of the tip of a striker with mass beyond its drive, positive towards the
        upper well; NaN of others.
    indentation : array_like of shape (...) or (..., strikers)
        Residual indentation of contacts under a law with plastic deformation, m; NaN of others.
    circuit : array_like of shape (...) or (..., harvesters)
        State of the circuits: voltage (V) of piezoelectric layers, current (A) of a coil with an inductance; NaN where
        there is none, or at rest.
    tangent : array_like of shape (..., k, 2, N), optional
        Small changes of amplitude and velocity that were carried along, k of them.
    statistics : mapping, optional
        Statistics of the interval since the previous state, by name. If the integration failed,
        ``statistics["status"]`` gives the reason and the state is NaN.
    modal : ModalState, optional
        The same in an engine's coordinates.

    See Also
    --------
    snapbeam.advance, snapbeam.System

    Examples
    --------
    >>> import numpy as np
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> model = sb.ReducedModel.from_beam(paper.BEAM, modes=2, damping_ratio=0.005)
    >>> start = sb.State(amplitude=1.1 * model.well_amplitude, velocity=np.zeros(2))
    >>> system = sb.System(model, initial_state=start)
    """

    amplitude: _Array
    velocity: _Array = None  # type: ignore[assignment]
    phase: _Array = np.nan  # type: ignore[assignment]
    striker_position: _Array = None  # type: ignore[assignment]
    contact_time: _Array = np.nan  # type: ignore[assignment]
    striker_shift: _Array = np.nan  # type: ignore[assignment]
    striker_rate: _Array = np.nan  # type: ignore[assignment]
    indentation: _Array = np.nan  # type: ignore[assignment]
    circuit: _Array = np.nan  # type: ignore[assignment]
    tangent: _Array | None = None
    statistics: Mapping[str, _Array] | None = field(default=None, repr=False)
    modal: ModalState | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        given: Any = self.amplitude
        given = given.amplitude if isinstance(given, Equilibrium) else given
        amplitude = _finite_where_known("state amplitude", given, self.statistics)
        if amplitude.ndim == 0:
            raise InputError(f"state amplitude = {float(amplitude):g}: must be an array of shape (..., modes)")
        batch = amplitude.shape[:-1]
        velocity = np.zeros_like(amplitude)
        if self.velocity is not None:
            velocity = _finite_where_known("state velocity", self.velocity, self.statistics)
            if velocity.shape != amplitude.shape:
                raise InputError(f"state velocity of shape {velocity.shape}: must have shape {amplitude.shape}")
        found = {"amplitude": amplitude, "velocity": velocity}
        found["phase"] = _maybe("state phase", self.phase, batch)
        position = np.nan if self.striker_position is None else self.striker_position
        found["striker_position"] = _maybe("state striker_position", position, batch)
        found["contact_time"] = _contact_times(self.contact_time, batch)
        for name in OWN_FIELDS:
            found[name] = _of_parts(f"state {name}", getattr(self, name), batch)
        for name, array in found.items():
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    def __repr__(self) -> str:
        count = f"{' x '.join(map(str, self.batch))} states" if self.batch else "one state"
        return f"<State: {count} of {self.modes} modes>"

    @property
    def batch(self) -> tuple[int, ...]:
        """Shape of the batch; () for one state."""
        return self.amplitude.shape[:-1]

    @property
    def modes(self) -> int:
        """Number of modes N."""
        return self.amplitude.shape[-1]

    def contact_times(self, strikers: int) -> _Array:
        """The contact time of each of so many strikers, shape (..., strikers).

        Raises
        ------
        InputError
            If the state contains the contact times of another number of strikers.
        """
        count = self.contact_time.shape[-1]
        if count != strikers and not np.isnan(self.contact_time).all():
            raise InputError(
                f"state contact_time of {count} strikers: must have one number for each of the {strikers} strikers of "
                "the system; give one for each, or leave contact_time out"
            )
        return self.contact_time if count == strikers else np.full((*self.batch, strikers), np.nan)

    def __getitem__(self, index: Any) -> State:
        """States of a batch, with what is known of each of them and not of their way as a whole."""
        if not self.batch:
            raise InputError(f"state[{index!r}]: this is one state, not a batch")
        passed, tangent = self.statistics, self.tangent
        if passed is not None:
            passed = {name: values[index] for name, values in passed.items() if np.shape(values) == self.batch}
        if tangent is not None:
            tangent = tangent[index] if tangent.shape[:-3] == self.batch else None
        modal = self.modal
        if modal is not None:
            parts = (modal.q[index], modal.p[index], modal.well_sign[index], modal.offset[index])
            modal = ModalState(*parts, modal.structure)
        return State(
            **{name: getattr(self, name)[index] for name in FIELDS}, tangent=tangent, statistics=passed, modal=modal
        )

    @cached_property
    def flat(self) -> State:
        """The batch as one dimension; a single state as a batch of one."""
        count = int(np.prod(self.batch, dtype=np.int64))
        modal = self.modal
        if modal is not None:
            q, p, home, offset, structure = modal
            shape = (count, q.shape[-1])
            modal = ModalState(q.reshape(shape), p.reshape(shape), home.ravel(), offset.ravel(), structure)
        return State(
            amplitude=self.amplitude.reshape(count, self.modes),
            velocity=self.velocity.reshape(count, self.modes),
            phase=self.phase.ravel(),
            striker_position=self.striker_position.ravel(),
            contact_time=self.contact_time.reshape(count, -1),
            **{
                name: getattr(self, name).reshape(count, *getattr(self, name).shape[len(self.batch) :])
                for name in OWN_FIELDS
            },
            modal=modal,
        )

    def with_modes(self, modes: int) -> State:
        """The same shape on another number of modes: more of them are still at zero.

        Raises
        ------
        InputError
            If moving modes would be discarded.
        """
        if modes == self.modes:
            return self
        if modes < self.modes and (self.amplitude[..., modes:].any() or self.velocity[..., modes:].any()):
            raise InputError(f"modes = {modes}: a state of {self.modes} modes cannot be cut to fewer without loss")
        kept = min(modes, self.modes)
        amplitude, velocity = np.zeros((*self.batch, modes)), np.zeros((*self.batch, modes))
        amplitude[..., :kept], velocity[..., :kept] = self.amplitude[..., :kept], self.velocity[..., :kept]
        return State(
            amplitude=amplitude, velocity=velocity, phase=self.phase, striker_position=self.striker_position,
            contact_time=self.contact_time, striker_shift=self.striker_shift, striker_rate=self.striker_rate,
            indentation=self.indentation, circuit=self.circuit,
        )  # fmt: skip


def _finite_where_known(name: str, value: ArrayLike, passed: Mapping[str, _Array] | None) -> _Array:
    """Finite numbers, except for states that were not reached according to their status."""
    status = None if passed is None else mapping("statistics", passed).get("status")
    if status is None:
        return finite_array(name, value)
    array = np.array(value, dtype=np.float64)
    lost = np.isnan(array).all(axis=-1) & ~np.isin(status, _REACHED)
    finite_array(name, np.where(lost[..., None], 0.0, array))
    return array


def _spread(name: str, array: _Array, batch: tuple[int, ...]) -> _Array:
    if array.shape == batch or not array.ndim:
        return np.full(batch, array, dtype=np.float64)
    try:
        return np.array(np.broadcast_to(array, batch), dtype=np.float64)
    except ValueError:
        raise InputError(f"{name} of shape {array.shape}: must have the shape {batch} of the batch") from None


def _contact_times(value: ArrayLike, batch: tuple[int, ...]) -> _Array:
    """Contact times of every striker; a single number is that of one striker."""
    given = np.asarray(_numbers("state contact_time", value))
    if given.ndim == 0:
        given = given[None]
    if given.shape[-1] == 0:
        raise InputError(f"state contact_time = {shown(value)}: must have one number for each striker")
    known = ~np.isnan(given)
    if (known.any(axis=-1) & ~known.all(axis=-1)).any():
        raise InputError(
            f"state contact_time = {shown(value)}: must be given for every striker, or be NaN for all of them"
        )
    return _spread("state contact_time", given, (*batch, given.shape[-1]))


def _of_parts(name: str, value: ArrayLike, batch: tuple[int, ...]) -> _Array:
    """One number for the striker or circuit of every state, or one for each of several."""
    given = _numbers(name, value)
    several = given.ndim == len(batch) + 1 and given.shape[:-1] == batch and given.shape[-1] > 1
    return np.array(given) if several else _spread(name, given, batch)


def _maybe(name: str, value: ArrayLike, batch: tuple[int, ...]) -> _Array:
    """Numbers of which NaN means that none is given."""
    return _spread(name, _numbers(name, value), batch)


def _numbers(name: str, value: ArrayLike) -> _Array:
    """Finite numbers, or NaN."""
    try:
        array = np.asarray(value)
    except Exception:
        raise InputError(f"{name} = {shown(value)}: must be an array of numbers") from None
    if array.dtype.kind not in "iuf" or np.isinf(array).any():
        raise InputError(f"{name} = {shown(value)}: must be finite numbers, or NaN for none")
    return array.astype(np.float64, copy=False)


# ----------------------------------------------------------------------------------------------------
# Where runs begin: at rest in a well, or anywhere, named in numbers that people use.


START_NAME = re.compile(r"(amplitude|velocity)\[([1-9][0-9]{0,3})\]")
"""Names of the parameters of a start, after ``initial_state.``: ``amplitude[1]``, ``velocity[3]``."""


def checked_well(name: str, value: Any) -> str | int:
    """The name of a well, "lower" or "upper", or its index in ``potential.wells``, also as text."""
    if isinstance(value, str) and value.isdecimal() and len(value) < 10:
        value = int(value)
    number = isinstance(value, (int, np.integer)) and not isinstance(value, (bool, np.timedelta64))
    whole = number and value >= 0
    if not whole and (not isinstance(value, str) or value not in ("lower", "upper")):
        raise InputError(f"{name} = {shown(value)}: must be 'lower', 'upper' or the index of a well in potential.wells")
    return int(value) if whole else value


UNFORCED = "unforced"
"""Initial well of a run whose local forces, such as the voltage of an electrode, begin with it."""


def checked_initial_well(name: str, value: Any) -> str | int:
    """A well as of :func:`checked_well`, or that of the structure without its local forces."""
    if isinstance(value, str) and value == UNFORCED:
        return UNFORCED
    try:
        return checked_well(name, value)
    except InputError as error:
        raise InputError(f"{error}, or {UNFORCED!r}") from None


def amplitude_scale(model: ReducedModel) -> float:
    """Return the unit of the amplitudes of an initial condition, m^0.5.

    It is the norm of the amplitudes in the well.  If these are zero, it is the amplitude that moves the centre by the
    length scale, or by 1 m if there is none.
    """
    well = float(np.sqrt(model.well_amplitude @ model.well_amplitude))
    if well > 0.0:
        return well
    return float(model.length_scale or 1.0) / float(np.abs(model.midspan_shape).max())


def rest_state(model: ReducedModel, striker: Striker | None = None) -> State:
    """State at rest in the well that the striker pushes away from, and touched by it.

    Without a striker: in the as-fabricated well, on the side of the initial shape; in the lower one of a beam without.
    """
    fabricated = striker is None and model.is_bistable and model.as_fabricated_well == "upper"
    if fabricated or (striker is not None and striker.side == "above"):
        return State(amplitude=-model.mirrored.well_amplitude)
    return State(amplitude=model.well_amplitude)


def started(model: ReducedModel, state: State, values: Mapping[str, Any]) -> State:
    """A state with some of its numbers changed.

    ``amplitude[i]`` is the amplitude of buckling mode i over that of the well (-1 for i = 1: the lower well),
    ``velocity[i]`` its velocity over the same times omega_1, ``striker_position`` the mid-position of the tip
    in space, m, ``phase`` that of the drive, rad.  Arrays of one length make a batch.
    """
    columns = {name: finite_array(f"initial_state.{name}", value) for name, value in values.items()}
    batch = np.broadcast_shapes(state.batch, *(column.shape for column in columns.values()))
    amplitude = np.array(np.broadcast_to(state.amplitude, (*batch, model.modes)))
    velocity = np.array(np.broadcast_to(state.velocity, (*batch, model.modes)))
    parts: dict[str, Any] = {"phase": state.phase, "striker_position": state.striker_position}
    scale = amplitude_scale(model)
    for name, column in columns.items():
        found = START_NAME.fullmatch(name)
        if found is None and name not in parts:
            raise InputError(
                f"initial_state.{name}: not a parameter of an initial state; must be amplitude[i], velocity[i], phase or striker_position"
            )
        if found is None:
            parts[name] = column
            continue
        mode = integer(f"initial_state.{name}: mode", int(found[2]), 1, model.modes) - 1
        if found[1] == "amplitude":
            amplitude[..., mode] = column * scale
        else:
            velocity[..., mode] = column * scale * 2.0 * np.pi * model.reference_frequency
    return State(amplitude=amplitude, velocity=velocity, **parts)
