"""An engine to read: the equations of docs/theory.md in Python, integrated by SciPy's DOP853 with events.

Eq. (11) for the amplitudes alpha of the assumed modes, with every part that a system may have:

    m alpha'' + C alpha' + K0 alpha + gamma (alpha . S alpha) S alpha
        = B + P_1(t) S alpha - y''(t) mu + sum_j s_j f_j phi(x_j) + sum_k F_k h_k + sum_k z_k theta_k

with P_1 the change of the axial load, y the motion of the base, mu = integral of rho S phi, F_k a local or external force along the
row h_k.  S is the identity for a beam.  The tip j strikes from the side s_j = +1 (below) or -1 (above):

    d_j = d_j0 + w_j(t) + x_j - s_j phi(x_j) . (alpha - alpha_eq),     f_j = max[0, F_j(d_j) + c_j(d_j) d_j']  for d_j > 0.

x_j is the displacement of a tip with a mass beyond its drive w_j; z_k is the voltage or minus the current of a circuit:

    m_j x_j'' + c_j x_j' + k_j x_j = -f_j - s_j m_j y''(t),     M_k z_k' + rho_k z_k = -theta_k . alpha'.

Laws and drives are the system's own objects: of a law the functions ``force`` and ``damping_coefficient`` are called, nothing is
compiled.  Works and losses are integrals beside the state.  This is slow: it is for reading, changing and checking.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from snapbeam.model.base_excitation import rigid_mass
from snapbeam.model.drive.base import Drive, Scale
from snapbeam.model.drive.sum import SumDrive
from snapbeam.solver.ensemble import Ensemble
from snapbeam.solver.further_contacts import OFFSET, SINCE
from snapbeam.solver.statistics import (
    CIRCUIT_LATE_LOSS,
    CIRCUIT_LOSS,
    CIRCUIT_PEAK,
    Last,
    OutputStates,
    Recorded,
    empty_accumulators,
)
from snapbeam.solver.step_size import seconds_of
from snapbeam.solver.terms import WORKS
from snapbeam.util.diagnostics import Diagnostic, Severity, tell
from snapbeam.util.status_codes import RunStatus
from snapbeam.util.validation import InputError

_Array = NDArray[np.float64]
_Motion = Callable[[float], tuple[float, float, float]]
APART, PRESSING, LOOSE, STUCK = range(4)
"""State of a contact; loose: the tip is inside, but a force that loses energy would pull."""
_RTOL = {4: 1e-9, 6: 2e-12}
"""Relative error of a step by the order of the accuracy level."""
_STEPS_PER_PERIOD = 150.0
"""Steps in a period of the first mode or of the drive, at least: so that no contact is passed over."""
_DEPTH, _FORCE = 1e-14, 1e-9
"""Penetration (m) and force (N) beyond zero at which events lie, so that rounding makes none."""
_NODES, _WEIGHTS = (
    0.5 * (x + i) for i, x in zip((1.0, 0.0), np.polynomial.legendre.leggauss(5), strict=True)
)
_SECONDS = 5e-4
"""Seconds of a step of this engine on one core."""
_SLOW = "engine = 'python' is made to be read: here it takes about {:.0g} times as long as engine = 'cpu', some {:.1g} s a run"


def motion_of(
    drive: Drive, scale: Scale, phase: float, later: float, samples: _Array
) -> tuple[_Motion, list[float]]:
    """w(t), w'(t) and w''(t) of a drive that began *later* seconds ago at a *phase*, and the times at which it jumps."""
    if isinstance(drive, SumDrive):
        of = [(each, getattr(each, "phase", 0.0), each.samples()) for each in drive.parts_of_sum]
        terms = [motion_of(each, scale, own, later, table) for each, own, table in of]
        begun = sum(
            motion_of(each, scale, own, 0.0, table)[0](0.0)[0] for each, own, table in of if each.harmonic
        )

        def together(t: float) -> tuple[float, float, float]:
            w, v, a = (sum(each) for each in zip(*(term(t) for term, _ in terms), strict=True))
            return w - begun, v, a

        return together, [at for _, jumps in terms for at in jumps]
    columns = {name: np.array([value]) for name, value in drive.values().items()} or {"": np.zeros(1)}
    kind: Any = drive.integrated_as or type(drive)
    found = drive.numbers(columns, scale)
    numbers = kind.numbers_type()(*(float(found[name][0]) for name in kind.number_names))
    omega = numbers.omega

    def harmonic(t: float) -> tuple[float, float, float]:
        angle, size = omega * (t + later) + phase, numbers.amplitude
        return size * math.sin(angle), size * omega * math.cos(angle), -size * omega * omega * math.sin(angle)

    def own(t: float) -> tuple[float, float, float]:
        at = omega * (t + later) + phase
        return *kind.motion(numbers, samples, at), kind.acceleration(numbers, samples, at)

    jumps = [getattr(numbers, name) - later - phase / omega for name in kind.discontinuities]
    return harmonic if kind.harmonic else own, jumps


class Tip(NamedTuple):
    """A striker and its contact."""

    law: Any
    row: _Array
    """s_j phi(x_j)."""
    side: float
    offset: float
    """d_j0."""
    motion: _Motion
    body: tuple[float, float, float, int] | None
    """m_j, k_j, c_j, and which x_j it is."""


class Equations:
    """The equations of motion of one run."""

    def __init__(self, ensemble: Ensemble, run: int) -> None:
        system, structure, table = ensemble.systems[run], ensemble.structure, ensemble.runs[run]
        model, scale = system.model, system.scale
        self.system, self.structure, self.scale = system, structure, scale
        self.n, self.rest, self.S = model.modes, structure.equilibrium, model.elongation_matrix
        modes = structure.model.linear_modes
        self.inverse_mass, self.mass, self.C = modes @ modes.T, model.mass, structure.model.damping_matrix
        self.K0 = model.stiffness if model.stiffness.ndim == 2 else np.diag(model.stiffness)
        self.gamma = float(model.nonlinear_stiffness)
        self.B = np.zeros(self.n) if model.transverse_force is None else model.transverse_force
        self.well_energy = float(model.potential_energy(self.rest))
        self.breaks: list[float] = []
        begun, alone = float(table["phase"]), getattr(ensemble.drive, "alone", True)
        clock = float(ensemble.drive_numbers[run, ensemble.drive.number_names.index("omega")])

        def moves(drive: Drive, sign: float = 1.0) -> _Motion:
            shared = not alone or isinstance(drive, SumDrive)
            phase, later = (float(getattr(drive, "phase", 0.0)), begun / clock) if shared else (begun, 0.0)
            phase = 0.0 if isinstance(drive, SumDrive) else phase
            motion, jumps = motion_of(drive, scale, phase, later, sign * drive.samples())
            self.breaks += jumps
            return motion

        base = system.base_excitation
        self.base = None if base is None else moves(base.motion)
        self.up = -1.0 if base is not None and base.direction == "down" else 1.0
        self.carried = base is not None and base.striker_on_base
        self.mu = np.zeros(self.n) if base is None else rigid_mass(model)
        self.load = None if system.axial_load is None else moves(system.axial_load.motion)
        self.external = [(each.row(model), moves(each.history)) for each in system.external_forces]
        self.local = [(each.row(model), type(each), each.numbers) for each in system.local_forces]
        self.circuits = [
            (each.row(model), each.inertia, float(each.loss(np.array(each.resistance))))
            for each in system.harvesters
        ]
        self.live = [i for i, each in enumerate(self.circuits) if each[1] > 0.0]
        self.tips: list[Tip] = []
        bodies = 0
        for j, each in enumerate(system.contacts):
            striker, side = each.striker, 1.0 if each.striker.side == "below" else -1.0
            place = float(ensemble.location[run]) if j == 0 else striker.location
            offset = table["offset"] if j == 0 else ensemble.others.numbers[run, j - 1, OFFSET]  # type: ignore[union-attr]
            body = None
            if striker.mass is not None:
                body = (striker.mass, striker.suspension_stiffness, striker.suspension_damping, bodies)
                bodies += 1
            sign = -1.0 if striker.drive.recorded and side < 0.0 else 1.0
            self.tips.append(
                Tip(
                    each.law,
                    side * model.shape_at(place),
                    side,
                    float(offset),
                    moves(striker.drive, sign),
                    body,
                )
            )
        self.bodies = bodies
        self.size = 2 * self.n + 2 * bodies + len(self.live)
        """Of the state; the integrals follow: impulse and work of each tip, then those of :data:`SUMS`, then losses of circuits."""
        self.indent([0.0] * len(self.tips))
        self.state = [APART] * len(self.tips)

    def parts(self, y: _Array) -> tuple[_Array, _Array, _Array, _Array, _Array]:
        """Alpha, alpha', x, x' and z of all circuits."""
        n, b = self.n, self.bodies
        a, v, x, rate = y[:n], y[n : 2 * n], y[2 * n : 2 * n + b], y[2 * n + b : 2 * n + 2 * b]
        z = np.array([-float(row @ v) / rho for row, _, rho in self.circuits])
        z[self.live] = y[2 * n + 2 * b : self.size]
        return a, v, x, rate, z

    def tip_motion(self, j: int, t: float) -> tuple[float, float, float]:
        """w_j, w_j' and w_j'' in the frame of the ends, in which a tip that stands in space moves by -y."""
        w = self.tips[j].motion(t)
        if self.base is None or self.carried:
            return w
        share = -self.up * self.tips[j].side
        w0, w1, w2 = (own + share * moved for own, moved in zip(w, self.base(t), strict=True))
        return w0, w1, w2

    def penetration(self, j: int, t: float, y: _Array) -> tuple[float, float]:
        """d_j and d_j', from the indented surface."""
        a, v, x, rate, _ = self.parts(y)
        tip, (w, speed, _) = self.tips[j], self.tip_motion(j, t)
        own = (0.0, 0.0) if tip.body is None else (float(x[tip.body[3]]), float(rate[tip.body[3]]))
        d = tip.offset + w + own[0] - float(tip.row @ (a - self.rest)) - self.memory[j]
        return d, speed + own[1] - float(tip.row @ v)

    def indent(self, memory: list[float]) -> None:
        """Enter the residual indentation of each contact."""
        self.memory, self.laws = (
            memory,
            [tip.law.numbers(left) for tip, left in zip(self.tips, memory, strict=True)],
        )

    def pressure(self, j: int, d: float, rate: float) -> float:
        """F_j(d) + c_j(d) d', which the contact does not let fall below zero."""
        law, numbers = type(self.tips[j].law), self.laws[j]
        return float(
            law.force(numbers, d)
            + (law.damping_coefficient(numbers, d) * rate if law.rate_dependent else 0.0)
        )

    def contact_energy(self, j: int, d: float) -> float:
        """Energy stored in a contact."""
        return float(type(self.tips[j].law).energy(self.laws[j], d)) if d > 0.0 else 0.0

    def held(self, j: int, t: float, total: _Array, body: float) -> float:
        """Force under which d'' = 0 of a tip that sticks, from the other forces and the acceleration of its body."""
        tip = self.tips[j]
        return (self.tip_motion(j, t)[2] + body - float(tip.row @ self.inverse_mass @ total)) * self.met_mass(
            j
        )

    def met_mass(self, j: int) -> float:
        """Mass of a contact: 1/(phi . m^-1 phi + 1/m_j)."""
        tip = self.tips[j]
        return 1.0 / (
            float(tip.row @ self.inverse_mass @ tip.row) + (0.0 if tip.body is None else 1.0 / tip.body[0])
        )

    def rate(self, t: float, y: _Array) -> _Array:
        """y'(t): the right side of the equations at the top of this file, and the powers whose integrals are kept."""
        a, v, x, x_rate, z = self.parts(y)
        dy, n, b = np.zeros(y.size), self.n, self.bodies
        stretched = a if self.S is None else self.S @ a
        damping = self.C @ v
        total = self.B - self.K0 @ a - self.gamma * float(a @ stretched) * stretched - damping
        power = dict.fromkeys(SUMS, 0.0)
        power["dissipated"] = float(v @ damping)
        y2 = 0.0 if self.base is None else self.up * self.base(t)[2]
        if self.base is not None:
            total -= y2 * self.mu
            power["base_work"] = -y2 * float(self.mu @ v)
        if self.load is not None:
            change = self.load(t)[0]
            total += change * stretched
            power["load_work"] = change * float(stretched @ v)
        for row, history in self.external:
            f = history(t)[0]
            total += f * row
            power["force_work"] += f * float(row @ v)
        for row, law, numbers in self.local:
            u, u_rate = float(row @ a), float(row @ v)
            lost = law.damping_force(numbers, u, u_rate)
            total += (law.force(numbers, u) + lost) * row
            power["local_force_work"] += lost * u_rate
        for (row, _, _), current in zip(self.circuits, z, strict=True):
            total += current * row
        for place, i in enumerate(self.live, 2 * n + 2 * b):
            row, inertia, rho = self.circuits[i]
            dy[place] = (-float(row @ v) - rho * z[i]) / inertia
        gross = 0.0
        for j, tip in enumerate(self.tips):
            d, d_rate = self.penetration(j, t, y)
            carried = tip.side * y2 if self.carried else 0.0
            free = 0.0
            if tip.body is not None:
                m, k, c, at = tip.body
                free = (-c * x_rate[at] - k * x[at]) / m - carried
                power["dissipated"] += c * x_rate[at] ** 2
                power["base_work"] -= m * carried * x_rate[at]
            f = max(0.0, self.pressure(j, d, d_rate)) if d > 0.0 else 0.0
            if self.state[j] == STUCK:
                f = self.held(j, t, total, free)
            elif tip.law.rate_dependent and d > 0.0:
                power["lost"] += (f - type(tip.law).force(self.laws[j], d)) * d_rate
            if tip.body is not None:
                dy[2 * n + b + at] = free - f / m
            total += f * tip.row
            own = f * self.tip_motion(j, t)[1]
            dy[self.size + 2 * j : self.size + 2 * j + 2] = f, own
            gross += abs(own)
        power["gross_work"] = gross + sum(abs(power[name]) for name in WORKS if name != "local_force_work")
        dy[:n], dy[n : 2 * n], dy[2 * n : 2 * n + b] = v, self.inverse_mass @ total, x_rate
        first = self.size + 2 * len(self.tips)
        dy[first : first + len(SUMS)] = [power[name] for name in SUMS]
        dy[first + len(SUMS) :] = [
            rho * current**2 for (_, _, rho), current in zip(self.circuits, z, strict=True)
        ]
        return dy

    def energy(self, y: _Array) -> float:
        """Energy of beam, local forces, bodies and circuits, J; 0 at rest in the first well without local forces."""
        a, v, x, rate, z = self.parts(y)
        total = (
            0.5 * float(v @ self.mass @ v) + float(self.system.model.potential_energy(a)) - self.well_energy
        )
        total += sum(law.energy(numbers, float(row @ a)) for row, law, numbers in self.local)
        bodies = [tip.body for tip in self.tips if tip.body is not None]
        total += sum(0.5 * (m * rate[at] ** 2 + k * x[at] ** 2) for m, k, _, at in bodies)
        return float(total + sum(0.5 * self.circuits[i][1] * z[i] ** 2 for i in self.live))

    def start(self, q: _Array, p: _Array, sign: float) -> _Array:
        """State of modal coordinates about the well *sign*, integrals at zero."""
        structure = self.structure
        first = q + structure.shift if sign < 0.0 else q
        sides = np.array([tip.side for tip in self.tips if tip.body is not None])
        at = [j for j, tip in enumerate(self.tips) if tip.body is not None]
        bodies = [np.atleast_1d(structure.bodies_of(each))[at] * sides for each in (q, p)]
        z = np.atleast_1d(structure.circuits_of(q))[self.live] if self.live else np.zeros(0)
        z = z / np.sqrt([self.circuits[i][1] for i in self.live]) if self.live else z
        held = np.atleast_1d(structure.indentations_of(q))[: len(self.tips)]
        self.indent(np.nan_to_num(held).tolist())
        sums = np.zeros(2 * len(self.tips) + len(SUMS) + len(self.circuits))
        return np.concatenate((structure.amplitudes(first), structure.velocities(p), *bodies, z, sums))

    def modal(self, y: _Array) -> tuple[_Array, _Array]:
        """Modal coordinates about the first well."""
        a, v, x, rate, z = self.parts(y)
        shift, speed = np.zeros((2, max(1, len(self.tips))))
        for j, tip in enumerate(self.tips):
            if tip.body is not None:
                shift[j], speed[j] = tip.side * x[tip.body[3]], tip.side * rate[tip.body[3]]
        circuit = (
            np.array([math.sqrt(inertia) for _, inertia, _ in self.circuits]) * z if self.circuits else np.nan
        )
        return self.structure.to_modal(a, v, shift, speed, np.array(self.memory or [0.0]), circuit)

    def tolerances(self, rtol: float) -> _Array:
        """Absolute errors of a step; of integrals any."""
        b, rate = self.scale.length, self.scale.omega
        size = b / max(float(np.abs(self.system.model.midspan_shape).max()), 1e-300)
        z = []
        for i in self.live:
            row, inertia, rho = self.circuits[i]
            z.append(float(np.abs(row).max()) * size * rate / max(rho, inertia * rate))
        blocks = (
            np.full(self.n, size),
            np.full(self.n, size * rate),
            np.full(self.bodies, b),
            np.full(self.bodies, b * rate),
        )
        sums = np.full(2 * len(self.tips) + len(SUMS) + len(self.circuits), np.inf)
        return np.concatenate((*(0.1 * rtol * each for each in (*blocks, np.array(z))), sums))


SUMS = ("lost", "dissipated", "gross_work", *WORKS)
"""Integrals beside the impulses and works of the tips, by the names of accumulators."""


class Impact(NamedTuple):
    """The present impact of a contact."""

    onset: float
    """s; negative if it began before the run."""
    impulse: float
    """Integral of the force at its beginning."""


class Simulation:
    """One run: pieces of smooth motion from event to event, samples, impacts and accumulators."""

    def __init__(self, ensemble: Ensemble, run: int, times: _Array, in_contact: bool = False) -> None:
        self.eq = Equations(ensemble, run)
        table, self.tick = ensemble.runs[run], float(ensemble.runs["tick"][run])
        self.ensemble, self.run, self.times, self.in_contact = ensemble, run, times, in_contact
        self.end = float(table["end"]) * self.tick
        self.rtol = _RTOL[ensemble.order]
        period, cycle = 2.0 * math.pi / self.eq.scale.omega, self.end / ensemble.cycles
        self.longest = min(period, cycle) / _STEPS_PER_PERIOD
        self.late = float(table["last_quarter"]) * self.tick
        eq, count = self.eq, len(self.eq.tips)
        start = int(table["start_row"])
        self.y = eq.start(*ensemble.starts[start], float(table["well_sign"]))
        self.t, self.steps, self.peaks, self.hits = 0.0, 0, [0.0] * count, [0] * count
        self.impacts: list[list[float]] = []
        self.samples: list[tuple[Any, ...]] = []
        self.found = empty_accumulators(1, max(0, count - 1), len(eq.circuits))
        self.present = [Impact(0.0, 0.0)] * count
        self.greatest = [0.0] * count
        since = [float(table["contact_time"])]
        if ensemble.others is not None:
            since += ensemble.others.numbers[run, :, SINCE].tolist()
        for j, begun in enumerate(since[:count]):
            d, rate = eq.penetration(j, 0.0, self.y)
            inside = d > 0.0 and not eq.tips[j].law.impulsive
            eq.state[j] = (PRESSING if eq.pressure(j, d, rate) > 0.0 else LOOSE) if inside else APART
            if eq.tips[j].law.impulsive and begun >= 0.0:
                eq.state[j] = STUCK
            self.present[j] = Impact(-begun if eq.state[j] != APART and begun > 0.0 else 0.0, 0.0)
        sign = eq.structure.sign
        self.places = sign * np.array(
            [eq.system.model.shape_at(float(ensemble.location[run])), eq.system.model.midspan_shape]
        )
        self.level = float(eq.structure.dividing_height)
        self.whole_energy = eq.energy(self.y) + self.stored()
        names = ("displacement", "center")
        at = self.places @ self.y[: eq.n]
        for name, value in zip(names, at, strict=True):
            self.found[f"min_{name}"] = self.found[f"max_{name}"] = value

    def stored(self) -> float:
        """Energy in the contacts."""
        eq = self.eq
        return sum(eq.contact_energy(j, eq.penetration(j, self.t, self.y)[0]) for j in range(len(eq.tips)))

    def watched(self) -> list[tuple[int, str, Callable[[float, _Array], float]]]:
        """Events that end a piece: contact, what happens to it, and the function whose zero it is."""
        found: list[tuple[int, str, Callable[[float, _Array], float]]] = []
        for j, tip in enumerate(self.eq.tips):
            state, law, numbers = self.eq.state[j], tip.law, self.eq.laws[j]
            if state == STUCK:
                found.append(
                    (
                        j,
                        "unstick",
                        self.event(j, lambda t, y, j=j: self.eq.rate(t, y)[self.eq.size + 2 * j], -1.0),
                    )
                )
                continue
            found.append(
                (j, "onset", self.depth(j, 1.0)) if state == APART else (j, "release", self.depth(j, -1.0))
            )
            if law.rate_dependent and state != APART:
                found.append(
                    (j, "loosen", self.force(j, -1.0))
                    if state == PRESSING
                    else (j, "press", self.force(j, 1.0))
                )
            if law.memory and state == PRESSING:
                yields = type(law).yield_penetration(numbers)
                found.append((j, "yield", self.depth(j, 1.0, yields)))
                found.append((j, "turn", self.turn(j, yields)))
        return found

    @staticmethod
    def event(
        j: int, value: Callable[[float, _Array], float], direction: float
    ) -> Callable[[float, _Array], float]:
        """A function that ends a piece where it passes zero in a direction."""
        value.terminal, value.direction = True, direction  # type: ignore[attr-defined]
        return value

    def depth(self, j: int, direction: float, beyond: float = 0.0) -> Callable[[float, _Array], float]:
        """d_j passes zero, or another value."""
        return self.event(
            j, lambda t, y: self.eq.penetration(j, t, y)[0] - beyond - direction * _DEPTH, direction
        )

    def force(self, j: int, direction: float) -> Callable[[float, _Array], float]:
        """The force of a law that loses energy changes its sign."""

        def value(t: float, y: _Array) -> float:
            d, rate = self.eq.penetration(j, t, y)
            return self.eq.pressure(j, d, rate) - direction * _FORCE if d > 0.0 else -direction

        return self.event(j, value, direction)

    def turn(self, j: int, yields: float) -> Callable[[float, _Array], float]:
        """d_j is greatest, beyond the penetration at which the law yields."""

        def value(t: float, y: _Array) -> float:
            d, rate = self.eq.penetration(j, t, y)
            return rate if d > yields else 1.0

        return self.event(j, value, -1.0)

    def happened(self, j: int, what: str) -> None:
        """Change the state of a contact after an event."""
        eq, state = self.eq, self.eq.state
        if what == "onset" and eq.tips[j].law.impulsive:
            self.hit(j)
        elif what in ("onset", "press"):
            state[j] = PRESSING
            self.present[j], self.greatest[j] = Impact(self.t, self.y[eq.size + 2 * j]), 0.0
        elif what in ("release", "loosen", "unstick"):
            if state[j] != LOOSE:
                self.ended(j)
            state[j] = LOOSE if what == "loosen" else APART
        elif what == "turn":  # the law with memory unloads from its greatest penetration
            d = eq.penetration(j, self.t, self.y)[0]
            before, memory = eq.contact_energy(j, d), list(eq.memory)
            memory[j] = float(type(eq.tips[j].law).memory_after(eq.laws[j], d))
            eq.indent(memory)
            after = eq.contact_energy(j, eq.penetration(j, self.t, self.y)[0])
            self.y[eq.size + 2 * len(eq.tips) + SUMS.index("lost")] += before - after

    def hit(self, j: int) -> None:
        """Newton's law: d' becomes -e d'; a tip that would rise less than the least height sticks."""
        eq, tip = self.eq, self.eq.tips[j]
        closing = eq.penetration(j, self.t, self.y)[1]
        self.push(j, tip.law.coefficient, closing)
        self.hits[j] += 1
        dy = eq.rate(self.t, self.y)
        body = 0.0 if tip.body is None else float(dy[2 * eq.n + eq.bodies + tip.body[3]])
        pressed = eq.tip_motion(j, self.t)[2] + body - float(tip.row @ dy[eq.n : 2 * eq.n])
        opening = -eq.penetration(j, self.t, self.y)[1]
        if pressed > 0.0 and opening**2 < 2.0 * pressed * float(self.ensemble.runs["lowest"][self.run]):
            self.push(j, 0.0, -opening)
            eq.state[j], self.present[j] = STUCK, Impact(self.t, self.y[eq.size + 2 * j])

    def push(self, j: int, coefficient: float, closing: float) -> None:
        """Impulse (1 + e) m d' of a tip on the beam, and its work."""
        eq, tip, mass = self.eq, self.eq.tips[j], self.eq.met_mass(j)
        impulse, first = (1.0 + coefficient) * mass * closing, eq.size + 2 * len(eq.tips)
        self.y[eq.n : 2 * eq.n] += impulse * (eq.inverse_mass @ tip.row)
        if tip.body is not None:
            self.y[2 * eq.n + eq.bodies + tip.body[3]] -= impulse / tip.body[0]
        work = impulse * eq.tip_motion(j, self.t)[1]
        self.y[eq.size + 2 * j : eq.size + 2 * j + 2] += impulse, work
        self.y[first + SUMS.index("lost")] += 0.5 * mass * (1.0 - coefficient**2) * closing**2
        self.y[first + SUMS.index("gross_work")] += abs(work)
        self.impacts.append([self.t, 0.0, math.nan, impulse, j + 1.0])

    def ended(self, j: int) -> None:
        """An impact has ended."""
        begun, impulse = self.present[j]
        self.impacts.append(
            [begun, self.t - begun, self.greatest[j], self.y[self.eq.size + 2 * j] - impulse, j + 1.0]
        )
        self.found["contact_time"] += self.t - max(begun, 0.0)
        self.hits[j] += 1

    def march(
        self, stops: _Array, progress: Callable[[float], object] | None = None
    ) -> list[tuple[_Array, _Array, list[float]]]:
        """Integrate to the end; modal coordinates and contact times at the *stops*."""
        eq, found, kept = self.eq, self.found, []
        cycle = self.end / self.ensemble.cycles
        cuts = {
            self.late,
            self.end,
            *stops.tolist(),
            *(at for at in eq.breaks if at > 0.0),
            *np.arange(cycle, self.end, cycle).tolist(),
        }
        found["first_energy"], found["status"] = self.whole_energy, RunStatus.OK
        losses = self.y[self.y.size - len(eq.circuits) :]
        for until in sorted(at for at in cuts if 0.0 < at <= self.end):
            try:
                while self.t < until and found["status"][0] == RunStatus.OK:
                    self.piece(until)
            except ArithmeticError:
                found["status"] = RunStatus.DIVERGED
            if found["status"][0] != RunStatus.OK:
                break
            if until in stops:
                kept.append((*eq.modal(self.y), self.since()))
            if until == self.late:
                losses = self.y[self.y.size - len(eq.circuits) :].copy()
            if progress is not None:
                progress(self.t / self.end)
        self.close(losses)
        return kept

    def piece(self, until: float) -> None:
        """Integrate smooth motion to the next event."""
        eq, watched = self.eq, self.watched()

        def center(t: float, y: _Array) -> float:
            return float(self.places[1] @ y[: eq.n]) - self.level

        events = [center, *(each for _, _, each in watched)]
        ranges = [
            (row, law.displacement_range(numbers)) for row, law, numbers in eq.local if law.is_limited()
        ]
        for row, (low, high) in ranges:
            events.append(self.event(0, lambda t, y, r=row, a=low, b=high: min(float(r @ y[: eq.n]) - a, b - float(r @ y[: eq.n])), -1.0))  # fmt: skip
        with np.errstate(all="ignore"):
            part = solve_ivp(
                eq.rate, (self.t, until), self.y, "DOP853", dense_output=True, events=events, rtol=self.rtol,
                atol=eq.tolerances(self.rtol), max_step=self.longest, first_step=min(1e-3 * self.longest, until - self.t),
            )  # fmt: skip
        self.observe(part, part.t_events[0])
        self.t, self.y = float(part.t[-1]), part.y[:, -1].copy()
        self.steps += part.t.size - 1
        for (j, what, _), hit in zip(watched, part.t_events[1:], strict=False):
            if hit.size:
                self.happened(j, what)
        left = any(hit.size for hit in part.t_events[1 + len(watched) :])
        if left or part.status < 0 or not np.isfinite(self.y).all():
            self.found["status"] = RunStatus.DIVERGED
        elif self.steps > self.ensemble.max_steps:
            self.found["status"] = RunStatus.STEP_LIMIT

    def observe(self, part: Any, crossings: _Array) -> None:
        """Samples and statistics of a piece; integrals by Gauss's rule in each step, extremes at its nodes and ends."""
        eq, found, n = self.eq, self.found, self.eq.n
        lengths = np.diff(part.t)
        nodes = (part.t[:-1, None] + lengths[:, None] * _NODES).ravel()
        inside, weights = part.sol(nodes), (lengths[:, None] * _WEIGHTS).ravel()
        every = np.concatenate((part.y, inside), axis=1)
        for i, (name, speed) in enumerate((("displacement", "velocity"), ("center", "midspan_velocity"))):
            at, rates = self.places[i] @ every[:n], np.abs(self.places[i] @ every[n : 2 * n])
            found[f"min_{name}"] = min(found[f"min_{name}"][0], at.min())
            found[f"max_{name}"] = max(found[f"max_{name}"][0], at.max())
            found[f"peak_{speed}"] = max(found[f"peak_{speed}"][0], rates.max())
            found[f"square_{name}"] += weights @ (self.places[i] @ inside[:n]) ** 2
            found[f"square_{speed}"] += weights @ (self.places[i] @ inside[n : 2 * n]) ** 2
        found["zero_crossings"] += crossings.size
        found["zero_crossings_last_quarter"] += int((crossings > self.late).sum())
        if crossings.size:
            found["last_zero_crossing"] = crossings[-1]
        structure, back = eq.structure, eq.structure.model.linear_modes.T @ eq.mass
        q, p = back @ (inside[:n] - eq.rest[:, None]), back @ inside[n : 2 * n]
        if structure.stretch > 0.0:  # about the well on whose side mid-span is
            q = q - np.where(self.places[1] @ inside[:n] > self.level, structure.shift[:n, None], 0.0)
        energies = 0.5 * (p**2 + (structure.omega[:n, None] * q) ** 2)
        found["energy_time"] += weights @ energies.sum(axis=0)
        found["high_energy_time"] += weights @ energies[
            structure.high_modes(self.ensemble.high_omega)[:n]
        ].sum(axis=0)
        for i, (row, inertia, rho) in enumerate(eq.circuits):
            z = (
                every[2 * n + 2 * eq.bodies + eq.live.index(i)] * math.sqrt(inertia)
                if i in eq.live
                else row @ every[n : 2 * n] / rho
            )
            found["circuits"][0, i, CIRCUIT_PEAK] = max(
                found["circuits"][0, i, CIRCUIT_PEAK], np.abs(z).max()
            )
        pressed = [j for j, state in enumerate(eq.state) if state in (PRESSING, STUCK)]
        if pressed:
            forces = np.array([eq.rate(t, y)[eq.size :: 2] for t, y in zip(nodes, inside.T, strict=True)])
            for j in pressed:
                self.greatest[j] = max(self.greatest[j], float(forces[:, j].max(initial=0.0)))
                self.peaks[j] = max(self.peaks[j], self.greatest[j])
        end = float(part.t[-1])
        asked = self.times[(self.times >= self.t) & ((self.times < end) | (end >= self.end))]
        if self.in_contact and pressed:
            asked = np.union1d(asked, part.t[1:])
        self.samples += [self.sample(t, part.sol(t)) for t in asked.tolist()]

    def sample(self, t: float, y: _Array) -> tuple[Any, ...]:
        """Time, q, p and the columns of :class:`Recorded`."""
        eq, count = self.eq, len(self.eq.tips)
        d, force = (eq.penetration(0, t, y)[0], eq.rate(t, y)[eq.size]) if count else (-1e30, 0.0)
        stored, work = (
            eq.contact_energy(0, d) if count else 0.0,
            y[eq.size + 1 : eq.size + 2 * count : 2].sum(),
        )
        first = eq.size + 2 * count
        sums = dict(zip(SUMS, y[first:].tolist(), strict=False))
        of_terms = [sums[name] for name in WORKS]
        lost = [sums["dissipated"] + sums["lost"], sums["lost"]]
        return (
            t,
            *eq.modal(y),
            [d, force, eq.energy(y), stored, work, *lost, *of_terms, *y[first + len(SUMS) :]],
        )

    def since(self) -> list[float]:
        """Ticks since the contact of each striker began, -1: apart."""
        touching = [state in (PRESSING, STUCK) for state in self.eq.state] or [False]
        begun = self.present or [Impact(0.0, 0.0)]
        return [
            (self.t - each.onset) / self.tick if on else -1.0
            for on, each in zip(touching, begun, strict=True)
        ]

    def close(self, losses: _Array) -> None:
        """Enter what is known at the end."""
        eq, found, y, count = self.eq, self.found, self.y, len(self.eq.tips)
        sums = y[eq.size + 2 * count :]
        for name, value in zip(SUMS, sums.tolist(), strict=False):
            found[name] = value
        found["dissipated"] += found["lost"]
        impulses, works = y[eq.size : eq.size + 2 * count : 2], y[eq.size + 1 : eq.size + 2 * count : 2]
        found["impacts"], found["total_impulse"], found["work"] = sum(self.hits), impulses.sum(), works.sum()
        found["time"], found["steps"] = round(self.t / self.tick), self.steps
        found["energy"] = eq.energy(y) + self.stored()
        found["displacement"], found["center"] = self.places @ y[: eq.n]
        found["side"] = 1 if found["center"][0] > self.level else -1
        since = self.since()
        found["contact_time"] += sum(min(each * self.tick, self.t) for each in since if each >= 0.0)
        found["touching"], found["onset"] = since[0] >= 0.0, round(self.t / self.tick - max(since[0], 0.0))
        if count:
            found["peak_force"] = self.peaks[0]
        if count > 1:
            found["others"][0] = np.stack((self.hits, self.peaks, impulses, works), axis=1)[1:]
        if eq.circuits:
            own = sums[len(SUMS) :]
            found["circuits"][0, :, CIRCUIT_LOSS], found["circuits"][0, :, CIRCUIT_LATE_LOSS] = (
                own,
                own - losses,
            )
        for name in found.dtype.names or ():
            if name.startswith(
                "own_"
            ):  # a registered statistic that is updated in every step of the other engines
                found[name] = math.nan

    def recorded(self) -> Recorded:
        """Samples, impacts and accumulators."""
        n, width = self.eq.structure.omega.size, 7 + len(WORKS) + len(self.eq.circuits)
        times, q, p, values = zip(*self.samples, strict=True) if self.samples else ((), (), (), ())
        table = np.array(self.impacts).reshape(-1, 5)[:, : 5 if len(self.eq.tips) > 1 else 4]
        last = Last(*self.eq.modal(self.y), 1, np.array(self.since()))
        arrays = (
            np.array(each, dtype=float).reshape(len(times), size)
            for each, size in ((q, n), (p, n), (values, width))
        )
        return Recorded(np.array(times), *arrays, table, self.found, last)


def _say_how_slow(ensemble: Ensemble) -> None:
    first = Simulation(ensemble, 0, np.empty(0))
    own = first.end / min(first.longest, 0.6 / max(float(ensemble.structure.omega.max()), 1e-300)) * _SECONDS
    factor = own / seconds_of(first.end / float(ensemble.step_times[0]), first.eq.n)
    tell(
        [
            Diagnostic(
                "python-engine", _SLOW.format(factor, own), {"factor": factor, "seconds": own}, Severity.INFO
            )
        ]
    )


def record(
    ensemble: Ensemble, times: _Array, in_contact: bool, progress: Callable[[float], object] | None = None
) -> Iterator[Recorded]:
    """Integrate the one run of an ensemble, and return its record."""
    _say_how_slow(ensemble)
    simulation = Simulation(ensemble, 0, times, in_contact)
    simulation.march(np.empty(0), progress)
    yield simulation.recorded()


def run_ensemble(
    ensemble: Ensemble, threads: int | None = None, progress: Callable[[int, int], object] | None = None
) -> NDArray[Any]:
    """Integrate every run of an ensemble, one after the other; returns a record of accumulators a run."""
    return integrate_with_output_states(ensemble, threads, progress).accumulators_of_runs


def integrate_with_output_states(
    ensemble: Ensemble, threads: int | None = None, progress: Callable[[int, int], object] | None = None
) -> OutputStates:
    """Integrate as :func:`run_ensemble`, with the states at every output time."""
    _say_how_slow(ensemble)
    runs, count, n = ensemble.runs, max(1, len(ensemble.systems[0].contacts)), ensemble.structure.omega.size
    outputs = int(-(-runs["end"][0] // runs["output_interval"][0]))
    q, p = np.full((2, ensemble.size, outputs, n), np.nan)
    since, found = np.full((ensemble.size, outputs, count), -1.0), []
    for i in range(ensemble.size):
        simulation = Simulation(ensemble, i, np.empty(0))
        ticks = np.minimum(np.arange(1, outputs + 1) * runs["output_interval"][i], runs["end"][i])
        for k, (own_q, own_p, own_since) in enumerate(simulation.march(ticks * simulation.tick)):
            q[i, k], p[i, k], since[i, k] = own_q, own_p, own_since
        found.append(simulation.found)
        if progress is not None:
            progress(i + 1, ensemble.size)
    return OutputStates(np.concatenate(found), q, p, np.ones((ensemble.size, outputs), dtype=np.int64), since)


def integrate_tangents(*arguments: Any, **options: Any) -> Any:
    """Refuse tangents."""
    raise InputError("tangent: is not integrated by engine = 'python'; use engine = 'cpu'")
