"""diffrax on the CPU, in double precision, compiled by XLA for one thread."""

from __future__ import annotations

import os
from functools import partial
from typing import Any

os.environ.setdefault("XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1")

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from benchmarks.cases import Case
from benchmarks.peers import Method, Solver
from benchmarks.peers.equations import equations_of

jax.config.update("jax_enable_x64", True)
jax.config.update("jax_platforms", "cpu")

__all__ = ["METHODS"]

_Array = NDArray[np.float64]


def _prepare(kind: Any, weight: float, case: Case, tolerance: float) -> Solver:
    e = equations_of(case)
    rate = weight * e.omega[0]
    even, odd = np.flatnonzero(e.parity < 0), np.flatnonzero(e.parity > 0)
    order = np.concatenate((odd, even))
    split, count = odd.size, order.size
    g_odd = jnp.asarray(e.tension[np.ix_(odd, odd)])
    g_even = jnp.asarray(e.tension[np.ix_(even, even)])
    g, contact, push, omega = (jnp.asarray(x[order]) for x in (e.g, e.contact, e.push, e.omega))
    damping = jnp.asarray((2.0 * e.damping_ratio * e.omega)[order])
    squared = omega * omega

    def slope(t: Any, u: Any, args: Any) -> Any:
        q, v = u[:count], u[count:]
        r = jnp.concatenate((g_odd @ q[:split], g_even @ q[split:]))
        gq, qr = g @ q, q @ r
        depth = jnp.maximum(e.amplitude * jnp.sin(e.drive * t) - contact @ q, 0.0)
        force = e.stiffness * depth * jnp.sqrt(depth)
        pull = force * push - squared * q - e.gamma * (qr * g + (2.0 * gq + qr) * r)
        return jnp.concatenate((rate * v, pull / rate - damping * v))

    term = diffrax.ODETerm(slope)
    start = jnp.zeros(2 * count)
    controller = diffrax.PIDController(rtol=tolerance, atol=tolerance)

    def solve(end: Any, times: Any) -> Any:
        save = diffrax.SaveAt(t1=True) if times is None else diffrax.SaveAt(ts=times)
        return diffrax.diffeqsolve(
            term,
            kind(),
            0.0,
            end,
            1e-6,
            start,
            saveat=save,
            stepsize_controller=controller,
            max_steps=None,
            adjoint=diffrax.ForwardMode(),
        ).ys

    sampled = jax.jit(lambda times: solve(times[-1], times))
    last = jax.jit(lambda end: solve(end, None))
    read_out = e.read_out[order]

    def sample(times: _Array) -> _Array:
        return np.asarray(sampled(jnp.asarray(times)))[:, :count] @ read_out

    def advance(end: float) -> None:
        last(end).block_until_ready()

    return Solver(sample, advance)


def _prepare_many(kind: Any, weight: float, cases: list[Case], tolerance: float) -> Solver:
    """All cases at once, by vmap: they differ in the drive alone."""
    every = [equations_of(case) for case in cases]
    e = every[0]
    rate = weight * e.omega[0]
    even, odd = np.flatnonzero(e.parity < 0), np.flatnonzero(e.parity > 0)
    order = np.concatenate((odd, even))
    split, count = odd.size, order.size
    g_odd = jnp.asarray(e.tension[np.ix_(odd, odd)])
    g_even = jnp.asarray(e.tension[np.ix_(even, even)])
    g, contact, push, omega = (jnp.asarray(x[order]) for x in (e.g, e.contact, e.push, e.omega))
    damping = jnp.asarray((2.0 * e.damping_ratio * e.omega)[order])
    squared = omega * omega

    def slope(t: Any, u: Any, args: Any) -> Any:
        amplitude, drive = args
        q, v = u[:count], u[count:]
        r = jnp.concatenate((g_odd @ q[:split], g_even @ q[split:]))
        gq, qr = g @ q, q @ r
        depth = jnp.maximum(amplitude * jnp.sin(drive * t) - contact @ q, 0.0)
        force = e.stiffness * depth * jnp.sqrt(depth)
        pull = force * push - squared * q - e.gamma * (qr * g + (2.0 * gq + qr) * r)
        return jnp.concatenate((rate * v, pull / rate - damping * v))

    def solve(end: Any, times: Any, amplitude: Any, drive: Any) -> Any:
        save = diffrax.SaveAt(t1=True) if times is None else diffrax.SaveAt(ts=times)
        return diffrax.diffeqsolve(
            diffrax.ODETerm(slope), kind(), 0.0, end, 1e-6, jnp.zeros(2 * count), args=(amplitude, drive),
            saveat=save, stepsize_controller=diffrax.PIDController(rtol=tolerance, atol=tolerance), max_steps=None,
            adjoint=diffrax.ForwardMode(),
        ).ys  # fmt: skip

    amplitudes, drives = (jnp.asarray([getattr(each, name) for each in every]) for name in ("amplitude", "drive"))
    sampled = jax.jit(jax.vmap(lambda times, a, w: solve(times[-1], times, a, w)))
    last = jax.jit(jax.vmap(lambda end, a, w: solve(end, None, a, w)))
    read_out = e.read_out[order]

    def sample(times: _Array) -> _Array:
        return np.asarray(sampled(jnp.asarray(times), amplitudes, drives))[..., :count] @ read_out

    def advance(ends: Any) -> None:
        last(jnp.asarray(ends), amplitudes, drives).block_until_ready()

    return Solver(sample, advance)


METHODS = (
    Method(
        "diffrax Tsit5", (1e-4, 1e-5, 1e-6, 1e-7, 1e-8), partial(_prepare, diffrax.Tsit5, 10.0), "vmap over the points",
        partial(_prepare_many, diffrax.Tsit5, 10.0),
    ),
    Method(
        "diffrax Dopri8", (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-10), partial(_prepare, diffrax.Dopri8, 10.0),
        "vmap over the points", partial(_prepare_many, diffrax.Dopri8, 10.0),
    ),
)  # fmt: skip
