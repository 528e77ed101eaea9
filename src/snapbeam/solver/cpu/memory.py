"""The CPU engine's layout: a structure in padded rows, eight modes a register, and room to integrate in."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.contact.base import ContactLaw
from snapbeam.model.contact.hertz import HertzContact
from snapbeam.model.drive.base import Drive
from snapbeam.model.drive.sine import Sine
from snapbeam.solver.cpu.mode_lanes import WORK_ROWS, Layout
from snapbeam.solver.cpu.terms.further_contacts import FurtherContacts
from snapbeam.solver.cpu.terms.velocity_block import ContactDamping, VelocityBlock, numbers_of_block
from snapbeam.solver.ensemble import Ensemble
from snapbeam.solver.further_contacts import DAMPED, NUMBERS, Several
from snapbeam.solver.simd import WIDTH
from snapbeam.solver.splitting import Stages, in_memory, slot_length
from snapbeam.solver.structure import Structure
from snapbeam.solver.terms import TERMS_AFTER_CONTACTS, TERMS_BEFORE_CONTACTS
from snapbeam.solver.terms.interface import TermMemory

_Array = NDArray[np.float64]

_LONGEST_DECAY = 4.0
"""zeta omega t up to which :func:`~snapbeam.solver.physics.decay_less_one` is accurate."""
_SLOWEST = 1e-12
"""Stands for no damping, 1/s."""
_ALIGNMENT = 64


class Packed(NamedTuple):
    """A structure in rows."""

    memory: _Array
    blocks: NDArray[np.int64]
    """First row, row after the last, and columns of each block of coupled modes."""
    layout: Layout
    rows: NDArray[np.int64]
    """Row of each linear mode, shape (N,)."""
    members: tuple[int, ...]
    """Modes of each block."""
    own: tuple[dict[str, int], ...]
    """Lengths of the run-specific data of each term in the layout."""

    def spread(self, values: _Array) -> _Array:
        """Numbers of modes, shape (..., N), as padded rows, shape (..., rows)."""
        out = np.zeros((*values.shape[:-1], self.layout.size))
        out[..., self.rows] = values
        return out


def _blocks_of(coupled: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return the block number of each mode, in the order of the first modes of the blocks.

    Every mode takes the minimum label of the modes that it is coupled to, until no label changes.
    It is five lines of scipy.sparse.csgraph, which takes longer to load than many a run to integrate.
    """
    among = coupled | coupled.T | np.eye(len(coupled), dtype=bool)
    label = np.arange(len(coupled))
    while True:
        least = np.where(among, label, len(label)).min(axis=1)
        if (least == label).all():
            return np.unique(label, return_inverse=True)[1]
        label = least


def pack(
    structure: Structure,
    high_omega: float = np.inf,
    drive: type[Drive] = Sine,
    several: type[Several] | None = None,
    law: type[ContactLaw] = HertzContact,
) -> Packed:
    """Arrange a structure in rows.

    Linear modes that the tension does not couple (the symmetric and the antisymmetric ones) become
    separate blocks, each padded to a multiple of eight rows.  *several*: with room for strikers beside the first, which
    touches by *law*.
    """
    label = _blocks_of(structure.coupling != 0.0)
    omega, zeta = structure.omega, structure.damping_ratio
    blocks: list[int] = []
    rows = np.empty(omega.size, dtype=np.int64)
    size = 0
    held: list[int] = []
    for b in range(label.max() + 1):
        members = np.flatnonzero(label == b)
        held.append(members.size)
        rows[members] = size + np.arange(members.size)
        stop = size + -(-members.size // WIDTH) * WIDTH
        unroll = 4 if stop - size > WIDTH else 2
        blocks += [size, stop, -(-members.size // unroll) * unroll]
        size = stop

    def padded(values: _Array, fill: float = 0.0) -> _Array:
        out = np.full(size, fill)
        out[rows] = values
        return out

    # the elements of circuits are no oscillators: they have a flow of their own
    states = np.isin(
        np.arange(omega.size), [each.mode for each in structure.circuits if each.mode is not None]
    )
    full = np.zeros((size, size))
    full[np.ix_(rows, rows)] = structure.coupling
    strips = []
    for start, stop, columns in zip(blocks[::3], blocks[1::3], blocks[2::3], strict=True):
        at = start
        while at < stop:
            height = 2 * WIDTH if at + 2 * WIDTH <= stop else WIDTH
            strips.append(full[at : at + height, start : start + columns].T.ravel())
            at += height
    arrays = {
        "omega": padded(omega),
        "omega_squared": padded(omega * omega),
        "omega_damped": padded(np.where(states, 1.0, omega * np.sqrt(1.0 - zeta * zeta)), 1.0),
        "damping": padded(zeta * omega),
        "g": padded(structure.well),
        "contact": np.zeros(size),
        "center": padded(structure.center),
        "shift": padded(structure.shift),
        "high": padded(structure.high_modes(high_omega).astype(np.float64)),
        "tension": np.concatenate(strips),
    }
    kinds = (*TERMS_BEFORE_CONTACTS, FurtherContacts, *TERMS_AFTER_CONTACTS)
    built: list[tuple[type, str, TermMemory]] = []
    for kind in kinds:
        for i, found in enumerate(
            [] if kind is FurtherContacts else kind.build(structure, drive, size, padded)
        ):
            prefix = f"{kind.__name__}.{i}."
            built.append((kind, prefix, found))
            arrays |= {f"{prefix}{name}": values for name, values in (found.shared | found.own).items()}
    if several is not None:
        arrays["striker_rows"] = np.zeros(len(several.laws) * size)
        arrays["strikers"] = np.zeros(len(several.laws) * NUMBERS)
    forces = sum(hasattr(kind, "channel") for kind, _, _ in built)
    contacts = sum(each.rate_dependent for each in (law, *(several.laws if several is not None else ())))
    damped = contacts + forces
    if damped:
        arrays["velocity_block"] = np.zeros(WIDTH + numbers_of_block(damped))
    starts = np.concatenate(([0], np.cumsum([array.size for array in arrays.values()])))
    placed = dict(zip(arrays, map(int, starts), strict=False))
    others = None
    if several is not None:
        dents = [_element(structure, rows, j + 1) for j in range(len(several.laws))]
        others = FurtherContacts(
            placed.pop("striker_rows"),
            placed.pop("strikers"),
            several.numbers_type()(),
            tuple(each or 0 for each in dents) if any(each is not None for each in dents) else None,
        )
    terms: list[Any] = []
    own: list[dict[str, int]] = []
    for kind in kinds:
        if kind is FurtherContacts and others is not None:
            terms.append(others)
            own.append({})
        for _, prefix, (shared, single, numbers) in [each for each in built if each[0] is kind]:
            places = {name: placed.pop(f"{prefix}{name}") for name in (*shared, *single)}
            terms.append(kind(**places, **numbers))
            own.append({name: values.size for name, values in single.items()})
    moving = bool(np.all(states | (omega * np.sqrt(1.0 - zeta * zeta) > 0.0)))
    gentle = _LONGEST_DECAY / max(float((zeta * omega).max()), _SLOWEST) if moving else 0.0
    block = placed.pop("velocity_block") if damped else 0
    layout = Layout(
        size=size,
        **placed,
        work=int(starts[-1]),
        gamma=structure.nonlinear_stiffness,
        stretch=structure.stretch,
        gentle=gentle,
        terms=tuple(terms),
        others=others,
        indentation=_element(structure, rows, 0),
        body=_body_of_first(structure, rows),
        bodies=tuple(map(int, rows[structure.modes_of_bodies])) or None,
        velocity_block=None,
    )
    if damped:
        layout = layout._replace(velocity_block=_velocity_block(layout, law, block))
    return Packed(
        np.concatenate(list(arrays.values())),
        np.array(blocks, dtype=np.int64),
        layout,
        rows,
        tuple(held),
        tuple(own),
    )


def _element(structure: Structure, rows: NDArray[np.int64], contact: int) -> int | None:
    """Element of a row that holds the residual indentation of a contact, from 0, or None."""
    mode = structure.mode_of_indentation(contact)
    return None if mode is None else int(rows[mode])


def _body_of_first(structure: Structure, rows: NDArray[np.int64]) -> int | None:
    """Element of a row that holds the mode of the first striker, or None."""
    if not structure.bodies or structure.bodies[0].contact > 0:
        return None
    return int(rows[structure.equilibrium.size])


def _velocity_block(layout: Layout, law: type[ContactLaw], numbers: int) -> VelocityBlock:
    """Every channel of a layout, and the places of their rows."""
    rows: list[int] = []
    channels: list[Any] = []
    first = None
    if law.rate_dependent:
        first = numbers
        channels.append(ContactDamping(first, 0))
        rows.append(layout.contact)
    for j, each in enumerate(() if layout.others is None else type(layout.others.kinds).owner.laws):
        if each.rate_dependent:
            channels.append(ContactDamping(layout.others.numbers + j * NUMBERS + DAMPED, len(rows)))
            rows.append(layout.others.rows + j * layout.size)
    for term in layout.terms:
        if hasattr(term, "channel"):
            channels.append(term.channel(len(rows)))
            rows.append(term.row)
    return VelocityBlock(tuple(rows), tuple(channels), numbers + WIDTH, first)


class Memory(NamedTuple):
    """Everything that one thread needs to integrate runs of an ensemble, in one flat array."""

    memory: _Array
    blocks: NDArray[np.int64]
    layouts: tuple[Layout, Layout]
    """Two places that share the rows of the structure."""
    stages: Stages
    drive_numbers: _Array
    """Numbers of the drive, with the memory offset of its samples."""


def lay_out(ensemble: Ensemble, packed: Packed, extra_rows: int = 0) -> Memory:
    """A copy of a structure's rows with room for two runs, aligned to whole registers.

    *extra_rows* are added to the work rows of the first place.
    """
    size, first = packed.layout.size, packed.layout
    slots = (ensemble.max_halvings + 2) * slot_length(ensemble.order, size) + 8 * size
    work = (WORK_ROWS + extra_rows) * size + slots
    second = first._replace(
        g=first.work + work, contact=first.work + work + size, work=first.work + work + 2 * size
    )
    if first.others is not None:
        count = len(type(first.others.kinds).owner.laws)
        rows = second.work
        second = second._replace(
            work=rows + count * (size + NUMBERS),
            others=first.others._replace(rows=rows, numbers=rows + count * size),
        )
    terms: list[Any] = []
    for term, own in zip(first.terms, packed.own, strict=True):
        places = {}
        for name, length in own.items():
            places[name] = second.work
            second = second._replace(work=second.work + length)
        terms.append(second.others if term is first.others else term._replace(**places))
    second = second._replace(terms=tuple(terms))
    if first.velocity_block is not None:
        length = WIDTH + numbers_of_block(len(first.velocity_block.rows))
        second = second._replace(
            velocity_block=_velocity_block(second, ensemble.law, second.work),
            work=second.work + length,
        )
    at = second.work + WORK_ROWS * size + slots
    stages, weights = in_memory(ensemble.order, at, general=first.velocity_block is not None)
    table = stages.flow + weights.size
    length = table + ensemble.samples.size
    raw = np.zeros(length + _ALIGNMENT // 8)
    skipped = (-raw.ctypes.data % _ALIGNMENT) // 8
    memory: _Array = raw[skipped : skipped + length]
    memory[: first.work] = packed.memory
    memory[second.g : second.g + size] = memory[first.g : first.g + size]
    memory[stages.flow : table] = weights
    memory[table:] = ensemble.samples
    numbers: Any = ensemble.drive_numbers
    sampled = [i for i, name in enumerate(ensemble.drive.number_names) if name.split("_")[-1] == "table"]
    if sampled:
        numbers = numbers.copy()
        numbers[:, sampled] += table
    return Memory(memory, packed.blocks, (first, second), stages, numbers)
