"""Recorded statistics of random runs of every system, with tolerances from the conditioning of each run.

A change of the solver may change last digits, which an impacting beam multiplies.  Each run is therefore recorded at level
reference with four neighbours: the same at level standard and with half the steps, and two whose drive differs by a relative 1e-9.
A number may differ from the record by a multiple of what these differ by; a run in which they differ by more than a hundredth is
left out.  After an intended change of numbers::

    python tests/conformance/reference_corpus.py
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from systems import SYSTEMS, ExtendedSystem

import snapbeam as sb
from snapbeam.simulation.tolerance import _perturbed
from snapbeam.solver.assemble import make_ensemble
from snapbeam.solver.native import run_ensemble
from snapbeam.solver.statistics import statistics_of

DATA = Path(__file__).parent / "data" / "reference_corpus.npz"
RUNS, CYCLES, NEIGHBOUR = 4, 3, 1e-9
ILL = 1e-2
"""Difference of neighbours over the scale of a statistic, beyond which nothing is compared."""
FLOOR = {"reference": 1e-6, "standard": 1e-3}
"""Tolerance over the scale of a statistic, at least, by level."""
MULTIPLE = 10.0
"""Tolerance over the difference of neighbours, or at level standard over its recorded error."""
NOT_PHYSICAL = ("steps", "trials", "time_step", "last_zero_crossing")
_Table = dict[str, NDArray[np.float64]]


class Case(NamedTuple):
    """Random runs of a system."""

    name: str
    entry: ExtendedSystem
    modes: int
    seed: int

    def statistics(self, accuracy: str, change: float = 0.0, step_factor: float = 1.0) -> _Table:
        """Statistics of the runs by name, arrays of shape (runs,)."""
        system = self.entry.system(self.modes)
        points = self.entry.points(RUNS, self.seed)
        how = sb.Integration(cycles=min(CYCLES, self.entry.cycles), accuracy=accuracy)
        ensemble = make_ensemble(system, how, points, step_factor=step_factor)
        if change:
            ensemble = _perturbed(ensemble, system, change)
        found = statistics_of(ensemble, run_ensemble(ensemble, 1))
        return {
            name: np.asarray(values, dtype=float)
            for name, values in found.items()
            if not any(word in name for word in NOT_PHYSICAL)
        }


def cases() -> Iterator[Case]:
    """Every system with two numbers of modes."""
    for number, (name, entry) in enumerate(SYSTEMS.items()):
        for modes in sorted({max(1, entry.fewest), entry.modes}):
            yield Case(f"{name}, {modes} modes", entry, modes, 100 * number + modes)


def record(case: Case) -> dict[str, NDArray[np.float64]]:
    """Values and allowed differences of a case, arrays of shape (statistics, runs)."""
    value, standard = case.statistics("reference"), case.statistics("standard")
    beside = [case.statistics("reference", sign * NEIGHBOUR) for sign in (1.0, -1.0)]
    beside.append(case.statistics("reference", step_factor=0.5))
    found: dict[str, list[NDArray[np.float64]]] = {"values": [], "reference": [], "standard": []}
    for name, own in value.items():
        scale = max(float(np.nanmax(np.abs(own), initial=0.0)), 1e-300)
        spread = np.max([np.abs(each[name] - own) for each in beside], axis=0)
        rough = np.abs(standard[name] - own)
        whole = np.all(own == np.rint(own))
        bounds = {"reference": MULTIPLE * spread, "standard": MULTIPLE * (spread + rough)}
        found["values"].append(own)
        for level, bound in bounds.items():
            bound = bound + (0.0 if whole else FLOOR[level] * scale)
            found[level].append(
                np.where((bound > ILL * scale * (10.0 if level == "standard" else 1.0)) | np.isnan(own), np.inf, bound)
            )
    return {name: np.array(rows) for name, rows in found.items()}


def names_of(case: Case) -> list[str]:
    """Statistics of a case, in the order of its rows."""
    return list(case.statistics("standard"))


def write() -> None:
    """Record all cases."""
    kept: dict[str, NDArray[np.float64]] = {}
    names: dict[str, list[str]] = {}
    for number, case in enumerate(cases()):
        names[case.name] = names_of(case)
        table = record(case)
        kept[f"{number} values"] = table["values"]
        kept |= {f"{number} {level}": table[level].astype(np.float32) for level in FLOOR}
        print(case.name, f"{np.isfinite(table['reference']).mean():.2f} compared", flush=True)
    np.savez_compressed(DATA, names=json.dumps(names), **kept)


def differences(case: Case, number: int, accuracy: str) -> tuple[list[str], int]:
    """Lines on what differs by more than is allowed, and how many numbers were compared."""
    with np.load(DATA) as file:
        names = json.loads(str(file["names"]))[case.name]
        values, allowed = file[f"{number} values"], file[f"{number} {accuracy}"].astype(float)
    now = case.statistics(accuracy)
    lines = []
    for name, own, bound in zip(names, values, allowed, strict=True):
        found = now.get(name, np.full(RUNS, np.nan))
        off = np.abs(found - own)
        lines += [
            f"{case.name}, {accuracy}, run {i}, {name}: {found[i]:.12g}; recorded is {own[i]:.12g} +- {bound[i]:.2g}"
            for i in np.flatnonzero(np.isfinite(bound) & ~(off <= bound))
        ]
    return lines, int(np.isfinite(allowed).sum())


if __name__ == "__main__":
    write()
