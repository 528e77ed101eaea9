"""An engine to read: the equations of docs/theory.md in Python, integrated by SciPy's DOP853 with events.

In the linear modes q about the first well (section Damping there), with everything that a system may have:

    q'' + 2 zeta omega q' + R q' + omega^2 q + gamma [(q.Gq) g + (2 g.q + q.Gq) G q]
        = P_1(t) (g + G q) + y''(t) b + sum_j r_j f_j + sum_k h_k F_k(t) + sum_k l_k F_k(u_k, u_k') + sum_k t_k z_k

R is what a damping matrix has beyond the damping ratios, P_1 is the change of the axial load and y the motion of the base; r_j, h_k, l_k and t_k are the rows of contacts, external and
local forces and circuits, V^T phi at their locations.  With w_j the drive of a tip and D_j its residual indentation,

    d_j = d_j0 + w_j(t) - r_j.q - D_j,     f_j = max[0, F_j(d_j) + c_j(d_j) d_j']  for d_j > 0,     z_k' = -t_k.q' - lambda_k z_k.

A striker with a mass is a mode of its own in q, -1/sqrt(m) in its row; so is the charge z_k + t_k.q of a circuit, and D_j.  Laws
are the system's own objects, whose Python functions are called, and motions the sums of their components: nothing is compiled.  Works and losses are integrals
beside the state.  This is slow: it is for reading, changing and checking.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import lru_cache, partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from snapbeam.model.drive.base import Drive
from snapbeam.model.quantity import section_of
from snapbeam.solver.assemble import fastest_of, run_columns
from snapbeam.solver.ensemble import Ensemble
from snapbeam.solver.excitation import carried, motion_of, side_of, started
from snapbeam.solver.python_records import APART, LOOSE, PRESSING, SUMS, Records, nodes_of
from snapbeam.solver.statistics import OutputStates, Recorded
from snapbeam.solver.step_size import seconds_of
from snapbeam.util.diagnostics import Diagnostic, Severity, tell
from snapbeam.util.status_codes import RunStatus

_Array = NDArray[np.float64]
Motion = Callable[[float], tuple[float, float, float]]
"""Displacement (m), velocity (m/s) and acceleration (m/s^2) at a time, s."""
_Event = Callable[[float, _Array], float]
_RTOL = {4: 1e-9, 6: 2e-12}
"""Relative error of a step by the order of the accuracy level."""
_STEPS_PER_PERIOD = 150.0
"""Steps in a period of the first mode or of the drive, at least: so that no contact is passed over."""
_DEPTH, _FORCE = 1e-14, 1e-9
"""Penetration (m) and force (N) beyond zero at which events lie, so that rounding makes none."""
_MOST_RESTING = 100
"""Pieces without duration, one after the other, that a run may have."""
_SECONDS, _TURN = 1.5e-3, 0.6
"""Seconds of a step on one core, and what the fastest mode turns in it at most, rad; both estimates."""
_SLOW = (
    "engine = 'python' is made to be read: here about {:.0f} times slower than engine = 'native', some {:.1g} s a run"
)


class Contact(NamedTuple):
    """A tip and its law."""

    law: Any
    row: _Array
    offset: float
    """d_j0."""
    motion: Motion
    follows: float
    """Share of the motion of the base in that of the tip, in the frame of the ends."""
    memory: int | None
    """Mode that holds D_j."""


class Equations:
    """The equations of motion of one run."""

    def __init__(self, ensemble: Ensemble, run: int) -> None:
        system, structure, table = ensemble.systems[run], ensemble.structure, ensemble.runs[run]
        self.structure, self.n, self.omega = structure, structure.omega.size, structure.omega
        self.decay = 2.0 * structure.damping_ratio * self.omega
        rows = structure.damping_rows
        self.R = (rows.T * structure.damping_coefficients) @ rows
        self.g, self.G, self.gamma = structure.well, structure.coupling, structure.nonlinear_stiffness
        self.b: Any = structure.base_load
        self.breaks: list[float] = []
        phase, clock = ensemble.runs["phase"][run : run + 1], ensemble.clock[run : run + 1]
        end = float(table["end"] * table["tick"])

        def moves(section: str, drive: Drive) -> Motion:
            own, begun = started(system, drive.columns(), phase, clock)
            (later,), sign = begun.tolist(), side_of(system, section, drive)
            motion = motion_of(drive, system.scale, later + end, own)
            self.breaks += [float(at[0]) - later for at in drive.jumps(own, system.scale).values()]

            @lru_cache(maxsize=16)  # a derivative of the state asks for the same time again and again
            def moved(t: float) -> tuple[float, float, float]:
                w, v, a = motion(t + later).tolist()
                return sign * w, sign * v, sign * a

            return moved

        base = system.base_excitation
        self.base = None if base is None else moves("base_excitation", base.motion)
        self.up = -1.0 if base is not None and base.direction == "down" else 1.0
        self.load = None if system.axial_load is None else moves("axial_load", system.axial_load.motion)
        histories = [moves("force", each.history) for each in system.external_forces]
        self.external = list(zip(structure.force_rows, histories, strict=True))
        self.local: list[Any] = [(each, type(each.law).owner) for each in structure.local_forces]
        circuits = zip(structure.circuits, ensemble.circuits, strict=True)
        self.circuits = [(each.row, each.mode, float(coupling.rate[run])) for each, coupling in circuits]
        self.state = [APART] * len(system.contacts)
        self.contacts = [
            Contact(each.law, ensemble.contact_rows[table["contact_row"][j]], table["offset"][j],
                moves(section_of("drive", j + 1), each.striker.drive), carried(system, each.striker),
                structure.mode_of_indentation(j))
            for j, each in enumerate(system.contacts)
        ]  # fmt: skip

    def tip(self, j: int, t: float) -> tuple[float, float]:
        """w_j and w_j' in the frame of the ends."""
        (w, v, _), follows = self.contacts[j].motion(t), self.contacts[j].follows
        y, rate, _ = self.base(t) if self.base is not None and follows else (0.0, 0.0, 0.0)
        return w + follows * y, v + follows * rate

    def contact(self, j: int, t: float, s: _Array) -> tuple[float, float, Any]:
        """d_j, d_j' and the numbers of the law."""
        each, (w, v), n = self.contacts[j], self.tip(j, t), self.n
        left = 0.0 if each.memory is None else float(s[each.memory])
        d = each.offset + w - float(each.row @ s[:n]) - left
        return d, v - float(each.row @ s[n : 2 * n]), each.law.numbers(left)

    def force(self, j: int, d: float, rate: float, numbers: Any) -> float:
        """f_j, N: that of the present state, so that it stays smooth beyond the event that ends a piece."""
        return self.pressure(j, d, rate, numbers) if self.state[j] == PRESSING else 0.0

    def pressure(self, j: int, d: float, rate: float, numbers: Any) -> float:
        """F_j(d) + c_j(d) d', which a contact does not let fall below zero."""
        law, d = type(self.contacts[j].law), max(d, 1e-30)  # laws are given for d > 0
        damping = law.damping_coefficient(numbers, d) * rate if law.rate_dependent else 0.0
        return float(law.force(numbers, d) + damping)

    def currents(self, s: _Array) -> list[float]:
        """z_k, in units in which z^2/2 is an energy; of a circuit without inertia -rate t.q'."""
        q, p = s[: self.n], s[self.n : 2 * self.n]
        return [-rate * float(t @ p) if at is None else q[at] - float(t @ q) for t, at, rate in self.circuits]

    def rate(self, t: float, s: _Array) -> _Array:
        """The derivative of the state: the equations above, and the powers whose integrals are kept."""
        n, power = self.n, dict.fromkeys(SUMS, 0.0)
        q, p = s[:n], s[n : 2 * n]
        Gq = self.G @ q
        square = float(q @ Gq)
        damping = self.decay * p + self.R @ p
        total = -damping - self.omega**2 * q
        total -= self.gamma * (square * self.g + (2.0 * float(self.g @ q) + square) * Gq)
        power["dissipated"] = float(damping @ p)
        pushes = [("force_work", history(t)[0] * row) for row, history in self.external]
        if self.load is not None:
            pushes.append(("load_work", self.load(t)[0] * (self.g + Gq)))
        if self.base is not None:
            pushes.append(("base_work", self.up * self.base(t)[2] * self.b))
        for name, push in pushes:
            work = float(push @ p)
            total, power[name] = total + push, power[name] + work
            power["gross_work"] += abs(work)
        for each, law in self.local:
            u, v = each.rest + float(each.row @ q), float(each.row @ p)
            lossy = law.damping_force(each.law, u, v)
            total += (law.force(each.law, u) + lossy) * each.row
            power["local_force_work"] += lossy * v
        touched, lost, dq = [], [], p.copy()
        for (row, mode, rate), z in zip(self.circuits, self.currents(s), strict=True):
            total += z * row
            if mode is not None:
                dq[mode] = -rate * z
            lost.append(rate * z * z if mode is not None else z * z / rate)
        for j, contact in enumerate(self.contacts):
            d, d_rate, numbers = self.contact(j, t, s)
            f = self.force(j, d, d_rate, numbers)
            total += f * contact.row
            touched += [f, f * self.tip(j, t)[1]]
            if contact.law.rate_dependent and self.state[j] == PRESSING:
                power["lost"] += (f - self.pressure(j, d, 0.0, numbers)) * d_rate
        power["gross_work"] += sum(map(abs, touched[1::2]))
        return np.concatenate((dq, total, [power[name] for name in SUMS], touched, lost))

    def energy(self, s: _Array) -> float:
        """Energy of modes, tension, local forces and circuits, J."""
        q, p = s[: self.n], s[self.n : 2 * self.n]
        square = float(q @ self.G @ q)
        total = 0.5 * float(p @ p + (self.omega * q) @ (self.omega * q))
        total += self.gamma * square * (float(self.g @ q) + 0.25 * square)
        total += sum(law.energy(each.law, each.rest + float(each.row @ q)) for each, law in self.local)
        live = zip(self.circuits, self.currents(s), strict=True)
        return total + sum(0.5 * z * z for (_, mode, _), z in live if mode is not None)

    def stored(self, j: int, t: float, s: _Array) -> float:
        """Energy in a contact, J; none while it does not press: what is left where the force ceases is lost."""
        d, _, numbers = self.contact(j, t, s)
        pressing = d > 0.0 and self.state[j] == PRESSING
        return float(type(self.contacts[j].law).energy(numbers, d)) if pressing else 0.0


class Simulation(Records):
    """One run: smooth pieces from event to event."""

    def __init__(self, ensemble: Ensemble, run: int, times: _Array, in_contact: bool = False) -> None:
        eq, table = Equations(ensemble, run), ensemble.runs[run]
        q, p = ensemble.starts[int(table["start_row"])]
        q = q + ensemble.structure.shift if table["well_sign"] < 0.0 else q
        sums = np.zeros(len(SUMS) + 2 * len(eq.contacts) + len(eq.circuits))
        super().__init__(ensemble, run, eq, np.concatenate((q, p, sums)), times, in_contact)
        self.cycle, first = self.end / ensemble.cycles, 2.0 * math.pi / ensemble.scale.omega
        system, self.rtol = ensemble.systems[run], _RTOL[ensemble.order]
        shortest = 2.0 * math.pi / max(float(fastest_of(system, run_columns(system, {}), 1)[0]), 1e-300)
        self.longest = min(first, self.cycle, shortest) / _STEPS_PER_PERIOD
        size = 0.1 * self.rtol * ensemble.scale.length / max(float(np.linalg.norm(self.places[1])), 1e-300)
        sizes = (np.full(eq.n, size), np.full(eq.n, size * ensemble.scale.omega), np.full(sums.size, np.inf))
        self.atol = np.concatenate(sizes)
        """Absolute tolerance of a step; integrals do not choose it."""
        self.limited = [each for each, law in eq.local if law.is_limited()]

    def events(self) -> list[tuple[int, str, _Event]]:
        """Events that end a smooth piece: contact, event, and the function whose zero it is."""
        eq: Any = self.eq
        found: list[tuple[int, str, _Event]] = []

        def add(j: int, what: str, direction: float, value: Callable[..., float]) -> None:
            def event(t: float, s: _Array) -> float:
                return value(*eq.contact(j, t, s))

            event.terminal, event.direction = True, direction  # type: ignore[attr-defined]
            found.append((j, what, event))

        for j, state in enumerate(eq.state):
            law, side = eq.contacts[j].law, 1.0 if state == APART else -1.0
            add(j, "onset" if state == APART else "release", side, lambda d, _, __, e=side * _DEPTH: d - e)
            if law.rate_dependent and state != APART:
                sign = -1.0 if state == PRESSING else 1.0
                add(j, "loosen" if state == PRESSING else "press", sign, lambda d, v, numbers, j=j, sign=sign: (
                    eq.pressure(j, d, v, numbers) - sign * _FORCE if d > 0.0 else -sign))  # fmt: skip
            if law.memory and state == PRESSING:
                edge = law.yield_penetration
                if self.loads[j]:
                    add(j, "turn", -1.0, lambda _, v, __: v)
                else:
                    add(j, "yield", 1.0, lambda d, _, numbers, edge=edge: d - edge(numbers))
        for each in self.limited:
            leave: Any = partial(self.space, each)
            leave.terminal = True
            found.append((-1, "leave", leave))
        return found

    def space(self, each: Any, _: float, s: _Array) -> float:
        """Distance of a local force's displacement from the nearest end of its law's range; negative outside."""
        u, (low, high) = each.rest + float(each.row @ s[: self.eq.n]), type(each.law).owner.displacement_range(each.law)
        return min(u - low, high - u)

    def happened(self, j: int, what: str) -> None:
        """Change the state of a contact after an event."""
        if what == "leave":
            self.found["status"] = RunStatus.DIVERGED
            return
        state, stored = self.eq.state, self.eq.stored(j, self.t, self.s)
        if what in ("onset", "press"):
            state[j], self.onset[j] = PRESSING, self.t
            self.begun[j], self.largest[j] = float(self.s[self.impulse(j)]), 0.0
            self.loads[j] = self.at_yield(j)
        elif what in ("release", "loosen"):
            if state[j] == PRESSING:
                self.impact_ended(j)
            state[j] = APART if what == "release" else LOOSE
        elif what == "turn":  # a law with memory unloads from its greatest penetration
            (d, _, numbers), memory = self.eq.contact(j, self.t, self.s), self.eq.contacts[j].memory
            self.s[memory] = self.eq.contacts[j].law.memory_after(numbers, d)
            self.loads[j] = False
        elif what == "yield":
            self.loads[j] = True
        self.s[2 * self.eq.n] += stored - self.eq.stored(j, self.t, self.s)

    def march(
        self, stops: list[float], progress: Callable[[float], object] | None = None, over: bool = True
    ) -> list[Any]:
        """Integrate to the end, where an impact ends if all is *over*; q, p and contact times at the *stops*."""
        kept, losses = [], slice(self.s.size - len(self.eq.circuits), None)
        early, turns = self.s[losses].copy(), np.arange(self.cycle, self.end, self.cycle)
        if not all(self.space(each, self.t, self.s) > 0.0 for each in self.limited):
            self.found["status"] = RunStatus.DIVERGED
        cuts = {self.late, self.end, *stops, *self.eq.breaks, *turns.tolist()}
        for until in sorted(at for at in cuts if 0.0 < at <= self.end):
            try:
                resting = 0
                while self.t < until and self.found["status"][0] == RunStatus.OK:
                    begun = self.t
                    self.piece(until)
                    resting = resting + 1 if self.t == begun else 0
                    if resting > _MOST_RESTING:
                        self.found["status"] = RunStatus.DIVERGED
            except ArithmeticError:
                self.found["status"] = RunStatus.DIVERGED
            if self.found["status"][0] != RunStatus.OK:
                break
            if until in stops:
                kept.append((self.s[: self.eq.n], self.s[self.eq.n : 2 * self.eq.n], self.lasting()))
            if until == self.late:
                early = self.s[losses].copy()
            if progress is not None:
                progress(self.t / self.end)
        self.close(early, over)
        return kept

    def closed_inside(self, part: Any) -> float | None:
        """The first node of a step at which a contact that is apart at both ends is closed."""
        apart = [j for j, state in enumerate(self.eq.state) if state == APART]
        for t in nodes_of(part.t).ravel().tolist() if apart else ():
            s = part.sol(t)
            if any(self.eq.contact(j, t, s)[0] > _DEPTH for j in apart):
                return float(t)
        return None

    def piece(self, until: float) -> None:
        """Integrate to the next event."""
        watched = self.events()

        def center(t: float, s: _Array) -> float:
            return float(self.at_rest[1] + self.places[1] @ s[: self.eq.n]) - self.level

        with np.errstate(all="ignore"):
            part = solve_ivp(
                self.eq.rate, (self.t, until), self.s, "DOP853", dense_output=True, rtol=self.rtol, atol=self.atol,
                max_step=self.longest, first_step=min(1e-3 * self.longest, until - self.t),
                events=[center, *(event for _, _, event in watched)],
            )  # fmt: skip
        hidden = self.closed_inside(part)
        if hidden is not None:
            return self.piece(hidden)
        self.observe(part)
        self.t, self.s = float(part.t[-1]), part.y[:, -1].copy()
        self.found["steps"] += part.t.size - 1
        for (j, what, _), hit in zip(watched, part.t_events[1:], strict=True):
            if hit.size:
                self.happened(j, what)
        if part.status < 0 or not np.isfinite(self.s).all():
            self.found["status"] = RunStatus.DIVERGED
        elif self.found["steps"][0] > self.ensemble.max_steps:
            self.found["status"] = RunStatus.STEP_LIMIT


def _say_how_slow(ensemble: Ensemble) -> None:
    """Say how slow this is."""
    first, fastest = Simulation(ensemble, 0, np.empty(0)), max(float(ensemble.structure.omega.max()), 1e-300)
    own = first.end / min(first.longest, _TURN / fastest) * _SECONDS
    factor = own / seconds_of(first.end / float(ensemble.step_times[0]), first.eq.n)
    found = {"factor": factor, "seconds": own}
    tell([Diagnostic("python-engine", _SLOW.format(float(f"{factor:.0e}"), own), found, Severity.INFO)])


def record(
    ensemble: Ensemble, times: _Array, in_contact: bool, progress: Callable[[float], object] | None = None
) -> Iterator[Recorded]:
    """Integrate the one run of an ensemble, and return its record."""
    _say_how_slow(ensemble)
    run = Simulation(ensemble, 0, times, in_contact)
    run.march([], progress)
    yield run.recorded()


def run_ensemble(
    ensemble: Ensemble, threads: int | None = None, progress: Callable[[int, int], object] | None = None
) -> NDArray[Any]:
    """Integrate every run of an ensemble, one after the other; returns a record of accumulators a run."""
    return _integrated(ensemble, progress, True).accumulators_of_runs


def integrate_with_output_states(
    ensemble: Ensemble, threads: int | None = None, progress: Callable[[int, int], object] | None = None
) -> OutputStates:
    """Integrate as :func:`run_ensemble`, with the states at every output time, from which the runs go on."""
    return _integrated(ensemble, progress, False)


def _integrated(ensemble: Ensemble, progress: Callable[[int, int], object] | None, over: bool) -> OutputStates:
    _say_how_slow(ensemble)
    runs, count, n = ensemble.runs, max(1, len(ensemble.systems[0].contacts)), ensemble.structure.omega.size
    outputs = int(-(-runs["end"][0] // runs["output_interval"][0]))
    q, p = np.full((2, ensemble.size, outputs, n), np.nan)
    lasting, found = np.full((ensemble.size, outputs, count), -1.0), []
    for i in range(ensemble.size):
        run = Simulation(ensemble, i, np.empty(0))
        ticks = np.minimum(np.arange(1, outputs + 1) * runs["output_interval"][i], runs["end"][i])
        for k, kept in enumerate(run.march((ticks * run.tick).tolist(), over=over)):
            q[i, k], p[i, k], lasting[i, k] = kept
        found.append(run.found)
        if progress is not None:
            progress(i + 1, ensemble.size)
    return OutputStates(np.concatenate(found), q, p, np.ones((ensemble.size, outputs), dtype=np.int64), lasting)
