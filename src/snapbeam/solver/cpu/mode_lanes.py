"""Operations on rows of modes, eight at a time: what the CPU engine's steps are made of.

Everything that a kernel needs is in one flat array, *memory*; a row is the index at which it begins, a
multiple of eight long, and holds the modes of one structure, each block of coupled modes padded with
zeros.  The tension matrix G is stored block by block in strips of sixteen (last: eight) rows, each strip
column by column, so that the product G q streams through it once.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from snapbeam.solver.compilation import called, inlined
from snapbeam.solver.physics import (
    decay_less_one,
    mode_energy,
    mode_power,
    rotation,
    sincos_cosm1,
    tension_acceleration,
    turned,
)
from snapbeam.solver.simd import WIDTH, broadcast_load, dot, fma, lanes_sum, load, splat, store
from snapbeam.solver.step import flow_mode, kick_mode
from snapbeam.solver.step_control import TRUST
from snapbeam.solver.terms.interface import (
    acceleration_about_nearest_well,
    add_acceleration,
    add_circuit_energy,
    add_to_speed_bound,
    bounds_by_energy,
    enter_flow,
    speed_bound,
)

WORK_ROWS = 11
"""Working rows of a run: q, p, k at both ends of a step and of a trial step inside it, G q, and the acceleration of a kick."""


class Layout(NamedTuple):
    """Memory offsets of the rows of a structure, and its two scalars."""

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
    high: int
    """1 for a mode above the frequency from which energy counts as high, 0 for the others."""
    tension: int
    """G, packed in strips."""
    work: int
    """First of the rows that the integration works in."""
    gamma: float
    """Tension stiffness, Eq. (15)."""
    stretch: float
    """Squared slopes of the beam in a well, alpha_eq . alpha_eq; 0 if there is one well only."""
    gentle: float
    """Longest flow, s, that polynomials serve; 0 if there is an overdamped or a still mode."""
    terms: Any
    """The terms of the structure, a tuple (:mod:`snapbeam.solver.terms`)."""
    indentation: Any
    """Row element with the residual indentation of the first contact; None without one."""
    others: Any
    """Further strikers (:class:`~snapbeam.solver.cpu.terms.further_contacts.FurtherContacts`); None without any."""
    body: Any
    """Element of a row that holds the mode of the first striker; None if it has no mass."""
    bodies: Any
    """Bodies of all strikers with mass, a tuple; None without any."""
    velocity_block: Any
    """Velocity-dependent forces (:class:`~snapbeam.solver.cpu.terms.velocity_block.VelocityBlock`); None without any."""


@inlined
def _rows_of_product(memory, at, stride, step, q, columns):
    """Sum over the columns *step* apart, and their right neighbours, of eight rows of G times q."""
    even, odd = splat(0.0), splat(0.0)
    last = q + columns
    while q < last:
        even = fma(load(memory, at), broadcast_load(memory, q), even)
        odd = fma(load(memory, at + stride), broadcast_load(memory, q + 1), odd)
        at += step * stride
        q += step
    return even + odd


@inlined
def _rows_of_two_products(memory, at, stride, step, a, b, columns):
    """:func:`_rows_of_product` of two states, with G read only once."""
    even_a, odd_a, even_b, odd_b = splat(0.0), splat(0.0), splat(0.0), splat(0.0)
    last = a + columns
    while a < last:
        even, odd = load(memory, at), load(memory, at + stride)
        even_a = fma(even, broadcast_load(memory, a), even_a)
        even_b = fma(even, broadcast_load(memory, b), even_b)
        odd_a = fma(odd, broadcast_load(memory, a + 1), odd_a)
        odd_b = fma(odd, broadcast_load(memory, b + 1), odd_b)
        at += step * stride
        a += step
        b += step
    return even_a + odd_a, even_b + odd_b


@inlined
def _products_of_rows(memory, size, g, q, r):
    """g.q and q.r."""
    along_g, along_r = splat(0.0), splat(0.0)
    for row in range(0, size, WIDTH):
        q_row = load(memory, q + row)
        along_g = fma(load(memory, g + row), q_row, along_g)
        along_r = fma(load(memory, r + row), q_row, along_r)
    return lanes_sum(along_g), lanes_sum(along_r)


@inlined
def tension_rows(memory, blocks, layout, q, r):
    """r = G q; returns g.q and q.r.

    *blocks* holds, for each block, its first row, the row after its last, and its columns.  Eight rows and two sums at a
    time fit the registers of a processor with vectors of four numbers; more would be kept in memory.
    """
    at = layout.tension
    for block in range(0, blocks.size, 3):
        row, stop, columns = blocks[block], blocks[block + 1], blocks[block + 2]
        column = q + row
        while row < stop:
            pairs = 2 if row + 2 * WIDTH <= stop else 1
            stride = pairs * WIDTH
            for _i in range(pairs):
                product = _rows_of_product(memory, at, stride, 2 * pairs, column, columns)
                if pairs == 2:
                    more = _rows_of_product(memory, at + 2 * stride, stride, 4, column + 2, columns - 2)
                    product = product + more
                store(memory, r + row, product)
                at += WIDTH
                row += WIDTH
            at += (columns - 1) * stride
    return _products_of_rows(memory, layout.size, layout.g, q, r)


@inlined
def tension_rows_twice(memory, blocks, layout_a, q_a, r_a, layout_b, q_b, r_b):
    """:func:`tension_rows` for two states at once, bit for bit, with G read only once."""
    at = layout_a.tension
    for block in range(0, blocks.size, 3):
        row, stop, columns = blocks[block], blocks[block + 1], blocks[block + 2]
        a, b = q_a + row, q_b + row
        while row < stop:
            pairs = 2 if row + 2 * WIDTH <= stop else 1
            stride = pairs * WIDTH
            for _i in range(pairs):
                of_a, of_b = _rows_of_two_products(memory, at, stride, 2 * pairs, a, b, columns)
                if pairs == 2:
                    more_a, more_b = _rows_of_two_products(
                        memory, at + 2 * stride, stride, 4, a + 2, b + 2, columns - 2
                    )
                    of_a, of_b = of_a + more_a, of_b + more_b
                store(memory, r_a + row, of_a)
                store(memory, r_b + row, of_b)
                at += WIDTH
                row += WIDTH
            at += (columns - 1) * stride
    gq_a, qr_a = _products_of_rows(memory, layout_a.size, layout_a.g, q_a, r_a)
    gq_b, qr_b = _products_of_rows(memory, layout_b.size, layout_b.g, q_b, r_b)
    return gq_a, qr_a, gq_b, qr_b


@inlined
def _acceleration_row(memory, layout, along_g, along_r, r, row):
    k = tension_acceleration(along_g, along_r, load(memory, layout.g + row), load(memory, r + row))
    return add_acceleration(memory, layout.size, layout.terms, row, k)


@inlined
def acceleration_rows(memory, layout, along_g, along_r, r, k):
    """k = the modal acceleration by the change of tension, and by the further forces at a kick."""
    for row in range(0, layout.size, WIDTH):
        store(memory, k + row, _acceleration_row(memory, layout, along_g, along_r, r, row))


@inlined
def kick_row(layout):
    """The working row that holds the whole acceleration of a kick, contact included."""
    return layout.work + 10 * layout.size


@inlined
def kick_rows(memory, layout, weight, k, force, p_from, p_to):
    """p_to = p_from + weight (k + c force), c the contact's row."""
    for row in range(0, layout.size, WIDTH):
        k_row, c_row = load(memory, k + row), load(memory, layout.contact + row)
        store(memory, p_to + row, kick_mode(weight, k_row, c_row, force, load(memory, p_from + row)))


@inlined
def kick_and_flow_rows(memory, layout, flow, weight, along_g, along_r, r, force, q, p):
    """In place: :func:`acceleration_rows`, :func:`kick_rows` and :func:`flow_rows` in one pass through memory."""
    size = layout.size
    for row in range(0, size, WIDTH):
        k = _acceleration_row(memory, layout, along_g, along_r, r, row)
        kicked = kick_mode(weight, k, load(memory, layout.contact + row), force, load(memory, p + row))
        _flow_row(memory, size, flow, row, load(memory, q + row), kicked, q, p)


@inlined
def flow_rows(memory, size, flow, q_from, p_from, q_to, p_to):
    """One flow of every linear mode."""
    for row in range(0, size, WIDTH):
        _flow_row(memory, size, flow, row, load(memory, q_from + row), load(memory, p_from + row), q_to, p_to)


@inlined
def _flow_row(memory, size, flow, row, q_row, p_row, q_to, p_to):
    at = flow + row
    a11, a12 = load(memory, at), load(memory, at + size)
    a21, a22 = load(memory, at + 2 * size), load(memory, at + 3 * size)
    q_row, p_row = flow_mode(q_row, p_row, a11, a12, a21, a22)
    store(memory, q_to + row, q_row)
    store(memory, p_to + row, p_row)


@inlined
def modal_energy(memory, layout, q, p):
    """Quadratic part of the energy, the sum of (p^2 + omega^2 q^2)/2."""
    total = splat(0.0)
    for row in range(0, layout.size, WIDTH):
        omega = load(memory, layout.omega + row)
        total = total + mode_energy(omega, load(memory, q + row), load(memory, p + row))
    return lanes_sum(total)


@inlined
def modal_energies(memory, layout, q, near, p, k, force):
    """Modal energies as in :func:`modal_energy`, the part above a frequency, and the rates of both.

    *q* is measured from the origin at hand, which the acceleration *k* belongs to; *force* is that of the contact.
    """
    total, high, power, high_power = splat(0.0), splat(0.0), splat(0.0), splat(0.0)
    for row in range(0, layout.size, WIDTH):
        omega, p_row, mask = (
            load(memory, layout.omega + row),
            load(memory, p + row),
            load(memory, layout.high + row),
        )
        energy = mode_energy(omega, load(memory, near + row), p_row)
        k_row = acceleration_about_nearest_well(
            memory, layout.terms, layout.omega_squared, q, near, row, load(memory, k + row)
        )
        change = mode_power(
            load(memory, layout.damping + row), k_row, load(memory, layout.contact + row), force, p_row
        )
        total, power = total + energy, power + change
        high, high_power = fma(mask, energy, high), fma(mask, change, high_power)
    return lanes_sum(total), lanes_sum(high), lanes_sum(power), lanes_sum(high_power)


@inlined
def validity_horizon(layout, step_time):
    """Time for which the bound of a free flight is trusted, in flight steps of *step_time*: a circuit changes soon."""
    return 0.25 * step_time if bounds_by_energy(layout.terms) else step_time


@inlined
def speed_bound_with_terms(memory, layout, drive, along, q, p, k, horizon):
    """A speed along a row that is not exceeded while the bound is trusted; *horizon* is :func:`validity_horizon`.

    It is that of the linear flow, and what the terms add.  For circuits: the linear modes and they keep or lose their
    energy E >= 0, to which other forces, of acceleration k, add: sqrt(2 E) grows by |k| per second at most.
    """
    size, omega, trusted, speed = layout.size, layout.omega, TRUST * horizon, 0.0
    if bounds_by_energy(layout.terms):
        energy = add_circuit_energy(memory, size, layout.terms, q, modal_energy(memory, layout, q, p))
        speed = math.sqrt(2.0 * energy) + math.sqrt(dot(memory, size, k, k)) * trusted
    bound = speed_bound(memory, size, omega, along, q, p)
    return add_to_speed_bound(memory, size, layout.terms, drive, omega, along, q, p, speed, trusted, bound)


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
def beam_signals(memory, layout, q, p, w, rate):
    """Displacement and velocity of the beam at the striker, of the products *w* and *rate* with the contact row.

    With a striker that has mass, these products are of the beam minus the striker's own displacement.
    """
    return _without_body(memory, layout.body, layout.contact, q, p, w, rate)


@inlined
def _without_body(memory, body, contact, q, p, w, rate):
    if body is None:
        return w, rate
    c = memory[contact + body]
    return w - c * memory[q + body], rate - c * memory[p + body]


@inlined
def beam_energy(memory, layout, q, p, energy):
    """The part of the modal *energy* that is in the beam and not in a striker's mass."""
    return _without_energy_of(memory, layout.bodies, layout.omega, q, p, energy)


@inlined
def _without_energy_of(memory, bodies, omega, q, p, energy):
    if bodies is None:
        return energy
    for i in range(len(bodies)):
        energy = energy - mode_energy(memory[omega + bodies[i]], memory[q + bodies[i]], memory[p + bodies[i]])
    return energy


@inlined
def _has_further_channels(velocity_block):
    """True if forces beside the first contact's depend on velocities."""
    if velocity_block is None:
        return False
    return _more_than(len(velocity_block.rows), velocity_block.first)


@inlined
def _more_than(count, first):
    if first is None:
        return True
    return count > 1


@inlined
def beam_power(memory, layout, p, k, force, power, high):
    """The part of the rates of the modal energies that is the beam's; 0 with forces that are not in *k*."""
    if _has_further_channels(layout.velocity_block):
        return 0.0, 0.0
    return _without_power_of(memory, layout, layout.bodies, p, k, force, power), high


@inlined
def _without_power_of(memory, layout, bodies, p, k, force, power):
    if bodies is None:
        return power
    for i in range(len(bodies)):
        c, damping = memory[layout.contact + bodies[i]], memory[layout.damping + bodies[i]]
        power = power - mode_power(damping, memory[k + bodies[i]], c, force, memory[p + bodies[i]])
    return power


@inlined
def propagate_free(memory, layout, contact, flow, subintervals, subinterval, q, p, k0, k1, center, parts):
    """A free step in short subintervals: signals at the end of each, one mode a lane, into *parts*; c is the row *contact*.

    Row by row of modes, so that a row stays in registers all the way.  At the border of subintervals i and i + 1
    stands a kick by the tension's acceleration, linear from k0 to k1 (half a kick at the first).  Piece i
    leaves c.q, c.p and, if *center*, e.q and e.p, each still eight sums, at ``parts[32 i]``.
    """
    size = layout.size
    for row in range(0, size, WIDTH):
        q_row, p_row = load(memory, q + row), load(memory, p + row)
        k0_row, k1_row = load(memory, k0 + row), load(memory, k1 + row)
        a11, a12 = load(memory, flow + row), load(memory, flow + size + row)
        a21, a22 = load(memory, flow + 2 * size + row), load(memory, flow + 3 * size + row)
        c_row, e_row = load(memory, contact + row), load(memory, layout.center + row)
        for i in range(subintervals):
            done, kick, at = i / subintervals, subinterval if i > 0 else 0.5 * subinterval, 4 * WIDTH * i
            kicked = fma(kick * done, k1_row, p_row)
            kicked = fma(kick * (1.0 - done), k0_row, kicked)
            p_row = turned(kicked, a22, a21, q_row)
            q_row = turned(q_row, a11, a12, kicked)
            if row == 0:
                for j in range(4):
                    store(parts, at + j * WIDTH, splat(0.0))
            store(parts, at, fma(c_row, q_row, load(parts, at)))
            store(parts, at + WIDTH, fma(c_row, p_row, load(parts, at + WIDTH)))
            if center:
                store(parts, at + 2 * WIDTH, fma(e_row, q_row, load(parts, at + 2 * WIDTH)))
                store(parts, at + 3 * WIDTH, fma(e_row, p_row, load(parts, at + 3 * WIDTH)))


@called
def flow_coefficients(memory, layout, length, at):
    """Rows a11 - 1, a12, a21, a22 - 1 of the exact flow over *length* seconds, written from *at* on."""
    size = layout.size
    _linear_flow(memory, layout, length, at)
    enter_flow(memory, size, layout.terms, length, at)


@inlined
def _linear_flow(memory, layout, length, at):
    size = layout.size
    if abs(length) < layout.gentle:
        for row in range(0, size, WIDTH):
            omega_damped, sigma = (
                load(memory, layout.omega_damped + row),
                load(memory, layout.damping + row),
            )
            squared = load(memory, layout.omega_squared + row)
            sine, _, less_one = sincos_cosm1(omega_damped * length)
            lost = decay_less_one(sigma * length)
            a11, a12, a21, a22 = rotation(sigma, squared, sine / omega_damped, less_one, lost)
            store(memory, at + row, a11)
            store(memory, at + size + row, a12)
            store(memory, at + 2 * size + row, a21)
            store(memory, at + 3 * size + row, a22)
        return
    for j in range(size):
        omega_damped, sigma = memory[layout.omega_damped + j], memory[layout.damping + j]
        sine, _, less_one = sincos_cosm1(omega_damped * length)
        over = sine / omega_damped if omega_damped > 0.0 else length
        squared = memory[layout.omega_squared + j]
        a11, a12, a21, a22 = rotation(sigma, squared, over, less_one, math.expm1(-sigma * length))
        memory[at + j] = a11
        memory[at + size + j] = a12
        memory[at + 2 * size + j] = a21
        memory[at + 3 * size + j] = a22
