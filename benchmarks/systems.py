"""Cost of each extended model: a run and a step over those of the paper's model, which is timed before and after."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

import snapbeam as sb
from benchmarks.report import save, table
from benchmarks.timing import measure
from snapbeam.model import default_values
from snapbeam.solver import native
from snapbeam.solver.assemble import make_ensemble
from snapbeam.solver.ensemble import Ensemble

__all__ = ["MODELS", "run"]

_SEED = 20240118
_MODES = 8
SINE = sb.Sine(frequency_ratio=1.0, velocity_amplitude=0.2)
PIEZO = sb.PiezoelectricHarvester.from_material(  # PZT-5H
    stress_constant=-16.6, permittivity=25.55e-9, layer_thickness=0.1e-3, layer_width=default_values.BEAM.width,
    beam=default_values.BEAM, resistance=1e4, patch_end=0.25, wiring="parallel",
)  # fmt: skip
COIL = sb.ElectromagneticHarvester(force_factor=1.5, resistance=30.0, coil_resistance=10.0, location=0.4)
Parts = Mapping[str, Any]


def _model(beam: sb.Beam = default_values.BEAM, imperfection: sb.Imperfection | None = None) -> sb.ReducedModel:
    return sb.ReducedModel.from_beam(beam, modes=_MODES, imperfection=imperfection)


def _system(parts: Parts) -> sb.System:
    """The paper's, but for what is given."""
    own = dict(parts)
    model = _model(own.pop("beam", default_values.BEAM), own.pop("imperfection", None))
    drive, law = own.pop("drive", SINE), own.pop("law", default_values.CONTACT)
    strikers = [sb.Striker(**({"drive": drive} | each)) for each in own.pop("strikers", [{}])]
    return sb.System(model, contacts=[sb.Contact(law, striker) for striker in strikers], **own)


MODELS: dict[str, Parts] = {
    "`power`": {"law": sb.PowerLaw.from_stiffness(4e11, 2.0)},
    "`hunt_crossley`": {"law": sb.HuntCrossley.from_restitution(4e8, 0.6, 0.05)},
    "`kelvin_voigt`": {"law": sb.KelvinVoigt(2e6, 20.0)},
    "a gap": {"strikers": [{"gap": 4e-5}]},
    "`burst`": {"drive": sb.Burst(frequency_ratio=1.0, velocity_amplitude=0.2, duration_cycles=1e6, ramp_up_cycles=2.0, ramp_down_cycles=1.0)},
    "`chirp`": {"drive": sb.Chirp(start_ratio=0.5, stop_ratio=3.0, velocity_amplitude=0.2, sweep_cycles=40.0)},
    "`sine+sine`": {
        "drive": sb.Sine(frequency_ratio=1.0, velocity_amplitude=0.2) + sb.Sine(frequency_ratio=2.0, velocity_amplitude=0.1)
    },
    "`band_limited_noise`": {"drive": sb.BandLimitedNoise(low_ratio=0.5, high_ratio=2.0, velocity_rms=0.2)},
    "a body of 20 g": {"strikers": [{"mass": 0.02, "suspension_stiffness": 700.0, "suspension_damping": 0.7}]},
    "a stop above, too": {"strikers": [{}, {"drive": sb.FixedStop(), "location": 0.3, "side": "above", "gap": 4e-5}]},
    "unequal wells": {"imperfection": sb.Imperfection(midspan_amplitude=4e-6)},
    "other ends": {"beam": default_values.BEAM.replace(boundary=sb.BoundaryConditions(left_rotational_stiffness=40.0, right_rotational_stiffness=40.0))},
    "a moving base": {
        "base_excitation": sb.BaseExcitation(motion=sb.AccelerationSine(frequency_ratio=0.9, acceleration_amplitude=0.1))
    },
    "a changing load": {"axial_load": sb.AxialLoadModulation(motion=sb.HarmonicForce(frequency_ratio=2.0, amplitude=3.0))},
    "a piezo": {"harvesters": [PIEZO]},
    "a coil": {"harvesters": [COIL]},
    "a coil and a piezo": {"harvesters": [COIL, PIEZO]},
    "an external force": {
        "forces": [sb.ExternalForce(history=sb.HarmonicForce(frequency_ratio=0.9, amplitude=0.02), location=0.4)]
    },
    "a local force with damping": {"forces": [sb.QuadraticDamping(coefficient=0.3, location=0.4)]},
}  # fmt: skip
"""What differs from the paper's system."""


def _ensemble(parts: Parts, size: int, cycles: int) -> Ensemble:
    """Runs at random velocities, and at random frequencies where the drive has one."""
    random = np.random.default_rng(_SEED)
    ratio, velocity = random.uniform(0.3, 3.5, size), random.uniform(0.05, 0.6, size)
    system = _system(parts)
    assert system.striker is not None
    known = system.striker.drive.values()
    drawn = {"frequency_ratio": ratio, "velocity_amplitude": velocity, "velocity_rms": 0.5 * velocity}
    drawn |= {f"{name}_1": values for name, values in drawn.items()}  # tones of a sum
    drawn |= {"frequency_ratio_2": 2.0 * ratio, "velocity_amplitude_2": 0.5 * velocity}
    columns = {f"drive.{name}": drawn[name] for name in known if name in drawn}
    return make_ensemble(system, sb.Integration(cycles=cycles), columns)


def _time(ensemble: Ensemble, repeats: int) -> tuple[float, float]:
    """Seconds of simulated time cost, per simulated second and per step."""
    integrate: Callable[[], Any] = lambda: native.run_ensemble(ensemble, 1)  # noqa: E731
    seconds = measure(integrate, repeats).seconds
    accumulators_of_runs = integrate()
    simulated = float(np.sum(ensemble.runs["tick"] * ensemble.runs["end"]))
    return seconds / simulated, seconds / float(accumulators_of_runs["steps"].sum())


def run(folder: Path, quick: bool) -> None:
    """Measure and write ``systems``."""
    size, cycles, repeats = (4, 4, 1) if quick else (48, 60, 7)
    plain = _ensemble({}, size, cycles)
    records: list[dict[str, Any]] = []
    before = _time(plain, repeats)
    for name, parts in MODELS.items():
        own = _time(_ensemble(parts, size, cycles), repeats)
        after = _time(plain, repeats)
        base = [0.5 * (before[i] + after[i]) for i in range(2)]
        drift = abs(after[0] / before[0] - 1.0)
        records.append({"model": name, "time": own[0] / base[0], "step": own[1] / base[1], "drift": drift})
        before = after
    rows = [[r["model"], f"{r['time']:.2f}", f"{r['step']:.2f}", f"{100.0 * r['drift']:.0f} %"] for r in records]
    head = (
        "model",
        "time per simulated second over the paper's",
        "time per step over the paper's",
        "the paper's, after over before",
    )
    data = {"modes": _MODES, "runs": size, "cycles": cycles, "seed": _SEED, "records": records}
    save(folder, "systems", quick, data, table(head, rows))
