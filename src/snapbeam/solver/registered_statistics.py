"""Statistics that were registered: scalar functions called after every step, one after the other."""

from __future__ import annotations

from collections import namedtuple
from typing import Any

from snapbeam.model.quantity import own_name
from snapbeam.solver.compilation import inlined, overloaded
from snapbeam.solver.statistics import CompletedStep, Statistic, updated


class Extras:
    """Additional statistics that a kernel updates; subclasses represent lists of statistics."""

    rows: tuple[Statistic, ...] = ()


_named_tuple: Any = namedtuple
_made: dict[tuple[Statistic, ...], Any] = {}


def extras_of_table() -> Any:
    """A value whose type tells a kernel which statistics the table has beside the package's own."""
    rows = updated()
    if rows not in _made:
        owner: Any = type("OwnExtras", (Extras,), {"rows": rows}) if rows else Extras
        made: Any = _named_tuple("Numbers", ())
        made.__name__, made.owner = own_name(owner), owner
        if not rows:
            made.__module__, made.__qualname__ = __name__, "Extras.Numbers"
            owner.Numbers = made
        _made[rows] = made()
    return _made[rows]


def observe(
    extras: Any,
    accumulators: Any,
    time: float,
    length: float,
    kinematics: Any,
    kinematics1: Any,
    touching: bool,
) -> None:
    """Update every registered statistic by a step."""
    rows = type(extras).owner.rows
    for row in rows:
        name = f"own_{row.name}"
        accumulators[name] = row.update(
            accumulators[name], _passed.py_func(time, length, kinematics, kinematics1, touching)
        )


@inlined
def _passed(time, length, kinematics, kinematics1, touching):
    return CompletedStep(
        time, length, (kinematics.w, kinematics1.w), (kinematics.wv, kinematics1.wv), (kinematics.c, kinematics1.c), (kinematics.cv, kinematics1.cv),
        (kinematics.d, kinematics1.d), touching,
    )  # fmt: skip


def _chain(rows: tuple[Statistic, ...]) -> Any:
    """The update functions of *rows*, compiled into one."""
    if not rows:

        @inlined
        def nothing(accumulators, passed):
            return

        return nothing
    assert rows[0].update is not None
    name, update, rest = f"own_{rows[0].name}", inlined(rows[0].update), _chain(rows[1:])

    @inlined
    def one_and_rest(accumulators, passed):
        accumulators[name] = update(accumulators[name], passed)
        rest(accumulators, passed)

    return one_and_rest


@overloaded(observe)
def _observe(extras, accumulators, time, length, kinematics, kinematics1, touching):
    rows = extras.instance_class.owner.rows
    if not rows:
        return lambda extras, accumulators, time, length, kinematics, kinematics1, touching: None
    apply = _chain(rows)

    def implementation(extras, accumulators, time, length, kinematics, kinematics1, touching):
        apply(accumulators, _passed(time, length, kinematics, kinematics1, touching))

    return implementation
