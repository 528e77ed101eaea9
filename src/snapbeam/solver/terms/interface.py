"""Interface of terms of the equation of motion, and the operations at which the solver calls them.

A *term* is a force or a coupling beside linear modes and tension: one class in one file of this folder.  The class is a
named tuple.  Its fields are numbers and places in memory; its static methods are the operations below, each under the
name that it has here.  A method has the parameters of the operation, with the term itself in place of *terms*.

Numba compiles a kernel for the tuple of the terms that a structure has.  An operation calls the method of every term
that has it, in the order of the tuple; the value of the last parameter goes in and comes out.  A term without the
method, and a structure without terms, leave no code.

Beside operations, a class has

``build(structure, drive, size, padded)``
    Python: a :class:`TermMemory` for each term of the class that the structure and the drive have.
``kick_work(memory, size, term, weight, g, r, kick, p)``, ``accumulator`` and ``work_description``
    Its work in a kick of *weight* seconds, J, exact: the row *kick* is the whole acceleration of the kick, contact
    included, and p the row of the velocities before it.  With it, the name and long name of the statistic of the work.
``channel(unknown)``
    Of a damping force: its channel of the velocity block (``cpu/terms/velocity_block.py``) with the number of its row.
``may_hide_onset``
    True if the term changes the motion within a step more than the interval without contact allows for.
``needs_tension_product``
    True if ``kick_work`` reads r = G q at the first kick of a step too.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numba.extending import overload
from numpy.typing import NDArray

from snapbeam.solver.compilation import INLINE_HERE, inlined
from snapbeam.solver.simd import WIDTH, fma, lanes_sum, load, splat, vabs
from snapbeam.solver.step_control import ContactKinematics


class TermMemory(NamedTuple):
    """Numbers of a term, by the names of its fields."""

    shared: dict[str, NDArray[np.float64]]
    """Rows of the structure; the field is their place in memory."""
    own: dict[str, NDArray[np.float64]]
    """The same, of which every run that is integrated has its own."""
    numbers: dict[str, float]


class ExternalWork(NamedTuple):
    """Work of the terms on the beam within a step, J."""

    works: Any
    """Work of each term, a tuple; 0 if a term does none."""
    gross: float
    """Sum of the absolute values of the works in the kicks."""


# How operations are made: text for the terms at hand, compiled into the kernel.


def _classes(terms: Any) -> list[Any]:
    """The classes of the terms of a Numba type."""
    return [each.instance_class for each in terms]


def _compiled_for_terms(stub: Any, write: Callable[[list[Any]], tuple[list[str], dict[str, Any]]]) -> Any:
    """Have Numba compile a call of *stub* as what *write* returns for the terms: lines of a body, and names in them."""
    parameters = ", ".join(inspect.signature(stub).parameters)

    def implementation(terms: Any) -> Any:
        lines, names = write(_classes(terms))
        return _defined(stub.__name__, parameters, lines, names)

    names = {"implementation": implementation}
    chosen = _defined(stub.__name__, parameters, ["return implementation(terms)"], names)
    overload(stub, jit_options=INLINE_HERE)(chosen)
    return stub


def _defined(name: str, parameters: str, lines: list[str], names: dict[str, Any]) -> Any:
    text = "\n    ".join([f"def {name}({parameters}):", *lines])
    known = {"__name__": __name__, "ExternalWork": ExternalWork, **names}
    exec(compile(text, f"<{name}>", "exec"), known)
    return known[name]


def operation(threaded: int = 1) -> Callable[[Any], Any]:
    """Declare an operation, whose last *threaded* parameters are its results."""

    def declared(stub: Any) -> Any:
        name, parameters = stub.__name__, list(inspect.signature(stub).parameters)
        results = ", ".join(parameters[len(parameters) - threaded :])

        def write(classes: list[Any]) -> tuple[list[str], dict[str, Any]]:
            lines, names = [], {}
            for i, each in enumerate(classes):
                if hasattr(each, name):
                    names[f"term{i}"] = getattr(each, name)
                    given = ", ".join(f"terms[{i}]" if p == "terms" else p for p in parameters)
                    lines.append(f"{results} = term{i}({given})" if threaded else f"term{i}({given})")
            return [*lines, f"return {results}"], names

        return _compiled_for_terms(stub, write)

    return declared


def _of_kernels() -> TypeError:
    return TypeError("operations of terms run in compiled code only")


# Forces.


@operation(threaded=0)
def update_forces(memory: Any, size: int, terms: Any, drive: Any, argument: float, q: int) -> Any:
    """Write what follows from time and displacements into memory, for an argument of the drive and the row *q*."""
    raise _of_kernels()


@operation()
def add_acceleration(memory: Any, size: int, terms: Any, row: int, k: Any) -> Any:
    """Add to *k*, eight elements of the modal acceleration from *row* on."""
    raise _of_kernels()


@operation(threaded=2)
def add_to_tension(memory: Any, terms: Any, along_g: Any, along_r: Any) -> Any:
    """Change the two coefficients of the tension's acceleration, along g and along r = G q."""
    raise _of_kernels()


@inlined
def speed_bound(memory, size, omega, c, q, p):
    """A speed that c.q cannot exceed by the linear flow alone: sum |c_j| (|p_j| + |omega_j q_j|)."""
    total = splat(0.0)
    for row in range(0, size, WIDTH):
        oq = load(memory, omega + row) * load(memory, q + row)
        total = fma(vabs(load(memory, c + row)), vabs(load(memory, p + row)) + vabs(oq), total)
    return lanes_sum(total)


@operation()
def add_to_speed_bound(
    memory: Any,
    size: int,
    terms: Any,
    drive: Any,
    omega: int,
    along: int,
    q: int,
    p: int,
    speed: float,
    horizon: float,
    bound: Any,
) -> Any:
    """Add to a *bound* of the speed along a row what the term can change within a time, for the interval without contact.

    *speed* is what neither the norm of p nor y of a circuit exceeds in that time, if a term :func:`bounds_by_energy`.
    """
    raise _of_kernels()


@operation()
def add_circuit_energy(memory: Any, size: int, terms: Any, q: int, energy: Any) -> Any:
    """Add the energy in circuits: with that of the linear modes it has a minimum of 0, whatever other forces store."""
    raise _of_kernels()


# States of terms: first-order equations, whose flow the linear modes drive.


@operation(threaded=0)
def begin_run(
    memory: Any, size: int, terms: Any, rates: Any, i: int, omega_squared: int, damping: int
) -> Any:
    """Write the numbers of run *i*; *rates* are those of circuits, shape (runs, circuits)."""
    raise _of_kernels()


@operation(threaded=0)
def begin_kick(memory: Any, terms: Any, weight: float, begins: bool) -> Any:
    """Add up losses over a kick, after :func:`update_forces`; *begins*: the first of a step."""
    raise _of_kernels()


@operation(threaded=0)
def enter_flow(memory: Any, size: int, terms: Any, length: float, at: int) -> Any:
    """Write the elements of a state in the rows of a flow over *length* seconds."""
    raise _of_kernels()


@operation(threaded=0)
def before_flow(memory: Any, size: int, terms: Any, flow: int, q: int, p: int) -> Any:
    """Keep what :func:`after_flow` needs of the beginning of a flow."""
    raise _of_kernels()


@operation(threaded=0)
def after_flow(memory: Any, size: int, terms: Any, q: int, p: int) -> Any:
    """Complete the states at the end of a flow."""
    raise _of_kernels()


@operation(threaded=0)
def carry_state(
    memory: Any,
    size: int,
    terms: Any,
    source: int,
    q: int,
    length: float,
    u0: float,
    u1: float,
    u2: float,
    u3: float,
) -> Any:
    """Write the states after a time in which a single mode has a prescribed displacement."""
    raise _of_kernels()


@operation(threaded=0)
def store_loss(memory: Any, terms: Any) -> Any:
    """Keep the losses of the step at hand: a trial step that follows writes over them."""
    raise _of_kernels()


@operation(threaded=0)
def add_stored_loss(memory: Any, terms: Any) -> Any:
    """Add the losses of the first part of a step to those of the second."""
    raise _of_kernels()


@operation(threaded=0)
def accumulate_loss(
    memory: Any, size: int, terms: Any, accumulators: Any, q: int, p: int, late: float
) -> Any:
    """Enter the losses of the accepted step in the statistics; the share *late* of it is in the last quarter."""
    raise _of_kernels()


@operation(threaded=0)
def write_loss(
    memory: Any, terms: Any, accumulators: Any, values: Any, sample: int, first: int, within: float
) -> Any:
    """Record the losses so far from column *first* on; *within* is 1 in a step and 0 at its end."""
    raise _of_kernels()


# Energy and wells.


@operation()
def add_potential_energy(memory: Any, size: int, terms: Any, q: int, energy: Any) -> Any:
    """Add to the *energy* of linear modes and tension about the present origin."""
    raise _of_kernels()


@operation(threaded=0)
def enter_well(memory: Any, size: int, terms: Any, well_sign: float) -> Any:
    """Write what depends on the well whose mirror image is the origin of q."""
    raise _of_kernels()


@operation()
def relative_to_nearest_well(memory: Any, size: int, terms: Any, well_sign: float, spare: int, q: Any) -> Any:
    """The row of the displacements from the well that the beam is near: *q* itself, or *spare*, written here."""
    raise _of_kernels()


@operation()
def acceleration_about_nearest_well(
    memory: Any, terms: Any, omega_squared: int, q: int, near: int, row: int, k: Any
) -> Any:
    """Take *k*, which belongs to *q*, with the linear force of the difference between *q* and *near*."""
    raise _of_kernels()


@operation()
def center_from_barrier(terms: Any, center: Any) -> Any:
    """The displacement of the centre from the height that divides the wells, m."""
    raise _of_kernels()


@operation()
def has_crossed(terms: Any, center: float, well_sign: float, crossed: Any) -> Any:
    """Return whether mid-span has crossed to the side of the other well."""
    raise _of_kernels()


@inlined
def kinematics_from_barrier(terms, kinematics):
    """The kinematics, with the centre measured from the barrier between the wells."""
    return ContactKinematics(
        kinematics.w,
        kinematics.wv,
        kinematics.d,
        kinematics.dv,
        center_from_barrier(terms, kinematics.c),
        kinematics.cv,
    )


# Work.


def _working(classes: list[Any]) -> list[int]:
    """Which terms do work."""
    return [i for i, each in enumerate(classes) if hasattr(each, "kick_work")]


def _tuple(items: list[str]) -> str:
    return f"({', '.join(items)},)" if items else "()"


def _write_flag(attribute: str) -> Callable[[list[Any]], tuple[list[str], dict[str, Any]]]:
    return lambda classes: ([f"return {any(hasattr(each, attribute) for each in classes)}"], {})


def does_work(terms: Any) -> bool:
    """Return whether a term does work on the beam; known at compile time, as are the next ones."""
    raise _of_kernels()


def needs_tension_product(terms: Any) -> bool:
    """Return whether the work of a term needs r = G q at every kick."""
    raise _of_kernels()


def wells_differ(terms: Any) -> bool:
    """Return whether the two wells are not mirror images."""
    raise _of_kernels()


def may_hide_onset(terms: Any) -> bool:
    """Return whether a term can change the motion within a step so much that an onset of contact is missed."""
    raise _of_kernels()


def bounds_by_energy(terms: Any) -> bool:
    """True with a term whose speed bound needs the energy; it is then trusted for a quarter of the time."""
    raise _of_kernels()


def has_state(terms: Any) -> bool:
    """True with a term whose state changes in flows."""
    raise _of_kernels()


_compiled_for_terms(does_work, _write_flag("kick_work"))
_compiled_for_terms(needs_tension_product, _write_flag("needs_tension_product"))
_compiled_for_terms(wells_differ, _write_flag("relative_to_nearest_well"))
_compiled_for_terms(may_hide_onset, _write_flag("may_hide_onset"))
_compiled_for_terms(bounds_by_energy, _write_flag("bounds_by_energy"))
_compiled_for_terms(has_state, _write_flag("after_flow"))


def no_external_work(terms: Any) -> ExternalWork:
    """Zero work of all terms."""
    raise _of_kernels()


_compiled_for_terms(
    no_external_work,
    lambda classes: ([f"return ExternalWork({_tuple(['0.0'] * len(classes))}, 0.0)"], {}),
)


def total_work(terms: Any, one: ExternalWork, two: ExternalWork) -> ExternalWork:
    """Sum of the work of two parts of a step."""
    raise _of_kernels()


def _write_total(classes: list[Any]) -> tuple[list[str], dict[str, Any]]:
    works = _tuple([f"one.works[{i}] + two.works[{i}]" for i in range(len(classes))])
    return [f"return ExternalWork({works}, one.gross + two.gross)"], {}


_compiled_for_terms(total_work, _write_total)


def add_work(
    memory: Any,
    size: int,
    terms: Any,
    weight: float,
    g: int,
    r: int,
    kick: int,
    p: int,
    external: ExternalWork,
) -> ExternalWork:
    """Add the work of a kick to that of the step so far."""
    raise _of_kernels()


def _write_added(classes: list[Any]) -> tuple[list[str], dict[str, Any]]:
    working = _working(classes)
    lines = [f"work{i} = term{i}(memory, size, terms[{i}], weight, g, r, kick, p)" for i in working]
    works = [f"external.works[{i}]" + (f" + work{i}" if i in working else "") for i in range(len(classes))]
    gross = " + ".join(["external.gross", *(f"abs(work{i})" for i in working)])
    lines.append(f"return ExternalWork({_tuple(works)}, {gross})")
    return lines, {f"term{i}": classes[i].kick_work for i in working}


_compiled_for_terms(add_work, _write_added)


def accumulate_work(terms: Any, accumulators: Any, external: ExternalWork) -> None:
    """Enter the work in a step in the statistics."""
    raise _of_kernels()


def _write_accumulated(classes: list[Any]) -> tuple[list[str], dict[str, Any]]:
    working = _working(classes)
    lines = [f"accumulators.{classes[i].accumulator} += external.works[{i}]" for i in working]
    return [*lines, *(["accumulators.gross_work += external.gross"] if working else []), "return"], {}


_compiled_for_terms(accumulate_work, _write_accumulated)


def works_so_far(accumulators: tuple[str, ...]) -> Any:
    """Make a function f(terms, sums, external): *accumulators* of the run, with the work in a part of a step."""

    def works(terms: Any, sums: Any, external: ExternalWork) -> tuple[float, ...]:
        raise _of_kernels()

    def write(classes: list[Any]) -> tuple[list[str], dict[str, Any]]:
        parts = {name: [f"sums.{name}"] for name in accumulators}
        for i in _working(classes):
            parts[classes[i].accumulator].append(f"external.works[{i}]")
        found = [" + ".join(each) for each in parts.values()]
        return [f"return {_tuple(found)}"], {}

    return _compiled_for_terms(works, write)
