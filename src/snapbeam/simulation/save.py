"""Saving and loading of runs: one NetCDF file for each run."""

from __future__ import annotations

import json
import os
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.integration import Integration
from snapbeam.model.quantity import quantities
from snapbeam.model.state import FIELDS, State
from snapbeam.model.system import System
from snapbeam.simulation.dataset import check_trajectory
from snapbeam.simulation.run import Run
from snapbeam.simulation.summary import RunSummary
from snapbeam.simulation.tolerance import ErrorEstimate
from snapbeam.solver.statistics import STATISTICS
from snapbeam.util.files import check_writable
from snapbeam.util.netcdf import read_netcdf, write_netcdf
from snapbeam.util.status_codes import ResponseClass, RunStatus
from snapbeam.util.validation import InputError, choice, file_path

if TYPE_CHECKING:
    import xarray as xr

_FORMAT = "snapbeam run 3"
_GROUPS = ("impacts", "summary")
_COMPRESSION = {"zlib": True, "complevel": 4, "shuffle": True}


CONTENTS = ("samples", "waveforms", "states", "statistics")
"""Contents of a file: all samples of a run, the series without those of modes, one sample of each cycle, or none."""


def save_run(run: Run, path: str | os.PathLike[str], content: str = CONTENTS[0]) -> None:
    """Write a run; see :meth:`snapbeam.Run.save`.

    The root group contains the time series, the groups ``impacts`` and ``summary`` the rest.  Attributes of the root
    contain the system, the integration, the error estimate and the final state as JSON.
    """
    target = check_writable(path, "path", (".nc",))
    kept = run.dataset.drop_dims("mode") if choice("content", content, CONTENTS) == "waveforms" else run.dataset
    if content == "states":
        kept = kept.isel(time=_whole_cycles(kept["cycle"].values))
    elif content == "statistics":
        kept = kept.isel(time=slice(0))
    root = kept.assign_attrs(description(run.system, run.integration, run.accuracy, run.final_state))
    groups = {None: root, "impacts": run.impacts.assign_attrs({}), "summary": summary_dataset(run.summary)}
    write_netcdf(groups, target, {name: compressed(dataset) for name, dataset in groups.items()})


def _whole_cycles(cycle: NDArray[np.float64]) -> NDArray[np.intp]:
    """The samples at the starts of cycles, or nearest to them, one for each."""
    wanted = np.arange(np.ceil(cycle[0] - 1e-6), np.floor(cycle[-1] + 1e-6) + 1.0)
    after = np.clip(np.searchsorted(cycle, wanted), 1, cycle.size - 1)
    return np.unique(np.where(wanted - cycle[after - 1] <= cycle[after] - wanted, after - 1, after))


def description(
    system: System, integration: Integration, accuracy: ErrorEstimate | None, end: State | None
) -> dict[str, str]:
    """Return the attributes from which a run is read again."""
    described = {
        "snapbeam_format": _FORMAT,
        "snapbeam_system": _json(system.to_mapping()),
        "snapbeam_integration": _json({name: getattr(integration, name) for name in quantities(Integration)}),
    }
    if accuracy is not None:
        described["snapbeam_accuracy"] = _json(vars(accuracy))
    if end is not None:
        described["snapbeam_final_state"] = _json({name: getattr(end, name) for name in FIELDS})
    return described


def load(path: str | os.PathLike[str]) -> Run:
    """Read a run that :meth:`snapbeam.Run.save` wrote.

    See Also
    --------
    snapbeam.Run, snapbeam.simulate_to_file

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> system = paper.struck_beam(frequency_ratio=1.2, velocity_amplitude=0.18)
    >>> sb.simulate(system, sb.Integration(cycles=2)).save("run.nc")
    >>> run = sb.load("run.nc")
    >>> run.system == system
    True
    """
    path = file_path("path", path)
    dataset = read_netcdf(path)
    attrs = dict(dataset.attrs)
    if attrs.pop("snapbeam_format", None) != _FORMAT:
        raise InputError(
            f"path = {str(path)!r}: is not a run that Run.save wrote; open a map or another result with "
            "xarray.open_dataset"
        )
    parts = {name: read_netcdf(path, group=name) for name in _GROUPS}
    try:
        system = System.from_mapping(_arrays(json.loads(attrs.pop("snapbeam_system"))))
        integration = Integration(**json.loads(attrs.pop("snapbeam_integration")))
        accuracy = ErrorEstimate(**json.loads(attrs.pop("snapbeam_accuracy"))) if "snapbeam_accuracy" in attrs else None
        end = _state(json.loads(attrs.pop("snapbeam_final_state"))) if "snapbeam_final_state" in attrs else None
    except (KeyError, TypeError, ValueError, RecursionError) as error:
        raise InputError(f"path = {str(path)!r}: its description is damaged ({error})") from None
    dataset = check_trajectory(dataset.drop_attrs(deep=False).assign_attrs(attrs))
    values = {str(name): array.values.item() for name, array in parts["summary"].variables.items()}
    return Run(dataset, RunSummary(values), parts["impacts"], system, integration, accuracy, end)


def summary_dataset(outcome: RunSummary) -> xr.Dataset:
    """Return the statistics of a run as scalar variables, with the meanings of codes."""
    from snapbeam.util.datasets import variable, xr

    variables: dict[str, Any] = {}
    for name, value in outcome.items():
        row = STATISTICS[name]
        labels: dict[str, Any] = {"units": row.unit, "long_name": row.long_name}
        kinds: type[ResponseClass] | type[RunStatus] | None = None
        if name in ("response_class", "status"):
            kinds = ResponseClass if name == "response_class" else RunStatus
            labels |= code_flags(kinds)
        number = np.asarray(int(value) if kinds else value).astype(row.dtype)
        variables[name] = variable(name, (), number, labels)
    return xr.Dataset(variables)


def code_flags(kinds: type[ResponseClass] | type[RunStatus]) -> dict[str, Any]:
    """Return the meanings of codes as attributes of the CF conventions."""
    return {
        "flag_values": np.array([int(kind) for kind in kinds], dtype=np.int8),
        "flag_meanings": " ".join(
            kind.label.replace(" ", "_") if isinstance(kind, ResponseClass) else kind.name.lower() for kind in kinds
        ),
    }


def compressed(dataset: xr.Dataset) -> dict[Any, dict[str, Any]]:
    """Return the encoding of a dataset; its series of modes would shrink by a seventh, for most of the time of writing."""
    return {name: _COMPRESSION for name, variable in dataset.variables.items() if variable.ndim == 1}


def _json(value: Any) -> str:
    return json.dumps(_without_nan(value), sort_keys=True)


def _without_nan(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_nan(item) for key, item in value.items()}
    if isinstance(value, (np.ndarray, np.generic)):
        return _without_nan(value.tolist())
    if isinstance(value, (list, tuple)):
        return [_without_nan(item) for item in value]
    if isinstance(value, float) and value != value:
        return None
    return value


def _arrays(sections: dict[str, dict[str, Any]]) -> dict[str, dict[str, Any]]:
    return {
        section: {name: np.array(value) if isinstance(value, list) else value for name, value in values.items()}
        for section, values in sections.items()
    }


def _state(values: dict[str, Any]) -> State:
    given = {name: np.array(value, dtype=np.float64) for name, value in values.items()}
    return State(**given)  # type: ignore[arg-type]
