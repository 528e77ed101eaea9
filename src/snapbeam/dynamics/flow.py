"""Flows: maps that take batches of states over one period.

:class:`Flow` is the protocol of such a map; :class:`Stroboscope` is the stroboscopic map of a system over one period of
its drive.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cached_property
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.model.drive.base import HORIZON, Drive
from snapbeam.model.integration import Integration
from snapbeam.model.parameter_axes import ratios_of
from snapbeam.model.parameters import lookup, ratio_of
from snapbeam.model.quantity import split_name
from snapbeam.model.state import FIELDS, OWN_FIELDS, State, amplitude_scale
from snapbeam.model.system import System
from snapbeam.simulation.advance import advance
from snapbeam.simulation.request import cycle_of
from snapbeam.simulation.states import states_of
from snapbeam.solver import native
from snapbeam.solver.assemble import cycles_of, make_ensemble, modal_of, phases_of, plans_of, run_columns
from snapbeam.solver.engines import engine_of
from snapbeam.solver.ensemble import Ensemble
from snapbeam.solver.statistics import statistics_of
from snapbeam.sweeps.replicates import MEASURING_ERROR, Replicates, perturbed_start
from snapbeam.util.provenance import canonical_json
from snapbeam.util.status_codes import RunStatus
from snapbeam.util.validation import InputError, InputTypeError, flag, integer, nonnegative, shown

_Array = NDArray[np.float64]
_REACHED = (int(RunStatus.OK), int(RunStatus.EARLY_STOP))
_SAME_PHASE = 1e-6
"""Difference of two phases, rad, that rounding can make."""
_NEAR_CONTACT = 0.25
"""Distance of a contact from the instant of observation that is small, over that of the instant farthest from contacts."""
_BYTES = 2**27
"""Maximum memory of the stored states."""


# Many starts of one system, each from its own number alone: a beam that rings faintly, a drive at any phase.


@dataclass(frozen=True, kw_only=True)
class InitialConditions:
    """Random initial conditions near the start of the system, or with another phase of the drive.

    Initial condition s follows from the seed and s only.

    Parameters
    ----------
    count : int
        Number of initial conditions, at least 1.
    displacement : float
        Root mean square of the mid-span displacement, m: every linear mode vibrates with equal mean energy.  0 for none;
        by default the error of reading a position to a pixel of the paper's camera.  An initial condition that would
        press the beam into the tip is mirrored about the beam at rest, because the overlap would add contact energy.
    phase : bool
        Whether to sample the phase of the drive in the half of its cycle in which the tip moves away, so that it does
        not press the beam at rest.  For a single striker with a sinusoidal motion.
    seed : int
        Seed of the initial conditions: number s comes from Philox with the key (seed, s).

    Examples
    --------
    >>> import snapbeam as sb
    >>> sb.dynamics.InitialConditions(count=64, displacement=1e-4, seed=1).count
    64
    """

    count: int = 32
    displacement: float = MEASURING_ERROR
    phase: bool = False
    seed: int = 0

    def __post_init__(self) -> None:
        integer("count", self.count, 1, 100_000)
        nonnegative("displacement", self.displacement, "m")
        flag("phase", self.phase)
        integer("seed", self.seed, 0, 2**63 - 1)
        if self.count > 1 and self.displacement == 0.0 and not self.phase:
            raise InputError(
                f"count = {self.count} with displacement = 0 and phase = False: all would be the same; set one of them"
            )

    def describe(self) -> dict[str, Any]:
        """Description of the initial conditions, for comparison."""
        return {
            "count": self.count,
            "displacement": self.displacement,
            "phase": self.phase,
            "seed": self.seed,
            "side": "away from the tip",
        }

    def state(
        self, system: System, number: int, state: State | None = None, location: ArrayLike | None = None
    ) -> State:
        """Start *number* of a system, or that start added to *state* or a batch of states.

        *location* is where the tip strikes, x_s/L, or that of each of several runs; the system's by default.  With several
        locations the result is a batch, also where they do not matter.
        """
        found = state if state is not None else system.start_state
        if location is not None and np.ndim(location):
            shape = (*np.broadcast_shapes(np.shape(location), found.batch), system.model.modes)
            found = dataclasses.replace(
                found,
                amplitude=np.broadcast_to(found.amplitude, shape),
                velocity=np.broadcast_to(found.velocity, shape),
                tangent=None,
                statistics=None,
                modal=None,
            )
        if self.displacement > 0.0:
            rung = perturbed_start(system, Replicates(1, self.displacement, seed=self.seed), number, found)
            found = leaving(system, found, rung, location)
        if not self.phase:
            return found
        if len(system.moving) != 1 or system.striker is None or not system.striker.drive.harmonic:
            raise InputError(
                "phase = True: the half of a cycle in which no tip presses the beam is known for a single striker with a "
                "sinusoidal motion; leave phase out"
            )
        generator = np.random.Generator(np.random.Philox(key=[self.seed, number]).jumped())
        phase = math.pi * (1.0 + generator.random())
        return dataclasses.replace(
            found,
            phase=np.array(phase),
            contact_time=np.array(np.nan),
            tangent=None,
            statistics=None,
            modal=None,
        )


def leaving(system: System, rest: State, begun: State, location: ArrayLike | None = None) -> State:
    """A state beside *rest*, turned about it where it would move the beam towards the first tip.

    *location* is x_s/L, or that of each run of a batch.
    """
    striker = system.striker
    if striker is None:
        return begun
    at = np.asarray(striker.location if location is None else location, dtype=np.float64)
    change: list[NDArray[np.float64]] = [begun.amplitude - rest.amplitude, begun.velocity - rest.velocity]
    away = 1.0 if striker.side == "below" else -1.0
    reach = np.sum(system.model.shape_at(at) * change[0], axis=-1)
    turn = np.where(away * reach < 0.0, -1.0, 1.0)[..., None]
    return dataclasses.replace(
        begun,
        amplitude=rest.amplitude + turn * change[0],
        velocity=rest.velocity + turn * change[1],
        contact_time=np.array(np.nan),
        tangent=None,
        statistics=None,
        modal=None,
    )


def starts_of(given: InitialConditions | int) -> InitialConditions:
    """Starts, or that many of them.

    Raises
    ------
    InputTypeError
    """
    if isinstance(given, InitialConditions):
        return given
    if isinstance(given, (bool, np.bool_)) or not isinstance(given, (int, np.integer)):
        raise InputTypeError(
            f"initial_conditions = {shown(given)}: must be InitialConditions, or their number"
        )
    return InitialConditions(count=int(given))


def held_in_space(system: System) -> System:
    """The system with the mid-position of its first tip fixed in space, where it is at its own start.

    A tip that touches the beam wherever that is makes another system of every start.  Further tips are fixed already.
    """
    if system.striker is None:
        return system
    offset, without_gap = (
        float(make_ensemble(each, Integration()).runs["offset"][0])
        for each in (system, system.replace(**{"contact.gap": 0.0, "initial_state": None}))
    )
    held = system.replace(**{"contact.gap": without_gap - offset})
    start = system.initial_state
    if start is None or np.isnan(start.striker_position).all():
        return held
    none = np.array(np.nan)
    return held.replace(initial_state=replace(start, striker_position=none, contact_time=none))


_MOST_CYCLES = 100
"""Cycles of the primary excitation in a common period, at most."""
_SAME_RATIO = 1e-12
"""Relative difference of a ratio of frequencies from a fraction that rounding can make."""


def frequencies_of(
    system: System, columns: Mapping[str, NDArray[np.float64]]
) -> list[tuple[str, Drive, list[NDArray[np.float64]] | None]]:
    """Section, drive and angular frequencies (rad/s) of every motion; None: it does not repeat."""
    runs, found = cycles_of(system, columns).size, []
    for section, drive in system.moving:
        own = {
            split_name(name)[1]: values for name, values in columns.items() if split_name(name)[0] == section
        }
        found.append((section, drive, drive.frequencies(own or {"": np.zeros(runs)}, system.scale)))
    return found


def common_cycles(system: System, columns: Mapping[str, NDArray[np.float64]]) -> NDArray[np.int64]:
    """Cycles of the primary excitation after which every motion repeats, for each run, shape (runs,).

    Raises
    ------
    InputError
        If a motion does not repeat, or the frequencies have no common period of at most 100 cycles.
    """
    cycle = cycles_of(system, columns)
    found = np.ones(cycle.size, dtype=np.int64)
    for section, drive, rates in frequencies_of(system, columns):
        if rates is None:
            raise InputError(
                f"{section}: a motion of type {drive.name!r} does not repeat; the dynamics tools need a common period of "
                "all motions; use sb.advance or simulate"
            )
        for rate in rates:
            turns = rate * cycle / (2.0 * math.pi)
            for ratio in np.unique(turns):
                which, fraction = turns == ratio, Fraction(float(ratio)).limit_denominator(_MOST_CYCLES)
                found[which] = np.lcm(found[which], fraction.denominator)
                apart = abs(float(fraction) - ratio) > _SAME_RATIO * ratio
                if apart or found[which].max() > _MOST_CYCLES:
                    leads = system.moving[0][0]
                    raise InputError(
                        f"{section}: no common period with {leads}; the ratio of its frequency to that of {leads} is "
                        f"{ratio:.12g} and must make all motions repeat within {_MOST_CYCLES} cycles of {leads}; choose "
                        "frequencies in ratios of small whole numbers, or use sb.advance or simulate"
                    )
    return found


@dataclass(frozen=True, eq=False)
class AdvancedStates:
    """States after a number of periods."""

    states: _Array
    """After the last period, shape (runs, d); NaN where a run failed."""
    every: _Array | None
    """After each period, shape (runs, periods, d), if requested."""
    tangents: _Array | None
    """Small changes that were carried along, shape (runs, k, d)."""
    statistics: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    """Statistics of the motion, by name, shape (runs,)."""
    hidden: Any = None
    """State of the solver for a bitwise exact restart."""
    hidden_every: tuple[Any, ...] | None = None
    """The same after each period, with *every*."""

    def beginnings(self, later: AdvancedStates) -> AdvancedStates:
        """States at the beginnings of the periods of *later*, a continuation of this result, ordered by period."""
        assert later.every is not None
        states = np.concatenate([self.states, *later.every.transpose(1, 0, 2)[:-1]])
        if later.hidden_every is None:
            return AdvancedStates(states, None, None, hidden=states)
        return AdvancedStates(
            states, None, None, hidden=_joined_states([self.hidden, *later.hidden_every[:-1]])
        )


@runtime_checkable
class Flow(Protocol):
    """A map of states of *dimension* numbers, applied once a period."""

    @property
    def dimension(self) -> int:
        """Numbers of a state, d."""
        ...

    @property
    def period(self) -> float:
        """Time that the map takes, s, or 1 for a map without time."""
        ...

    @property
    def smooth(self) -> bool:
        """True if tangents can be computed."""
        ...

    def advance(
        self,
        states: ArrayLike | AdvancedStates,
        periods: int = 1,
        *,
        tangents: _Array | None = None,
        every: bool = False,
        points: Mapping[str, _Array] | None = None,
    ) -> AdvancedStates:
        """Take states of shape (runs, d), or where they came to, some periods on.

        *tangents* has the shape (runs, k, d); *points* are parameters that differ between the runs.
        """
        ...

    def neighbour(self, name: str, value: float) -> Flow:
        """The flow with one parameter changed."""
        ...

    def value(self, name: str) -> float:
        """A parameter."""
        ...


@dataclass(frozen=True, eq=False)
class Stroboscope:
    """The map of a system over the common period of its motions, the tips' mid-positions fixed in space.

    A state is amplitude over that of the well for each buckling mode, then velocity over the same times omega_1: the
    coordinates ``amplitude[i]`` and ``velocity[i]``.  States of strikers and circuits follow, each in a unit of the same size:
    ``striker_shift[i]`` and ``striker_rate[i]`` of a striker with mass at contact i, its ``indentation[i]``, ``circuit[i]`` of harvester i.

    Parameters
    ----------
    system : System
    integration : Integration, optional
    phase : float, optional
        Phase of the primary excitation at which the map takes states, rad.  By default each motion has the phase at
        which a run of the system begins.
    """

    system: System
    integration: Integration = field(default_factory=Integration)
    phase: float | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.system, System):
            raise InputTypeError(f"system = {shown(self.system)}: must be a System")
        if not isinstance(self.integration, Integration):
            raise InputTypeError(f"integration = {shown(self.integration)}: must be an Integration")
        if self.integration.tolerance is not None:
            raise InputError(
                f"tolerance = {self.integration.tolerance:g}: is for one run; give steps, or accuracy = 'reference'"
            )
        self.cycles_per_period  # noqa: B018  refuses motions without a common period
        object.__setattr__(self, "system", held_in_space(self.system))

    @property
    def modes(self) -> int:
        """N."""
        return self.system.model.modes

    @property
    def dimension(self) -> int:
        """2 N, and one for each state of strikers and circuits."""
        return 2 * self.modes + len(self._own)

    @cached_property
    def _own(self) -> tuple[tuple[str, int, float], ...]:
        """States in addition to those of the beam: array of :class:`State`, place in it, and unit."""
        parts = self.system.contacts
        if not self.system.harvesters and all(
            each.striker.mass is None and not each.law.memory for each in parts
        ):
            return ()
        ensemble = make_ensemble(self.system, self.integration)
        structure, model = ensemble.structure, self.system.model
        size, omega = amplitude_scale(model), 2.0 * math.pi * model.reference_frequency
        length = size * float(np.abs(model.midspan_shape).max())
        units = {"striker_shift": length, "striker_rate": length * omega}
        return (
            *((name, body.contact, unit) for name, unit in units.items() for body in structure.bodies),
            *(("indentation", contact, length) for contact in structure.indentations),
            *(
                ("circuit", i, size * float(np.linalg.norm(circuit.row)) * ensemble.circuits[i].unit)
                for i, circuit in enumerate(structure.circuits)
                if circuit.mode is not None
            ),
        )

    @property
    def has_memory(self) -> bool:
        """True if a contact leaves an indentation."""
        return any(name == "indentation" for name, _, _ in self._own)

    def _own_arrays(self, rows: _Array) -> dict[str, Any]:
        """The arrays of a state that hold the last coordinates of *rows*, in SI units, shape (..., d)."""
        places = {"circuit": len(self.system.harvesters)}
        found = {
            name: np.full((*rows.shape[:-1], max(1, places.get(name, len(self.system.contacts)))), np.nan)
            for name in OWN_FIELDS
        }
        for column, (name, place, _) in enumerate(self._own, 2 * self.modes):
            found[name][..., place] = rows[..., column]
        return {name: values if values.shape[-1] > 1 else values[..., 0] for name, values in found.items()}

    @cached_property
    def cycles_per_period(self) -> int:
        """Cycles of the primary excitation in the common period of all motions."""
        return int(common_cycles(self.system, run_columns(self.system, {}))[0])

    @cached_property
    def period(self) -> float:
        """Common period of all motions, s."""
        return self.cycles_per_period * cycle_of(self.system)

    @property
    def _turns(self) -> int:
        """Cycles of the primary excitation in one turn of the phase of a state."""
        leads = self.system.primary_excitation
        return 1 if leads is None or (leads[1].is_periodic and len(self.system.moving) < 2) else HORIZON

    @property
    def smooth(self) -> bool:
        """True: tangents are exact."""
        return True

    @property
    def jumps(self) -> bool:
        """True if the derivatives of the map may jump, by a contact force that does, depends on the velocity or has a memory."""
        laws = [each.law for each in self.system.contacts]
        return any(
            law.is_dissipative or not (law.properties.smooth and law.properties.tangent) for law in laws
        )

    @property
    def refined(self) -> Stroboscope:
        """The flow at accuracy level "reference"."""
        return Stroboscope(self.system, self.integration.replace(accuracy="reference", step=None), self.phase)

    @property
    def with_half_step(self) -> Stroboscope:
        """The flow with steps of half the length."""
        step = plans_of(self.system, self.integration, run_columns(self.system, {}))[0].step
        return Stroboscope(self.system, self.integration.replace(step=0.5 * step), self.phase)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the coordinates."""
        modes = range(1, self.modes + 1)
        own = (f"{name}[{place + 1}]" for name, place, _ in self._own)
        return (*(f"amplitude[{i}]" for i in modes), *(f"velocity[{i}]" for i in modes), *own)

    @cached_property
    def scales(self) -> _Array:
        """Units of the coordinates, m^0.5 and m^0.5/s of the beam, shape (d,)."""
        size = amplitude_scale(self.system.model)
        speed = size * 2.0 * math.pi * self.system.model.reference_frequency
        return np.append(np.repeat([size, speed], self.modes), [unit for _, _, unit in self._own])

    @property
    def given_phase(self) -> float:
        """The ``phase`` of a state that begins a period, rad; NaN: every motion begins at its own phase."""
        if self.phase is not None:
            if self._turns == 1:
                return self.phase
            return (self.phase - self._own_phase) % (2.0 * math.pi) / self._turns
        return math.nan if self.system.initial_state is None else float(self.system.initial_state.phase)

    @property
    def striker_phase(self) -> float:
        """Phase of the primary excitation at the beginning of a period, rad; 0 if nothing moves."""
        own, given = self._own_phase, self.given_phase
        if self.system.primary_excitation is None or math.isnan(given):
            return own
        # several motions share one clock, which counts from the time at which all have their own phases
        return given if self._turns == 1 else own + self._turns * given

    @property
    def _own_phase(self) -> float:
        """Phase of the primary excitation at the start of a run, rad."""
        leads = self.system.primary_excitation
        return 0.0 if leads is None else float(getattr(leads[1], "phase", 0.0))

    def starting(self, state: State) -> System:
        """The system with *state* as its start, at the phase at which the map takes states."""
        changes: dict[str, Any] = {"initial_state": state}
        section, drive = self.system.primary_excitation or ("", None)
        if self.phase is not None and self._turns == 1 and section == "drive" and hasattr(drive, "phase"):
            changes["drive.phase"] = self.phase
        return self.system.replace(**changes)

    def neighbour(self, name: str, value: float) -> Stroboscope:
        """The flow of the system with one parameter changed, by dotted name or the name in datasets."""
        return self.changed({name: value})

    def changed(self, values: Mapping[str, float]) -> Stroboscope:
        """The flow of the system with parameters changed, by dotted names or the names in datasets."""
        for name in values:
            self._require_free(name)
        changes = {self.system.parameter(name).name: value for name, value in values.items()}
        return Stroboscope(self.system.replace(**changes), self.integration, self.phase)

    def _require_free(self, name: str) -> None:
        """Refuse to change a phase that another value would override."""
        section, field = split_name(self.system.parameter(name).name)
        leads = self.system.moving[:1]
        if field != "phase" or not leads or section != leads[0][0]:
            return
        if self.phase is not None or (len(self.system.moving) == 1 and not math.isnan(self.given_phase)):
            source = "phase" if self.phase is not None else "initial_state.phase"
            raise InputError(
                f"{source} = {self.given_phase:g}: must not be given if {section}.phase changes; leave {source} out"
            )

    def value(self, name: str) -> float:
        """A parameter of the system."""
        return float(self.system.get(self.system.parameter(name).name))

    def coordinates(self, state: State | None = None) -> _Array:
        """A state, or a batch of them, in the coordinates of the flow, shape (runs, d); the start by default."""
        if state is None:
            state = self.system.start_state
        else:
            self._require_phase(state)
        if state.modes != self.modes:
            raise InputError(f"state of {state.modes} modes: must have the {self.modes} modes of the model")
        return self._coordinates_of(state.flat())

    def _coordinates_of(self, flat: State) -> _Array:
        parts = [flat.amplitude, flat.velocity]
        for name, place, _ in self._own:
            given = getattr(flat, name).reshape(flat.batch[0], -1)
            parts.append(np.nan_to_num(given[:, [min(place, given.shape[1] - 1)]]))
        return np.concatenate(parts, axis=1) / self.scales

    def _require_phase(self, state: State) -> None:
        """Refuse a state at another phase of the motions than the one at which the map takes states."""
        apart = (state.phase - self._clock_phase) * self._turns
        apart = np.abs(apart - 2.0 * math.pi * np.rint(apart / (2.0 * math.pi)))
        if self.system.primary_excitation is not None and (apart > _SAME_PHASE).any():
            raise InputError(
                f"state phase = {shown(state.phase)}: must be the phase at which the system is observed, "
                f"{self._clock_phase:g} rad, or NaN; advance the state to that phase with sb.advance"
            )

    def state(self, coordinates: ArrayLike) -> State:
        """States of coordinates of shape (..., d), at the phase at which the system is seen."""
        full = np.asarray(coordinates, dtype=np.float64) * self.scales
        return State(
            amplitude=full[..., : self.modes],
            velocity=full[..., self.modes : 2 * self.modes],
            phase=np.array(self._clock_phase),
            striker_position=np.array(self.striker_position),
            **self._own_arrays(full),
        )

    @cached_property
    def _clock_phase(self) -> float:
        """The argument of the engine's clock at the beginning of a period, rad."""
        own = phases_of(self.system, run_columns(self.system, {}), 1)
        return float(own[0]) if math.isnan(self.given_phase) else self.given_phase

    def carried(self, coordinates: _Array, phase: float) -> _Array:
        """A state that the map takes, at the next instant at which the primary excitation has *phase*, rad."""
        from snapbeam.simulation.simulate import simulate

        part = (phase - self.striker_phase) % (2.0 * math.pi) / (2.0 * math.pi)
        if part == 0.0:
            return coordinates
        begun = self.state(coordinates)
        if self._own:  # to a tick of the clock
            return self._coordinates_of(
                advance(self.system, begun, part, integration=self.integration).flat()
            )[0]
        integration = self.integration.replace(cycles=1, early_termination=False)
        times = [0.0, part * cycle_of(self.system)]
        last = simulate(self.starting(begun), integration, sample_times=times).dataset.isel(time=-1)
        return np.concatenate([last["modal_amplitude"].values, last["modal_velocity"].values]) / self.scales

    def phase_between_contacts(self, coordinates: _Array, periods: int) -> float | None:
        """Phase of the primary excitation, rad, at which a periodic motion is farthest from its contacts.

        None where that is not needed: the map is smooth, or no contact is near the phase at which it takes states.
        """
        from snapbeam.simulation.simulate import simulate

        if not self.jumps or self.system.striker is None:
            return None
        cycles, cycle = periods * self.cycles_per_period, cycle_of(self.system)
        integration = self.integration.replace(cycles=cycles, early_termination=False)
        end = cycles * cycle
        run = simulate(self.starting(self.state(coordinates)), integration, sample_times=[0.0, end])
        onset = run.impacts["onset"].values
        if run.summary.status != int(RunStatus.OK) or not onset.size:
            return None
        order = np.argsort(onset)
        release = np.maximum.accumulate((onset + run.impacts["duration"].values)[order])
        free = np.append(onset[order][1:], onset[order][0] + end) - release
        middle = (release + 0.5 * free) % end
        # several motions share one clock: their map takes states within the first cycle of the common period
        free[middle % self.period > cycle] = 0.0
        best = int(np.argmax(free))
        distance = min(float(onset.min()), end - float(release[-1]))
        if distance > _NEAR_CONTACT * 0.5 * free[best]:
            return None
        return (self.striker_phase + 2.0 * math.pi * float(middle[best]) / cycle) % (2.0 * math.pi)

    @cached_property
    def striker_position(self) -> float:
        """Mid-position of the tip, m; NaN without a striker."""
        if self.system.striker is None:
            return math.nan
        ensemble = make_ensemble(self.system, self.integration)
        run, sign = ensemble.runs[0], ensemble.structure.sign
        return float(sign * (run["rest_contact"] + run["offset"]))

    def advance(
        self,
        states: ArrayLike | AdvancedStates,
        periods: int = 1,
        *,
        tangents: _Array | None = None,
        every: bool = False,
        points: Mapping[str, _Array] | None = None,
    ) -> AdvancedStates:
        """Advance as :meth:`Flow.advance`; a run does not depend on the runs that are integrated with it."""
        begun = states.hidden if isinstance(states, AdvancedStates) else self._begun(states)
        if tangents is not None and periods > 1:
            # period by period along this motion, which that of the finer steps of derivatives would leave
            came = self.advance(states, periods, every=True, points=points)
            for start in (begun, *(came.hidden_every or ())[:-1]):
                tangents = self._advance_part(start, 1, False, points, tangents).tangents
            kept = came if every else replace(came, every=None, hidden_every=None)
            return replace(kept, tangents=tangents)
        count, size = begun.batch[0], 2 * 8 * (self.modes + 16)
        share = max(1, _BYTES // (size * periods * self.cycles_per_period))
        parts = [slice(at, min(at + share, count)) for at in range(0, count, share)]
        found = [
            self._advance_part(
                begun[part] if len(parts) > 1 else begun,
                periods,
                every,
                None if points is None else {name: values[part] for name, values in points.items()},
                None if tangents is None else tangents[part],
            )
            for part in parts
        ]
        return found[0] if len(found) == 1 else _joined(found)

    def _begun(self, states: ArrayLike) -> State:
        rows = _rows(states)
        if rows.ndim != 2 or rows.shape[1] != self.dimension:
            raise InputError(f"states of shape {rows.shape}: must have the shape (runs, {self.dimension})")
        # a failed state stands still and stays lost
        lost = ~np.asarray(np.isfinite(rows).all(axis=1))
        full = np.where(lost[:, None], 0.0, rows) * self.scales
        passed: dict[str, Any] = {
            "status": np.where(lost, int(RunStatus.DIVERGED), int(RunStatus.OK)).astype(np.int8)
        }
        return State(
            amplitude=full[:, : self.modes],
            velocity=full[:, self.modes : 2 * self.modes],
            phase=np.array(self.given_phase),
            statistics=passed,
            **self._own_arrays(full),
        )

    def _ensemble(self, begun: State, periods: int, points: Mapping[str, _Array]) -> Ensemble:
        """Runs of some periods from a batch of states."""
        for name in points:
            self._require_free(name)
        named = {self.system.parameter(name).name: np.asarray(each) for name, each in points.items()}
        own = ratios_of(self.system, named)
        if own:
            self._require_period(own)
        how = self.integration.replace(early_termination=False)
        return make_ensemble(
            self.system, how, own, start=begun.flat(), periods=periods * self.cycles_per_period
        )

    def slope(self, x: _Array, periods: int, name: str, value: float, step: float) -> _Array:
        """Derivative by a parameter of the runs of where the map brings one state, shape (d,).

        The numbers of a run are differentiated by a difference over twice the *step*, the run itself exactly.  A motion whose table of
        pieces depends on the parameter, or that jumps, takes differences between runs.
        """
        begun, moved = self._begun(x[None]), np.zeros((1, 1, self.dimension))
        for _ in range(periods):
            here, above, below = (
                self._ensemble(begun, 1, {name: np.array([at])}) for at in (value, value + step, value - step)
            )
            if not native.differentiable(above, below):
                ends = [
                    self.advance(x[None], periods, points={name: np.array([at])})
                    for at in (value + step, value - step)
                ]
                change: _Array = (ends[0].states - ends[1].states)[0] / (2.0 * step)
                return change
            moved = self._moved(here, moved, np.zeros(1, bool), (above, below, 2.0 * step))
            begun = self._advance_part(begun, 1, False, {name: np.array([value])}, None).hidden
            # the gap says where the tip is, whatever the parameter moves
            begun = replace(begun, striker_position=np.array(np.nan), modal=None)
        found: _Array = moved[0, 0]
        return found

    def _advance_part(
        self,
        begun: State,
        periods: int,
        every: bool,
        points: Mapping[str, _Array] | None,
        tangents: _Array | None,
    ) -> AdvancedStates:
        lost = None if begun.statistics is None else ~np.isin(begun.statistics["status"], _REACHED)
        ensemble = self._ensemble(begun, periods, points or {})
        output_states = engine_of(ensemble).integrate_with_output_states(ensemble, self.integration.threads)
        failed = ~np.isin(output_states.accumulators_of_runs["status"], _REACHED)
        if lost is not None:
            failed |= lost
        last = self._rows(
            ensemble, output_states.q[:, -1:], output_states.p[:, -1:], output_states.well_sign[:, -1:]
        )[:, 0]
        each = slice(self.cycles_per_period - 1, None, self.cycles_per_period)
        whole = None
        if every:
            whole = self._rows(
                ensemble, output_states.q[:, each], output_states.p[:, each], output_states.well_sign[:, each]
            )
        for array in (last, whole):
            if array is not None:
                array[failed] = np.nan
        status = np.where(
            failed,
            np.where(
                output_states.accumulators_of_runs["status"] == 0,
                3,
                output_states.accumulators_of_runs["status"],
            ),
            0,
        )

        def after(index: int) -> State:
            q, p = (
                np.where(failed[:, None], 0.0, values[:, index])
                for values in (output_states.q, output_states.p)
            )
            found = states_of(
                ensemble, q, p, output_states.well_sign[:, index], output_states.contact_ticks[:, index], ensemble.runs["end"]
            )  # fmt: skip
            # after a period every motion is where it began
            return replace(found, phase=ensemble.runs["phase"].copy(), statistics={"status": status})

        ends = range(output_states.q.shape[1])[each]
        return AdvancedStates(
            last,
            whole,
            None if tangents is None else self._moved(ensemble, tangents, failed),
            statistics_of(ensemble, output_states.accumulators_of_runs),
            after(-1),
            tuple(after(index) for index in ends) if every else None,
        )

    def _moved(
        self,
        ensemble: Ensemble,
        tangents: _Array,
        failed: NDArray[np.bool_],
        beside: tuple[Ensemble, Ensemble, float] | None = None,
    ) -> _Array:
        """Small changes of shape (runs, k, d) of the coordinates at the end of runs, NaN of those that failed."""
        structure, full, n = ensemble.structure, np.diag(self.scales), self.modes
        units = np.array([each.unit for each in ensemble.circuits] or [1.0])
        along = State(
            amplitude=structure.equilibrium + full[:, :n],
            velocity=full[:, n : 2 * n],
            **self._own_arrays(full),
        )
        modal = modal_of(structure, along, units)
        q, p = native.tangents(
            ensemble, tangents @ modal[:, 0], tangents @ modal[:, 1], self.integration.threads, beside
        )
        one, none = np.ones(q.shape[:2], np.int64), np.zeros_like(q)
        found: _Array = self._rows(ensemble, q, p, one) - self._rows(ensemble, none, none, one)
        found[failed] = np.nan
        return found

    def _require_period(self, own: Mapping[str, _Array]) -> None:
        """Refuse parameters of runs with which the motions have a common period of another number of cycles."""
        found = common_cycles(self.system, run_columns(self.system, own))
        if (found != self.cycles_per_period).any():
            raise InputError(
                f"{', '.join(own)}: the common period of all motions must have the same number of cycles in every run; it "
                f"has {self.cycles_per_period} cycles in the system and {int(found[found != self.cycles_per_period][0])} "
                "in one of the runs; change all frequencies together, or ask for each value by itself"
            )

    def _rows(self, ensemble: Any, q: _Array, p: _Array, well_sign: NDArray[np.int64]) -> _Array:
        """States in coordinates, one by one, so that none depends on the others; shape (runs, periods, d)."""
        structure = ensemble.structure
        first = np.where((well_sign < 0)[..., None], q + structure.shift, q)
        modes, beam = self.system.model.linear_modes.T, slice(self.modes)
        amplitude = structure.equilibrium + (first[..., None, beam] @ modes)[..., 0, :]
        velocity = (p[..., None, beam] @ modes)[..., 0, :]
        found = {
            "striker_shift": structure.bodies_of(q),
            "striker_rate": structure.bodies_of(p),
            "indentation": structure.indentations_of(q),
            "circuit": structure.circuits_of(q),
        }
        own = [found[name].reshape(*q.shape[:2], -1)[..., place, None] for name, place, _ in self._own]
        rows: _Array = np.concatenate([amplitude, velocity, *own], axis=-1)
        for column, (name, place, _) in enumerate(self._own, 2 * self.modes):
            if name == "circuit":
                rows[..., column] *= ensemble.circuits[place].unit
        return rows / self.scales


def _joined(parts: list[AdvancedStates]) -> AdvancedStates:
    """Parts of an ensemble that were integrated one after the other."""

    def stacked(arrays: list[Any]) -> Any:
        return None if arrays[0] is None else np.concatenate(arrays)

    statistics = {name: stacked([part.statistics[name] for part in parts]) for name in parts[0].statistics}
    return AdvancedStates(
        stacked([part.states for part in parts]),
        stacked([part.every for part in parts]),
        stacked([part.tangents for part in parts]),
        statistics,
        _joined_states([part.hidden for part in parts]),
        None
        if parts[0].hidden_every is None
        else tuple(
            _joined_states(list(each))
            for each in zip(*(part.hidden_every or () for part in parts), strict=True)
        ),
    )


def _joined_states(states: list[State]) -> State:
    from snapbeam.model.state import ModalState

    arrays: dict[str, Any] = {
        name: np.concatenate([getattr(each, name) for each in states]) for name in FIELDS
    }
    modals = [each.modal for each in states]
    first = modals[0]
    assert first is not None
    parts: dict[str, Any] = {
        name: np.concatenate([getattr(each, name) for each in modals])
        for name in ("q", "p", "well_sign", "offset")
    }
    status = np.concatenate([np.asarray((each.statistics or {})["status"]) for each in states])
    return State(
        **arrays, statistics={"status": status}, modal=ModalState(**parts, structure=first.structure)
    )


def flow_of(
    system: System | Flow, integration: Integration | None = None, accuracy: str = "standard"
) -> Flow:
    """The flow that a system makes, or one that is one; *accuracy* is meant where no integration is given."""
    if isinstance(system, System):
        return Stroboscope(system, Integration(accuracy=accuracy) if integration is None else integration)
    if not isinstance(system, Flow):
        raise InputTypeError(
            f"system = {shown(system)}: must be a System, or a Flow that takes states a period on"
        )
    if integration is not None:
        raise InputTypeError("integration: is for a System; a Flow brings its own")
    return system


def jumps(flow: Flow) -> bool:
    """Return whether the derivatives of a map may jump between orbits with other numbers of impacts."""
    return flow.jumps if isinstance(flow, Stroboscope) else not flow.smooth


TIME_CONSTANTS = 16.0
"""Time constants of the slowest decay after which a motion counts as settled: free vibration has fallen to 1e-7."""
_LONGEST = 20_000
"""Maximum number of periods that the damping chooses."""


def fixed_parameters(flow: Flow, *varied: str) -> dict[str, Any]:
    """Return the parameters that a figure states: beam, modes, excitation and location, without the varied ones."""
    if not isinstance(flow, Stroboscope):
        return {}
    system, model = flow.system, flow.system.model
    attrs: dict[str, Any] = {
        "modes": model.modes,
        "length_scale": model.length_scale,
        "reference_frequency": model.reference_frequency,
        "system": canonical_json(system.to_mapping()),
    }
    if model.beam is not None:
        attrs |= {
            f"beam_{name}": float(getattr(model.beam, name))
            for name in ("length", "thickness", "buckling_level")
        }
    if system.primary_excitation is not None:
        section, drive = system.primary_excitation
        attrs |= {lookup(f"{section}.{name}").short: float(value) for name, value in drive.values().items()}
    if system.striker is not None:
        attrs["location"] = float(system.striker.location)
    shorts = {lookup(ratio_of(system.parameter(name).name)).short for name in varied}
    return {name: value for name, value in attrs.items() if name not in {*varied, *shorts}}


def dimensionless(words: str) -> dict[str, str]:
    """Attributes of a variable without a unit."""
    return {"units": "1", "long_name": words}


def settling_periods(flow: Flow, rates: ArrayLike = (), least: int = 200) -> tuple[int, str]:
    """The number of periods after which a motion of *flow* counts as settled, and the rule that gave it.

    It is 16 time constants of the slowest mode, 1/min(zeta_j omega_j), but at least *least* and at most 20,000 periods.

    Parameters
    ----------
    flow : Flow
        Without modes, as a map has, *rates* alone count; without both the number is *least*.
    rates : array_like
        Further decay rates, 1/s (per period of a map), such as those towards known attractors.
    """
    known = [float(rate) for rate in np.ravel(np.asarray(rates, dtype=np.float64))]
    if isinstance(flow, Stroboscope):
        model = flow.system.model
        rates = model.damping_ratio * model.omega if model.damping is None else -flow.system.poles().real
        known.append(float(np.min(rates)))
    if not known:
        return least, f"{least} periods"
    slowest = min(known)
    wanted = TIME_CONSTANTS / (slowest * flow.period) if slowest > 0.0 else math.inf
    rule = f"{TIME_CONSTANTS:g} time constants of the slowest decay"
    if wanted > _LONGEST:
        return _LONGEST, f"the maximum of {_LONGEST} periods; {rule} would be {wanted:.3g}"
    if wanted < least:
        return least, f"the minimum of {least} periods; {rule} are {wanted:.3g}"
    return math.ceil(wanted), rule


def _rows(states: ArrayLike) -> _Array:
    """States as rows of numbers, NaN in those that were lost."""
    try:
        return np.atleast_2d(np.asarray(states, dtype=np.float64))
    except (TypeError, ValueError, OverflowError):
        raise InputTypeError(f"states = {shown(states)}: must be an array of numbers, a row a run") from None
