"""snapbeam: the case as a model given by matrices.

The model is assembled before the clock starts, as the equations of the other solvers are; what is timed is the integration with its
statistics, the records at the output times and what is made of them.  Many runs are one ensemble.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import snapbeam as sb
from impact20 import Array, Case, Tip
from impact20.runners import CannotRun, Result
from snapbeam.simulation.dataset import joined
from snapbeam.simulation.request import cycle_of
from snapbeam.simulation.simulate import prepared
from snapbeam.solver.assemble import make_ensemble, run_columns
from snapbeam.solver.native import integrate_with_output_states, pieces, recorder_of

PACKAGE = "snapbeam"
_MANY: dict[tuple[Any, ...], Any] = {}
"""What ensembles are assembled from, by case and setting: only amplitudes differ."""


def settings(case: Case) -> list[dict[str, Any]]:
    """Both levels, and steps of the default's halves; `step` is a share of the default."""
    del case
    found: list[dict[str, Any]] = [{"method": "standard", "step": 1.0 / 2**i} for i in range(0, 8)]
    return [*found, {"method": "reference", "step": 1.0}]


@dataclass(frozen=True, kw_only=True)
class Truss(sb.LocalForce):
    """Two bars of rest length l and half span 1: -k u (1 - l/sqrt(1 + u^2))."""

    bar_stiffness: float = sb.quantity("N/m", "stiffness of the bars")
    rest_length: float = sb.quantity("m", "rest length of a bar")
    name = "truss"

    @staticmethod
    def force(law: Any, displacement: Any) -> Any:
        """Force of the bars."""
        return -law.bar_stiffness * displacement * (1.0 - law.rest_length / math.sqrt(1.0 + displacement**2))

    @staticmethod
    def energy(law: Any, displacement: Any) -> Any:
        """Energy of the bars."""
        return law.bar_stiffness * (0.5 * displacement**2 - law.rest_length * math.sqrt(1.0 + displacement**2))


def _law(tip: Tip) -> Any:
    if tip.law == "restitution":
        return sb.Restitution(tip.coefficient)
    if tip.law == "kelvin_voigt":
        return sb.KelvinVoigt(tip.stiffness, tip.damping)
    if tip.law == "hunt_crossley":
        return sb.HuntCrossley(tip.stiffness, tip.factor)
    if tip.exponent == 1.0:
        return sb.KelvinVoigt(tip.stiffness, 0.0)
    return sb.HertzContact(tip.stiffness)


def _model(case: Case) -> tuple[Any, Array]:
    """The reduced model, and the point of its coordinates that is the origin of the case's."""
    n = len(case.stiffness)
    stiffness = np.diag(case.stiffness)
    more: dict[str, Any] = {}
    origin = np.zeros(n)
    hessian = stiffness
    well = None
    if case.coupling is not None:
        more = {"nonlinear_stiffness": case.gamma, "elongation_matrix": case.coupling}
        if case.gradient is not None:
            # alpha = x0 + x with G x0 = g: K = W - gamma (x0 . g) G - 2 gamma g g^T.
            origin = np.linalg.solve(case.coupling, case.gradient)
            well = origin
            outer = np.outer(case.gradient, case.gradient)
            stiffness = stiffness - case.gamma * (origin @ case.gradient * case.coupling + 2 * outer)
        elif case.stiffness[0] < 0:
            # A pair of wells at +-sqrt(-k/gamma) of the first coordinate; the run begins in that of its start.
            well = np.zeros(n)
            well[0] = math.copysign(math.sqrt(-case.stiffness[0] / case.gamma), case.start[0])
            hessian = stiffness.copy()
            hessian[0, 0] = -2 * case.stiffness[0]
    if well is not None:
        more["well_amplitude"] = well
    omega = np.sqrt(np.maximum(np.diag(hessian), 0.0))
    if np.any((omega == 0) & (case.damping > 0)):
        more["damping"] = np.diag(case.damping)
    else:
        ratio = np.where(omega > 0, case.damping / (2 * np.where(omega > 0, omega, 1.0)), 0.0)
        more["damping_ratio"] = ratio[np.argsort(omega, kind="stable")]
    if case.circuit is not None:
        more["patch_shape"] = np.ones(1)
    row = case.tips[0].row
    # the well of a model is the lower one: a tip that it moves up to is a tip from above
    row = -row if well is not None and row @ well > 0.0 else row
    model = sb.ReducedModel.from_matrices(
        np.eye(n), stiffness, contact_shape=row, length_scale=1.0, reference_frequency=1 / (2 * math.pi), **more
    )
    return model, origin


def _system(case: Case) -> tuple[Any, Array]:
    model, origin = _model(case)
    row = model.contact_shape
    strikers = []
    for tip in case.tips:
        side = "below" if np.allclose(tip.row, row) else "above"
        if side == "above" and not np.allclose(tip.row, -row):
            raise CannotRun("contacts at several places of a model given by matrices")
        move = sb.DisplacementSine(frequency_ratio=tip.frequency, displacement_amplitude=tip.amplitude, phase=tip.phase) if tip.amplitude else sb.FixedStop()  # fmt: skip
        strikers.append((_law(tip), sb.Striker(drive=move, side=side), tip))
    forces = []
    if case.load is not None:
        forces.append(sb.ExternalForce(history=sb.ConstantForce(force=1.0), shape=case.load))
    if case.harmonic is not None:
        history = sb.HarmonicForce(frequency_ratio=case.frequency, amplitude=1.0, phase=case.phase)
        forces.append(sb.ExternalForce(history=history, shape=case.harmonic))
    if case.pulse is not None:
        history = sb.model.HalfSineForce(peak=1.0, duration=case.pulse_duration / (2 * math.pi))
        forces.append(sb.ExternalForce(history=history, shape=case.pulse))
    if case.truss is not None:
        forces.append(Truss(bar_stiffness=case.truss[0], rest_length=case.truss[1]))
    circuits = []
    if case.circuit is not None:
        circuits.append(sb.PiezoelectricHarvester(moment_per_volt=case.circuit[0], capacitance=1.0, resistance=1 / case.circuit[1], patch_start=0.0, patch_end=0.5))  # fmt: skip
    start = sb.State(amplitude=origin + case.start, velocity=case.speed)

    def at_rest(rest: Array) -> sb.System:
        contacts = [
            sb.Contact(law, replace(striker, gap=tip.gap + float(tip.row @ (rest - origin))))
            for law, striker, tip in strikers
        ]
        return sb.System(model, contacts=contacts, forces=forces, harvesters=circuits, initial_state=start)

    # gaps are counted from the beam at rest
    return at_rest(at_rest(origin).rest_state.amplitude), origin


def _prepared(case: Case, setting: dict[str, Any]) -> Any:
    """The run of a case, assembled, and the origin of its coordinates."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            system, origin = _system(case)
            cycle = cycle_of(system)
            cycles = max(1, math.ceil(case.horizon / cycle + 1e-9))
            accuracy = "reference" if setting["method"] == "reference" else "standard"
            integration = sb.Integration(cycles=cycles, threads=1, accuracy=accuracy)
            run = prepared(system, integration, np.minimum(case.times, cycles * cycle))
            if setting["step"] != 1.0:
                run = prepared(system, integration.replace(step=run.plan.step * setting["step"]), run.times)
            return run, origin
        except sb.InputError as refusal:
            raise CannotRun(str(refusal).splitlines()[0]) from None


def prepare(case: Case, setting: dict[str, Any]) -> Callable[[], Result]:
    """A solve of the case."""
    run, origin = _prepared(case, setting)
    prepared_run = recorder_of(run.ensemble, run.times, False)

    def solve() -> Result:
        found = joined(list(pieces(*prepared_run)))
        status = int(found.accumulators_of_runs["status"][0])
        if status:
            raise CannotRun(f"status {status}")
        # the run goes on to a whole cycle: only impacts up to the horizon count
        onsets = found.impacts[:, 0]
        values = (run.ensemble.structure.amplitudes(found.q) - origin) @ case.output
        return Result(values, int(np.count_nonzero(onsets <= case.horizon)), None, None)

    return solve


def solve_many(cases: Sequence[Case], setting: dict[str, Any]) -> list[Array]:
    """Outputs of cases that differ in the amplitude of the first tip, as one ensemble."""
    case = cases[0]
    known = case.name, case.horizon, *setting.values()
    if known not in _MANY:
        _MANY[known] = _prepared(case, setting)
    run, origin = _MANY[known]
    columns = {"drive.displacement_amplitude": np.array([each.tips[0].amplitude for each in cases])}
    ensemble = make_ensemble(run.system, run.integration, run_columns(run.system, columns), plan=run.plan)
    table = ensemble.runs
    table["output_interval"] = np.rint(case.horizon / case.samples / table["tick"])
    table["end"] = case.samples * table["output_interval"]
    found = integrate_with_output_states(ensemble, 1)
    far = (found.well_sign < 0.0)[..., None]
    first = np.where(far, found.q + ensemble.structure.shift, found.q)
    return list((ensemble.structure.amplitudes(first) - origin) @ case.output)
