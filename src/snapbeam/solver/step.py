"""The time step of every layout: kicks by the nonlinear forces and exact flows of the linear modes.

With the amplitudes ``alpha = alpha_eq + V q`` about a well and ``p = q'``, a structure obeys

    q' = p,    p' = -omega^2 q - 2 zeta omega p + k(q) + c f(d),

    k(q) = -gamma [(q.Gq) g + (2 g.q + q.Gq) Gq],    G = V^T V,    g = V^T alpha_eq,    c = V^T phi(x_s),

where k is the acceleration by the change of midplane tension and f the contact force at the penetration
``d = offset + w_s(t) - c.q``.  The right-hand side has two parts, each with an exact solution:

* A **flow** A(t) solves the linear part.  Every mode is a damped oscillator of its own: (q, p) is multiplied by a matrix
  of 2 x 2 numbers, which :func:`flow_mode` applies (``physics.py: rotation`` computes it, once for each length of step).
* A **kick** B(t) solves the nonlinear part.  q does not change in it, and neither do k and f:
  ``p <- p + t (k + c f)``, as in :func:`kick_mode`.

A step of length h is the symmetric composition of kicks and flows

    S(h) =  B(b_0 h) A(a_0 h) B(b_1 h) A(a_1 h) ... A(a_{s-1} h) B(b_s h),    a_i = a_{s-1-i},    b_i = b_{s-i},

from left to right in time.  ``splitting.py`` holds the weights of orders 4 and 6, and their source.  The contact force of
kick i uses the displacement w_s of the striker at the time of that kick, after the fraction a_0 + ... + a_{i-1} of the step.

A *stage* is a kick and the flow after it; the last stage has no flow.  Every stage

1. forms the inner products c.q, g.q and q.Gq,
2. computes the two coefficients of k, one of g and one of r = Gq,
3. computes the contact force f, and adds impulse and work of the contact, b_i h f and b_i h f w_s',
4. kicks p, and then lets q and p flow.

The first kick needs no tension: k at the beginning of a step is k at the end of the last one, which every step keeps.

A layout may have further forces, the *terms* (``solver/terms``).  Those that depend on position and time alone add to k,
or to its two coefficients.  A contact force that depends on velocity
changes during a kick, as does the damping of a local force.  All such forces follow together from one equation for the
velocities along their rows, by a Runge-Kutta method with steps much shorter than the kick.

The step itself decides nothing.  Whether a contact is closed is fixed for a whole step.  The caller observes the beam at
the end, and inside the step where needed.  If a contact began or ended there, the caller takes a shorter step from the same
beginning.  Then it accepts the step: the end becomes the next beginning, and the increments enter the statistics
(``cpu/events.py: accept_step``, ``cpu/run_lanes/control.py: accept_steps``, ``cuda/control.py``).

Layouts.  This file does not know where numbers are in memory.  A number is a float, or a register of eight runs; q, p and k
are rows in memory, registers, or one number in each thread of a block.  A layout provides the operations of
:class:`Primitives`; :func:`build_step` binds the step to them, and Numba compiles the result into the kernel of the layout.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from snapbeam.solver.compilation import inlined
from snapbeam.solver.contact_force import contact_force
from snapbeam.solver.physics import tension_factors, turned
from snapbeam.solver.simd import fma

# One mode: layouts call these in their loops over modes.


@inlined
def kick_mode(weight, k, c, force, p):
    """p after a kick of *weight* seconds: p + weight (k + c f)."""
    return fma(weight, fma(force, c, k), p)


@inlined
def flow_mode(q, p, a11, a12, a21, a22):
    """q and p after a flow; the diagonal a11, a22 of its matrix is stored less one."""
    return turned(q, a11, a12, p), turned(p, a22, a21, q)


@inlined
def rotate_phase(sine, cosine, sine_ahead, cosine_ahead):
    """Sine and cosine of the sum of two angles: the phase of a drive at the beginning of a step and its advance since."""
    return sine * cosine_ahead + cosine * sine_ahead, cosine * cosine_ahead - sine * sine_ahead


# The values that pass from stage to stage.


class InnerProducts(NamedTuple):
    """Inner products of the displacements at a kick; 0 where they are not needed."""

    cq: Any
    """c.q, m: displacement of the beam at the striker. Only of a step in contact."""
    gq: Any
    """g.q and q.Gq. Not at the first kick of a step."""
    qr: Any
    r: Any
    """The row r = Gq, as the layout holds rows. Not at the first kick of a step."""


class ContactIncrement(NamedTuple):
    """Contact of the first striker within a step."""

    force: Any
    """Force at the present kick, N."""
    impulse: Any
    """Sums over the kicks so far: impulse, N s; work of the striker, J; the sum of its absolute values, J."""
    work: Any
    gross: Any
    lost: Any
    """Energy lost in the contact so far, J."""


class Increment(NamedTuple):
    """Changes over the stages of a step so far."""

    gq: Any
    """g.q and q.Gq at the last kick."""
    qr: Any
    contact: ContactIncrement
    dissipated: Any
    """Energy that the damping of the modes dissipated, J; 0 in a layout or a run that does not account for it."""
    surroundings: Any
    """Work of the terms, and the state of the circuit; None in a layout without them."""


class Primitives(NamedTuple):
    """Operations of a layout.

    *data* is a named tuple of all numbers that a step reads.  Its fields ``flows`` (number s of flows), ``gamma``, ``tip``
    (an :class:`~snapbeam.solver.excitation.Tip`) and ``in_contact`` are read here.  *state* is the layout's form of q, p
    and k.
    """

    zero: Callable[..., Any]
    """``zero(data)``: the number 0."""
    begin: Callable[..., Any]
    """``begin(data)``: the state at the beginning of the step, and the surroundings before it."""
    kick_weight: Callable[..., Any]
    """``kick_weight(data, stage)``: b_i h, s."""
    tip_motion: Callable[..., Any]
    """``tip_motion(data, stage)``: displacement w_s and velocity of the striker at a kick."""
    form_products: Callable[..., Any]
    """``form_products(data, stage, state)``: :class:`InnerProducts`."""
    where_closed: Callable[..., Any]
    """``where_closed(data, force)``: the force; 0 in those runs of a register that are not in contact."""
    kick_and_flow: Callable[..., Any]
    """``kick_and_flow(data, stage, state, weight, along_g, along_r, r, force)``.

    Returns the state after the kick and the flow of a stage, and the energy dissipated in the flow.  After the first stage
    k is *along_g* g + *along_r* r, with the accelerations of further forces that the layout has.
    """
    update_terms: Callable[..., Any] | None = None
    """``update_terms(data, stage, weight)``: compute what the terms and the further contacts need at a kick.

    None in a layout without them, as are the following operations.
    """
    add_to_tension: Callable[..., Any] | None = None
    """``add_to_tension(data, along_g, along_r)``: both coefficients of k with what terms add to the tension."""
    force_of_contact: Callable[..., Any] | None = None
    """``force_of_contact(data, penetration, velocity)``.

    The force in a kick, of any contact law; 0 of a law whose force :attr:`exchange_energy` adds, since it depends on the
    velocity too.  *velocity* is that of the striker.
    """
    exchange_energy: Callable[..., Any] | None = None
    """``exchange_energy(data, stage, weight, along_g, along_r, contact, surroundings)``.

    Adds the work of the terms in a kick, and the impulses of all forces that depend on p; returns the contact and the
    surroundings.
    """


class StepFunctions(NamedTuple):
    """The step of a layout."""

    begin_step: Any
    """``begin_step(data)``: state and :class:`Increment` before the first stage."""
    take_stage: Any
    """``take_stage(data, stage, state, products, increment)``: both after a stage."""
    take_step: Any
    """``take_step(data)``: both at the end of the step."""


def build_step(layout: Primitives, compiled_part: Callable[..., Any] = inlined) -> StepFunctions:
    """Build the time step of a layout.

    Parameters
    ----------
    layout : Primitives
        A primitive that is None leaves no code.
    compiled_part : callable
        Compiles a function into the kernel that calls it.
    """
    zero, begin, kick_weight, tip_motion = layout.zero, layout.begin, layout.kick_weight, layout.tip_motion
    form_products, where_closed = layout.form_products, layout.where_closed
    kick_and_flow = layout.kick_and_flow
    update_terms, add_to_tension = layout.update_terms, layout.add_to_tension
    force_of_contact, exchange_energy = layout.force_of_contact, layout.exchange_energy

    @compiled_part
    def evaluate_contact(data, stage, weight, cq, before):
        """The contact at a kick of *weight* seconds."""
        if not data.in_contact:
            return before
        displacement, velocity = tip_motion(data, stage)
        penetration = data.tip.offset + displacement - cq
        if force_of_contact is None:
            force = where_closed(data, contact_force(data.tip.law, penetration))
        else:
            force = force_of_contact(data, penetration, velocity)
        return ContactIncrement(
            force,
            before.impulse + weight * force,
            before.work + weight * force * velocity,
            before.gross + weight * abs(force * velocity),
            before.lost,
        )

    @compiled_part
    def begin_step(data):
        """The state before the first stage, and increments of 0."""
        state, surroundings = begin(data)
        nil = zero(data)
        return state, Increment(nil, nil, ContactIncrement(nil, nil, nil, nil, nil), nil, surroundings)

    @compiled_part
    def take_stage(data, stage, state, products, before):
        """A kick and the flow after it."""
        weight = kick_weight(data, stage)
        along_g, along_r = tension_factors(data.gamma, products.gq, products.qr)
        if update_terms is not None:
            update_terms(data, stage, weight)
        if add_to_tension is not None:
            along_g, along_r = add_to_tension(data, along_g, along_r)
        contact = evaluate_contact(data, stage, weight, products.cq, before.contact)
        surroundings = before.surroundings
        if exchange_energy is not None:
            contact, surroundings = exchange_energy(
                data, stage, weight, along_g, along_r, contact, surroundings
            )
        state, dissipated = kick_and_flow(
            data, stage, state, weight, along_g, along_r, products.r, contact.force
        )
        return state, Increment(
            products.gq, products.qr, contact, before.dissipated + dissipated, surroundings
        )

    @compiled_part
    def take_step(data):
        """All stages of a step."""
        state, increment = begin_step(data)
        for stage in range(data.flows + 1):
            products = form_products(data, stage, state)
            state, increment = take_stage(data, stage, state, products, increment)
        return state, increment

    return StepFunctions(begin_step, take_stage, take_step)
