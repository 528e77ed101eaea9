"""MuJoCo: one mass on a slide joint whose range limits are the stops.

MuJoCo's limit prescribes the acceleration -k r - b r' of the penetration r in place of all other forces (solreflimit =
(-k, -b), impedance at its largest, 0.9999).  That is the equation of a Kelvin-Voigt or linear contact without other
forces exactly, of an oscillator's linear stop with its own stiffness added to k, and Newton's law in the limit of k
without bound, where (k, b) with b = 2 z sqrt(k) has the restitution exp(-2 z acos(z)/sqrt(1 - z^2)).
"""

from __future__ import annotations

from collections.abc import Callable
from math import acos, exp, sin, sqrt
from typing import Any

import mujoco
import numpy as np
from scipy.optimize import brentq

from impact20 import Case
from impact20.runners import CannotRun, Result, has_restitution

PACKAGE = "mujoco"


def settings(case: Case) -> list[dict[str, Any]]:
    """Time steps of the Runge-Kutta integrator, with 40 steps in a stiff contact that stands for an impact."""
    sizes = (1e-3, 3e-4, 1e-4, 3e-5)
    found = [{"method": "RK4", "step": h} for h in sizes]
    return found + ([] if has_restitution(case) else [{"method": "implicitfast", "step": h} for h in sizes])


def _damping(e: float) -> float:
    """Damping ratio of a contact with the restitution e."""
    if e >= 1:
        return 0.0
    return float(brentq(lambda z: exp(-2 * z * acos(z) / sqrt(1 - z * z)) - e, 0.0, 1 - 1e-9))


def prepare(case: Case, setting: dict[str, Any]) -> Callable[[], Result]:
    """A solve of the case."""
    if len(case.stiffness) > 1 or case.coupling is not None or case.truss is not None or case.circuit is not None:
        raise CannotRun("modal, cubic and circuit terms are no rigid bodies")
    if case.stiffness[0] < 0 or case.pulse is not None:
        raise CannotRun("only passive springs and steady forces")
    if any(tip.amplitude for tip in case.tips):
        raise CannotRun("a joint limit does not move")
    law = case.tips[0].law
    if not (law in ("restitution", "kelvin_voigt") or (law == "power" and case.tips[0].exponent == 1.0)):
        raise CannotRun("soft contacts are linear: no Hertz or Hunt-Crossley law")
    h, tip = setting["step"], case.tips[0]
    if law == "restitution":
        k = (np.pi / (40 * h)) ** 2
        b = 2 * _damping(tip.coefficient) * sqrt(k)
    else:
        k, b = tip.stiffness + case.stiffness[0], tip.damping + case.damping[0]
    low = [each.gap for each in case.tips if each.row[0] > 0]
    high = [each.gap for each in case.tips if each.row[0] < 0]
    limits = f"{-low[0] if low else -1e3!r} {high[0] if high else 1e3!r}"
    model = mujoco.MjModel.from_xml_string(f"""
<mujoco><option timestep="{h!r}" integrator="{setting["method"]}" gravity="0 0 0" tolerance="1e-15"/>
<compiler autolimits="true"/>
<worldbody><body><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
<joint type="slide" axis="1 0 0" stiffness="{float(case.stiffness[0])!r}" damping="{float(case.damping[0])!r}" range="{limits}"
 solreflimit="{-float(k)!r} {-float(b)!r}" solimplimit="0.9999 0.9999 0.001"/></body></worldbody></mujoco>""")
    steady = float(case.load[0]) if case.load is not None else 0.0

    def solve() -> Result:
        data = mujoco.MjData(model)
        data.qpos[0], data.qvel[0] = case.start[0], case.speed[0]
        values, at, count = np.empty(case.samples), 0, 0
        while at < case.samples:
            data.qfrc_applied[0] = steady
            if case.harmonic is not None:
                data.qfrc_applied[0] += case.harmonic[0] * sin(case.frequency * (count + 0.5) * h + case.phase)
            before, speed = data.qpos[0], data.qvel[0]
            mujoco.mj_step(model, data)
            count += 1
            # The output between steps: the cubic through both ends.
            while at < case.samples and case.times[at] <= count * h:
                s = case.times[at] / h - (count - 1)
                q = s - 1
                x, v = data.qpos[0], data.qvel[0]
                values[at] = case.output[0] * (
                    (1 + 2 * s) * q * q * before + s * q * q * h * speed + s * s * (3 - 2 * s) * x + s * s * q * h * v
                )
                at += 1
        return Result(
            values, None, count * (4 if setting["method"] == "RK4" else 1), np.concatenate((data.qpos, data.qvel))
        )

    return solve
