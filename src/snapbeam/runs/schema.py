"""The labelled dataset of one run, simulated or measured: its names, dimensions and units.

Displacements are normalised by the buckling level b and velocities by b omega_1, times are in seconds, ``cycle``
counts periods of the excitation (the paper's tau).  A measured run has no modal amplitudes, force or energies, and
may have dropouts: samples at which something was not found have ``valid`` = 0, and only there may a number be NaN.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from snapbeam.core.validate import InputError, InputTypeError, axis, finite_array, shown

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import ArrayLike

__all__ = ["SCHEMA", "Variable", "check_trajectory", "trajectory_dataset"]


class Variable(NamedTuple):
    """What one variable of a run is: its dimensions, its unit and its name in words."""

    dims: tuple[str, ...]
    units: str
    long_name: str


SCHEMA: dict[str, Variable] = {
    "time": Variable(("time",), "s", "time"),
    "cycle": Variable(("time",), "1", "cycles of excitation"),
    "mode": Variable(("mode",), "1", "buckling mode"),
    "striker": Variable(("striker",), "1", "number of the striker"),
    "displacement_at_striker": Variable(("time",), "1", "beam displacement at the striker, over b"),
    "midspan_displacement": Variable(("time",), "1", "beam displacement at the centre, over b"),
    "velocity_at_striker": Variable(("time",), "1", "beam velocity at the striker, over b omega_1"),
    "midspan_velocity": Variable(("time",), "1", "beam velocity at the centre, over b omega_1"),
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
        ("time",), "J", "energy of the striker's motion beyond that of its drive, in its suspension included"
    ),
    "striker_work": Variable(("time",), "J", "work done by the striker"),
    "energy_dissipated": Variable(("time",), "J", "energy dissipated"),
    "base_displacement": Variable(("time",), "1", "displacement of the base in space, over b"),
    "base_velocity": Variable(("time",), "1", "velocity of the base in space, over b omega_1"),
    "base_work": Variable(("time",), "J", "work done by the base, in its frame"),
    "load_change": Variable(("time",), "N", "axial load beyond that of the reduction"),
    "load_work": Variable(("time",), "J", "work done by the change of the axial load"),
    "voltage": Variable(("time",), "V", "voltage across the harvester's load"),
    "power_load": Variable(("time",), "W", "power in the harvester's load"),
    "energy_harvested": Variable(("time",), "J", "energy that ended in the harvester's load"),
    "energy_circuit": Variable(("time",), "J", "energy stored in the harvester's circuit"),
    "energy_lost_contact": Variable(("time",), "J", "part of it that was lost in contact"),
    "valid": Variable(("time",), "1", "whether the sample was measured"),
}
"""Every variable a run may have, by name; ``time``, ``cycle`` and ``mode`` are coordinates."""

_MODAL = ("modal_amplitude", "modal_velocity")
_OF_STRIKERS = ("striker_displacements", "striker_penetrations", "striker_forces")
_FORMER_UNITS = {"b": "1"}
"""Units that files of version 0.1 give to numbers over b."""
_COORDINATES = ("time", "cycle", "mode", "striker")


def trajectory_dataset(
    time: ArrayLike,
    cycle: ArrayLike | None = None,
    *,
    attrs: Mapping[str, Any] | None = None,
    **variables: ArrayLike,
) -> xr.Dataset:
    """Return a run as a labelled dataset.

    Parameters
    ----------
    time : array_like, shape (samples,)
        Seconds, strictly increasing.
    cycle : array_like, shape (samples,), optional
        Cycles of excitation since its start; left out of a run without excitation.
    attrs : mapping, optional
        What the run came from: parameters and provenance.
    **variables : array_like
        The variables of :data:`SCHEMA` by name, of shape (samples,), or (samples, modes) for
        ``modal_amplitude`` and ``modal_velocity``.

    Returns
    -------
    xarray.Dataset
        With dimensions ``time`` and, if there are modal amplitudes, ``mode`` counted from 1; every variable
        carries ``units`` and ``long_name``.

    Raises
    ------
    InputError
        For an unknown name, a wrong shape, times that do not increase, or numbers that are not finite.
    """
    import xarray as xr

    coords: dict[str, Any] = {"time": _labelled("time", axis("time", time, -np.inf, np.inf, closed="both"))}
    if cycle is not None:
        coords["cycle"] = _labelled("cycle", finite_array("cycle", cycle, 1))
    data = {}
    for name, values in variables.items():
        if name in _COORDINATES or name not in SCHEMA:
            known = ", ".join(key for key in SCHEMA if key not in _COORDINATES)
            raise InputError(f"{name}: not a variable of a run; the variables are {known}")
        array = np.asarray(values)
        if array.dtype.kind not in "biuf":
            raise InputTypeError(f"{name}: must be an array of numbers, not of {array.dtype}")
        data[name] = _labelled(name, array)
        if name in _MODAL and array.ndim == 2:
            coords["mode"] = _labelled("mode", np.arange(1, array.shape[1] + 1))
        if name in _OF_STRIKERS and array.ndim == 2:
            coords["striker"] = _labelled("striker", np.arange(1, array.shape[1] + 1))
    length = len(coords["time"][1])
    for name, (dims, values, _) in (*coords.items(), *data.items()):
        if values.ndim != len(dims) or (dims[0] == "time" and values.shape[0] != length):
            raise InputError(
                f"{name} of shape {values.shape}: must have dimensions {dims}, with time of {length}"
            )
    dataset = xr.Dataset(data, coords, dict(attrs or {}))
    check_trajectory(dataset, require=())
    return dataset


def _labelled(name: str, values: np.ndarray) -> tuple[tuple[str, ...], np.ndarray, dict[str, str]]:
    quantity = SCHEMA[name]
    return quantity.dims, values, {"units": quantity.units, "long_name": quantity.long_name}


def check_trajectory(
    dataset: xr.Dataset, require: Iterable[str] = ("displacement_at_striker",)
) -> xr.Dataset:
    """Return *dataset* if it follows the schema of a run; say what is wrong with it if not.

    Variables beyond the schema are left alone, so that an experiment may add its own.

    Parameters
    ----------
    dataset : xarray.Dataset
        A run, simulated or measured.
    require : iterable of str
        The variables the caller cannot do without.

    Raises
    ------
    InputError
        If ``time`` or a required variable is missing, dimensions or units differ from :data:`SCHEMA`, times
        do not increase strictly, or a number is not finite where ``valid`` does not say so.
    """
    import xarray as xr

    if not isinstance(dataset, xr.Dataset):
        raise InputTypeError(f"dataset: must be an xarray.Dataset, not {type(dataset).__name__}")
    missing = [name for name in ("time", *require) if name not in dataset.variables]
    if missing:
        raise InputError(f"run without {', '.join(missing)}: it has {', '.join(map(str, dataset.variables))}")
    valid = dataset["valid"].values.astype(bool) if "valid" in dataset else None
    for name, quantity in SCHEMA.items():
        if name not in dataset.variables:
            continue
        variable = dataset[name]
        if variable.dims != quantity.dims:
            raise InputError(f"{name} with dimensions {variable.dims}: must have dimensions {quantity.dims}")
        units = variable.attrs.get("units")
        if _FORMER_UNITS.get(str(units), units) != quantity.units:
            raise InputError(f"{name} in units {shown(units)}: must be in {quantity.units!r}")
        good = np.isfinite(variable.values)
        if valid is not None and name not in _COORDINATES:
            good = good | ~(valid if good.ndim == 1 else valid[:, None])
        if not good.all():
            at = tuple(int(i) for i in np.argwhere(~good)[0])
            raise InputError(f"{name}{list(at)} = {float(variable.values[at])!r}: must be finite")
    steps = np.diff(dataset["time"].values)
    if (steps <= 0.0).any():
        late = int(np.argmax(steps <= 0.0)) + 1
        raise InputError(
            f"time[{late}] = {float(dataset['time'][late])!r}: must be later than the one before"
        )
    return dataset
