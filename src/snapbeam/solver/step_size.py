"""Choice of the step size: the default from model and contact, or the user's request."""

from __future__ import annotations

import math
from collections import OrderedDict
from functools import cached_property
from itertools import zip_longest
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam import _core
from snapbeam.model.contact.base import ContactLaw
from snapbeam.model.drive.base import HORIZON
from snapbeam.model.drive.recorded_motion import RecordedMotion
from snapbeam.model.integration import ACCURACIES, Integration
from snapbeam.model.matrix_pairs import coupled_blocks
from snapbeam.model.reduced_model import ReducedModel
from snapbeam.model.system import System
from snapbeam.solver.channels import SIGNAL
from snapbeam.solver.ensemble import Records
from snapbeam.solver.structure import Structure, structure_of
from snapbeam.util.cores import usable_cores
from snapbeam.util.diagnostics import Diagnostic, Severity
from snapbeam.util.validation import InputError, choice, positive

_Array = NDArray[np.float64]
_FEWEST = 30.0
"""Flight steps in a period of the first mode, at least."""
_MOST = 2.0**17
_PER_OCTAVE = 20
_IN_A_ROW = 3
"""Successive numbers of those that are tried that must serve, the one that is taken and those above it: steps are made
shorter to fit the cycle, and modes that come in step with the kicks spoil single lengths."""
_FINER = 2.0
"""Steps of sixth order that all others are compared with, over the shortest of them."""
CALM = {4: 10.0, 6: 3.0}
"""Energy of a motion over the barrier's beyond which flight steps are halved, by order: of order 4 the most of those by which they are chosen."""
_STARTS = ((0.15, 1.0 / 60.0, 2.0, 0.3), (10.0, 1.0 / 160.0, 1.0, 1.0))
"""Energy of each impulse over the barrier's, its maximum duration in periods of the first mode, the length of the
steps that are tried over the flight step, and the error allowed over the limit: a beam that rings in its well, and one
after a strong impulse.  The first may ring for many cycles, so that steps of twice the length must serve."""
_SHORT_IMPACT = 1.0 / 150.0
"""Impact duration over the period of the first mode, below which higher modes reduce the error limit."""
_STRUCK = 0.46
"""Relative location on the beam of a reference striker: no mode has an isolated node near it."""
_PERIODS = 2.0
_MOST_SLOPE = 1e5
_NEIGHBOUR = 1e-9
"""Relative difference of the velocities of a neighbour, by which a start's own sensitivity is measured."""
_PLACES = (0.1, 0.2, 0.3, 0.4, 0.5)
_MOST_MODES = 48
"""Lowest modes that take part: the tension hardly couples the others, and the step found is the same."""
_CHOSEN: OrderedDict[tuple[object, ...], float] = OrderedDict()
"""Steps that were chosen, by all that the choice depends on."""
_MOST_CHOSEN = 4096
# Free flight: the error allowed a step, as it is measured on the structure, by level of accuracy.
_LIMIT = {"standard": 2.5e-7, "reference": 2e-11}
_LIMIT_OF_HITS = {"standard": 1e-9, "reference": 1e-13}
"""Error limit of impacts of zero duration: there are no contact steps to share the error, and only one mode."""
_ORDER = {"standard": 4, "reference": 6}


def composition_of(order: int, general: bool = False) -> int:
    """Number of a composition in ``core/structure.hpp``; a *general* one is for kicks that depend on velocities too."""
    return 0 if order == 4 else 2 if general else 1


_FREE_TURN = 4.0
"""Maximum phase of the fastest mode in a flight step of level "reference", rad."""
_MOST_DECAY = 1.8
"""Maximum decay of the fastest decaying mode in a flight step."""
# Contact: longest step over the time of an impact at the speed 0.2 b omega_1, by level, and how many
# halvings below it the shortest step is, by order.
_CONTACT_SHARE = {"standard": 1.0 / 8.0, "reference": 1.0 / 32.0}
_CONTACT_SPEED = 0.2
_HALVINGS = {4: 4, 6: 10}
_NATIVE_HALVINGS = 3
_MOST_HALVINGS = {"standard": 5, "reference": 7}
_CONTACT_TURN = {"standard": math.pi, "reference": 1.0}
"""Maximum phase of the fastest mode in the longest contact step, rad; beyond half a turn, kicks are in resonance."""
SUBDIVISION = 1 << 20
"""Ticks of a flight step."""
_MOST_TICKS = 2.0**61
_MOST_TICKS_OF_RUN = 2.0**53
"""Ticks to the end of a run, which the core counts in doubles."""
_HOUR = 3600.0


# Steps in free flight, measured on the structure itself.
#
# How long a step may be follows from how the tension detunes the modes, from which of them come in step with the kicks,
# and from how much energy there is; no formula holds from one mode to a hundred and from shallow beams to deep ones.  So
# it is tried: the structure in its well gets a weak and a strong impulse at one point and is integrated for two periods
# of its first mode with steps of many lengths.  A step serves if its result differs by less than a limit from that of
# steps shorter than all of them, where the error is
# counted in the relative change of velocity at the start that would have done as much.


def flight_step(
    model: ReducedModel, order: int, limit: float, impact: float = math.inf, resonances: bool = False
) -> float:
    """The longest step in free flight, s, that serves a structure.

    Parameters
    ----------
    model : ReducedModel
    order : int
        Order of the composition.
    limit : float
        Maximum error of a displacement, over the buckling level, after two periods of the first mode; where the
        start is sensitive, that many times the displacement's relative slope along the velocity at the start.
    impact : float
        Duration of an impact, s: the impulses that are tried last no longer, and of impacts shorter than 1/150 of the
        period the limit is less in proportion.
    resonances : bool
        Shorten the step until no motion grows at any tension that is held fixed.
    """
    period = 1.0 / _first_frequency(model)
    limit *= min(1.0, impact / (_SHORT_IMPACT * period))
    linear = model.nonlinear_stiffness == 0.0 or not model.tension_matrix.any()
    if linear and not model.modal_damping.coefficients.size:
        return period / _FEWEST  # nothing but linear modes, whose flow is exact
    structure = structure_of(model, "below")
    places = model.beam if model.contact_shape is None else model.contact_shape.tobytes()
    longest = min(impact / period, max(duration for _, duration, *_ in _STARTS))
    key = (structure.hash, order, limit, period, model.length_scale, places, longest, resonances)
    if key not in _CHOSEN:
        chosen = period / (_FEWEST if linear else _Bench(structure, order, longest).fewest(limit))
        if not linear and not structure.wells_are_mirror_images:
            chosen = min(chosen, period / _Bench(structure, order, longest, far=True).fewest(limit))
        while resonances and chosen > period / _MOST and growth(structure, order, chosen) > _MOST_GROWTH:
            chosen *= 0.97
        _CHOSEN[key] = _with_coupled_damping(structure, order, chosen, _COUPLED * limit, period)
        while len(_CHOSEN) > _MOST_CHOSEN:
            _CHOSEN.popitem(last=False)
    return _CHOSEN[key]


def _first_frequency(model: ReducedModel) -> float:
    """Frequency of the first mode, Hz, or the one that normalises where that is higher, as of a free mass.

    A given reference frequency far below the first mode must not lengthen the steps.
    """
    return max(float(model.about_reference_well.natural_frequencies[0]), model.reference_frequency)


_TENSIONS = np.concatenate((np.geomspace(0.02, 0.5, 8), np.linspace(0.75, 8.0, 16)))
"""Changes of the tension, over what the well has beyond the critical load; 8 is that of three times the amplitude of the well."""
_MOST_GROWTH = 0.05
"""Growth of a motion at fixed tension, by its logarithm in a period of the first mode, that counts as none."""
_SQUARINGS = 14
_COUPLED = 10.0
"""Error limit of damping that couples modes, over that of the tension: of a period and any start, here in energies."""


def _with_coupled_damping(structure: Structure, order: int, step: float, limit: float, period: float) -> float:
    """A step (s) not longer, with which kicks by the damping that couples modes err less than *limit* in a period.

    The error is the norm of the difference from the exact flow of the linear modes, in the coordinates omega q and p.
    """
    coefficients, rows = structure.damping_coefficients, structure.damping_rows
    composition = _core.COMPOSITIONS[composition_of(order, True)]
    if not coefficients.size:
        return step
    n, sigma = structure.omega.size, structure.damping_ratio * structure.omega
    scale = np.where(structure.omega > 0.0, structure.omega, 2.0 * math.pi / period)
    alone = np.zeros((n, 2, 2))
    alone[:, 0, 1], alone[:, 1, 0], alone[:, 1, 1] = scale, -(structure.omega**2) / scale, -2.0 * sigma
    matrix = np.block([[np.diag(alone[:, i, j]) for j in (0, 1)] for i in (0, 1)])
    matrix[n:, n:] -= (rows.T * coefficients) @ rows

    from scipy.linalg import expm  # takes a quarter of a second, and few structures have such dampers

    def error(h: float) -> float:
        steps, found = math.ceil(period / h), np.eye(2 * n)
        flows = {weight: expm(weight * h * alone) for weight in set(composition[0])}
        for weight, between in zip_longest(composition[1], composition[0]):
            decay = float(np.abs(weight * h * coefficients).sum())
            parts = _core.kick_parts(composition_of(order, True), decay)
            x = -weight * h * coefficients / parts  # by Runge and Kutta, as the core kicks
            gain = (1.0 + x * (1.0 + x / 2.0 * (1.0 + x / 3.0 * (1.0 + x / 4.0)))) ** parts - 1.0
            found[n:] += (rows.T * gain) @ (rows @ found[n:])
            if between is not None:
                flow = flows[between][..., None]
                q, p = found[:n], found[n:]
                found = np.concatenate([flow[:, k, 0] * q + flow[:, k, 1] * p for k in (0, 1)])
        exact = expm(h * matrix)
        return float(np.linalg.norm(np.linalg.matrix_power(found, steps) - np.linalg.matrix_power(exact, steps), 2))

    shortest = period / _MOST
    with np.errstate(all="ignore"):
        while step > shortest and not (found := error(step)) <= limit:
            step *= min(0.8, max(0.25, (limit / found) ** (1.0 / order))) if math.isfinite(found) else 0.25
    return max(step, shortest)


def growth(structure: Structure, order: int, step: float) -> float:
    """Largest growth of a motion with steps of a length (s) at fixed tension, by its logarithm in a period of the first mode.

    With the tension changed by tau and held, p' = -omega^2 q - 2 sigma p - tau G q is stable; steps in which kicks
    and flows come in resonance let modes grow.  The spectral radius of a step is that of a high power of it.
    """
    kept = slice(0, _MOST_MODES)
    omega, coupling = structure.omega[kept], structure.coupling[kept, kept]
    damping, n = (structure.damping_ratio * structure.omega)[kept], omega.size
    stretch = structure.nonlinear_stiffness * structure.stretch
    if stretch <= 0.0 or (omega <= 0.0).any():
        return 0.0
    composition = _core.COMPOSITIONS[composition_of(order)]
    root = np.sqrt((omega**2 - damping**2).astype(np.complex128))
    # in the coordinates omega q and p, in which the flow of a mode is a turn
    state = np.tile(np.eye(2 * n), (_TENSIONS.size, 1, 1))
    q, p = state[:, :n], state[:, n:]
    pull = -stretch * (coupling / omega) * _TENSIONS[:, None, None]
    for kick, flow in zip_longest(composition[1], composition[0]):
        p = p + kick * step * (pull @ q)
        if flow is not None:
            time = flow * step
            sine, cosine, decay = ((np.sin(root * time) / root).real, np.cos(root * time).real, np.exp(-damping * time))
            ahead, turned, behind = (
                decay * (cosine + damping * sine),
                decay * sine * omega,
                decay * (cosine - damping * sine),
            )
            q, p = ahead[:, None] * q + turned[:, None] * p, -turned[:, None] * q + behind[:, None] * p
    power, logarithm = np.concatenate((q, p), axis=1), np.zeros(_TENSIONS.size)
    for _ in range(_SQUARINGS):
        power = power @ power
        size = np.abs(power).max(axis=(1, 2))
        power, logarithm = power / size[:, None, None], 2.0 * logarithm + np.log(size)
    return float(logarithm.max()) / 2.0**_SQUARINGS * 2.0 * math.pi / (omega[0] * step)


def barrier_of(structure: Structure) -> float:
    """Energy of the lowest barrier between the wells above the deepest one, J.

    Of a structure with one well that of its first mode with the length that normalises as its amplitude.
    """
    model = structure.model
    if not structure.wells_are_mirror_images and model.landscape is not None:
        return model.saddle_energy - model.landscape.deepest.energy
    if not model.is_bistable:
        shown = np.abs(_rows_of(model)).max(axis=0)
        return float(0.5 * (2.0 * math.pi * _first_frequency(model) / (shown[0] or shown.max() or 1.0)) ** 2)
    straight, well = np.zeros(model.modes), structure.equilibrium
    return float(model.potential_energy(straight) - model.potential_energy(well))


def _rows_of(model: ReducedModel) -> _Array:
    """Rows of the displacements of a few places, that of the contact last, over the length that normalises."""
    own = [] if model.contact_shape is None else [model.contact_shape]
    shapes = [model.midspan_shape, *own] if model.beam is None else [*map(model.shape_at, _PLACES), *own]
    return np.asarray(np.array(shapes) @ model.linear_modes / (model.length_scale or 1.0))


class _Bench:
    """The structure, let go."""

    def __init__(self, structure: Structure, order: int, impact: float, far: bool = False) -> None:
        model, n = structure.model, min(structure.omega.size, _MOST_MODES)
        self.structure, self.order = structure, order
        self.period = 1.0 / _first_frequency(model)
        rows = _rows_of(model)[:, :n]
        # only its direction counts
        impulse_shape = rows[-1] if model.beam is None else (model.shape_at(_STRUCK) @ model.linear_modes)[:n]
        if not impulse_shape.any():
            impulse_shape = np.ones(n)
        barrier = barrier_of(structure)
        # modes that the tension couples follow each other
        placed, self.blocks = coupled_blocks(structure.coupling[:n, :n] != 0.0)
        self.omega, self.damping = structure.omega[placed], (structure.damping_ratio * structure.omega)[placed]
        self.coupling, self.rows = np.ascontiguousarray(structure.coupling[np.ix_(placed, placed)]), rows[:, placed]
        about = structure.about_second_well() if far else (structure.well, np.zeros(n), np.zeros(n))
        self.well, self.rest, self.force = (each[placed] for each in about)
        self.starts = []
        for energy, duration, *_ in _STARTS:
            # the spectrum of a pulse falls off beyond the inverse of what it lasts
            lasting = min(duration, impact) * self.period
            velocity = impulse_shape / (1.0 + (structure.omega[:n] * lasting / math.pi) ** 2)
            self.starts.append((velocity * math.sqrt(2.0 * energy * barrier / (velocity @ velocity)))[placed])

    def ends(self, velocity: _Array, counts: _Array, order: int) -> _Array:
        """Displacements at the end, with each number of steps, over the length that normalises.

        Shape (counts, places).
        """
        batch = _free_runs(self.rest, velocity, _PERIODS * self.period / counts, counts)
        problem = self._problem | {"composition": composition_of(order)}
        _core.integrate(problem, batch, "runs", "", usable_cores(), None)
        found: _Array = batch["states"][:, 0, : self.omega.size]
        return found @ self.rows.T

    @cached_property
    def _problem(self) -> dict[str, Any]:
        """The structure in free flight, as the core gets it."""
        n = self.omega.size
        zero, nothing = np.zeros(n), np.zeros((0, 0))
        return {
            "omega": self.omega.copy(), "sigma": self.damping.copy(), "G": self.coupling, "g": -self.well,
            "gamma": float(self.structure.nonlinear_stiffness), "shift": None, "far_force": self.force.copy(), "second": None, "high": None,
            "beam": np.ones(n), "lift": 0.0, "block_sizes": self.blocks, "laws": np.zeros(0, np.int32),
            "signals": 0, "uses": nothing, "signal_kinds": np.zeros(0, np.int32), "windows": np.zeros(0, np.int32), "jumps": 0, "law_numbers": 0, "center": zero, "center_rest": 0.0, "dividing_height": 0.0, "levels": 2,
            "update": np.zeros(0, np.int64),
        }  # fmt: skip

    def fewest(self, limit: float) -> float:
        """Fewest flight steps per period that serve, and still do with a few more of them."""
        lowest = _FEWEST
        while lowest < _MOST:
            counts = lowest * 2.0 ** (np.arange(_PER_OCTAVE + _IN_A_ROW) / _PER_OCTAVE)
            serves = self._errors(counts) <= limit
            for first in range(_PER_OCTAVE + 1):
                if serves[first : first + _IN_A_ROW].all():
                    return float(counts[first])
            lowest *= 2.0
        return float(counts[-1])

    def _errors(self, counts: _Array) -> _Array:
        """Maximum error of each number of flight steps, over what each start is allowed."""
        worst = np.zeros(counts.size)
        for velocity, (_, _, longer, share) in zip(self.starts, _STARTS, strict=True):
            own = np.ceil(_PERIODS * counts / longer)
            reference_count = np.ceil(_FINER * own[-1:])
            with np.errstate(all="ignore"):
                best = self.ends(velocity, reference_count, 6)
                beside = self.ends((1.0 + _NEIGHBOUR) * velocity, reference_count, 6)
                slope = min(max(1.0, float(np.abs(beside - best).max()) / _NEIGHBOUR), _MOST_SLOPE)
                difference = np.abs(self.ends(velocity, own, self.order) - best).max(axis=1) / (share * slope)
            worst = np.maximum(worst, np.where(np.isfinite(difference), difference, np.inf))
        return worst


def _free_runs(rest: _Array, velocity: _Array, steps: _Array, counts: _Array) -> dict[str, Any]:
    """Runs of so many steps of so many seconds from one state, as the core gets them: about the well of sign -1."""
    runs, n = counts.size, rest.size
    run = np.zeros((runs, _core.RUN_NUMBERS))
    run[:, 0], run[:, 1], run[:, 5], run[:, 11] = steps, 1.0, -1.0, 1e15
    run[:, 2] = run[:, 3] = np.floor(counts)
    run[:, 6] = 1.0
    run[:, 8], run[:, 10], run[:, 13] = -math.inf, -1.0, math.inf
    return {
        "run": run, "signals": np.zeros((runs, 0, len(SIGNAL))), "pieces": np.zeros((0, 7)), "jumps": np.zeros((runs, 0)), "numbers": np.zeros((runs, 0, 0)), "offset": np.zeros((runs, 0)),
        "since": np.zeros((runs, 0)), "rows": np.zeros((1, n)), "row_of": np.zeros((runs, 1), np.int32), "rest": np.zeros((runs, 1)),
        "q": np.tile(rest, (runs, 1)), "p": np.tile(velocity, (runs, 1)), "order": np.argsort(-counts, kind="stable").astype(np.int32),
        "outputs": 1, "states": np.full((runs, 1, 2 * n + 1), np.nan), "statistics": np.zeros((runs, _core.STATISTICS)),
        "of_channels": np.zeros((runs, 0, _core.OF_CHANNEL)), "held": np.zeros((runs, 0)),
        "account": 0,
    }  # fmt: skip


class Plan(NamedTuple):
    """Order of the composition and lengths of its steps."""

    order: int
    step: float
    """Flight step, s."""
    contact: float
    """Longest contact step, s."""
    halvings: int
    """Halvings of it, at most."""

    @property
    def shortest(self) -> float:
        """Shortest contact step, s."""
        return self.contact * 0.5**self.halvings

    def no_longer(self, longest: float) -> Plan:
        """Steps that are at most so long, s."""
        return self._replace(step=min(self.step, longest), contact=min(self.contact, longest))

    def scaled(self, factor: float) -> Plan:
        """Steps that are all so many times as long."""
        return self._replace(step=factor * self.step, contact=factor * self.contact)


def choose_base_step(
    model: ReducedModel, contact: ContactLaw | None, *, step: float | None = None, accuracy: str = "standard"
) -> Plan:
    """The steps of a run: short enough in flight, as measured on the model itself, and for an impact.

    Parameters
    ----------
    model, contact
        Structure and contact law.  The location does not matter: the steps suit the lightest point of the beam, so
        that every run of a map is stepped alike.
    step : float, optional
        Flight step in seconds, instead of the default; contact steps scale with it.
    accuracy : {"standard", "reference"}
        ``"standard"``: order 4, and errors of about a thousandth of the buckling level where a run is well conditioned.
        ``"reference"``: order 6, and errors a hundred thousand times smaller.
    """
    choice("accuracy", accuracy, ACCURACIES)
    order = _ORDER[accuracy]
    fastest = float(model.omega.max())
    limits = _LIMIT_OF_HITS if contact is not None and contact.impulsive else _LIMIT
    duration = 0.0
    if contact is not None and not contact.impulsive:
        mass = model.lightest_contact_mass
        speed = _CONTACT_SPEED * (model.length_scale or 1.0) * 2.0 * math.pi * _first_frequency(model)
        duration = contact.time_scale(mass, speed)
    longer = order == 4 and not (contact is not None and contact.impulsive)
    flight = flight_step(model, order, limits[accuracy], duration if duration > 0.0 else math.inf, resonances=longer)
    damping = model.modal_damping
    decay = max(float((damping.ratio * model.omega).max()), 0.5 * float(np.abs(damping.coefficients).max(initial=0.0)))
    flight = min(flight, _longest_flight(fastest, decay, accuracy))
    impact = flight
    if duration > 0.0:
        impact = _CONTACT_SHARE[accuracy] * duration
        flight = min(flight, impact * 2 ** _MOST_HALVINGS[accuracy])
        impact = min(impact, _CONTACT_TURN[accuracy] / max(fastest, 1e-300))
    if step is not None:
        impact *= positive("step", step, "s") / flight
        flight = step
    # steps in contact are chosen apart from those in flight
    return Plan(order, flight, impact, _NATIVE_HALVINGS if longer else _HALVINGS[order])


def _longest_flight(fastest: float, decay: float, accuracy: str) -> float:
    """Longest flight step, s, with modes up to an angular frequency (rad/s) and a decay rate (1/s)."""
    turn = _FREE_TURN if accuracy == "reference" else math.inf
    return min(turn / max(fastest, 1e-300), _MOST_DECAY / max(decay, 1e-300))


def for_modes(plan: Plan, fastest: float, decay: float, integration: Integration) -> Plan:
    """Steps that also serve modes of such a frequency (rad/s) and decay rate (1/s), as of strikers on suspensions."""
    turn = _CONTACT_TURN[integration.accuracy] / max(fastest, 1e-300)
    if integration.step is None:
        plan = plan.no_longer(_longest_flight(fastest, decay, integration.accuracy))
    return plan._replace(contact=min(plan.contact, turn))


# The clock of a run: time in ticks, so that halved steps and located events are whole numbers.


_STEP_COST, _MODE_COST, _PAIR_COST = 0.3e-6, 0.02e-6, 0.8e-9
"""Seconds of one core for a step, and more of it for each mode and each pair of modes."""
_FEWEST_CLOCK = 4.0
"""Flight steps, at least, in a cycle of excitation and in a period of the first mode, of a step that was asked for."""


def clocked(
    table: Records, system: System, integration: Integration, cycle: _Array, plans: list[Plan], periods: float | None
) -> float:
    """Enter the ticks of every run in the table of runs, and return the cycles of each.

    *cycle* holds the seconds of one cycle of excitation of each run.

    Raises
    ------
    InputError
        If a run has more steps than can be counted in ticks, or a record ends before it.
    """
    require_resolved(system, integration, cycle)
    drive = None if system.primary_excitation is None else system.primary_excitation[1]
    alone = len(system.moving) < 2
    repeats = drive is None or (drive.is_periodic and alone)
    _, lengths, table["contact_step"], table["halvings"] = np.array(plans).T
    table["step"] = SUBDIVISION
    if isinstance(drive, RecordedMotion):
        # the argument makes one turn over a record alone, and over HORIZON cycles of several motions
        left = 1.0 - table["phase"] / (2.0 * math.pi) * (1.0 if alone else HORIZON * cycle / drive.duration)
        cycles_asked = _asked_cycles(drive, integration, periods, float(left.min()))
    else:
        cycles_asked = float(integration.cycles_or_default if periods is None else periods)
    if isinstance(drive, RecordedMotion) and alone:
        table["period"] = _whole_steps(np.full(table.size, drive.duration), lengths, 1.0) * SUBDIVISION
        table["tick"] = drive.duration / table["period"]
        held = drive.duration * drive.frequency
        table["output_interval"] = np.rint(table["period"] / held)
        share = cycles_asked / drive.frequency / drive.duration
        table["end"] = np.rint(share * table["period"] if periods is None else cycles_asked * table["output_interval"])
        table["end"] = np.minimum(table["end"], np.rint(left * table["period"]))
        cycles = float(table["end"][0] * table["tick"][0] * drive.frequency)
    else:
        cycles = cycles_asked
        table["period"] = _whole_steps(cycle, lengths, cycles) * SUBDIVISION
        table["tick"] = cycle / table["period"]
        table["end"] = table["period"] * int(cycles)
        if not cycles.is_integer():
            table["end"] = np.rint(table["period"] * cycles).astype(np.int64)
        table["output_interval"] = table["period"]
        if not repeats:
            _whole_steps(cycle, lengths, float(HORIZON))  # refused if that cannot be counted
            table["period"] *= HORIZON
    if (table["end"] < 1).any():
        least = 1.0 / float(table["period"].max() if repeats else table["output_interval"].max())
        raise InputError(
            f"{'cycles' if periods is None else 'periods'} = {cycles:g}: must be at least {least:.2g}, a tick of the clock"
        )
    require_affordable(integration, system.model.modes, lengths, table["end"] / SUBDIVISION)
    _require_counted(float(table["end"].max()), _MOST_TICKS_OF_RUN, cycle, lengths, cycles)
    if periods is None:
        table["output_interval"] = table["end"]
    table["last_quarter"] = table["end"] // 4 * 3
    return cycles


def _asked_cycles(drive: RecordedMotion, integration: Integration, periods: float | None, left: float) -> float:
    """Cycles to integrate, of a record of which a share *left* is still to come."""
    held = drive.duration * drive.frequency * left
    cycles_asked = integration.cycles if periods is None else periods
    if cycles_asked is None and held > 0.0:
        return held
    if cycles_asked is None or cycles_asked > held + 1e-6:  # states stand on ticks
        of = "of" if left == 1.0 else "that are left of"
        raise InputError(
            f"cycles = {cycles_asked}: must be at most the {max(held, 0.0):.1f} cycles {of} the recorded drive"
        )
    return min(float(cycles_asked), held)


def require_resolved(system: System, integration: Integration, cycle: _Array) -> None:
    """Refuse a step that was asked for and does not resolve a *cycle* (s) of excitation or the first mode's period.

    Raises
    ------
    InputError
    """
    if integration.step is None:
        return
    shortest, first = float(cycle.min()), 1.0 / _first_frequency(system.model)
    for length, words in ((shortest, "a cycle of excitation"), (first, "a period of the first mode")):
        if integration.step * _FEWEST_CLOCK > length * (1.0 + 1e-12):
            raise InputError(
                f"step = {integration.step:g} s: does not resolve {words} of {length:.4g} s; must be at most "
                f"{length / _FEWEST_CLOCK:.4g} s, a quarter of it"
            )


def seconds_of(steps: float, modes: int) -> float:
    """Estimated time of a number of steps on one core, s, within a factor of two or three."""
    return steps * (_STEP_COST + _MODE_COST * modes + _PAIR_COST * modes**2)


def most_steps(integration: Integration, modes: int) -> int:
    """Steps that one run may take: those that were asked for, or what one core does in an hour."""
    if integration.max_steps is not None:
        return integration.max_steps
    return int(_HOUR / seconds_of(1.0, modes))


def require_affordable(integration: Integration, modes: int, lengths: _Array, steps: _Array) -> None:
    """Refuse runs that take more steps than they may, before they begin; *lengths* of the steps in s.

    Raises
    ------
    InputError
    """
    most, longest = most_steps(integration, modes), int(np.argmax(steps))
    if steps[longest] > most:
        allowed = "an hour's" if integration.max_steps is None else "max_steps"
        spent = _words(seconds_of(float(steps[longest]), modes))
        raise InputError(
            f"a run of {steps[longest]:.3g} steps of {lengths[longest]:.3g} s, some {spent} on one core: must be at "
            f"most {most:.3g} steps ({allowed}); ask for fewer cycles or longer steps, or for a larger max_steps"
        )


_ANNOUNCED = 60.0
"""Estimated time, s, from which a run is announced."""


def long_run(modes: int, length: float, steps: float, limited: str) -> list[Diagnostic]:
    """Announcement of a run of so many flight steps, of a *length* in s, if it may take over a minute; empty if not.

    *limited* names the causes of the step length.  Steps in contact are shorter, so that the run may take longer.
    """
    seconds = seconds_of(steps, modes)
    if not seconds > _ANNOUNCED:
        return []
    message = (
        f"the run has {steps:.3g} steps of {length:.3g} s in flight alone and may take some {_words(seconds)} or more; "
        f"{limited}"
    )
    return [Diagnostic("run.long", message, {"steps": steps, "step": length, "seconds": seconds}, Severity.INFO)]


def long_sweep(runs: int, steps: float, each: float, cores: int, early: bool = False) -> list[Diagnostic]:
    """Announcement of *runs* of *steps* flight steps and *each* s on average if they may take over a minute on so many cores."""
    seconds = runs * each / cores
    if not seconds > _ANNOUNCED:
        return []
    spent = f"{'up to' if early else 'some'} {_words(seconds)}"
    message = (
        f"{runs} runs of {steps:.3g} steps in flight on average may take {spent} on {cores} "
        f"core{'s' if cores > 1 else ''}, more with many contacts, and less with early termination or refinement"
    )
    numbers = {"runs": runs, "steps": steps, "cores": cores, "seconds": seconds}
    return [Diagnostic("run.long", message, numbers, Severity.INFO)]


def _words(seconds: float) -> str:
    for size, unit in ((86400.0 * 365.25, "years"), (86400.0, "days"), (3600.0, "hours"), (60.0, "minutes")):
        if seconds >= size:
            return f"{seconds / size:.2g} {unit}"
    return f"{seconds:.2g} seconds"


def _whole_steps(period: _Array, step: _Array, cycles: float) -> NDArray[np.int64]:
    """Flight steps in each period, the step made a little shorter to fit."""
    steps = np.ceil(period / step * (1.0 - 1e-12))
    _require_counted(float(steps.max()) * max(cycles, 1.0) * SUBDIVISION, _MOST_TICKS, period, step, cycles)
    return np.asarray(steps.astype(np.int64))


def _require_counted(ticks: float, most: float, period: _Array, step: _Array, cycles: float) -> None:
    if not ticks <= most:
        raise InputError(
            f"step = {float(step.min()):g} s with cycles = {cycles:g} of up to {float(period.max()):g} s: makes "
            f"{ticks / SUBDIVISION:.2g} steps, must be at most {most / SUBDIVISION:.2g}"
        )
