"""A look inside a free step: what the gap and the centre do between its ends."""

from __future__ import annotations

from snapbeam.engines.cpu.rows import dot, propagate_free, signals
from snapbeam.engines.scalar.compile import compiled
from snapbeam.engines.scalar.lanes import WIDTH, lanes_sum, load
from snapbeam.engines.scalar.physics import sincos
from snapbeam.engines.scalar.tip import turned_motion

__all__ = ["sample_inside_step"]


@compiled
def sample_inside_step(memory, layout, tip, flow, pieces, piece, step, with_center, scratch):
    """Follow a free step in *pieces* short ones, each one exact linear flow, and note what is seen.

    The tension's acceleration, known at both ends of the step, is taken as linear in between: exact
    enough for signals whose fastest mode the pieces resolve.  Row i of ``room.looked`` becomes the penetration, its
    rate, and, if *with_center*, the displacement of the centre from rest and its rate.
    """
    looked, parts = scratch.looked, scratch.parts
    q, p, k, k1 = step.q, step.p, step.k, step.k1
    propagate_free(memory, layout, layout.contact, flow, pieces, piece, q, p, k, k1, with_center, parts)
    size, drive = layout.size, tip.drive
    contact0, contact1 = dot(memory, size, layout.contact, k), dot(memory, size, layout.contact, k1)
    center0, center1 = dot(memory, size, layout.center, k), dot(memory, size, layout.center, k1)
    turn_sine, turn_cosine = sincos(drive.omega * piece)
    sine, cosine = sincos(step.phase)
    w, rate, c, c_rate = signals(memory, layout, q, p)
    # kicks stand on the borders of the pieces, half a kick at the first; seen rates are half a kick ahead
    for i in range(pieces + 1):
        done, owed = i / pieces, 0.5 * piece
        if i == 0:
            owed = 0.0
        else:
            at = 4 * WIDTH * (i - 1)
            w, rate = lanes_sum(load(parts, at)), lanes_sum(load(parts, at + WIDTH))
            if with_center:
                c, c_rate = lanes_sum(load(parts, at + 2 * WIDTH)), lanes_sum(load(parts, at + 3 * WIDTH))
        argument = step.phase + i * piece * drive.omega
        motion, velocity = turned_motion(drive, memory, argument, sine, cosine)
        looked[i, 0] = tip.offset + motion - w
        looked[i, 1] = velocity - rate - owed * ((1.0 - done) * contact0 + done * contact1)
        looked[i, 2] = c
        looked[i, 3] = c_rate + owed * ((1.0 - done) * center0 + done * center1)
        sine, cosine = sine * turn_cosine + cosine * turn_sine, cosine * turn_cosine - sine * turn_sine
