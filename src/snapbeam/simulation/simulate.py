"""Simulate and record single runs."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from typing import TYPE_CHECKING, Any, NamedTuple, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.model.drive.recorded_motion import RecordedMotion
from snapbeam.model.integration import Integration
from snapbeam.model.parameter_file import numbers_as_given
from snapbeam.model.parameters import lookup
from snapbeam.model.quantity import numbered, quantities
from snapbeam.model.state import State
from snapbeam.model.system import System
from snapbeam.simulation.dataset import impact_table, joined, run_dataset
from snapbeam.simulation.request import checked_request, cycle_of
from snapbeam.simulation.run import Run
from snapbeam.simulation.states import states_of
from snapbeam.simulation.summary import RunSummary
from snapbeam.simulation.tolerance import ErrorEstimate, steps_for
from snapbeam.solver.assemble import make_ensemble, plans_of, run_columns
from snapbeam.solver.engines import engine_of
from snapbeam.solver.ensemble import Ensemble
from snapbeam.solver.statistics import WORKS, Recorded, lost_in_circuits, rounding_energy, statistics_of
from snapbeam.solver.step_size import SUBDIVISION, Plan, long_run
from snapbeam.util.cores import usable_cores
from snapbeam.util.diagnostics import Diagnostic, counting, sharing, tell
from snapbeam.util.interrupts import raise_held
from snapbeam.util.provenance import array_hash, created_now, made_by
from snapbeam.util.status_codes import RunStatus
from snapbeam.util.validation import InputError, InputTypeError, finite_array, shown

if TYPE_CHECKING:
    import xarray as xr

CONVENTIONS = "CF-1.11"
_LONGEST = 1024
"""Maximum size of an array in an attribute."""
_Array = NDArray[np.float64]
_SAMPLES_PER_CYCLE = 200
"""Regular samples per cycle of the excitation or of the first mode, whichever is shorter."""
_BLOCK = 2**22
"""Instants in a block."""
MEMORY_LIMIT = 4 * 2**30
"""Maximum memory of the samples of a run, bytes."""
_ENERGY_ERROR = 1e-3
"""Energy-balance error, over the gross work, above which a run gets a diagnostic."""
_ENDED = (RunStatus.OK, RunStatus.EARLY_STOP, RunStatus.INTERRUPTED)


# Attributes of datasets: all parameters by name.


def describe_system(system: System, plan: Plan) -> dict[str, Any]:
    """Return the parameters of a system, except those of its drive and striker, and its steps as attributes."""
    model = system.model
    damping = system.struck_model.damping_ratio
    attrs: dict[str, Any] = {
        "modes": model.modes,
        "damping_ratio": float(damping[0]) if np.all(damping == damping[0]) else damping.tolist(),
        "length_scale": model.length_scale,
        "reference_frequency": model.reference_frequency,
        "step": plan.step,
        "order": plan.order,
        "longest_contact_step": plan.contact,
        "shortest_contact_step": plan.shortest,
    }
    if system.contacts:
        attrs["contact_type"] = system.contacts[0].law.name
        attrs |= _short(system.contacts[0].law)
    if model.beam is not None:
        attrs |= {name: float(value) for name, value in _short(model.beam).items()}
        attrs |= _short(model.beam.boundary)
    if model.imperfection is not None:
        attrs |= _short(model.imperfection)
    if model.transverse_force is not None:
        attrs["reference_well"] = model.reference_well
    attrs |= {"initial_well": system.start_well, "initial_well_reason": system.initial_well_reason}
    if not model.is_bistable:
        attrs["wells"] = 1
    if system.contacts[1:]:
        attrs["strikers"] = len(system.contacts)
    around = ("base_excitation", "axial_load", "force", "harvester")
    for section, values in system.to_mapping().items():
        kind, number = numbered(section)
        if kind not in around and number == 1:
            continue
        of = "contact" if kind == "drive" else kind
        suffix = "" if number == 1 else f"_{of}_{number}"
        for name, value in values.items():
            plain = name in ("type", "label")
            short = f"{kind}_{name}{suffix}" if plain else lookup(f"{section}.{name}").short
            attrs[short] = int(value) if isinstance(value, bool) else value
    return attrs


def _short(part: Any) -> dict[str, Any]:
    """Return the parameters of a part by their names in datasets."""
    return {
        item.short or name: getattr(part, name)
        for name, item in quantities(type(part)).items()
        if isinstance(getattr(part, name), (float, int, str))
    }


def attributes_of(
    title: str, system: System, integration: Integration, plan: Plan, more: dict[str, Any], points: Any = None
) -> dict[str, Any]:
    """Return the attributes of a dataset: title, all parameters, provenance, and the hash of all of it.

    *points* identify a sweep.
    """
    attrs: dict[str, Any] = {"Conventions": CONVENTIONS, "title": title}
    attrs |= describe_system(system, plan) | more
    own = {name: getattr(integration, name) for name in quantities(Integration) if name != "threads"}
    attrs["system_hash"] = system.hash
    attrs["system"] = json.dumps(_short_arrays(system.to_mapping()), sort_keys=True)
    attrs |= given_attribute(system)
    attrs["integration"] = json.dumps(own, sort_keys=True)
    identity = {"system": system.hash, "integration": own, "more": more}
    return attrs | made_by(identity if points is None else identity | {"points": points})


def given_attribute(system: System) -> dict[str, str]:
    """Return the attribute with the numbers that were given in units, in these units."""
    found = numbers_as_given(system) if system.as_given else {}
    return {"as_given": json.dumps(found, sort_keys=True)} if found else {}


def _short_arrays(value: Any) -> Any:
    """Return plain values; an array that is too long for an attribute is replaced by its hash."""
    if isinstance(value, np.ndarray):
        if value.size > _LONGEST:
            return {"shape": list(value.shape), "sha256": array_hash(value)}
        return value.tolist()
    if isinstance(value, dict):
        return {key: _short_arrays(item) for key, item in value.items()}
    return value


# Preparation of a recorded run, and its attributes.


class Prepared(NamedTuple):
    """A checked run with its steps and sample times."""

    system: System
    integration: Integration
    plan: Plan
    accuracy: ErrorEstimate | None
    """Error estimate, if a tolerance was given."""
    ensemble: Ensemble
    times: _Array | None
    """Requested sample times, s."""
    samples: int
    """Number of sample times, without the ends of steps in contact."""
    end: float
    """End of the run, s."""
    period: float
    """Period of a cycle, s."""

    @property
    def instants(self) -> _Array:
        """Sample times, s."""
        return even_instants(self.end, self.samples) if self.times is None else self.times


def even_instants(end: float, count: int) -> _Array:
    """Return ``numpy.linspace(0, end, count)``, by blocks: signals are heard between them."""
    instants, step = np.empty(count), end / max(count - 1, 1)
    for first in range(0, count, _BLOCK):
        raise_held()
        instants[first : first + _BLOCK] = np.arange(first, min(first + _BLOCK, count)) * step
    if count > 1:
        instants[-1] = end
    return instants


def prepared(system: System, integration: Integration, sample_times: ArrayLike | None) -> Prepared:
    """Choose the steps and the sample times of a run, and report the diagnostics of the system."""
    tell(system.diagnostics())
    plan, accuracy = plans_of(system, integration, run_columns(system, {}))[0], None
    if integration.tolerance is not None:
        plan, accuracy = steps_for(system, integration)
    ensemble = make_ensemble(system, integration, plan=plan)
    end = float(ensemble.runs["tick"][0]) * int(ensemble.runs["end"][0])
    period = cycle_of(system)
    times = None if sample_times is None else _checked_times(sample_times, end, float(ensemble.runs["tick"][0]))
    count = _regular_count(system, end, period) if times is None else times.size
    steps = float(ensemble.runs["end"][0]) / SUBDIVISION
    plan = plan.no_longer(float(ensemble.step_times[0]))  # fitted to the cycle
    tell(long_run(system.model.modes, plan.step, steps, _causes(system, integration)))
    return Prepared(system, integration, plan, accuracy, ensemble, times, count, end, period)


def _causes(system: System, integration: Integration) -> str:
    """Words for what the number of steps of a run follows from."""
    if integration.step is not None:
        return "the step is that of integration.step"
    contact = ", an impact (softer contacts have longer ones)" if system.contacts else ""
    return f"the step follows from the highest mode, the strongest damping{contact}; fewer cycles take less time"


_UNBALANCED = (RunStatus.INTERRUPTED, RunStatus.DIVERGED)
"""The balance is closed at the end of a run alone, and beyond the range of a law a force may be infinite."""


def run_attributes(run: Prepared, summary: RunSummary, accumulators_of_runs: Any) -> dict[str, Any]:
    """Return the attributes of a run that ended."""
    lasted = run.end / run.period
    more: dict[str, Any] = _own_attributes(run.system, run.integration, lasted)
    more["response_class"] = summary.response_class.label_of(2 if run.system.model.is_bistable else 1)
    more["status"] = f"{summary.status.name}: {summary.status.advice}"
    attrs = attributes_of("run of a struck bistable beam", run.system, run.integration, run.plan, more)
    attrs["gross_work"] = float(accumulators_of_runs["gross_work"][0])
    missed, scale = _energy_balance(accumulators_of_runs)
    attrs["energy_error"] = math.nan if summary.status in _UNBALANCED else missed / scale
    if run.accuracy is not None:
        attrs |= run.accuracy.attributes()
    return attrs


def tell_imbalance(run: Prepared, summary: RunSummary, accumulators_of_runs: Any) -> None:
    """Report an energy-balance error of a run that ended."""
    if summary.status in _UNBALANCED:
        return
    missed, scale = _energy_balance(accumulators_of_runs)
    rounding = float(rounding_energy(run.ensemble, accumulators_of_runs)[0])
    if abs(missed) > _ENERGY_ERROR * scale + rounding:
        tell(
            [
                Diagnostic(
                    "energy-balance",
                    f"the energy-balance error is {abs(missed / scale):.2g} of the gross work: the steps are too long; use "
                    "accuracy = 'reference', a tolerance, or a smaller step",
                    {"energy_error": missed / scale},
                )
            ]
        )


def _own_attributes(system: System, integration: Integration, lasted: float) -> dict[str, Any]:
    """Return the attributes of the drive, the striker and the duration."""
    striker = system.striker
    attrs: dict[str, Any] = {
        "cycles": round(lasted, 9),
        "engine": "python" if integration.engine == "python" else "native",
    }
    if striker is not None and striker.drive.harmonic:
        attrs |= {
            name: getattr(striker.drive, name)
            for name in ("frequency_ratio", "velocity_amplitude")
            if hasattr(striker.drive, name)
        }
    elif striker is not None and isinstance(striker.drive, RecordedMotion):
        attrs |= {
            "drive_type": "recorded_motion",
            "frequency_ratio": striker.drive.frequency / system.model.reference_frequency,
        }
    if striker is not None:
        attrs |= {"location": striker.location, "side": striker.side}
    attrs["early_termination"] = int(integration.early_termination)
    return attrs


def _energy_balance(accumulators_of_runs: Any) -> tuple[float, float]:
    """Return the energy-balance error of a recorded run at its end, J, and the gross work; (0, W) for exact steps.

    Without work the energies take its place.  The error is the external work minus the energy gain of beam, contact and
    circuit and the dissipated energy.
    """
    accumulators = accumulators_of_runs[0]
    with np.errstate(invalid="ignore"):  # a run that failed has no numbers
        given = sum((accumulators[name] for name in WORKS), start=accumulators["work"])
        missed = (
            given
            - (accumulators["energy"] - accumulators["first_energy"])
            - accumulators["dissipated"]
            - lost_in_circuits(accumulators_of_runs)[0]
        )
    scale = (
        float(accumulators["gross_work"])
        or float(abs(accumulators["first_energy"]) + abs(accumulators["energy"]))
        or 1.0
    )
    return float(missed), scale


def _regular_count(system: System, end: float, period: float) -> int:
    fastest = min(period, 1.0 / system.model.reference_frequency)
    count = end / fastest * _SAMPLES_PER_CYCLE
    if count > 1e9:
        raise InputError(f"a run of {count:.3g} samples is too long to record: give sample_times, or fewer cycles")
    return math.ceil(count) + 1


def least_file_size(system: System, integration: Integration, samples: int | None = None) -> float:
    """Estimated size in bytes of the file of a run, half of that of its numbers without compression.

    *samples* is the number of sample times, by default that of :func:`prepared`.
    """
    if samples is None:
        period = cycle_of(system)
        samples = _regular_count(system, integration.cycles_or_default * period, period)
    return 4.0 * samples * (2 * system.model.modes + 8)


def check_memory(system: System, samples: int, with_contacts: bool) -> None:
    """Refuse a run whose samples do not fit into the memory limit, before any step."""
    row = 8 * (4 * system.model.modes + 20)
    size = samples * row * (1.5 if with_contacts else 1.0)
    if size > MEMORY_LIMIT:
        raise InputError(
            f"{samples} samples of {system.model.modes} modes would take {size / 2**30:.1f} GiB, the limit is "
            f"{MEMORY_LIMIT / 2**30:.0f} GiB: give fewer sample_times or cycles, or use simulate_to_file (--stream)"
        )


def _checked_times(sample_times: ArrayLike, end: float, tick: float) -> _Array:
    """Sample times of a run, whose end is that of its cycles to a *tick* (s)."""
    times = finite_array("sample_times", sample_times, 1).copy()
    if times.size == 0:
        raise InputError("sample_times = []: must contain at least one time")
    if (np.diff(times) <= 0.0).any():
        raise InputError("sample_times: must be strictly increasing")
    if times[0] < 0.0 or times[-1] > end * (1.0 + 1e-9) + tick:
        raise InputError(f"sample_times from {times[0]:g} to {times[-1]:g} s: must lie within the run, 0 to {end:g} s")
    return times


def reached_by(recorded: Recorded, until: float) -> Recorded:
    """Return the samples up to the time that a run reached."""
    return recorded.at(recorded.times <= until)


def end_state(ensemble: Ensemble, recorded: Recorded, summary: RunSummary) -> State | None:
    """Return the state at the end of a run; None if the run failed."""
    if summary.status not in _ENDED:
        return None
    q, p, well_sign, contact_ticks = (each[:, 0] for each in recorded.last)
    return states_of(ensemble, q, p, well_sign, contact_ticks, recorded.accumulators_of_runs["time"])[0]


@overload
def simulate(
    system: System,
    integration: Integration | None = None,
    *,
    sample_times: ArrayLike | None = None,
    progress: Callable[[float], object] | bool | None = None,
) -> Run: ...


@overload
def simulate(
    system: Sequence[System],
    integration: Integration | None = None,
    *,
    sample_times: ArrayLike | None = None,
    progress: Callable[[int, int], object] | bool | None = None,
) -> list[Run]: ...


def simulate(
    system: System | Sequence[System],
    integration: Integration | None = None,
    *,
    sample_times: ArrayLike | None = None,
    progress: Any = None,
) -> Run | list[Run]:
    """Simulate one run and record its time series.

    By default the beam starts at rest, with the tip in contact, in the well that the striker pushes it out of (the
    lower one for a striker below, Eqs. 11-18). Without an excitation a cycle is a period of the first mode.

    Parameters
    ----------
    system : System, or a list of them
        System, or several, which all cores simulate in parallel.
    integration : Integration, optional
        Solver settings; always on the CPU.
    sample_times : array_like, optional
        Times to record, s, ascending, from 0 to the end of the run; by default 200 per cycle, and the ends of the first 96
        steps of each impact. Times that a run did not reach are NaN, with ``valid`` = 0.
    progress : callable, optional
        Called with the finished fraction of the run or, for several, as ``progress(done, total)``; True prints it.

    Returns
    -------
    Run, or a list of them

    Raises
    ------
    InputError
        If the sample times are not increasing within the run, or need more than 4 GiB. A run that fails numerically
        gives the reason in ``run.summary.status``.

    See Also
    --------
    snapbeam.simulate_to_file, snapbeam.advance, snapbeam.sweep

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> system = paper.struck_beam(frequency_ratio=1.2, velocity_amplitude=0.18)
    >>> run = sb.simulate(system, sb.Integration(cycles=20))
    >>> run.summary.response_class.label
    'continuous interwell'
    """
    if isinstance(system, (list, tuple)):
        return _several(system, integration, sample_times, progress)
    system, integration = checked_request(system, integration)
    report = sharing(progress, "run")
    run = prepared(system, integration, sample_times)
    times, ensemble = run.times, run.ensemble
    check_memory(system, run.samples, times is None)
    recorded = joined(list(engine_of(ensemble).record(ensemble, run.instants, times is None, report)))
    if report is not None:
        report(1.0)
    summary = RunSummary.from_statistics(statistics_of(ensemble, recorded.accumulators_of_runs))
    if times is None and summary.status != RunStatus.OK:
        recorded = reached_by(recorded, float(recorded.accumulators_of_runs["time"][0] * ensemble.runs["tick"][0]))
        if recorded.times.size == 0:
            times = np.zeros(1)  # the run failed before its first sample
    tell_imbalance(run, summary, recorded.accumulators_of_runs)
    created = {"created": created_now()}

    def tables() -> tuple[xr.Dataset, xr.Dataset]:
        attrs = run_attributes(run, summary, recorded.accumulators_of_runs) | created
        return (
            run_dataset(ensemble, system, recorded, times, run.period, attrs),
            impact_table(recorded.impacts, attrs),
        )

    return Run.of(
        tables,
        summary=summary,
        system=system,
        integration=integration,
        accuracy=run.accuracy,
        final_state=end_state(ensemble, recorded, summary),
    )


def _several(
    systems: Sequence[Any], integration: Integration | None, sample_times: ArrayLike | None, progress: Any
) -> list[Run]:
    """Simulate several systems on all cores; the core releases the interpreter lock."""
    report = counting(progress, "simulate", "runs")
    for at, system in enumerate(systems):
        if not isinstance(system, System):
            raise InputTypeError(f"system[{at}] = {shown(system)}: must be a System")
    checked = [checked_request(system, integration) for system in systems]
    threads = next((each.threads for _, each in checked), None) or usable_cores()
    with ThreadPoolExecutor(max_workers=max(1, min(threads, len(systems) or 1))) as pool:
        waiting = [pool.submit(simulate, system, each, sample_times=sample_times) for system, each in checked]
        try:
            for done, future in enumerate(as_completed(waiting), 1):
                future.result()
                if report is not None:
                    report(done, len(systems))
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return [future.result() for future in waiting]
