"""snapbeam: the case as a model given by matrices, through `simulate`.

The library has no switch for a plain run without its statistics and its dataset; both are in the cost.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

import snapbeam as sb
from impact20 import Array, Case, Tip
from impact20.runners import CannotRun, Result
from snapbeam.simulation.request import cycle_of

PACKAGE = "snapbeam"


def settings(case: Case) -> list[dict[str, Any]]:
    """Both levels, and steps of the default's halves; `step` is a share of the default."""
    del case
    found: list[dict[str, Any]] = [{"method": "standard", "step": 1.0 / 2**i} for i in range(0, 8)]
    return [*found, {"method": "reference", "step": 1.0}]


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
    squares = np.diag(hessian)
    omega = np.sqrt(np.maximum(squares, 0.0))
    order = np.argsort(omega, kind="stable")
    if np.any((omega == 0) & (case.damping > 0)):
        raise CannotRun("a damped free mass is left out")
    ratio = np.where(omega > 0, case.damping / (2 * np.where(omega > 0, omega, 1.0)), 0.0)[order]
    if case.circuit is not None:
        more["patch_shape"] = np.ones(1)
    model = sb.ReducedModel.from_matrices(
        np.eye(n), stiffness, contact_shape=case.tips[0].row, damping_ratio=ratio, length_scale=1.0,
        reference_frequency=1 / (2 * math.pi), **more,
    )  # fmt: skip
    return model, origin


def _system(case: Case) -> tuple[Any, Array]:
    if case.truss is not None:
        raise CannotRun("the force of the truss's bars is no built-in law")
    if case.pulse is not None:
        raise CannotRun("a half-sine force is no built-in history; a record would interpolate it")
    model, origin = _model(case)
    row = case.tips[0].row
    contacts = []
    for tip in case.tips:
        side = "below" if np.allclose(tip.row, row) else "above"
        if side == "above" and not np.allclose(tip.row, -row):
            raise CannotRun("contacts at several places of a model given by matrices")
        move = sb.DisplacementSine(frequency_ratio=tip.frequency, displacement_amplitude=tip.amplitude, phase=tip.phase) if tip.amplitude else sb.FixedStop()  # fmt: skip
        rest = model.well_amplitude
        # The gap is counted from the beam at rest in the well of the start.
        sign = 1.0 if side == "below" else -1.0
        gap = tip.gap + sign * float(row @ (rest - origin))
        contacts.append(sb.Contact(_law(tip), sb.Striker(drive=move, side=side, gap=gap)))
    forces = []
    if case.load is not None:
        forces.append(sb.ExternalForce(history=sb.ConstantForce(force=1.0), shape=case.load))
    if case.harmonic is not None:
        history = sb.HarmonicForce(frequency_ratio=case.frequency, amplitude=1.0, phase=case.phase)
        forces.append(sb.ExternalForce(history=history, shape=case.harmonic))
    circuits = []
    if case.circuit is not None:
        circuits.append(sb.PiezoelectricHarvester(moment_per_volt=case.circuit[0], capacitance=1.0, resistance=1 / case.circuit[1], patch_start=0.0, patch_end=0.5))  # fmt: skip
    start = sb.State(amplitude=origin + case.start, velocity=case.speed)
    return sb.System(model, contacts=contacts, forces=forces, harvesters=circuits, initial_state=start), origin  # fmt: skip


def prepare(case: Case, setting: dict[str, Any]) -> Callable[[], Result]:
    """A solve of the case."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            system, origin = _system(case)
            cycle = cycle_of(system)
            cycles = max(1, math.ceil(case.horizon / cycle + 1e-9))
            integration = sb.Integration(cycles=cycles, threads=1, accuracy="reference" if setting["method"] == "reference" else "standard")  # fmt: skip
            if setting["step"] != 1.0:
                plain = sb.simulate(system, sb.Integration(cycles=1, threads=1), sample_times=[0.0])
                integration = integration.replace(step=float(plain.dataset.attrs["step"]) * setting["step"])
            sb.simulate(system, integration, sample_times=[0.0])
        except sb.InputError as refusal:
            raise CannotRun(str(refusal).splitlines()[0]) from None
    times = np.minimum(case.times, cycles * cycle)

    def solve() -> Result:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            run = sb.simulate(system, integration, sample_times=times)
        if not run.summary.status.name == "OK":
            raise CannotRun(f"status {run.summary.status.name}")
        alpha = run.dataset["modal_amplitude"].values
        values = (alpha - origin) @ case.output
        # The run goes on to a whole cycle: only impacts up to the horizon count.
        onsets = run.impacts["onset"].values
        return Result(values, int(np.count_nonzero(onsets <= case.horizon)), None, None)

    return solve
