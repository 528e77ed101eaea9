"""Operations on rows of modes, eight at a time: what the CPU engine's steps are made of.

Everything a march needs stands in one flat array, *memory*; a row is the index at which it begins, a
multiple of eight long, and holds the modes of one structure, each block of coupled modes padded with
zeros.  The tension matrix G is stored block by block in strips of sixteen (last: eight) rows, each strip
column by column, so that the product G q streams through it once.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from snapbeam.kernels.compile import compiled, inlined
from snapbeam.kernels.lanes import (
    WIDTH,
    fma,
    lanes_sum,
    load,
    splat,
    spread_at,
    store,
    vabs,
)
from snapbeam.kernels.physics import decay, mode_energy, rotate, rotation, sincos, tension_acceleration

__all__ = [
    "Layout",
    "acceleration_rows",
    "dot",
    "flow_coefficients",
    "flow_rows",
    "glide",
    "kick_and_flow",
    "kick_rows",
    "modal_energy",
    "signals",
    "speed_bound",
    "tension_rows",
]


class Layout(NamedTuple):
    """Where a structure's rows begin in memory, and the two numbers that are no rows."""

    size: int
    """Length of a row."""
    omega: int
    omega_squared: int
    omega_damped: int
    damping: int
    """zeta omega of each mode, 1/s."""
    g: int
    """V^T alpha_eq."""
    contact: int
    """V^T phi(x_s), with the sign of the shaker's side."""
    center: int
    """V^T phi(1/2), with the sign of the shaker's side."""
    shift: int
    """From the well the run begins in to the other, as q."""
    tension: int
    """G, packed in strips."""
    work: int
    """First of the rows that the march works in."""
    gamma: float
    """Tension stiffness, Eq. (15)."""
    stretch: float
    """Squared slopes of the beam in a well, alpha_eq . alpha_eq; 0 if there is one well only."""
    drive: int
    """Where a recorded drive begins: displacement and velocity of each sample in turn."""
    drive_samples: int
    """Samples of the recorded drive; 0: the drive is sinusoidal."""
    drive_interval: float
    """Seconds between samples."""


@inlined
def tension_rows(memory, blocks, layout, q, r):
    """r = G q; returns g.q and q.r.

    *blocks* holds, for each block, its first row, the row after its last, and its columns.
    """
    g, at = layout.g, layout.tension
    total_g, total_r = splat(0.0), splat(0.0)
    for block in range(0, blocks.size, 3):
        row, stop, columns = blocks[block], blocks[block + 1], blocks[block + 2]
        column = q + row
        last = column + columns
        while row + 2 * WIDTH <= stop:
            low0, high0, low1, high1 = splat(0.0), splat(0.0), splat(0.0), splat(0.0)
            low2, high2, low3, high3 = splat(0.0), splat(0.0), splat(0.0), splat(0.0)
            here = column
            while here < last:
                q0, q1 = spread_at(memory, here), spread_at(memory, here + 1)
                q2, q3 = spread_at(memory, here + 2), spread_at(memory, here + 3)
                low0 = fma(load(memory, at), q0, low0)
                high0 = fma(load(memory, at + WIDTH), q0, high0)
                low1 = fma(load(memory, at + 2 * WIDTH), q1, low1)
                high1 = fma(load(memory, at + 3 * WIDTH), q1, high1)
                low2 = fma(load(memory, at + 4 * WIDTH), q2, low2)
                high2 = fma(load(memory, at + 5 * WIDTH), q2, high2)
                low3 = fma(load(memory, at + 6 * WIDTH), q3, low3)
                high3 = fma(load(memory, at + 7 * WIDTH), q3, high3)
                at += 8 * WIDTH
                here += 4
            low, high = (low0 + low1) + (low2 + low3), (high0 + high1) + (high2 + high3)
            store(memory, r + row, low)
            store(memory, r + row + WIDTH, high)
            q_low, q_high = load(memory, q + row), load(memory, q + row + WIDTH)
            total_g = fma(load(memory, g + row), q_low, total_g)
            total_r = fma(low, q_low, total_r)
            total_g = fma(load(memory, g + row + WIDTH), q_high, total_g)
            total_r = fma(high, q_high, total_r)
            row += 2 * WIDTH
        if row < stop:
            even_sum, odd_sum = splat(0.0), splat(0.0)
            here = column
            while here < last:
                even_sum = fma(load(memory, at), spread_at(memory, here), even_sum)
                odd_sum = fma(load(memory, at + WIDTH), spread_at(memory, here + 1), odd_sum)
                at += 2 * WIDTH
                here += 2
            both = even_sum + odd_sum
            store(memory, r + row, both)
            q_row = load(memory, q + row)
            total_g = fma(load(memory, g + row), q_row, total_g)
            total_r = fma(both, q_row, total_r)
    return lanes_sum(total_g), lanes_sum(total_r)


@inlined
def dot(memory, size, a, b):
    """a.b over a row."""
    total = splat(0.0)
    for row in range(0, size, WIDTH):
        total = fma(load(memory, a + row), load(memory, b + row), total)
    return lanes_sum(total)


@inlined
def acceleration_rows(memory, layout, along_g, along_r, r, k):
    """k = the modal acceleration by the change of tension."""
    for row in range(0, layout.size, WIDTH):
        g_row = load(memory, layout.g + row)
        store(memory, k + row, tension_acceleration(along_g, along_r, g_row, load(memory, r + row)))


@inlined
def kick_rows(memory, layout, weight, k, force, p_from, p_to):
    """p_to = p_from + weight (k + c force), c the contact's row."""
    for row in range(0, layout.size, WIDTH):
        total = fma(force, load(memory, layout.contact + row), load(memory, k + row))
        store(memory, p_to + row, fma(weight, total, load(memory, p_from + row)))


@inlined
def kick_and_flow(memory, layout, flow, weight, along_g, along_r, r, force, q, p):
    """In place: p += weight (tension + c force), then one flow of every linear mode."""
    size = layout.size
    for row in range(0, size, WIDTH):
        k = tension_acceleration(along_g, along_r, load(memory, layout.g + row), load(memory, r + row))
        k = fma(force, load(memory, layout.contact + row), k)
        kicked = fma(weight, k, load(memory, p + row))
        q_row, at = load(memory, q + row), flow + row
        store(memory, q + row, rotate(load(memory, at), load(memory, at + size), q_row, kicked))
        at += 2 * size
        store(memory, p + row, rotate(load(memory, at), load(memory, at + size), q_row, kicked))


@inlined
def flow_rows(memory, size, flow, q_from, p_from, q_to, p_to):
    """One flow of every linear mode."""
    for row in range(0, size, WIDTH):
        q_row, p_row, at = load(memory, q_from + row), load(memory, p_from + row), flow + row
        store(memory, q_to + row, rotate(load(memory, at), load(memory, at + size), q_row, p_row))
        at += 2 * size
        store(memory, p_to + row, rotate(load(memory, at), load(memory, at + size), q_row, p_row))


@inlined
def modal_energy(memory, layout, q, p):
    """Quadratic part of the energy, the sum of (p^2 + omega^2 q^2)/2."""
    total = splat(0.0)
    for row in range(0, layout.size, WIDTH):
        omega = load(memory, layout.omega + row)
        total = total + mode_energy(omega, load(memory, q + row), load(memory, p + row))
    return lanes_sum(total)


@inlined
def speed_bound(memory, layout, c, q, p):
    """A speed that c.q cannot exceed by the linear flow alone: sum |c_j| (|p_j| + |omega_j q_j|)."""
    total = splat(0.0)
    for row in range(0, layout.size, WIDTH):
        oq = load(memory, layout.omega + row) * load(memory, q + row)
        total = fma(vabs(load(memory, c + row)), vabs(load(memory, p + row)) + vabs(oq), total)
    return lanes_sum(total)


@inlined
def signals(memory, layout, q, p):
    """Displacement of the contact point and of the centre from rest and their rates: c.q, c.p, e.q, e.p."""
    cq, cp, eq, ep = splat(0.0), splat(0.0), splat(0.0), splat(0.0)
    for row in range(0, layout.size, WIDTH):
        q_row, p_row = load(memory, q + row), load(memory, p + row)
        c_row, e_row = load(memory, layout.contact + row), load(memory, layout.center + row)
        cq, cp = fma(c_row, q_row, cq), fma(c_row, p_row, cp)
        eq, ep = fma(e_row, q_row, eq), fma(e_row, p_row, ep)
    return lanes_sum(cq), lanes_sum(cp), lanes_sum(eq), lanes_sum(ep)


@inlined
def glide(memory, layout, flow, weight0, k0, weight1, k1, q, p):
    """In place: p += weight0 k0 + weight1 k1, then one flow; returns the signals, as :func:`signals`."""
    size = layout.size
    cq, cp, eq, ep = splat(0.0), splat(0.0), splat(0.0), splat(0.0)
    for row in range(0, size, WIDTH):
        kicked = fma(weight1, load(memory, k1 + row), load(memory, p + row))
        kicked = fma(weight0, load(memory, k0 + row), kicked)
        old, at = load(memory, q + row), flow + row
        q_row = rotate(load(memory, at), load(memory, at + size), old, kicked)
        at += 2 * size
        p_row = rotate(load(memory, at), load(memory, at + size), old, kicked)
        store(memory, q + row, q_row)
        store(memory, p + row, p_row)
        c_row, e_row = load(memory, layout.contact + row), load(memory, layout.center + row)
        cq, cp = fma(c_row, q_row, cq), fma(c_row, p_row, cp)
        eq, ep = fma(e_row, q_row, eq), fma(e_row, p_row, ep)
    return lanes_sum(cq), lanes_sum(cp), lanes_sum(eq), lanes_sum(ep)


@compiled
def flow_coefficients(memory, layout, length, at):
    """Rows a11, a12, a21, a22 of the exact flow over *length* seconds, written from *at* on."""
    size = layout.size
    gentle = True
    for j in range(size):
        if memory[layout.damping + j] * abs(length) > 4.0 or memory[layout.omega_damped + j] == 0.0:
            gentle = False
    if gentle:
        for row in range(0, size, WIDTH):
            damped, sigma = load(memory, layout.omega_damped + row), load(memory, layout.damping + row)
            squared = load(memory, layout.omega_squared + row)
            sine, cosine = sincos(damped * length)
            a11, a12, a21, a22 = rotation(sigma, squared, cosine, sine / damped, decay(sigma * length))
            store(memory, at + row, a11)
            store(memory, at + size + row, a12)
            store(memory, at + 2 * size + row, a21)
            store(memory, at + 3 * size + row, a22)
        return
    for j in range(size):
        damped, sigma = memory[layout.omega_damped + j], memory[layout.damping + j]
        sine, cosine = sincos(damped * length)
        over = sine / damped if damped > 0.0 else length
        squared = memory[layout.omega_squared + j]
        a11, a12, a21, a22 = rotation(sigma, squared, cosine, over, math.exp(-sigma * length))
        memory[at + j] = a11
        memory[at + size + j] = a12
        memory[at + 2 * size + j] = a21
        memory[at + 3 * size + j] = a22
