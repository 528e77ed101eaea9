"""Schema of the dataset of a run, simulated or measured: names, dimensions and units.

Displacements are normalised by the buckling level b and velocities by b omega_1.  Times are in seconds; ``cycle``
counts periods of the excitation (the paper's tau).  A measured run has no modal amplitudes, force or energies.  Its
dropouts have ``valid`` = 0, and only there a number may be NaN.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.quantity import numbered
from snapbeam.model.system import System
from snapbeam.solver.assemble import motions_of, tip_of
from snapbeam.solver.ensemble import Ensemble
from snapbeam.solver.statistics import SAMPLED, Recorded
from snapbeam.util.validation import InputError, InputTypeError, axis, finite_array, require_texts, shown

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import ArrayLike

__all__ = [
    "SCHEMA",
    "Variable",
    "check_trajectory",
    "impact_table",
    "joined",
    "run_dataset",
    "strikers_of",
    "trajectory_dataset",
]

_Array = NDArray[np.float64]


class Variable(NamedTuple):
    """Variable of a run: dimensions, unit and long name."""

    dims: tuple[str, ...]
    unit: str
    long_name: str


SCHEMA: dict[str, Variable] = {
    "time": Variable(("time",), "s", "time"),
    "cycle": Variable(("time",), "1", "cycles of excitation"),
    "mode": Variable(("mode",), "1", "buckling mode"),
    "striker": Variable(("striker",), "1", "number of the striker"),
    "force": Variable(("force",), "1", "number of the external force"),
    "harvester": Variable(("harvester",), "1", "number of the harvester"),
    "displacement_at_striker": Variable(("time",), "1", "beam displacement at the striker, over b"),
    "midspan_displacement": Variable(("time",), "1", "beam displacement at mid-span, over b"),
    "velocity_at_striker": Variable(("time",), "1", "beam velocity at the striker, over b omega_1"),
    "midspan_velocity": Variable(("time",), "1", "beam velocity at mid-span, over b omega_1"),
    "striker_displacement": Variable(("time",), "1", "striker displacement, over b"),
    "penetration_normalised": Variable(("time",), "1", "penetration, over b"),
    "contact_force": Variable(("time",), "N", "contact force"),
    "striker_displacements": Variable(("time", "striker"), "1", "displacement of each striker's tip, over b"),
    "striker_penetrations": Variable(("time", "striker"), "1", "penetration of each striker, over b"),
    "striker_forces": Variable(("time", "striker"), "N", "contact force of each striker"),
    "modal_amplitude": Variable(("time", "mode"), "m^0.5", "modal amplitude"),
    "modal_velocity": Variable(("time", "mode"), "m^0.5/s", "modal velocity"),
    "energy_beam": Variable(("time",), "J", "kinetic and potential energy of the beam, above its well"),
    "energy_contact": Variable(("time",), "J", "energy stored in the contact"),
    "energy_striker": Variable(
        ("time",), "J", "energy of the striker's motion relative to its drive, suspension included"
    ),
    "striker_work": Variable(("time",), "J", "work done by the striker"),
    "energy_dissipated": Variable(("time",), "J", "energy dissipated"),
    "base_displacement": Variable(("time",), "1", "displacement of the base, over b"),
    "base_velocity": Variable(("time",), "1", "velocity of the base, over b omega_1"),
    "base_work": Variable(("time",), "J", "work done by the base, in its frame"),
    "external_force": Variable(("time",), "N", "external force"),
    "external_forces": Variable(("time", "force"), "N", "each of several external forces"),
    "force_work": Variable(("time",), "J", "work done by external forces"),
    "load_change": Variable(("time",), "N", "change of the axial load"),
    "load_work": Variable(("time",), "J", "work done by the change of the axial load"),
    "local_force_work": Variable(("time",), "J", "work done by the damping part of a local force"),
    "voltage": Variable(("time",), "V", "voltage across the (first) harvester's load"),
    "voltages": Variable(("time", "harvester"), "V", "voltages across the loads of several harvesters"),
    "power_load": Variable(("time",), "W", "power in the loads of harvesters"),
    "energy_harvested": Variable(("time",), "J", "energy dissipated in the loads of harvesters"),
    "energy_circuit": Variable(("time",), "J", "energy stored in the circuits of harvesters"),
    "energy_lost_contact": Variable(("time",), "J", "part of the dissipated energy that was lost in contact"),
    "valid": Variable(("time",), "1", "whether the sample was measured"),
}
"""Variables of a run by name; ``time``, ``cycle``, ``mode``, ``striker`` and ``force`` are coordinates."""

_COORDINATES = ("time", "cycle", "mode", "striker", "force", "harvester")


def trajectory_dataset(
    time: ArrayLike, cycle: ArrayLike | None = None, *, attrs: Mapping[str, Any] | None = None, **variables: ArrayLike
) -> xr.Dataset:
    """Return a run as a labelled dataset.

    Parameters
    ----------
    time : array_like, shape (samples,)
        Seconds, strictly increasing.
    cycle : array_like, shape (samples,), optional
        Cycles of excitation since its start; None for a run without excitation.
    attrs : mapping, optional
        Attributes: parameters and provenance.
    **variables : array_like
        The variables of :data:`SCHEMA` by name, of shape (samples,), or (samples, modes) for
        ``modal_amplitude`` and ``modal_velocity``.

    Returns
    -------
    xarray.Dataset
        Dataset with the dimensions ``time`` and, if there are modal amplitudes, ``mode`` counted from 1; every variable
        carries ``units`` and ``long_name``.
    """
    from snapbeam.util.datasets import variable, xr

    require_texts("attrs", attrs)
    coords: dict[str, Any] = {"time": _labelled("time", axis("time", time, -np.inf, np.inf, closed="both"))}
    if cycle is not None:
        coords["cycle"] = _labelled("cycle", finite_array("cycle", cycle, 1))
    data = {}
    for name, values in variables.items():
        if name in _COORDINATES or name not in SCHEMA:
            known = ", ".join(key for key in SCHEMA if key not in _COORDINATES)
            raise InputError(f"{name}: is not a variable of a run; must be one of {known}")
        array = np.asarray(values)
        if array.dtype.kind not in "biuf":
            raise InputTypeError(f"{name}: must be an array of numbers, not of {array.dtype}")
        data[name] = _labelled(name, array)
        counted = SCHEMA[name].dims[1:]
        if counted and array.ndim == 2:
            coords[counted[0]] = _labelled(counted[0], np.arange(1, array.shape[1] + 1))
    length = len(coords["time"][1])
    for name, (dims, values, _) in (*coords.items(), *data.items()):
        if values.ndim != len(dims) or (dims[0] == "time" and values.shape[0] != length):
            raise InputError(f"{name} of shape {values.shape}: must have dimensions {dims}, with time of {length}")
    series, axes = ({name: variable(name, *each) for name, each in part.items()} for part in (data, coords))
    dataset = xr.Dataset(series, axes, dict(attrs or {}))
    check_trajectory(dataset, require=())
    return dataset


def _labelled(name: str, values: np.ndarray) -> tuple[tuple[str, ...], np.ndarray, dict[str, str]]:
    quantity = SCHEMA[name]
    return quantity.dims, values, {"units": quantity.unit, "long_name": quantity.long_name}


def check_trajectory(dataset: xr.Dataset, require: Iterable[str] = ("displacement_at_striker",)) -> xr.Dataset:
    """Return *dataset* if it follows the schema of a run.

    Variables that are not in the schema are not checked, so that an experiment may add its own.

    Parameters
    ----------
    dataset : xarray.Dataset
        A run, simulated or measured.
    require : iterable of str
        Variables that the dataset must have.

    Raises
    ------
    InputError
        If ``time`` or a required variable is missing, dimensions or units differ from :data:`SCHEMA`, times do not
        increase strictly, or a number is not finite although its sample is valid.
    """
    from snapbeam.util.datasets import xr

    if not isinstance(dataset, xr.Dataset):
        raise InputTypeError(f"dataset: must be an xarray.Dataset, not {type(dataset).__name__}")
    missing = [name for name in ("time", *require) if name not in dataset.variables]
    if missing:
        raise InputError(
            f"run without {', '.join(missing)}: its variables are {', '.join(map(str, dataset.variables))}"
        )
    valid = dataset["valid"].values.astype(bool) if "valid" in dataset else None
    for name, quantity in SCHEMA.items():
        if name not in dataset.variables:
            continue
        found = dataset.variables[name]
        if found.dims != quantity.dims:
            raise InputError(f"{name} with dimensions {found.dims}: must have dimensions {quantity.dims}")
        units = found.attrs.get("units")
        if units != quantity.unit:
            raise InputError(f"{name} in units {shown(units)}: must be in {quantity.unit!r}")
        good = np.isfinite(found.values)
        if valid is not None and name not in _COORDINATES:
            good = good | ~(valid if good.ndim == 1 else valid[:, None])
        if not good.all():
            at = tuple(int(i) for i in np.argwhere(~good)[0])
            raise InputError(f"{name}{list(at)} = {float(found.values[at])!r}: must be finite")
    steps = np.diff(dataset["time"].values)
    if (steps <= 0.0).any():
        late = int(np.argmax(steps <= 0.0)) + 1
        raise InputError(f"time[{late}] = {float(dataset['time'][late])!r}: must be later than the one before")
    return dataset


# Displacement, penetration and force of each of several strikers.


def strikers_of(ensemble: Ensemble, system: System, recorded: Recorded, first: _Array) -> dict[str, _Array]:
    """Return series of shape (samples, strikers).

    *first* is the displacement of the first tip, over b; those of the others follow from their motions.
    """
    structure, run, length = ensemble.structure, ensemble.runs[0], system.scale.length
    tip = np.zeros((recorded.times.size, len(system.contacts)))
    tip[:, 0] = first
    follows = _follows(ensemble, system, recorded)
    for j in range(1, len(system.contacts)):
        upward = 1.0 if system.contacts[j].striker.side == "below" else -1.0
        row = ensemble.contact_rows[run["contact_row"][j]]
        motion = tip_of(ensemble, system, j + 1, recorded.times) + upward * structure.sign * follows
        motion -= recorded.q @ (row - structure.row_of_beam(row))  # of a striker with mass its own
        tip[:, j] = upward * (run["rest_contact"][j] + run["offset"][j] + motion) / length
    return {
        "striker_forces": recorded.contacts[:, :, 1],
        "striker_penetrations": recorded.contacts[:, :, 0] / length,
        "striker_displacements": tip,
    }


def _indentation(ensemble: Ensemble, recorded: Recorded, contact: int) -> _Array:
    """Return the residual indentation under a striker, from 0, m; zeros under a law without one."""
    mode = ensemble.structure.mode_of_indentation(contact)
    return np.zeros(recorded.q.shape[0]) if mode is None else recorded.q[:, mode]


def _follows(ensemble: Ensemble, system: System, recorded: Recorded) -> _Array:
    """Return the displacement of fixed tips relative to a moving base, in the direction of the first striker."""
    if system.base_excitation is None or system.base_excitation.striker_on_base:
        return np.zeros(recorded.times.size)
    moved = motions_of(ensemble, system, recorded.times)["base_excitation"][0]
    return -ensemble.structure.sign * moved


# Datasets of a run from the pieces that an engine recorded.


_COLUMN = {name: number for number, name in enumerate(SAMPLED)}
"""Columns of the recorded values."""
_CIRCUITS = len(_COLUMN)
"""The first column of the energies lost in circuits."""
IMPACT_COLUMNS = (
    ("onset", "s", "onset of the impact"),
    ("duration", "s", "duration of the impact"),
    ("peak_force", "N", "peak contact force"),
    ("impulse", "N s", "impulse on the beam"),
    ("striker", "1", "number of the striker"),
)


def joined(pieces: list[Recorded]) -> Recorded:
    """Join pieces of a run, with the samples in the order of time."""
    times, q, p, contacts, values, impacts = (
        np.concatenate(parts) if len(pieces) > 1 else parts[0]
        for parts in zip(*(piece[:6] for piece in pieces), strict=True)
    )
    order: NDArray[np.intp] | slice = slice(None)
    if not (np.diff(times) > 0.0).all():
        order = np.argsort(times, kind="stable")
        order = order[np.append(True, np.diff(times[order]) > 0.0)]
    return Recorded(
        times[order],
        q[order],
        p[order],
        contacts[order],
        values[order],
        impacts,
        pieces[-1].accumulators_of_runs,
        pieces[-1].last,
    )


def run_dataset(
    ensemble: Ensemble, system: System, recorded: Recorded, times: _Array | None, period: float, attrs: dict[str, Any]
) -> xr.Dataset:
    """Return the time series of a run.

    *times* are the requested times; those that the run did not reach are NaN, with ``valid`` = 0.
    """
    structure, model = ensemble.structure, system.model
    values = recorded.values.copy()
    scale, speed = system.scale.length, system.scale.length * system.scale.omega
    alpha, rate = structure.amplitudes(recorded.q), structure.velocities(recorded.p)
    own = np.zeros(recorded.q.shape[0])
    if structure.bodies:
        body = structure.modes_of_bodies
        own = 0.5 * (recorded.p[:, body] ** 2 + (structure.omega[body] * recorded.q[:, body]) ** 2).sum(axis=1)
        values[:, _COLUMN["energy"]] -= own
    values[:, _COLUMN["energy"]] -= _stored_in_circuits(ensemble, recorded)
    for i, circuit in enumerate(ensemble.circuits):  # dissipated in the resistance of the coil
        values[:, _COLUMN["dissipated"]] += (1.0 - circuit.share[0]) * values[:, _CIRCUITS + i]
    location = 0.5 if system.striker is None else system.striker.location
    shape = model.shape_at(location)
    displacement = alpha @ shape / scale
    variables: dict[str, _Array] = {
        "displacement_at_striker": displacement,
        "midspan_displacement": alpha @ model.midspan_shape / scale,
        "velocity_at_striker": rate @ shape / speed,
        "midspan_velocity": rate @ model.midspan_shape / speed,
    }
    struck = bool(system.contacts)
    if struck:
        penetration = recorded.contacts[:, 0, 0] / scale
        variables |= {
            "striker_displacement": displacement
            + structure.sign * (penetration + _indentation(ensemble, recorded, 0) / scale),
            "penetration_normalised": penetration,
            "contact_force": recorded.contacts[:, 0, 1],
        }
    variables |= {"modal_amplitude": alpha, "modal_velocity": rate, "energy_beam": values[:, _COLUMN["energy"]]}
    if struck:
        variables |= {"energy_contact": values[:, _COLUMN["contact"]], "striker_work": values[:, _COLUMN["work"]]}
    if structure.bodies:
        variables["energy_striker"] = own
    variables["energy_dissipated"] = values[:, _COLUMN["dissipated"]]
    variables |= _around(ensemble, system, recorded, values)
    if ensemble.contacts > 1:
        variables |= strikers_of(ensemble, system, recorded, variables["striker_displacement"])
    if ensemble.circuits:
        variables |= _harvested(ensemble, recorded, values)
    if any(each.law.is_dissipative for each in system.contacts):
        variables["energy_lost_contact"] = values[:, _COLUMN["lost"]]
    at = recorded.times
    valid = np.asarray(np.isfinite(values).all(axis=1) & np.isfinite(alpha).all(axis=1))
    if times is not None and at.size < times.size:
        missing = times.size - at.size
        at, valid = times, np.concatenate((valid, np.zeros(missing, dtype=bool)))
        variables = {
            name: np.concatenate((array, np.full((missing, *array.shape[1:]), np.nan)))
            for name, array in variables.items()
        }
    if not valid.all():
        variables = {
            name: np.where(valid if array.ndim == 1 else valid[:, None], array, np.nan)
            for name, array in variables.items()
        }
        variables["valid"] = np.asarray(valid, dtype=np.int8)
    return trajectory_dataset(at, at / period, attrs=attrs, **variables)


def _stored_in_circuits(ensemble: Ensemble, recorded: Recorded) -> _Array:
    """Return the energy in circuits, y^2/2 each, J, shape (samples,)."""
    y = ensemble.structure.circuits_of(recorded.q).reshape(-1, max(1, len(ensemble.circuits)))
    return 0.5 * (np.nan_to_num(y) ** 2).sum(axis=1)


def _harvested(ensemble: Ensemble, recorded: Recorded, values: _Array) -> dict[str, _Array]:
    """Return the variables of harvesters."""
    structure = ensemble.structure
    y = structure.circuits_of(recorded.q).reshape(-1, len(ensemble.circuits))
    voltage, power, energy = np.zeros(y.shape), np.zeros(y.shape), np.zeros(y.shape[0])
    for i, (circuit, row) in enumerate(zip(ensemble.circuits, structure.circuits, strict=True)):
        per_square = circuit.rate[0]
        if row.mode is None:
            y[:, i] = -circuit.rate[0] * (recorded.p @ row.row)
            per_square = 1.0 / circuit.rate[0]
        voltage[:, i] = circuit.volts[0] * y[:, i]
        power[:, i] = circuit.share[0] * per_square * y[:, i] ** 2
        energy += circuit.share[0] * values[:, _CIRCUITS + i]
    found = {"voltage": voltage[:, 0], "power_load": power.sum(axis=1), "energy_harvested": energy}
    if len(ensemble.circuits) > 1:
        found["voltages"] = voltage
    if any(row.mode is not None for row in structure.circuits):
        found["energy_circuit"] = _stored_in_circuits(ensemble, recorded)
    return found


def _around(ensemble: Ensemble, system: System, recorded: Recorded, values: _Array) -> dict[str, _Array]:
    """Return the variables of a base excitation, of a changing axial load and of external forces."""
    found: dict[str, _Array] = {}
    if any(each.dissipative for each in system.local_forces):
        found["local_force_work"] = values[:, _COLUMN["local_force_work"]]
    motions = motions_of(ensemble, system, recorded.times)
    if system.base_excitation is not None:
        found["base_displacement"] = motions["base_excitation"][0] / system.scale.length
        found["base_velocity"] = motions["base_excitation"][1] / (system.scale.length * system.scale.omega)
        found["base_work"] = values[:, _COLUMN["base_work"]]
    if system.axial_load is not None:
        found["load_change"] = motions["axial_load"][0]
        found["load_work"] = values[:, _COLUMN["load_work"]]
    forces = [motion[0] for section, motion in motions.items() if numbered(section)[0] == "force"]
    if forces:
        several = len(forces) > 1
        found["external_forces" if several else "external_force"] = np.stack(forces, 1) if several else forces[0]
        found["force_work"] = values[:, _COLUMN["force_work"]]
    return found


def impact_table(table: _Array, attrs: dict[str, Any]) -> xr.Dataset:
    """Return the table of the impacts of a run."""
    from snapbeam.util.datasets import variable, xr

    columns = {
        name: (table[:, i].astype(np.int64) if name == "striker" else table[:, i], {"units": units, "long_name": words})
        for i, (name, units, words) in enumerate(IMPACT_COLUMNS[: table.shape[1]])
    }
    columns["impact"] = (np.arange(1, len(table) + 1), {"units": "1", "long_name": "number of the impact"})
    data = {name: variable(name, ("impact",), *each) for name, each in columns.items()}
    return xr.Dataset(data, attrs=attrs)
