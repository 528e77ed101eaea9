"""A single mode held where the tip is: the force that this takes, and what it does over a time."""

from __future__ import annotations

from snapbeam.solver.compilation import compiled, inlined
from snapbeam.solver.cpu.mode_lanes import acceleration_rows, tension_rows
from snapbeam.solver.excitation import tip_acceleration, tip_motion
from snapbeam.solver.physics import tension_factors

__all__ = ["PANELS", "constraint_force", "held_for", "hold"]


PANELS = 8
"""Of a step: the force is integrated over each by Simpson's rule, and checked for a release."""


@compiled
def hold(memory, blocks, layout, tip, phase, q, p, k):
    """Put the mode where the tip is; returns the contact force that this takes, g.q and q.Gq.

    With the tip's acceleration a_s, c q'' = a_s and q'' = k - 2 zeta omega p - omega^2 q + c f.
    """
    r = layout.work + 9 * layout.size
    motion, velocity = tip_motion(tip.drive, memory, phase)
    c = memory[layout.contact]
    for row in range(layout.size):
        memory[q + row] = 0.0
        memory[p + row] = 0.0
    memory[q] = (tip.offset + motion) / c
    memory[p] = velocity / c
    gq, qr = tension_rows(memory, blocks, layout, q, r)
    along_g, along_r = tension_factors(layout.gamma, gq, qr)
    acceleration_rows(memory, layout, along_g, along_r, r, k)
    wanted = tip_acceleration(tip.drive, memory, phase) / c
    free = memory[k] - 2.0 * memory[layout.damping] * memory[p] - memory[layout.omega_squared] * memory[q]
    return (wanted - free) / c, gq, qr


@inlined
def constraint_force(memory, blocks, layout, run, tip, phase):
    """The force alone; the mode is put into the spare rows."""
    spare, size = run.spare, layout.size
    force, _, _ = hold(memory, blocks, layout, tip, phase, spare, spare + size, spare + 2 * size)
    return force


@compiled
def held_for(memory, blocks, layout, run, tip, phase, length):
    """What the force does over *length*: impulse, work, gross work, dissipation and its maximum value."""
    omega, p, damping = tip.drive.omega, run.spare + layout.size, memory[layout.damping]
    c = memory[layout.contact]
    impulse, work, gross, dissipated, peak = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(2 * PANELS + 1):
        weight = 4.0 if i % 2 == 1 else 2.0
        if i == 0 or i == 2 * PANELS:
            weight = 1.0
        weight *= length / (6.0 * PANELS)
        force = constraint_force(
            memory, blocks, layout, run, tip, phase + omega * (i * length / (2 * PANELS))
        )
        speed = memory[p] * c
        impulse += weight * force
        work += weight * force * speed
        gross += weight * abs(force * speed)
        dissipated += weight * 2.0 * damping * memory[p] * memory[p]
        peak = max(peak, force)
    return impulse, work, gross, dissipated, peak
