"""diffrax on the CPU in double precision, compiled by XLA for one thread; with root-finding events or through contacts."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

os.environ.setdefault("XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1")
os.environ.setdefault("JAX_PLATFORMS", "cpu")

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import optimistix

from impact20 import Array, Case
from impact20.runners import Result, has_restitution, tolerances
from impact20.runners.flat import initial_state
from impact20.runners.hybrid import Segment, drive, outputs

jax.config.update("jax_enable_x64", True)
PACKAGE = "diffrax"


def settings(case: Case) -> list[dict[str, Any]]:
    """Dopri8 with events where they are needed, Dopri8 and Tsit5 through the contacts elsewhere."""
    if has_restitution(case):
        return tolerances(case, "Dopri8", (1e-5, 1e-7, 1e-9, 1e-11), events=True)
    return [
        *tolerances(case, "Dopri8", (1e-4, 1e-6, 1e-8, 1e-10, 1e-12), events=False),
        *tolerances(case, "Tsit5", (1e-5, 1e-7, 1e-9), events=False),
    ]


def prepare(case: Case, setting: dict[str, Any]) -> Callable[[], Result]:
    """A solve of the case."""
    n, tolerance = len(case.stiffness), setting["tolerance"]
    as_array = {
        name: None if getattr(case, name) is None else jnp.asarray(getattr(case, name))
        for name in ("stiffness", "damping", "load", "harmonic", "pulse", "coupling", "gradient")
    }
    rows = [jnp.asarray(tip.row) for tip in case.tips]

    def contact(j: int, t: Any, u: Any) -> tuple[Any, Any]:
        tip = case.tips[j]
        angle = tip.frequency * t + tip.phase
        d = tip.amplitude * jnp.sin(angle) - tip.gap - rows[j] @ u[:n]
        return d, tip.amplitude * tip.frequency * jnp.cos(angle) - rows[j] @ u[n : 2 * n]

    def slope(t: Any, u: Any, args: Any) -> Any:
        del args
        x, v = u[:n], u[n : 2 * n]
        a = -as_array["stiffness"] * x - as_array["damping"] * v
        if as_array["coupling"] is not None:
            r = as_array["coupling"] @ x
            along = x @ r
            gx = 0.0
            if as_array["gradient"] is not None:
                gx = as_array["gradient"] @ x
                a = a - case.gamma * along * as_array["gradient"]
            a = a - case.gamma * (2.0 * gx + along) * r
        if case.load is not None:
            a = a + as_array["load"]
        if case.harmonic is not None:
            a = a + as_array["harmonic"] * jnp.sin(case.frequency * t + case.phase)
        if case.pulse is not None:
            shock = jnp.sin(jnp.pi * t / case.pulse_duration)
            a = a + as_array["pulse"] * jnp.where(t < case.pulse_duration, shock, 0.0)
        if case.truss is not None:
            a = a - case.truss[0] * x * (1.0 - case.truss[1] / jnp.sqrt(1.0 + x * x))
        if case.circuit is not None:
            a = a - case.circuit[0] * u[2 * n]
        for j, tip in enumerate(case.tips):
            if tip.law == "restitution":
                continue
            d, rate = contact(j, t, u)
            deep = jnp.maximum(d, 0.0)
            if tip.law == "kelvin_voigt":
                f = jnp.where(d > 0.0, jnp.maximum(tip.stiffness * d + tip.damping * rate, 0.0), 0.0)
            else:
                power = deep if tip.exponent == 1.0 else deep * jnp.sqrt(deep)
                f = jnp.maximum(tip.stiffness * power * (1.0 + tip.factor * rate), 0.0)
            a = a + f * rows[j]
        parts = [v, a]
        if case.circuit is not None:
            parts.append((case.circuit[0] * v[0] - case.circuit[1] * u[2 * n])[None])
        return jnp.concatenate(parts)

    term = diffrax.ODETerm(slope)
    method = {"Dopri8": diffrax.Dopri8, "Tsit5": diffrax.Tsit5}[setting["method"]]()
    if not setting["events"]:
        jumps = [case.pulse_duration] if case.pulse is not None else None
        inner = diffrax.PIDController(rtol=tolerance, atol=tolerance * 1e-1)
        controller = inner if jumps is None else diffrax.ClipStepSizeController(inner, jump_ts=jnp.asarray(jumps))
        times = jnp.asarray(np.concatenate((case.times, [])))

        @jax.jit
        def whole(start: Any) -> Any:
            found = diffrax.diffeqsolve(
                term, method, 0.0, case.horizon, 1e-4, start, saveat=diffrax.SaveAt(ts=times), max_steps=None,
                stepsize_controller=controller, adjoint=diffrax.ForwardMode(),
            )  # fmt: skip
            return found.ys, found.stats["num_steps"]

        start = jnp.asarray(initial_state(case))

        def solve() -> Result:
            states, steps = whole(start)
            stages = {"Dopri8": 13, "Tsit5": 6}[setting["method"]]
            array = np.asarray(states)
            return Result(outputs(case, array), None, stages * int(steps), array[-1])

        return solve

    longest = 1.0 / max([case.frequency, *[tip.frequency for tip in case.tips], 0.5])
    restart = diffrax.PIDController(rtol=tolerance, atol=tolerance * 1e-1, dtmax=longest)
    finder = optimistix.Bisection(1e-12, 1e-12, flip="detect")

    def outside(t: Any, y: Any, args: Any, **more: Any) -> Any:
        del args, more
        return -jnp.max(jnp.stack([contact(j, t, y)[0] for j in range(len(case.tips))]))

    event = diffrax.Event(outside, finder, False)

    def both(times: Any) -> Any:
        return diffrax.SaveAt(subs=[diffrax.SubSaveAt(ts=times), diffrax.SubSaveAt(t1=True)])

    @jax.jit
    def flight(t: Any, u: Any, end: Any, times: Any) -> Any:
        found = diffrax.diffeqsolve(
            term, method, t, end, 1e-4, u, saveat=both(times), max_steps=None,
            stepsize_controller=restart, event=event, adjoint=diffrax.ForwardMode(),
        )  # fmt: skip
        return (found.ts[1][0], found.ys[0], found.ys[1][0], found.event_mask)

    def segment(states: tuple[int, ...], pulse: bool, t: float, u: Array, end: float, times: Array) -> Segment:
        del states, pulse
        wanted = np.clip(case.times, t, end)
        at, found, last, hits = flight(t, jnp.asarray(u), end, jnp.asarray(wanted))
        at, array = float(at), np.asarray(found)
        depths = [float(contact(j, at, last)[0]) for j in range(len(case.tips))]
        hit = int(np.argmax(depths)) if bool(hits) else -1
        first = case.samples - np.count_nonzero(case.times >= (times[0] if times.size else np.inf))
        reached = int(np.count_nonzero(times <= at))
        return Segment(at, np.asarray(last), array[first : first + reached, :n] @ case.output, hit, 0)

    return lambda: drive(case, segment)
