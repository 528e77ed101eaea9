"""The strikers beside the first one, as kernels see them: which laws they touch by, and as which drives they move.

Their numbers stand in memory, a block each; which functions belong to them follows from the type of *kinds*.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba.extending import overload

from snapbeam.model.contact.base import LAWS, ContactLaw
from snapbeam.model.quantity import numbers_type
from snapbeam.solver.compilation import INLINE_HERE, inlined
from snapbeam.solver.contact_force import (
    begins_with_jump,
    contact_energy,
    contact_force,
    contact_slope,
    damping_coefficient,
    felt_force,
    force_break,
    jumps,
    mark_of,
    memory_after,
    peak_force,
    peak_in_step,
    released_at,
    with_memory,
    yield_penetration,
)
from snapbeam.solver.excitation import motion_by_number, part_motion

_SEPARATOR = "__"
NUMBERS = 40
"""Numbers of a striker in memory, a block of whole registers."""
# given
OFFSET, REST, SIGN, SPEED = 0, 1, 2, 3
# as they stand
HERE, TOUCHING, ONSET, SAFE, DEPTH, RATE, DEEPEST, PUSHED = 4, 5, 6, 7, 8, 9, 10, 11
# of the step at hand
DEPTH1, RATE1, EVENT_TICKS, FORCE, IMPULSE, WORK, GROSS, KEPT, WORKED = 12, 13, 14, 15, 16, 17, 18, 19, 20
# of the state that a run begins in: s since the contact began; negative: apart; NaN: the penetration decides
SINCE = 21
# of the step that tangents go through again: whether the striker touched in it, and the slope of its force
TOUCHED, SLOPE = 22, 23
# of a law that loses energy: the numbers of its channel in the velocity block; the energy lost, of the step and kept
DAMPED = 24
LOST, LOST_KEPT = 29, 30
# of a law with memory: HERE without the indentation
SURFACE = 31
LAW = 32
"""The law's numbers follow from there on."""


class Several:
    """Contact laws of the further strikers; :func:`several` makes one subclass for each combination."""

    laws: tuple[type[ContactLaw], ...] = ()

    @classmethod
    def numbers_type(cls) -> Any:
        """A named tuple of nothing, whose type tells a kernel the mixture."""
        return numbers_type(cls, ())


def several(laws: tuple[type[ContactLaw], ...]) -> type[Several]:
    """The class of a mixture of laws, one for each striker beside the first."""
    for law in laws:
        if LAWS.get(law.name) is not law:
            raise TypeError(f"{law.__name__}: is registered under no name")
    name = _SEPARATOR.join(["Several", *(law.name for law in laws)])
    if name not in globals():
        body = {"__module__": __name__, "__qualname__": name, "__doc__": "Laws by name.", "laws": laws}
        globals()[name] = type(name, (Several,), body)
    found: type[Several] = globals()[name]
    return found


def __getattr__(name: str) -> type[Several]:
    """A mixture by its name, as another process knows it."""
    first, *words = name.split(_SEPARATOR)
    if first != "Several" or not words or not all(word in LAWS for word in words):
        raise AttributeError(name)
    return several(tuple(LAWS[word] for word in words))


def _law_reader(law: Any) -> Any:
    """A function that makes the numbers of a law of those that stand in memory."""
    count = len(law.numbers_type()._fields)
    numbers = ", ".join(f"memory[at + {i}]" for i in range(count))
    made: dict[str, Any] = {"Numbers": law.numbers_type()}
    exec(f"def read(memory, at):\n    return Numbers({numbers})", made)
    return inlined(made["read"])


def _by_law(laws: tuple[Any, ...], function: Any) -> Any:
    """*function* of the numbers of striker j and what follows; the striker is chosen as the integration goes."""
    read, rest = _law_reader(laws[0]), _by_law(laws[1:], function) if len(laws) > 1 else None

    @inlined
    def own(memory, at, j, *values):
        return function(read(memory, at), *values)

    if rest is None:
        return own

    @inlined
    def chosen(memory, at, j, *values):
        if j == 0:
            return function(read(memory, at), *values)
        return rest(memory, at, j - 1, *values)

    return chosen


def _of_laws(value: Callable[[Any], Any]) -> Any:
    """A function f(kinds): *value* of the tuple of laws; known when a kernel is compiled."""

    def stub(kinds: Any) -> Any:
        return value(type(kinds).owner.laws)

    @overload(stub, jit_options=INLINE_HERE)
    def chosen(kinds):
        found = value(kinds.instance_class.owner.laws)
        return lambda kinds: found

    return stub


def _of_each_law(value: Callable[[Any], Any]) -> Any:
    """A function f(kinds, j): *value* of the law of striker *j* beside the first; a constant if it is the same of all."""

    def stub(kinds: Any, j: int) -> Any:
        return value(type(kinds).owner.laws[j])

    @overload(stub, jit_options=INLINE_HERE)
    def chosen(kinds, j):
        values = tuple(value(law) for law in kinds.instance_class.owner.laws)
        if len(set(values)) > 1:
            return lambda kinds, j: values[j]
        common = values[0]
        return lambda kinds, j: common

    return stub


count_of = _of_laws(len)
any_damped = _of_laws(lambda laws: any(law.rate_dependent for law in laws))
any_jumps = _of_laws(lambda laws: any(begins_with_jump(law) for law in laws))
damped_at = _of_each_law(lambda law: bool(law.rate_dependent))
"""True if the contact law of a striker dissipates energy."""
breaks_at = _of_each_law(lambda law: bool(law.rate_dependent or law.memory))
"""True if its force is not smooth within a contact (:func:`force_break`)."""
memory_place = _of_each_law(lambda law: LAW + len(law.numbers_type()._fields) - 1 if law.memory else -1)
"""Place of the residual indentation among the numbers of a striker, or -1."""


def _function_of_contact(function: Any) -> Any:
    """A function f(kinds, memory, at, j, ...): *function* of the law of striker *j* beside the first and what follows.

    The law's numbers stand from *at* on.
    """

    def stub(kinds: Any, memory: Any, at: int, j: int, *values: float) -> float:
        raise TypeError("laws of further contacts run in compiled code only")

    @overload(stub, jit_options=INLINE_HERE)
    def chosen(kinds, memory, at, j, *values):
        own = _by_law(kinds.instance_class.owner.laws, function)
        return lambda kinds, memory, at, j, *values: own(memory, at, j, *values)

    return stub


force_of = _function_of_contact(contact_force)
slope_of = _function_of_contact(contact_slope)
energy_of = _function_of_contact(contact_energy)
damping_of = _function_of_contact(damping_coefficient)
felt_at = _function_of_contact(felt_force)
mark_at = _function_of_contact(mark_of)
peak_of = _function_of_contact(peak_force)
way_to_release = _function_of_contact(released_at)
break_of = _function_of_contact(force_break)
memory_after_of = _function_of_contact(memory_after)
yield_penetration_of = _function_of_contact(yield_penetration)
peak_in_step_of = _function_of_contact(peak_in_step)
jumps_at = _function_of_contact(jumps)


@inlined
def _energy_with_memory(law, memory, penetration):
    return contact_energy(with_memory(law, memory), penetration)


with_memory_energy_of = _function_of_contact(_energy_with_memory)


def motion_of(drive: Any, memory: Any, argument: float, j: int, sign: float) -> tuple[float, float]:
    """Displacement (m) and velocity (m/s) of striker *j* beside the first, in the frame of the ends.

    *sign* is +1 if it strikes from the same side as the first.
    """
    raise TypeError("motion_of runs in compiled code only")


@overload(motion_of, jit_options=INLINE_HERE)
def _motion_of(drive, memory, argument, j, sign):
    owner = drive.instance_class.owner
    base, own = part_motion(owner, "base"), motion_by_number(owner, "tip")
    if "base_follow" not in drive.fields:
        return lambda drive, memory, argument, j, sign: own(drive, memory, argument, j + 1)

    def both(drive, memory, argument, j, sign):
        moved, speed = own(drive, memory, argument, j + 1)
        y, rate = base(drive, memory, argument)
        share = sign * drive.base_follow
        return moved + share * y, speed + share * rate

    return both
