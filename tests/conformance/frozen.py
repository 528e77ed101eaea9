"""Three hundred runs whose every number version 0.1 wrote down: what a rebuilding must not change.

``python tests/conformance/frozen.py FILE`` writes the answers of the package that is installed.
"""

from __future__ import annotations

import hashlib
import json
import math
import sys
from typing import Any
from unittest import mock

import numpy as np

import snapbeam as sb
from snapbeam.model import default_values

MODES = (1, 5, 20, 32)
EACH = {"plain": 35, "early": 15, "above": 5, "reference": 5, "recorded": 5}
RESTITUTIONS = 40


def cases() -> list[dict[str, Any]]:
    """What is asked of each run, plain numbers."""
    rng = np.random.default_rng(20240831)
    found: list[dict[str, Any]] = []
    for modes in MODES:
        for kind, count in EACH.items():
            for _ in range(count):
                found.append(
                    {
                        "modes": modes,
                        "kind": kind,
                        "frequency_ratio": float(rng.uniform(0.3, 4.0)),
                        "velocity_amplitude": float(rng.uniform(0.0, 0.65)),
                        "location": float(rng.uniform(0.1, 0.9)),
                        "cycles": int(rng.integers(4, 25)) if kind != "reference" else 3,
                    }
                )
    for _ in range(RESTITUTIONS):
        found.append(
            {
                "modes": 1,
                "kind": "restitution",
                "coefficient": float(rng.uniform(0.5, 1.0)),
                "frequency_ratio": float(rng.uniform(0.8, 4.0)),
                "velocity_amplitude": float(rng.uniform(0.05, 0.65)),
                "location": float(rng.uniform(0.25, 0.75)),
                "cycles": int(rng.integers(4, 12)),
            }
        )
    return found


def recorded(case: dict[str, Any], model: sb.ReducedModel) -> sb.Striker:
    """A start-up over three cycles to a sine of two harmonics, as a record would hold it."""
    freq = case["frequency_ratio"] * model.reference_frequency
    rate = 60.0 * freq
    t = np.arange(int(case["cycles"] * 60) + 1) / rate
    omega = 2.0 * np.pi * freq
    stroke = case["velocity_amplitude"] * model.length_scale * 2.0 * np.pi * model.reference_frequency / omega
    grown = np.minimum(t * freq / 3.0, 1.0)
    rise, slope = grown**2 * (3.0 - 2.0 * grown), 6.0 * grown * (1.0 - grown) * freq / 3.0
    wave = np.sin(omega * t) + 0.1 * np.sin(2.0 * omega * t)
    rate_of = omega * np.cos(omega * t) + 0.2 * omega * np.cos(2.0 * omega * t)
    return sb.Striker(
        drive=sb.RecordedMotion(
            displacement=stroke * rise * wave,
            velocity=stroke * (rise * rate_of + slope * wave),
            sampling_frequency=rate,
            frequency=freq,
        ),
        location=case["location"],
    )


def model_hash(model: sb.ReducedModel) -> str:
    """Of the model's numbers, which linear algebra may round otherwise on another processor."""
    digest = hashlib.sha256()
    for values in (model.mass, model.stiffness, model.omega, model.linear_modes, model.well_amplitude):
        digest.update(np.ascontiguousarray(values).tobytes())
    return digest.hexdigest()


def plan_0_1(
    model: sb.ReducedModel, contact: Any, *, step: float | None = None, accuracy: str = "standard"
) -> Any:
    """The steps of version 0.1, by the constants that it had for the paper's beam."""
    from snapbeam.solver.step_size import Plan

    fastest = float(model.omega.max())
    stretch = float(model.well_amplitude @ model.well_amplitude)
    detuning = float(
        model.nonlinear_stiffness * stretch * (np.diag(model.tension_matrix) / model.omega).max()
    )
    flight = impact = max(0.2 / fastest, 0.0248 / detuning)
    if not contact.impulsive:
        speed = 0.2 * model.length_scale * 2.0 * math.pi * model.reference_frequency
        impact = contact.impact_duration(model.lightest_contact_mass, speed) / 6.0
        flight = min(flight, impact * 32)
        impact = min(impact, math.pi / fastest)
    coarsest = max(0, math.ceil(math.log2(flight / impact)))
    order = 4 if accuracy == "standard" else 6
    if accuracy == "reference":
        flight /= 6.0
        while fastest * flight > 4.0:
            flight, coarsest = 0.5 * flight, max(0, coarsest - 1)
    return Plan(order, flight if step is None else step, coarsest, coarsest + {4: 2, 6: 6}[order])


def answer(case: dict[str, Any]) -> sb.Run:
    """The run of a case, with the steps of version 0.1."""
    with mock.patch("snapbeam.solver.assemble.choose_base_step", plan_0_1):
        return answer_with_own_steps(case)


def answer_with_own_steps(case: dict[str, Any]) -> sb.Run:
    """The run of a case, with the steps of the package."""
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=case["modes"])
    contact: Any = default_values.CONTACT
    drive: Any = sb.Shaker(
        frequency_ratio=case["frequency_ratio"],
        velocity_amplitude=case["velocity_amplitude"],
        location=case["location"],
        side="above" if case["kind"] == "above" else "below",
    )
    more: dict[str, Any] = {"cycles": case["cycles"]}
    if case["kind"] == "restitution":
        contact = sb.Restitution(case["coefficient"])
    elif case["kind"] == "recorded":
        drive, more = recorded(case, model), {}
    elif case["kind"] == "reference":
        more["accuracy"] = "reference"
    elif case["kind"] == "early":
        more["early_termination"] = True
    return sb.simulate(sb.System(model, contact, drive), sb.Integration(**more), sample_times=[0.0])


def numbers(run: sb.Run) -> dict[str, Any]:
    """Every statistic of a run to the last bit, and a hash of its table of impacts."""
    response = run.summary
    found: dict[str, Any] = {}
    for name in NAMES:
        value = getattr(response, name)
        found[name] = float(value).hex() if isinstance(value, float) else int(value)
    digest = hashlib.sha256()
    for name in ("onset", "duration", "peak_force", "impulse"):
        digest.update(np.ascontiguousarray(run.impacts[name].values).tobytes())
    found["impact_table"] = digest.hexdigest()[:16]
    found["gross_work"] = float(run.dataset.attrs["gross_work"]).hex()
    return found


NAMES = (
    "response_class", "status", "zero_crossings", "zero_crossings_last_quarter", "last_zero_crossing", "final_well", "final_well_proven",
    "min_displacement", "max_displacement", "min_midspan_displacement", "max_midspan_displacement", "peak_force",
    "impacts", "contact_time_fraction", "early_stop_time",
)  # fmt: skip


def main(path: str) -> None:
    """Write the answers."""
    runs = [numbers(answer(case)) for case in cases()]
    hashes = {str(n): model_hash(sb.ReducedModel.from_beam(default_values.BEAM, modes=n)) for n in MODES}
    with open(path, "w", encoding="utf-8") as stream:
        json.dump({"models": hashes, "runs": runs}, stream, indent=None, separators=(",", ":"))
        stream.write("\n")


if __name__ == "__main__":
    main(sys.argv[1])
