"""From the pieces that an engine wrote down to the datasets of a run."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.engines.driven import motions_of
from snapbeam.engines.ensemble import Ensemble, CircuitCoupling
from snapbeam.engines.outputs import Recorded
from snapbeam.model.system import System
from snapbeam.runs.schema import trajectory_dataset
from snapbeam.runs.strikers import strikers_of

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["impact_table", "joined", "run_dataset"]

_Array = NDArray[np.float64]

IMPACT_COLUMNS = (
    ("onset", "s", "onset of the impact"),
    ("duration", "s", "duration of the impact"),
    ("peak_force", "N", "peak contact force"),
    ("impulse", "N s", "impulse on the beam"),
    ("striker", "1", "number of the striker"),
)


def joined(pieces: list[Recorded]) -> Recorded:
    """Pieces of a run as one, its samples in the order of time."""
    times, q, p, values, impacts = (
        np.concatenate(parts) for parts in zip(*(piece[:5] for piece in pieces), strict=True)
    )
    order = np.argsort(times, kind="stable")
    order = order[np.append(True, np.diff(times[order]) > 0.0)] if order.size else order
    return Recorded(
        times[order],
        q[order],
        p[order],
        values[order],
        impacts,
        pieces[-1].accumulators_of_runs,
        pieces[-1].last,
    )


def run_dataset(
    ensemble: Ensemble,
    system: System,
    recorded: Recorded,
    times: _Array | None,
    period: float,
    attrs: dict[str, Any],
) -> xr.Dataset:
    """The time series of a run.

    *times* are the instants that were asked for; those that the run did not reach are NaN, with ``valid`` = 0.
    """
    structure, model = ensemble.structure, system.model
    values = recorded.values.copy()
    scale, speed = system.scale.length, system.scale.length * system.scale.omega
    alpha, rate = structure.amplitudes(recorded.q), structure.velocities(recorded.p)
    own = np.zeros(recorded.q.shape[0])
    if structure.body_mass is not None:
        body = model.modes
        own = 0.5 * (recorded.p[:, body] ** 2 + (structure.omega[body] * recorded.q[:, body]) ** 2)
        values[:, 2] -= own
    if structure.circuit:
        values[:, 2] -= 0.5 * recorded.p[:, -1] ** 2
    if ensemble.tapped is not None:  # what the coil's own resistance takes
        values[:, 5] += (1.0 - ensemble.tapped.share[0]) * values[:, 9]
    location = 0.5 if system.striker is None else system.striker.location
    shape = model.shape_at(location)
    displacement = alpha @ shape / scale
    variables: dict[str, _Array] = {
        "displacement_at_striker": displacement,
        "midspan_displacement": alpha @ model.midspan_shape / scale,
        "velocity_at_striker": rate @ shape / speed,
        "midspan_velocity": rate @ model.midspan_shape / speed,
    }
    struck = system.striker is not None
    if struck:
        penetration = values[:, 0] / scale
        variables |= {
            "striker_displacement": displacement + structure.sign * penetration,
            "penetration_normalised": penetration,
            "contact_force": values[:, 1],
        }
    variables |= {"modal_amplitude": alpha, "modal_velocity": rate, "energy_beam": values[:, 2]}
    if struck:
        variables |= {"energy_contact": values[:, 3], "striker_work": values[:, 4]}
    if structure.body_mass is not None:
        variables["energy_striker"] = own
    variables["energy_dissipated"] = values[:, 5]
    variables |= _around(ensemble, system, recorded, values)
    if ensemble.others is not None:
        of_each = strikers_of(ensemble, system, recorded, values, variables["striker_displacement"])
        variables["energy_contact"] = of_each.pop("energy_contact")
        variables |= of_each
    if ensemble.tapped is not None:
        variables |= _harvested(ensemble, ensemble.tapped, recorded, values)
    if struck and system.contact is not None and system.contact.is_dissipative:
        variables["energy_lost_contact"] = values[:, 6]
    at = recorded.times
    valid = np.asarray(np.isfinite(values[:, 2:]).all(axis=1) & np.isfinite(alpha).all(axis=1))
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


def _harvested(
    ensemble: Ensemble, tapped: CircuitCoupling, recorded: Recorded, values: _Array
) -> dict[str, _Array]:
    """What a run says of a harvester."""
    structure = ensemble.structure
    assert structure.tapped is not None
    if structure.circuit:
        y = structure.circuit_of(recorded.p)
    else:
        y = -tapped.rate[0] * (recorded.p @ structure.tapped)
    lost = (tapped.rate[0] if structure.circuit else 1.0 / tapped.rate[0]) * y * y
    found = {
        "voltage": tapped.volts[0] * y,
        "power_load": tapped.share[0] * lost,
        "energy_harvested": tapped.share[0] * values[:, 9],
    }
    if structure.circuit:
        found["energy_circuit"] = 0.5 * y * y
    return found


def _around(ensemble: Ensemble, system: System, recorded: Recorded, values: _Array) -> dict[str, _Array]:
    """What a run says of a moving base and of a changing axial load."""
    found: dict[str, _Array] = {}
    if system.base_excitation is None and system.axial_load is None:
        return found
    motions = motions_of(ensemble, system, recorded.times)
    if system.base_excitation is not None:
        found["base_displacement"] = motions["base"][0] / system.scale.length
        found["base_velocity"] = motions["base"][1] / (system.scale.length * system.scale.omega)
        found["base_work"] = values[:, 7]
    if system.axial_load is not None:
        found["load_change"] = motions["axial"][0]
        found["load_work"] = values[:, 8]
    return found


def impact_table(table: _Array, attrs: dict[str, Any]) -> xr.Dataset:
    """The impacts of a run, one after the other."""
    import xarray as xr

    data = {
        name: (
            "impact",
            table[:, i].astype(np.int64) if name == "striker" else table[:, i],
            {"units": units, "long_name": words},
        )
        for i, (name, units, words) in enumerate(IMPACT_COLUMNS[: table.shape[1]])
    }
    number = ("impact", np.arange(1, len(table) + 1), {"units": "1", "long_name": "number of the impact"})
    return xr.Dataset(data, {"impact": number}, attrs)
