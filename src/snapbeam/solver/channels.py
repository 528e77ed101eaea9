"""Channels of a system for the native core: a row, a law and signals for everything that acts on the modes.

    q_i'' + 2 zeta_i omega_i q_i' + omega_i^2 q_i = tension + sum_j r_ij f_j(u_j, v_j, t),    u_j = u_j0 + r_j . q

A contact, a local force, an external force, the base, the axial load and a circuit are channels; the motion of a striker, the base, a load or
a force is a signal.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.contact.base import ContactLaw
from snapbeam.model.contact.elastic_plastic import ElasticPlasticContact
from snapbeam.model.contact.hertz import HertzContact
from snapbeam.model.contact.hunt_crossley import HuntCrossley
from snapbeam.model.contact.kelvin_voigt import KelvinVoigt
from snapbeam.model.contact.layered_hertz import LayeredHertz
from snapbeam.model.contact.power_law import PowerLaw
from snapbeam.model.contact.restitution import Restitution
from snapbeam.model.drive.base import Drive
from snapbeam.model.drive.components import Pieces, Sweep, Tone
from snapbeam.model.drive.fixed_stop import FixedStop
from snapbeam.model.local_force import (
    CoulombFriction,
    ElectrostaticForce,
    LocalForce,
    LocalSpring,
    MagneticForce,
    QuadraticDamping,
)
from snapbeam.model.quantity import section_of
from snapbeam.model.reduced_model import ReducedModel
from snapbeam.model.system import System
from snapbeam.solver.excitation import carried, own_columns, side_of, started
from snapbeam.solver.structure import Structure
from snapbeam.solver.user_laws import UserLaw, contact_law, local_force

_Array = NDArray[np.float64]

LAWS: dict[type, tuple[int, tuple[str, ...]]] = {
    HertzContact: (0, ("stiffness",)),
    PowerLaw: (1, ("force_at_1um", "exponent")),
    LayeredHertz: (2, ("stiffness", "layer_stiffness")),
    HuntCrossley: (3, ("stiffness", "damping_factor")),
    KelvinVoigt: (4, ("linear_stiffness", "linear_damping")),
    LocalSpring: (5, ("stiffness", "cubic_stiffness")),
    ElectrostaticForce: (6, ("voltage", "area", "gap")),
    MagneticForce: (7, ("strength", "gap")),
    QuadraticDamping: (8, ("coefficient",)),
    ElasticPlasticContact: (19, ("loading_stiffness", "unloading_stiffness", "indentation")),
    Restitution: (20, ("coefficient",)),
    CoulombFriction: (9, ("friction_force", "smoothing_velocity")),
}
"""Number of each law in ``core/laws.hpp``, and the names of its numbers in their order there."""
LINEAR_DAMPING, EXTERNAL_FORCE, BASE, AXIAL_LOAD, CIRCUIT = 10, 11, 12, 13, 14
USER_LAWS = {"contact": 15, "lossy contact": 16, "force": 17, "lossy force": 18, "contact with memory": 21}
"""Number of the law that calls a user's, by :attr:`snapbeam.solver.user_laws.UserLaw.kind`."""
SIGNAL = (
    "mean", "amplitude", "rate", "phase", "period", "exponential", "power", "most_value", "most_slope", "most_bend"
)  # fmt: skip
"""Numbers of a tone; those of pieces are gain, first piece, pieces, time, of a sweep size, first and last rate, time, duration, power,
of a sum of tones (at 1, 2 and 4) its first partial, the rate of the fastest, and tones."""
TONE, PIECES, SWEEP, TONES, PARTIAL = range(5)
"""Kinds of signals, in the order of ``core/api.hpp: SignalKind``."""
STEEP = (
    *(LAWS[kind][0] for kind in (ElectrostaticForce, MagneticForce, PowerLaw, HuntCrossley, KelvinVoigt)),
    *USER_LAWS.values(),
)
"""Laws whose stiffness or damping may be far beyond that at usual speeds: deep in a contact, or close to a magnet."""


@dataclass(frozen=True, eq=False)
class Channels:
    """Everything that acts on the modes of many runs."""

    laws: NDArray[np.int32]
    """Shape (channels,): contacts first, the first striker's before the others."""
    contacts: int
    circuits: int
    """Channels of circuits, which are last."""
    uses: _Array
    """Factor of each signal in each channel, shape (channels, signals)."""
    signals: _Array
    """Numbers of the signals, in the order of ``core/api.hpp: SignalNumber``; shape (runs, signals, 10)."""
    kinds: NDArray[np.int32]
    """Kind of each signal, shape (signals,); partials, the tones of a sum, follow the others."""
    windows: NDArray[np.int32]
    """Signal by which each is multiplied, -1: none; shape (signals,)."""
    pieces: _Array
    """Begin (s) and coefficients of the pieces of all signals, shape (pieces, 7)."""
    jumps: _Array
    """Times at which a derivative jumps, s; shape (runs, jumps)."""
    numbers: _Array
    """Numbers of the laws, shape (runs, channels, numbers of the law that has most)."""
    offset: _Array
    """Penetration in the first well with all signals at zero, shape (runs, channels)."""
    since: _Array
    """Seconds in contact at the start, -1: apart, NaN: the penetration decides; shape (runs, channels)."""
    rows: _Array
    """Shape (rows, N)."""
    row_of: NDArray[np.int32]
    """Row of each channel, then that of the displacement observed, shape (runs, channels + 1)."""
    rest: _Array
    """Displacement along these rows in the first well, shape (runs, channels + 1)."""
    of_user: tuple[UserLaw, ...] = ()

    @property
    def moves(self) -> bool:
        """True if a signal changes with time."""
        return bool(
            np.any(self.signals[:, :, 1] * (self.kinds != PIECES))
            or np.any(self.pieces[:, 1:])
            or np.any(self.kinds == SWEEP)
        )


class _Builder:
    """Channels and signals, one after the other."""

    def __init__(self, runs: int, rows: _Array) -> None:
        self.runs = runs
        self.channels: list[tuple[int, _Array, dict[str, float], _Array, _Array]] = []
        """Law, numbers, factors of signals, offset and time in contact."""
        self.rows: list[_Array] = [rows]
        self.places: list[tuple[_Array, _Array]] = []
        """Row of each run, and the displacement along it at rest."""
        self.signals: list[tuple[str, int, _Array, int]] = []
        """Section, kind, numbers and window."""
        self.partials: list[_Array] = []
        self.pieces: list[_Array] = []
        self.jumps: dict[str, _Array] = {}
        self.of_user: list[UserLaw] = []

    def each(self, value: Any) -> _Array:
        """A number of each run."""
        return np.broadcast_to(np.asarray(value, float), self.runs)

    def add(
        self, law: int, rows: _Array | None, which: Any = 0, rest: Any = 0.0, uses: dict[str, float] | None = None,
        numbers: Any = (), offset: Any = 0.0, since: Any = -1.0,
    ) -> None:  # fmt: skip
        """Add a channel: its law, rows (None: those there are) and which of them each run has, and the factors of its signals."""
        own = np.array([self.each(value) for value in numbers]).reshape(-1, self.runs).T
        self.channels.append((law, own, uses or {}, self.each(offset), self.each(since)))
        self.place(rows, which, rest)

    def law(self, law: ContactLaw | LocalForce, model: ReducedModel) -> tuple[int, tuple[float, ...], tuple[str, ...]]:
        """Number of a law in the core, what is told of a user's, and the names of the law's own numbers."""
        kind = type(law)
        if kind in LAWS:
            number, names = LAWS[kind]
            return number, (), names
        if isinstance(law, ContactLaw):
            own = contact_law(law)
        else:
            largest = law.largest_displacement(model)
            own = local_force(law, largest, 10.0 * largest * 2.0 * math.pi * model.reference_frequency)
        self.of_user.append(own)
        return USER_LAWS[own.kind], own.head, kind.numbers_type()._fields

    def place(self, rows: _Array | None, which: Any, rest: Any) -> None:
        """Add rows, and which of them each run has."""
        first = 0
        if rows is not None:
            first = sum(map(len, self.rows))
            self.rows.append(np.atleast_2d(rows))
        self.places.append((self.each(np.asarray(which) + first), self.each(rest)))

    def add_signal(self, section: str, kind: int, numbers: _Array, window: int | None = None) -> int:
        """Add a signal of a section; returns its number."""
        self.signals.append((section, kind, numbers, -1 if window is None else window))
        return len(self.signals) - 1

    def add_tones(self, section: str, tones: list[_Array], most: _Array, window: int | None) -> None:
        """Add the sum of many tones as one signal."""
        numbers = np.zeros((self.runs, len(SIGNAL)))
        numbers[:, 1], numbers[:, 4] = len(self.partials), len(tones)
        numbers[:, 2], numbers[:, -3:] = np.max([each[:, 2] for each in tones], axis=0), most
        self.partials += tones
        self.add_signal(section, TONES, numbers, window)

    def add_pieces(self, section: str, each: Pieces, begun: _Array, most: _Array | None = None, sign: float = 1.0) -> int:  # fmt: skip
        """Add a signal of pieces; runs with the same pieces share them."""
        tables = np.concatenate((each.begins[..., None], each.coefficients), axis=2)
        which = np.zeros(self.runs, dtype=np.int64)
        if len(tables) > 1:
            flat = tables.reshape(len(tables), -1)
            _, first, which = np.unique(flat, axis=0, return_index=True, return_inverse=True)
            tables = tables[first]
        length = tables.shape[1]
        numbers = np.zeros((self.runs, len(SIGNAL)))
        numbers[:, 0], numbers[:, 1] = sign * each.gain, sum(map(len, self.pieces)) + which * length
        numbers[:, 2], numbers[:, 3] = length, begun
        numbers[:, -3:] = 0.0 if most is None else most
        self.pieces.append(tables.reshape(-1, 7))
        return self.add_signal(section, PIECES, numbers)

    def built(self, contacts: int, circuits: int) -> Channels:
        """Everything as arrays."""
        count, most = len(self.channels), max((each[1].shape[1] for each in self.channels), default=0)
        numbers = np.zeros((self.runs, count, most))
        for j, (_, own, *_) in enumerate(self.channels):
            numbers[:, j, : own.shape[1]] = own
        for _, kind, own, _ in self.signals:
            own[:, 1] += len(self.signals) if kind == TONES else 0
        self.signals += [("", PARTIAL, each, -1) for each in self.partials]
        sections, kinds, signals, windows = zip(*self.signals, strict=True) if self.signals else ((), (), (), ())
        offset, since = np.array([each[3:] for each in self.channels]).reshape(count, 2, self.runs).transpose(1, 2, 0)
        row_of, rest = np.array(self.places).transpose(1, 2, 0)
        jumps = [*self.jumps.values()]
        return Channels(
            laws=np.array([each[0] for each in self.channels], np.int32),
            contacts=contacts,
            circuits=circuits,
            uses=np.array([[each[2].get(of, 0.0) for of in sections] for each in self.channels]).reshape(
                count, len(sections)
            ),
            signals=np.stack(signals, axis=1) if signals else np.zeros((self.runs, 0, len(SIGNAL))),
            kinds=np.array(kinds, np.int32),
            windows=np.array(windows, np.int32),
            pieces=np.concatenate([np.zeros((0, 7)), *self.pieces]),
            jumps=np.stack(jumps, axis=1) if jumps else np.zeros((self.runs, 0)),
            numbers=numbers,
            offset=offset.copy(),
            since=since.copy(),
            rows=np.concatenate(self.rows),
            row_of=row_of.astype(np.int32, order="C"),
            rest=rest.copy(),
            of_user=tuple(self.of_user),
        )


def channels_of(system: System, ensemble: Any, columns: Mapping[str, _Array]) -> Channels:
    """Return the channels of an ensemble.

    Raises
    ------
    InputError
        If the native core does not have a part of the system.
    """
    structure, table, runs = ensemble.structure, ensemble.runs, ensemble.size
    built = _Builder(runs, ensemble.contact_rows)
    for section, drive in _motions(system):
        _add_motion(built, system, ensemble, columns, section, drive)
    base = system.base_excitation
    for number, contact in enumerate(system.contacts, 1):
        section = section_of("contact", number)
        law, head, names = built.law(contact.law, system.model)
        uses = {section_of("drive", number): 1.0, "base_excitation": carried(system, contact.striker)}
        left = None
        if contact.law.memory:
            left = ensemble.starts[table["start_row"], 0, structure.mode_of_indentation(number - 1)]
        values = [*head, *(left if name == contact.law.memory else columns[f"{section}.{name}"] for name in names)]
        which, rest, offset, since = (
            table[name][:, number - 1] for name in ("contact_row", "rest_contact", "offset", "contact_time")
        )
        if contact.law.impulsive:
            values.append(_cancelled(structure, ensemble.contact_rows)[which])
        built.add(law, None, which, rest, uses, values, offset, since)
    for force, row in zip(system.local_forces, structure.local_forces, strict=True):
        law, head, names = built.law(force, system.model)
        own = [*head, *(getattr(force.numbers, name) for name in names)]
        built.add(law, row.row, rest=row.rest, numbers=own)
    sections = [section for section, _ in system.moving if section.startswith("force")]
    for section, external in zip(sections, structure.force_rows, strict=True):
        built.add(EXTERNAL_FORCE, external, uses={section: 1.0})
    if base is not None:
        built.add(BASE, structure.base_load, uses={"base_excitation": 1.0 if base.direction == "up" else -1.0})
    if system.axial_load is not None:
        built.add(AXIAL_LOAD, np.zeros(structure.omega.size), uses={"axial_load": 1.0})
    for row, coefficient in zip(structure.damping_rows, structure.damping_coefficients, strict=True):
        built.add(LINEAR_DAMPING, row, numbers=[coefficient])
    starts = structure.circuits_of(ensemble.starts[:, 0]).reshape(len(ensemble.starts), -1)
    for circuit, coupling, state in zip(structure.circuits, ensemble.circuits, starts.T, strict=False):
        own = [coupling.rate] if circuit.mode is None else [coupling.rate, 0.0, state[table["start_row"]]]
        built.add(LINEAR_DAMPING if circuit.mode is None else CIRCUIT, circuit.row, numbers=own)
    first = ensemble.contact_rows[: 1 + int(table["contact_row"][:, 0].max())]
    observed = np.array([structure.row_of_beam(row) for row in first])
    built.place(observed, table["contact_row"][:, 0], table["rest_contact"][:, 0])
    return built.built(len(system.contacts), len(structure.circuits))


def _cancelled(structure: Structure, rows: _Array) -> _Array:
    """r.omega^2 r/(r.r)^2: the stiffness along each row that a contact which is held together cancels."""
    return np.asarray(np.sum((rows * structure.omega) ** 2, axis=1) / np.maximum(np.sum(rows**2, axis=1) ** 2, 1e-300))


def _motions(system: System) -> list[tuple[str, Drive]]:
    """Every motion by section; a stop at rest too."""
    found = [(section_of("drive", number), each.striker.drive) for number, each in enumerate(system.contacts, 1)]
    return found + [each for each in system.moving if not each[0].startswith("drive")]


_FAR = 1e300
"""Bound of a motion that has none."""
_FEW_TONES = 4
"""Largest number of components of a motion whose tones are separate signals; the tones of a motion with more are one, their sum."""


def _bounds(drive: Drive, own: Mapping[str, _Array], system: System) -> _Array:
    """Bounds of the value, slope and second derivative of a motion, shape (runs, 3)."""
    runs = next(iter(own.values())).size
    found = np.full((runs, 3), _FAR)
    highest, found[:, 1] = drive.bounds(own, system.scale)
    found[:, 0] = np.maximum(highest, drive.mirrored_bounds(own, system.scale))
    if type(drive).can_excite_base():
        found[:, 2] = drive.peak_acceleration(own, system.scale)
    return np.minimum(found, _FAR)


def _add_motion(built: _Builder, system: System, ensemble: Any, columns: Mapping[str, _Array], section: str, drive: Drive) -> None:  # fmt: skip
    """Add the components of a motion as signals, named by the section."""
    runs, table = ensemble.size, ensemble.runs
    if isinstance(drive, FixedStop):
        return
    own, begun = started(system, own_columns(columns, section, runs), table["phase"], ensemble.clock)
    repeats = len(system.moving) < 2 and drive.is_periodic
    bounds = _bounds(drive, own, system)
    components = drive.components_until(own, system.scale, begun + table["end"] * table["tick"])
    windows: dict[int, int] = {}
    many: dict[int | None, list[_Array]] = {}
    for each in components:
        signal = np.zeros((runs, len(SIGNAL)))
        most, window, kind_of = bounds, None, TONE
        if isinstance(each, Tone):
            size, rate = np.abs(each.amplitude), each.rate
            signal[:, 0], signal[:, 1], signal[:, 2] = each.mean, each.amplitude, rate
            signal[:, 3] = each.phase + np.fmod(rate * begun, 2.0 * math.pi)
            if repeats and len(components) == 1:
                signal[:, 4] = table["period"]
            if each.window is None:
                most = np.stack((size + np.abs(each.mean), size * rate, size * rate**2), axis=1)
            else:
                if id(each.window) not in windows:
                    windows[id(each.window)] = built.add_pieces(f"{section} window", each.window, begun)
                window = windows[id(each.window)]
        elif isinstance(each, Sweep):
            signal[:, 0], signal[:, 1], signal[:, 2], signal[:, 3] = each.size, each.first, each.last, begun
            signal[:, 4], signal[:, 5], signal[:, 6] = each.duration, float(each.exponential), each.power
            kind_of = SWEEP
        else:
            built.add_pieces(section, each, begun, most, side_of(system, section, drive))
            bounds = np.zeros((runs, 3))
            continue
        if most is bounds:  # those of the whole motion, stated once; a tone alone has its own
            bounds = np.zeros((runs, 3))
        signal[:, -3:] = most
        if kind_of == TONE and len(components) > _FEW_TONES:
            many.setdefault(window, []).append(signal)
        else:
            built.add_signal(section, kind_of, signal, window)
    for window, tones in many.items():
        built.add_tones(section, tones, np.sum([each[:, -3:] for each in tones], axis=0), window)
    for name, times in drive.jumps(own, system.scale).items():
        built.jumps[f"{section} {name}"] = times - begun
