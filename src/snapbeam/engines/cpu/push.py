"""The contact within a step: its force at a kick, and what it did so far."""

from __future__ import annotations

from typing import Any, NamedTuple

from numba.extending import overload

from snapbeam.engines.cpu.rows import dot
from snapbeam.engines.cpu.strikers.force import struck_along
from snapbeam.engines.cpu.uneven import pushed_along
from snapbeam.engines.cpu.world.forced import shaken_along
from snapbeam.engines.scalar.compile import INLINE_HERE, inlined
from snapbeam.engines.scalar.contact import kick_force

__all__ = ["ContactIncrement", "apply_contact_loss", "no_contact_increment"]


class ContactIncrement(NamedTuple):
    """The contact within a step: the force at the present kick, and its quadratures so far."""

    force: float
    impulse: float
    work: float
    gross: float
    lost: float
    penetration: float
    """At the present kick, and the tip's velocity there: of a law that loses energy."""
    velocity: float


@inlined
def no_contact_increment():
    """The contact of a step that has not begun."""
    return ContactIncrement(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def apply_contact_loss(
    memory: Any,
    layout: Any,
    tip: Any,
    step: Any,
    stage: int,
    weight: float,
    along_g: float,
    along_r: float,
    push: Any,
) -> Any:
    """The contact of a law that loses energy, once the tension's acceleration is known; *push* of any other law.

    Of the first kick that acceleration is the row that the last step left.
    """
    raise TypeError("damped runs in compiled code only")


@inlined
def _damped(memory, layout, tip, step, stage, weight, along_g, along_r, push):
    if not step.touching:
        return ContactIncrement(
            0.0, push.impulse, push.work, push.gross, push.lost, push.penetration, push.velocity
        )
    size, contact = layout.size, layout.contact
    if stage == 0:
        rate, along = dot(memory, size, contact, step.p), dot(memory, size, contact, step.k)
    else:
        rate = dot(memory, size, contact, step.p1)
        along = along_g * dot(memory, size, contact, layout.g) + along_r * dot(memory, size, contact, step.r)
        along = pushed_along(memory, size, layout.uneven, contact, along)
        along = struck_along(memory, size, layout.others, contact, along)
        along = shaken_along(memory, size, layout.forced, contact, along)
    mobility = dot(memory, size, contact, contact)
    given = kick_force(tip.law, push.penetration, push.velocity - rate, mobility, along, weight)
    force, velocity = given.impulse, push.velocity
    return ContactIncrement(
        force,
        push.impulse + weight * force,
        push.work + weight * force * velocity,
        push.gross + weight * abs(force * velocity),
        push.lost + given.lost,
        push.penetration,
        push.velocity,
    )


@overload(apply_contact_loss, jit_options=INLINE_HERE)
def _damped_by_law(memory, layout, tip, step, stage, weight, along_g, along_r, push):
    law = tip.types[tip.fields.index("law")]
    if not law.instance_class.owner.rate_dependent:
        return lambda memory, layout, tip, step, stage, weight, along_g, along_r, push: push

    def implementation(memory, layout, tip, step, stage, weight, along_g, along_r, push):
        return _damped(memory, layout, tip, step, stage, weight, along_g, along_r, push)

    return implementation
