"""Coordinates of the states of a system: the numbers that a map takes and gives."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.integration import Integration
from snapbeam.model.state import OWN_FIELDS, State, amplitude_scale
from snapbeam.model.system import System
from snapbeam.solver.assemble import make_ensemble, modal_of
from snapbeam.solver.ensemble import Ensemble

_Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Coordinates:
    """Coordinates of the states of a system.

    They are amplitude over that of the well for each buckling mode, then velocity over the same times omega_1: ``amplitude[i]``
    and ``velocity[i]``.  States of strikers and circuits follow, each in a unit of the same size: ``striker_shift[i]`` and
    ``striker_rate[i]`` of a striker with mass at contact i, its ``indentation[i]``, ``circuit[i]`` of harvester i.
    """

    system: System
    integration: Integration

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
        if not self.system.harvesters and all(each.striker.mass is None and not each.law.memory for each in parts):
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

    def of(self, state: State) -> _Array:
        """Coordinates of a batch of states, shape (runs, d)."""
        parts = [state.amplitude, state.velocity]
        for name, place, _ in self._own:
            given = getattr(state, name).reshape(state.batch[0], -1)
            parts.append(np.nan_to_num(given[:, [min(place, given.shape[1] - 1)]]))
        return np.concatenate(parts, axis=1) / self.scales

    def arrays(self, rows: _Array) -> dict[str, Any]:
        """The arrays of a state of coordinates of shape (..., d), in SI units."""
        full, places = rows * self.scales, {"circuit": len(self.system.harvesters)}
        found = {
            name: np.full((*full.shape[:-1], max(1, places.get(name, len(self.system.contacts)))), np.nan)
            for name in OWN_FIELDS
        }
        for column, (name, place, _) in enumerate(self._own, 2 * self.modes):
            found[name][..., place] = full[..., column]
        own = {name: values if values.shape[-1] > 1 else values[..., 0] for name, values in found.items()}
        return {"amplitude": full[..., : self.modes], "velocity": full[..., self.modes : 2 * self.modes], **own}

    def modal_directions(self, ensemble: Ensemble) -> tuple[_Array, _Array]:
        """Changes of q and p by each coordinate, shape (d, modes of the solver)."""
        arrays = self.arrays(np.eye(self.dimension))
        arrays["amplitude"] = arrays["amplitude"] + ensemble.structure.equilibrium
        units = np.array([each.unit for each in ensemble.circuits] or [1.0])
        modal = modal_of(ensemble.structure, State(**arrays), units)
        return modal[:, 0], modal[:, 1]

    def of_modal(self, ensemble: Ensemble, q: _Array, p: _Array, well_sign: NDArray[np.int64]) -> _Array:
        """Coordinates of the solver's states, one by one, so that none depends on the others; shape (runs, periods, d)."""
        structure = ensemble.structure
        first = np.where((well_sign < 0)[..., None], q + structure.shift, q)
        modes, beam = structure.model.linear_modes.T, slice(self.modes)
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
