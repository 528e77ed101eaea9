"""Samples, impacts and statistics of a run of the Python engine, in the form in which every engine answers."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.solver.ensemble import Ensemble
from snapbeam.solver.statistics import CIRCUIT_PEAK, SAMPLED, WORKS, Recorded, empty_accumulators
from snapbeam.util.status_codes import RunStatus

_Array = NDArray[np.float64]
SUMS = ("lost", "dissipated", "gross_work", *WORKS)
"""Integrals beside the state, by the names of accumulators; impulse and work of each contact and losses of circuits follow."""
APART, PRESSING, LOOSE = range(3)
"""State of a contact; loose: the tip is inside, but a force that loses energy would pull."""
_NODES, _WEIGHTS = (0.5 * (x + i) for i, x in zip((1.0, 0.0), np.polynomial.legendre.leggauss(5), strict=True))


def nodes_of(times: _Array) -> _Array:
    """Gauss's nodes between *times*, a row for each step."""
    return times[:-1, None] + np.diff(times)[:, None] * _NODES


class Records:
    """Statistics of a run at *t*, in the state *s* of the equations *eq*."""

    def __init__(self, ensemble: Ensemble, run: int, eq: Any, s: _Array, times: _Array, in_contact: bool) -> None:
        table, structure, count = ensemble.runs[run], ensemble.structure, len(eq.contacts)
        self.ensemble, self.eq, self.t, self.s = ensemble, eq, 0.0, s
        self.times, self.in_contact, self.tick = times, in_contact, float(table["tick"])
        self.end, self.late = float(table["end"]) * self.tick, float(table["last_quarter"]) * self.tick
        row = ensemble.contact_rows[table["contact_row"][0]]
        self.places = np.stack((structure.row_of_beam(row), structure.center))
        self.at_rest = np.array([float(table["rest_contact"][0]), structure.center_rest])
        self.level = float(structure.dividing_height)
        wells = ensemble.structure.unequal_wells
        self.second_well = ensemble.structure.shift + (0.0 if wells is None else wells.second)
        self.onset, self.begun = [0.0] * count, [0.0] * count
        """Onset of the present impact of each contact, and its impulse until then."""
        self.loads = [False] * count
        """True for each contact with a memory whose law is on the way that changes the memory, not below it."""
        self.peaks, self.largest, self.hits = [0.0] * count, [0.0] * count, [0] * count
        for j, since in enumerate(table["contact_time"][:count].tolist()):
            d, rate, numbers = eq.contact(j, 0.0, s)
            if d > 0.0:
                eq.state[j] = PRESSING if eq.pressure(j, d, rate, numbers) > 0.0 else LOOSE
                self.onset[j] = -since if since > 0.0 else 0.0
                self.loads[j] = self.at_yield(j)
        self.impacts: list[list[float]] = []
        self.samples: list[tuple[Any, ...]] = []
        self.found = found = empty_accumulators(1, count, len(eq.circuits))
        found["status"], found["first_energy"] = RunStatus.OK, self.energy()
        for i, name in enumerate(("displacement", "center")):
            found[f"min_{name}"] = found[f"max_{name}"] = self.at_rest[i] + self.places[i] @ s[: eq.n]

    def at_yield(self, j: int) -> bool:
        """Return whether a law with memory is at or beyond the penetration from which it changes the memory."""
        law, (d, _, numbers) = self.eq.contacts[j].law, self.eq.contact(j, self.t, self.s)
        return bool(law.memory) and d >= law.yield_penetration(numbers)

    def impulse(self, j: int) -> int:
        """Place of the impulse of a contact in the state; its work follows."""
        return 2 * self.eq.n + len(SUMS) + 2 * j

    def energy(self) -> float:
        """Energy, contacts included."""
        return self.eq.energy(self.s) + sum(self.eq.stored(j, self.t, self.s) for j in range(len(self.eq.state)))

    def force(self, j: int, t: float, s: _Array) -> float:
        """f_j, N."""
        return max(0.0, self.eq.force(j, *self.eq.contact(j, t, s)))

    def observe(self, part: Any) -> None:
        """Samples and statistics of a piece: integrals by Gauss's rule in each step, extremes at its nodes and ends."""
        eq, found, n, structure = self.eq, self.found, self.eq.n, self.eq.structure
        ends = np.union1d(part.t, part.t_events[0])  # crossings split a step: the energy of the modes jumps there
        nodes, weights = nodes_of(ends).ravel(), (np.diff(ends)[:, None] * _WEIGHTS).ravel()
        inside = part.sol(nodes)
        every = np.concatenate((inside, part.y), axis=1)
        heights, rates = self.at_rest[:, None] + self.places @ every[:n], self.places @ every[n : 2 * n]
        for i, (name, speed) in enumerate((("displacement", "velocity"), ("center", "midspan_velocity"))):
            found[f"min_{name}"] = min(found[f"min_{name}"][0], heights[i].min())
            found[f"max_{name}"] = max(found[f"max_{name}"][0], heights[i].max())
            found[f"peak_{speed}"] = max(found[f"peak_{speed}"][0], np.abs(rates[i]).max())
            found[f"square_{name}"] += weights @ heights[i, : nodes.size] ** 2
            found[f"square_{speed}"] += weights @ rates[i, : nodes.size] ** 2
        crossings = part.t_events[0]
        found["zero_crossings"] += crossings.size
        found["zero_crossings_last_quarter"] += int((crossings > self.late).sum())
        found["last_zero_crossing"] = crossings[-1] if crossings.size else found["last_zero_crossing"]
        # the energy of the modes is counted from the well on whose side mid-span is
        far = (heights[1, : nodes.size] > self.level) & (structure.stretch > 0.0)
        q = inside[:n] - np.where(far, self.second_well[:, None], 0.0)
        energies = 0.5 * (inside[n : 2 * n] ** 2 + (eq.omega[:, None] * q) ** 2)
        energies[structure.equilibrium.size :] = 0.0
        found["energy_time"] += weights @ energies.sum(axis=0)
        found["high_energy_time"] += weights @ energies[structure.high_modes(self.ensemble.high_omega)].sum(axis=0)
        if eq.circuits:
            peaks = np.abs([eq.currents(s) for s in every.T]).max(axis=0)
            found["circuits"][0, :, CIRCUIT_PEAK] = np.maximum(found["circuits"][0, :, CIRCUIT_PEAK], peaks)
        touching = [j for j, state in enumerate(eq.state) if state == PRESSING]
        for j in touching:
            self.largest[j] = max(self.largest[j], *(self.force(j, t, s) for t, s in zip(nodes, inside.T, strict=True)))
            self.peaks[j] = max(self.peaks[j], self.largest[j])
        end = float(part.t[-1])
        asked = self.times[(self.times >= self.t) & ((self.times < end) | (end >= self.end))]
        if self.in_contact and touching:
            asked = np.union1d(asked, part.t[1:])
        for t, s in zip(asked.tolist(), part.sol(asked).T if asked.size else (), strict=True):
            pressed = [(eq.contact(j, t, s)[0], self.force(j, t, s)) for j in range(len(eq.contacts))]
            sums = s[2 * n : 2 * n + len(SUMS)]
            works = s[self.impulse(0) + 1 : self.impulse(len(eq.contacts)) : 2].sum()
            stored = sum(eq.stored(j, t, s) for j in touching)
            values = (eq.energy(s), stored, works, sums[0] + sums[1], sums[0], *sums[3:])
            self.samples.append((t, s[:n], s[n : 2 * n], pressed, (*values, *s[s.size - len(eq.circuits) :])))

    def lasting(self) -> list[float]:
        """Ticks since the contact of each striker began, -1: apart."""
        pairs = zip(self.eq.state, self.onset, strict=True)
        return [(self.t - at) / self.tick if state == PRESSING else -1.0 for state, at in pairs] or [-1.0]

    def close(self, early: _Array, over: bool) -> None:
        """Enter what is known at the end, where an impact ends if all is *over*; *early* are the losses of circuits before the last quarter."""
        found, s, n, lasting = self.found, self.s, self.eq.n, self.lasting()
        for j, each in enumerate(lasting):
            if over and each >= 0.0:
                self.impact_ended(j)
        for name, value in zip(SUMS, s[2 * n :].tolist(), strict=False):
            found[name] = value
        found["dissipated"] += found["lost"]
        impulses, works = s[self.impulse(0) : self.impulse(len(self.eq.state))].reshape(-1, 2).T
        found["impacts"], found["total_impulse"], found["work"] = sum(self.hits), impulses.sum(), works.sum()
        found["time"], found["energy"] = round(self.t / self.tick), self.energy()
        found["displacement"], found["center"] = self.at_rest + self.places @ s[:n]
        found["side"] = 1 if found["center"][0] > self.level else -1
        found["contact_time"] += 0.0 if over else sum(min(each * self.tick, self.t) for each in lasting if each >= 0.0)
        found["peak_force"] = max(self.peaks, default=0.0)
        if self.eq.circuits:
            losses = s[s.size - early.size :]
            found["circuits"][0, :, :CIRCUIT_PEAK] = np.stack((losses, losses - early), axis=1)
        if self.eq.state:
            found["contacts"][0] = np.stack((self.hits, self.peaks, impulses, works), axis=1)

    def impact_ended(self, j: int) -> None:
        """Enter an impact."""
        lasted, impulse = self.t - self.onset[j], float(self.s[self.impulse(j)]) - self.begun[j]
        self.impacts.append([self.onset[j], lasted, self.largest[j], impulse, j + 1.0])
        self.found["contact_time"] += min(lasted, self.t)
        self.hits[j] += 1

    def recorded(self) -> Recorded:
        """Records of the run."""
        n, count, width = self.eq.n, len(self.eq.state), len(SAMPLED) + len(self.eq.circuits)
        columns = zip(*self.samples, strict=True) if self.samples else ((), (), (), (), ())
        at, q, p, contacts, values = (
            np.array(each, dtype=float).reshape(len(self.samples), *shape)
            for each, shape in zip(columns, ((), (n,), (n,), (count, 2), (width,)), strict=True)
        )
        impacts = np.array(self.impacts).reshape(-1, 5)[:, : 5 if len(self.eq.state) > 1 else 4]
        last = tuple(np.array(each)[None, None] for each in (self.s[:n], self.s[n : 2 * n], 1.0, self.lasting()))
        return Recorded(at, q, p, contacts, values, impacts, self.found, last)
