"""The run-lane layout's operations over modes, written out for a shape: one mode a variable, nothing in a loop.

``solver/step.py`` explains the step that is built from them.  Sums over modes are taken in the order in which the
mode-lane layout takes them, eight modes to a register, so that
both give the same bits.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cache
from typing import Any, NamedTuple

from numba.extending import overload

from snapbeam.solver.compilation import INLINE_HERE, inlined
from snapbeam.solver.cpu.run_lanes import layout as at
from snapbeam.solver.excitation import Tip
from snapbeam.solver.interpolation import hermite_overshoot_bound
from snapbeam.solver.physics import (
    mode_energy,
    mode_power,
    shaker_motion,
    sincos,
    tension_acceleration,
    tension_factors,
    turned,
)
from snapbeam.solver.simd import (
    WIDTH,
    both,
    broadcast_load,
    fma,
    less,
    load,
    move,
    pick,
    splat,
    store,
    vabs,
    vmax,
)
from snapbeam.solver.splitting import TURNS
from snapbeam.solver.step import InnerProducts, Primitives, build_step, flow_mode, kick_mode, rotate_phase

_KNOWN: dict[str, Any] = {
    "__name__": __name__, "both": both, "hermite_overshoot_bound": hermite_overshoot_bound, "flow_mode": flow_mode, "fma": fma,
    "InnerProducts": InnerProducts, "kick_mode": kick_mode, "less": less, "load": load, "move": move,
    "mode_energy": mode_energy, "mode_power": mode_power, "pick": pick, "shaker_motion": shaker_motion, "sincos": sincos,
    "splat": splat, "broadcast_load": broadcast_load, "store": store, "tension_acceleration": tension_acceleration,
    "tension_factors": tension_factors, "turned": turned, "vabs": vabs, "vmax": vmax,
}  # fmt: skip


class Modes:
    """The modes of a shape, in the order of their rows in the other layout."""

    def __init__(self, blocks: tuple[int, ...], flows: int) -> None:
        self.count, self.flows, self.distinct = sum(blocks), flows, (flows + 1) // 2
        self.rows: list[int] = []
        """Padded row of each mode."""
        self.blocks: list[range] = []
        first = padded = 0
        for size in blocks:
            self.blocks.append(range(first, first + size))
            self.rows += [padded + j for j in range(size)]
            first, padded = first + size, padded + -(-size // WIDTH) * WIDTH

    def each(self) -> range:
        """Return the indices of the modes."""
        return range(self.count)

    def place(self, i: int, field: int) -> int:
        """Return the row in memory of *field* of mode *i*."""
        return at.MODE + i * at.MODE_ROWS + field

    def row(self, i: int, field: int | str) -> str:
        """A row of a mode; *field* may be the name of an argument."""
        return (
            f"load(m, {self.place(i, 0)} + {field})"
            if isinstance(field, str)
            else f"load(m, {self.place(i, field)})"
        )

    def number(self, i: int, which: int) -> str:
        """Return the expression that loads one number of mode *i* into all lanes."""
        return f"broadcast_load(m, {self.place(i, which)})"

    def total(self, term: Callable[[int], tuple[str, str]]) -> str:
        """The sum over modes of products: a chain down each of the eight columns, then halves, quarters and pairs."""
        columns: list[str | None] = [None] * WIDTH
        for i in self.each():
            column = self.rows[i] % WIDTH
            before, (a, b) = columns[column], term(i)
            columns[column] = f"({a} * {b})" if before is None else f"fma({a}, {b}, {before})"
        return _tree(columns)

    def plain_total(self, term: Callable[[int], str]) -> str:
        """The sum over modes of plain terms, in the same order."""
        columns: list[str | None] = [None] * WIDTH
        for i in self.each():
            column = self.rows[i] % WIDTH
            before = columns[column]
            columns[column] = term(i) if before is None else f"({before} + {term(i)})"
        return _tree(columns)

    def product(self, i: int) -> str:
        """Row i of G q, of variables q0, q1, ..."""
        block = next(each for each in self.blocks if i in each)
        padded = -(-len(block) // WIDTH) * WIDTH
        strip = (i - block.start) // (2 * WIDTH) * 2 * WIDTH
        ways = 4 if strip + 2 * WIDTH <= padded else 2
        sums: list[str | None] = [None] * ways
        for j in block:
            way = (j - block.start) % ways
            element = f"broadcast_load(m, {at.COUPLING + i * at.MOST + j})"
            before = sums[way]
            sums[way] = f"({element} * q{j})" if before is None else f"fma({element}, q{j}, {before})"
        if ways == 4:
            return _add(_add(sums[0], sums[1]), _add(sums[2], sums[3])) or "splat(0.0)"
        return _add(sums[0], sums[1]) or "splat(0.0)"


def _add(a: str | None, b: str | None) -> str | None:
    if a is None or b is None:
        return a or b
    return f"({a} + {b})"


def _tree(columns: list[str | None]) -> str:
    width = WIDTH
    while width > 1:
        width //= 2
        columns = [_add(columns[i], columns[i + width]) for i in range(width)]
    return columns[0] or "splat(0.0)"


def made(name: str, lines: list[str]) -> Any:
    """Compile source lines that define the function *name*, and return it."""
    found: dict[str, Any] = dict(_KNOWN)
    exec(compile("\n".join(lines), f"<{name}>", "exec"), found)
    return found[name]


def _tension(modes: Modes) -> list[str]:
    """g.q, q.Gq and the products r0, r1, ... of q0, q1, ... ; the well's numbers are g0, g1, ..."""
    lines = [f"r{i} = {modes.product(i)}" for i in modes.each()]
    lines += [f"gq = {modes.total(lambda i: (f'g{i}', f'q{i}'))}"]
    lines += [f"qr = {modes.total(lambda i: (f'r{i}', f'q{i}'))}"]
    return lines


# The operations that the step is built from.  Rows are tuples of registers, one for each mode.


class LaneState(NamedTuple):
    """Rows of a step: displacements, velocities, and accelerations at the last kick."""

    q: Any
    p: Any
    k: Any


class LaneStepData(NamedTuple):
    """All numbers that a step of eight runs reads."""

    m: Any
    stages: Any
    flows: int
    gamma: float
    tip: Any
    in_contact: bool
    """True if any of the runs is in contact."""
    closed: Any
    """Mask of those that are."""
    length: Any
    sine: Any
    """Sine of the phase of the drive at the beginning."""
    cosine: Any


class SineDrive(NamedTuple):
    """The drives of eight runs."""

    amplitude: Any
    omega: Any


_KNOWN["LaneState"] = LaneState


@inlined
def _zero(data):
    return splat(0.0)


@inlined
def _kick_weight(data, stage):
    return broadcast_load(data.m, data.stages.kick + stage) * data.length


@inlined
def _tip_motion(data, stage):
    turn = at.TURN + WIDTH * stage
    ahead, cosine_ahead = load(data.m, turn), load(data.m, turn + TURNS * WIDTH)
    sine, cosine = rotate_phase(data.sine, data.cosine, ahead, cosine_ahead)
    return shaker_motion(data.tip.drive.amplitude, data.tip.drive.omega, sine, cosine)


@inlined
def _where_closed(data, force):
    return pick(data.closed, force, 0.0)


def _row(terms: Iterable[str]) -> str:
    return f"({', '.join(terms)},)"


def _begin(modes: Modes) -> list[str]:
    rows = [_row(modes.row(i, field) for i in modes.each()) for field in (at.Q, at.P, at.K)]
    return ["def begin(data):", "    m = data.m", f"    return LaneState({', '.join(rows)}), None"]


def _form_products(modes: Modes) -> list[str]:
    lines = ["def form_products(data, stage, state):", "    m, cq, r = data.m, splat(0.0), state.q"]
    lines += ["    gq, qr = cq, cq"]
    lines += [f"    q{i} = state.q[{i}]" for i in modes.each()]
    lines += ["    if data.in_contact:"]
    lines += [f"        cq = {modes.total(lambda i: (modes.row(i, at.CONTACT), f'q{i}'))}"]
    lines += ["    if stage > 0:"]
    lines += [f"        g{i} = {modes.row(i, at.SEEN_WELL)}" for i in modes.each()]
    lines += [f"        {line}" for line in _tension(modes)]
    lines += [f"        r = {_row(f'r{i}' for i in modes.each())}"]
    return [*lines, "    return InnerProducts(cq, gq, qr, r)"]


def _kick_and_flow(modes: Modes) -> list[str]:
    each, last = modes.each(), modes.flows
    k = (f"tension_acceleration(along_g, along_r, {modes.row(i, at.SEEN_WELL)}, r[{i}])" for i in each)
    p = (f"kick_mode(weight, k[{i}], {modes.row(i, at.CONTACT)}, force, p[{i}])" for i in each)
    lines = ["def kick_and_flow(data, stage, state, weight, along_g, along_r, r, force):"]
    lines += ["    m, q, p, k = data.m, state.q, state.p, state.k"]
    lines += ["    if stage > 0:", f"        k = {_row(k)}", f"    p = {_row(p)}"]
    lines += [f"    if stage < {last}:", f"        flow = {4 * WIDTH} * min(stage, {last - 1} - stage)"]
    for i in each:
        a = (f"load(m, {modes.place(i, at.FLOW + c * WIDTH)} + flow)" for c in range(4))
        lines += [f"        q{i}, p{i} = flow_mode(q[{i}], p[{i}], {', '.join(a)})"]
    lines += [f"        q, p = {_row(f'q{i}' for i in each)}, {_row(f'p{i}' for i in each)}"]
    return [*lines, "    return LaneState(q, p, k), splat(0.0)"]


def _store_end(modes: Modes) -> list[str]:
    """The state at the end of a step, into Q1, P1 and K1."""
    lines = ["def store_end(m, state):"]
    for i in modes.each():
        for name, field in (("q", at.Q1), ("p", at.P1), ("k", at.K1)):
            lines += [f"    store(m, {modes.place(i, field)}, state.{name}[{i}])"]
    return lines


@cache
def _step_of(shape: Any) -> Any:
    """The step for a shape."""
    begin, form_products, kick_and_flow, store_end = (
        _function(name, shape) for name in ("begin", "form_products", "kick_and_flow", "store_end")
    )
    flows = shape.flows
    take = build_step(
        Primitives(
            zero=_zero,
            begin=begin,
            kick_weight=_kick_weight,
            tip_motion=_tip_motion,
            form_products=form_products,
            where_closed=_where_closed,
            kick_and_flow=kick_and_flow,
        )
    ).take_step

    @inlined
    def take_step(m, stages, gamma, in_contact, closed, law):
        offset = load(m, at.OFFSET) + (1.0 - load(m, at.WELL_SIGN)) * load(m, at.REST_CONTACT)
        tip = Tip(offset, law, SineDrive(load(m, at.AMPLITUDE), load(m, at.OMEGA)))
        length, sine, cosine = load(m, at.LENGTH), load(m, at.SINE), load(m, at.COSINE)
        state, increment = take(
            LaneStepData(m, stages, flows, gamma, tip, in_contact, closed, length, sine, cosine)
        )
        store_end(m, state)
        store(m, at.GQ, increment.gq)
        store(m, at.QR, increment.qr)
        return increment.contact

    return take_step


def _signals(modes: Modes) -> list[str]:
    lines = ["def signals(m, shape, q, p):"]
    for i in modes.each():
        lines += [f"    q{i}, p{i} = {modes.row(i, 'q')}, {modes.row(i, 'p')}"]
        lines += [f"    c{i}, e{i} = {modes.row(i, at.CONTACT)}, {modes.number(i, at.CENTER)}"]
    found = [
        modes.total(lambda i, row=row, of=of: (f"{row}{i}", f"{of}{i}"))  # type: ignore[misc]
        for row, of in (("c", "q"), ("c", "p"), ("e", "q"), ("e", "p"))
    ]
    return [*lines, f"    return {', '.join(found)}"]


def _tension_at(modes: Modes) -> list[str]:
    """g.q and q.Gq of a state, and the tension's acceleration, into K where the mask is true."""
    lines = ["def tension(m, shape, gamma, which, q):"]
    for i in modes.each():
        lines += [f"    q{i}, g{i} = {modes.row(i, 'q')}, {modes.row(i, at.SEEN_WELL)}"]
    lines += [f"    {line}" for line in _tension(modes)]
    lines += ["    along_g, along_r = tension_factors(gamma, gq, qr)"]
    for i in modes.each():
        lines += [
            f"    store(m, {modes.place(i, at.K)}, pick(which, tension_acceleration(along_g, along_r, g{i}, r{i}),"
            f" {modes.row(i, at.K)}))"
        ]
    return [*lines, "    return gq, qr"]


def _bounds(modes: Modes) -> list[str]:
    """Bounds of the speeds of contact point and centre by the linear flow, and what the tension pushes them with."""
    lines = ["def bounds(m, shape):"]
    for i in modes.each():
        omega = modes.number(i, at.OMEGA_I)
        lines += [f"    s{i} = vabs({modes.row(i, at.P)}) + vabs({omega} * {modes.row(i, at.Q)})"]
        lines += [f"    k{i}, c{i} = {modes.row(i, at.K)}, {modes.row(i, at.CONTACT)}"]
        lines += [f"    e{i} = {modes.number(i, at.CENTER)}"]
    found = [
        modes.total(lambda i: (f"vabs(c{i})", f"s{i}")),
        modes.total(lambda i: (f"c{i}", f"k{i}")),
        modes.total(lambda i: (f"vabs(e{i})", f"s{i}")),
        modes.total(lambda i: (f"e{i}", f"k{i}")),
    ]
    return [*lines, f"    return {', '.join(found)}"]


def _cubic_errors(modes: Modes) -> list[str]:
    """Bounds of the distance of contact point and centre from the cubics through both ends of a free step of length h.

    A cubic through the values and the rates at both ends is off by at most h^4 / 384 times the fourth derivative.  Of
    q'' = -2 zeta w p - w^2 q + k that is at most (1 + 4 zeta^2) w^2 (w^2 |q| + w |p| + 3 |k|), with q and p at the beginning.  The
    kicks add at most 0.02 h^2 |k|, since samples take the acceleration as impulses at the ends of subintervals.
    """
    lines = ["def cubic_errors(m, shape, length):"]
    for i in modes.each():
        omega, squared = modes.number(i, at.OMEGA_I), modes.number(i, at.OMEGA_SQUARED)
        damping = modes.number(i, at.DAMPING)
        lines += [f"    k{i} = vabs({modes.row(i, at.K)}) + vabs({modes.row(i, at.K1)})"]
        lines += [
            f"    u{i} = {squared} * vabs({modes.row(i, at.Q)}) + {omega} * vabs({modes.row(i, at.P)}) + 3.0 * k{i}"
        ]
        lines += [f"    u{i} = fma(factor, ({squared} + 4.0 * {damping} * {damping}) * u{i}, kicks * k{i})"]
        lines += [f"    c{i}, e{i} = vabs({modes.row(i, at.CONTACT)}), vabs({modes.number(i, at.CENTER)})"]
    lines[1:1] = [
        "    kicks = 0.02 * (length * length)",
        f"    factor = {1.1 / 384.0} * (length * length) * (length * length)",
    ]
    found = [modes.total(lambda i: ("c" + str(i), f"u{i}")), modes.total(lambda i: ("e" + str(i), f"u{i}"))]
    lines += [f"    turn = load(m, {at.OMEGA}) * load(m, {at.OMEGA})"]
    return [
        *lines,
        f"    return fma(factor * (turn * turn), vabs(load(m, {at.AMPLITUDE})), {found[0]}), {found[1]}",
    ]


def _energies(modes: Modes) -> list[str]:
    """Quadratic part of the energy."""
    lines = ["def modal_energy(m, shape, q, p):"]
    for i in modes.each():
        omega = modes.number(i, at.OMEGA_I)
        lines += [f"    u{i} = mode_energy({omega}, {modes.row(i, 'q')}, {modes.row(i, 'p')})"]
    total = modes.plain_total(lambda i: f"u{i}")
    return [*lines, f"    return {total}"]


def _energies_and_powers(modes: Modes) -> list[str]:
    """Quadratic part of the energy, the part of it in modes that count as high, and the rates of both."""
    lines = ["def modal_energies(m, shape, q, p, k, force):"]
    for i in modes.each():
        omega, damping = modes.number(i, at.OMEGA_I), modes.number(i, at.DAMPING)
        lines += [f"    p{i} = {modes.row(i, 'p')}"]
        lines += [f"    u{i} = mode_energy({omega}, {modes.row(i, 'q')}, p{i})"]
        contact = modes.row(i, at.CONTACT)
        lines += [f"    v{i} = mode_power({damping}, {modes.row(i, 'k')}, {contact}, force, p{i})"]
    total, power = modes.plain_total(lambda i: f"u{i}"), modes.plain_total(lambda i: f"v{i}")
    high = modes.total(lambda i: (modes.number(i, at.HIGH), f"u{i}"))
    high_power = modes.total(lambda i: (modes.number(i, at.HIGH), f"v{i}"))
    return [*lines, f"    return {total}, {high}, {power}, {high_power}"]


def _free_propagation(modes: Modes) -> list[str]:
    """A free step in short subintervals, as the other layout's :func:`~snapbeam.solver.cpu.events.sample_inside_step`.

    Row i of the samples is the penetration, its rate, the displacement of the centre and its rate; only lanes of *which*
    that have so many subintervals are written.  Returns, for each lane, the maximum value that the penetration may have
    had: its cubics stay below.
    """
    head = ["def glide(m, shape, sampling, which, with_center, most):"]
    body = [f"subintervals, subinterval = load(m, {at.SUBINTERVALS}), load(m, {at.SUBINTERVAL})"]
    body += [f"amplitude, omega = load(m, {at.AMPLITUDE}), load(m, {at.OMEGA})"]
    body += [f"offset = load(m, {at.OFFSET}) + (1.0 - load(m, {at.WELL_SIGN})) * load(m, {at.REST_CONTACT})"]
    for i in modes.each():
        body += [f"q{i}, p{i} = {modes.row(i, at.Q)}, {modes.row(i, at.P)}"]
        body += [f"k{i}, l{i} = {modes.row(i, at.K)}, {modes.row(i, at.K1)}"]
        body += [f"c{i}, e{i} = {modes.row(i, at.CONTACT)}, {modes.number(i, at.CENTER)}"]
    total = modes.total
    body += [
        f"contact0 = {total(lambda i: (f'c{i}', f'k{i}'))}",
        f"contact1 = {total(lambda i: (f'c{i}', f'l{i}'))}",
    ]
    body += [
        f"center0 = {total(lambda i: (f'e{i}', f'k{i}'))}",
        f"center1 = {total(lambda i: (f'e{i}', f'l{i}'))}",
    ]
    body += [
        "turn_sine, turn_cosine = sincos(omega * subinterval)",
        f"sine, cosine = load(m, {at.SINE}), load(m, {at.COSINE})",
    ]
    cq, cp = total(lambda i: (f"c{i}", f"q{i}")), total(lambda i: (f"c{i}", f"p{i}"))
    eq, ep = total(lambda i: (f"e{i}", f"q{i}")), total(lambda i: (f"e{i}", f"p{i}"))
    body += ["before, before_rate, begun, greatest = splat(0.0), splat(0.0), splat(0.0), splat(-1.0)"]
    body += ["for i in range(most + 1):"]
    step = ["done = i / subintervals", "if i > 0:"]
    # the subinterval that ends here, after the kick at its beginning
    step += [
        "    begun = (i - 1) / subintervals",
        "    kick = subinterval",
        "    if i == 1:",
        "        kick = 0.5 * subinterval",
    ]
    for i in modes.each():
        a11, a12, a21, a22 = (modes.row(i, at.SAMPLING_FLOW + c * WIDTH) for c in range(4))
        step += [f"    kicked = fma(kick * begun, l{i}, p{i})"]
        step += [f"    kicked = fma(kick * (1.0 - begun), k{i}, kicked)"]
        step += [f"    p{i} = turned(kicked, {a22}, {a21}, q{i})"]
        step += [f"    q{i} = turned(q{i}, {a11}, {a12}, kicked)"]
    step += ["owed = 0.5 * subinterval", "if i == 0:", "    owed = splat(0.0)"]
    step += ["motion, velocity = shaker_motion(amplitude, omega, sine, cosine)"]
    step += [f"d = offset + motion - {cq}"]
    step += [f"dv = velocity - {cp} - owed * ((1.0 - done) * contact0 + done * contact1)"]
    step += [f"row = sampling + {4 * WIDTH} * i"]
    step += ["written = both(which, less(i - 0.5, subintervals))"]
    step += ["store(m, row, pick(written, d, load(m, row)))"]
    step += [f"store(m, row + {WIDTH}, pick(written, dv, load(m, row + {WIDTH})))"]
    step += ["if with_center:"]
    step += [f"    c = {eq}", f"    cv = {ep} + owed * ((1.0 - done) * center0 + done * center1)"]
    step += [f"    store(m, row + {2 * WIDTH}, pick(written, c, load(m, row + {2 * WIDTH})))"]
    step += [f"    store(m, row + {3 * WIDTH}, pick(written, cv, load(m, row + {3 * WIDTH})))"]
    step += ["if i > 0:"]
    step += ["    reach = vmax(before, d) + hermite_overshoot_bound(before_rate, dv, subinterval)"]
    step += ["    greatest = pick(written, vmax(greatest, reach), greatest)"]
    step += ["before, before_rate, begun = d, dv, done"]
    step += [
        "sine, cosine = sine * turn_cosine + cosine * turn_sine, cosine * turn_cosine - sine * turn_sine"
    ]
    body += [f"    {line}" for line in step]
    return head + [f"    {line}" for line in [*body, "return greatest"]]


def _load_prepared_step(modes: Modes) -> list[str]:
    """The flows and turns of a prepared step, copied into one lane."""
    lines = ["def load_prepared_step(m, shape, place, lane):"]
    for i in modes.each():
        for flow in range(modes.distinct):
            group, j = divmod(i * modes.distinct + flow, WIDTH)
            for c in range(4):
                to = modes.place(i, at.FLOW + (4 * flow + c) * WIDTH)
                lines += [f"    move(m, {to} + lane, place + {(4 * group + c) * WIDTH + j})"]
    turns = at.groups(modes.count, modes.distinct) * 4 * WIDTH
    for stage in range(modes.flows + 1):
        for part in (0, TURNS):
            to = at.TURN + (part + stage) * WIDTH
            lines += [f"    move(m, {to} + lane, place + {turns + part + stage})"]
    return lines


TEXTS = {
    "load_prepared_step": _load_prepared_step, "begin": _begin, "form_products": _form_products, "kick_and_flow": _kick_and_flow,
    "store_end": _store_end, "signals": _signals, "tension": _tension_at, "bounds": _bounds,
    "cubic_errors": _cubic_errors,
    "modal_energy": _energies, "modal_energies": _energies_and_powers, "glide": _free_propagation,
}  # fmt: skip


# Functions over modes, each written out for the shape that it is called with.


@cache
def _function(name: str, shape: Any) -> Any:
    """A function over the modes of a shape, compiled into whatever calls it."""
    return inlined(made(name, TEXTS[name](Modes(shape.blocks, shape.flows))))


def take_step(m: Any, shape: Any, stages: Any, gamma: float, in_contact: bool, closed: Any, law: Any) -> Any:
    """A step of every lane, from Q, P and K to Q1, P1 and K1; returns the increment of the contact.

    *closed* is the mask of the lanes in contact; *in_contact* is whether there is any.
    """
    raise TypeError("take_step runs in compiled code only")


@overload(take_step, jit_options=INLINE_HERE)
def _take_step_of(m, shape, stages, gamma, in_contact, closed, law):
    written = _step_of(shape.instance_class)
    return lambda m, shape, stages, gamma, in_contact, closed, law: written(
        m, stages, gamma, in_contact, closed, law
    )


def signals(m: Any, shape: Any, q: int, p: int) -> Any:
    """Displacement of the contact point and of the centre from rest and their rates: c.q, c.p, e.q, e.p."""
    raise TypeError("signals runs in compiled code only")


@overload(signals, jit_options=INLINE_HERE)
def _signals_of(m, shape, q, p):
    written = _function("signals", shape.instance_class)
    return lambda m, shape, q, p: written(m, shape, q, p)


def beam_signals(m: Any, shape: Any, q: int, p: int, w: Any, wv: Any) -> Any:
    """Displacement and velocity of the beam at the striker, as in the mode-lane layout."""
    raise TypeError("beam_signals runs in compiled code only")


@overload(beam_signals, jit_options=INLINE_HERE)
def _beam_signals_of(m, shape, q, p, w, wv):
    if shape.instance_class.body is None:
        return lambda m, shape, q, p, w, wv: (w, wv)
    body = at.MODE + shape.instance_class.body * at.MODE_ROWS

    def without_body(m, shape, q, p, w, wv):
        c = load(m, body + at.CONTACT)
        return w - c * load(m, body + q), wv - c * load(m, body + p)

    return without_body


def beam_energies(m: Any, shape: Any, q: int, p: int, k: int, force: Any, energy: Any, power: Any) -> Any:
    """Modal energy of the beam without the striker's mass, and its rate."""
    raise TypeError("beam_energies runs in compiled code only")


@overload(beam_energies, jit_options=INLINE_HERE)
def _beam_energies_of(m, shape, q, p, k, force, energy, power):
    if shape.instance_class.body is None:
        return lambda m, shape, q, p, k, force, energy, power: (energy, power)
    body = at.MODE + shape.instance_class.body * at.MODE_ROWS

    def without_body(m, shape, q, p, k, force, energy, power):
        omega, damping = broadcast_load(m, body + at.OMEGA_I), broadcast_load(m, body + at.DAMPING)
        own = mode_energy(omega, load(m, body + q), load(m, body + p))
        given = mode_power(damping, load(m, body + k), load(m, body + at.CONTACT), force, load(m, body + p))
        return energy - own, power - given

    return without_body


def tension(m: Any, shape: Any, gamma: float, which: Any, q: int) -> Any:
    """g.q and q.Gq; the tension's acceleration goes to K where the mask *which* is true."""
    raise TypeError("tension runs in compiled code only")


@overload(tension, jit_options=INLINE_HERE)
def _tension_of(m, shape, gamma, which, q):
    written = _function("tension", shape.instance_class)
    return lambda m, shape, gamma, which, q: written(m, shape, gamma, which, q)


def bounds(m: Any, shape: Any) -> Any:
    """Bounds of the speed of contact point and mid-span, and of the acceleration by the tension."""
    raise TypeError("bounds runs in compiled code only")


@overload(bounds, jit_options=INLINE_HERE)
def _bounds_of(m, shape):
    written = _function("bounds", shape.instance_class)
    return lambda m, shape: written(m, shape)


def cubic_errors(m: Any, shape: Any, length: Any) -> Any:
    """Bounds of the distances of contact point and centre from the cubics through both ends of a free step."""
    raise TypeError("cubic_errors runs in compiled code only")


@overload(cubic_errors, jit_options=INLINE_HERE)
def _cubic_errors_of(m, shape, length):
    written = _function("cubic_errors", shape.instance_class)
    return lambda m, shape, length: written(m, shape, length)


def modal_energy(m: Any, shape: Any, q: int, p: int) -> Any:
    """Quadratic part of the energy."""
    raise TypeError("modal_energy runs in compiled code only")


@overload(modal_energy, jit_options=INLINE_HERE)
def _energy_of(m, shape, q, p):
    written = _function("modal_energy", shape.instance_class)
    return lambda m, shape, q, p: written(m, shape, q, p)


def modal_energies(m: Any, shape: Any, q: int, p: int, k: int, force: Any) -> Any:
    """The same, the part of it in modes that count as high, and the rates of both under a contact force."""
    raise TypeError("modal_energies runs in compiled code only")


@overload(modal_energies, jit_options=INLINE_HERE)
def _energies_of(m, shape, q, p, k, force):
    written = _function("modal_energies", shape.instance_class)
    return lambda m, shape, q, p, k, force: written(m, shape, q, p, k, force)


def propagate_free(m: Any, shape: Any, sampling: int, which: Any, with_center: bool, most: int) -> Any:
    """A free step in subintervals, noted from *sampling* on; returns what the penetration cannot exceed after the start."""
    raise TypeError("propagate_free runs in compiled code only")


@overload(propagate_free, jit_options=INLINE_HERE)
def _propagate_free_of(m, shape, sampling, which, with_center, most):
    written = _function("glide", shape.instance_class)
    return lambda m, shape, sampling, which, with_center, most: written(
        m, shape, sampling, which, with_center, most
    )


def modes_of(shape: Any) -> int:
    """Number of modes."""
    return sum(type(shape).blocks)


@overload(modes_of, jit_options=INLINE_HERE)
def _modes_of(shape):
    count = sum(shape.instance_class.blocks)
    return lambda shape: count


def load_prepared_step(m: Any, shape: Any, place: int, lane: int) -> None:
    """Have the flows and turns of the prepared step at *place* at hand in a lane."""
    raise TypeError("load_prepared_step runs in compiled code only")


@overload(load_prepared_step, jit_options=INLINE_HERE)
def _load_prepared_step_of(m, shape, place, lane):
    written = _function("load_prepared_step", shape.instance_class)
    return lambda m, shape, place, lane: written(m, shape, place, lane)


def groups_of(shape: Any) -> int:
    """Groups of eight pairs of a mode and a distinct flow."""
    kind = type(shape)
    return at.groups(sum(kind.blocks), (kind.flows + 1) // 2)


@overload(groups_of, jit_options=INLINE_HERE)
def _groups_of(shape):
    kind = shape.instance_class
    count = at.groups(sum(kind.blocks), (kind.flows + 1) // 2)
    return lambda shape: count
