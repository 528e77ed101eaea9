"""Random systems against an independent reference: whether parts combine.

``SNAPBEAM_COMPOSITIONS=200 pytest tests/composition -m slow`` tests 200 seeds in place of 2,000, and
``python tests/composition/generator.py SEED`` repeats one.
"""

from __future__ import annotations

import math
import os
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from composition_reference import Solution
from generator import Composition, Features, composed, features_of
from numpy.typing import NDArray

import snapbeam as sb
from snapbeam.util.validation import InputError

Array = NDArray[np.float64]

PHYSICAL = {
    "no well": r"leave no well where a run begins",
    "kink of a chirp": r"striker_on_base = False with a chirp",
}
"""Refusals with a physical reason, or for data that are missing."""
NOT_YET = {
    "rows of excitation": r"one row of excitation",
    "velocity-dependent forces": r"one velocity-dependent force|the first alone may lose energy",
    "circuits": r"\d circuits; must be at most 1",
    "contacts": r"contacts: \d+; must be at most 4",
    "records": r"own time axis",
    "bodies": r"the first alone may be a body",
    "Newton's law": r"sticking under Newton's law",
}
"""Refusals by limits of the solver, which are to go."""
LIMIT = {"standard": 1e-3, "reference": 1e-7}
"""Greatest errors of a run, over b, of well-conditioned problems."""
LOCAL = {"standard": 1e-5, "reference": 1e-9}
"""Errors over b that a run makes on its way, which its conditioning enlarges."""
BEYOND = 100.0
"""Multiple of the limit up to which an error that the conditioning enlarges is compared."""
KICK = 1e-10
"""Relative change of the start by which the conditioning is measured."""
BALANCE = {"standard": 1e-4, "reference": 1e-6}
"""Greatest errors of the energy balance, over the gross work."""
COUNT = int(os.environ.get("SNAPBEAM_COMPOSITIONS", "2000"))
CHUNK = 20


@dataclass
class Report:
    """The results of one system."""

    seed: int
    refused: str = ""
    compared: float = math.nan
    """Share of the run up to the horizon."""
    error: dict[str, float] = field(default_factory=dict)
    """Greatest error over b up to the horizon, over what is allowed, by level."""
    balance: dict[str, float] = field(default_factory=dict)
    largest: float = math.nan
    """Greatest amplification of a change of the start."""
    failures: list[str] = field(default_factory=list)
    impacts: int = 0


def reason(error: InputError) -> str:
    """The name of a refusal; raises what is not in the lists."""
    for name, words in (*PHYSICAL.items(), *NOT_YET.items()):
        if re.search(words, str(error)):
            return name
    raise error


def lasting(system: sb.System) -> tuple[int, float]:
    """Cycles that take about one and a half periods of the first mode, at most 3, and their duration."""
    lead, first = system.primary_excitation, 2.0 * math.pi / system.scale.omega
    cycle = first
    if lead is not None:
        columns = {name: np.array([value]) for name, value in lead[1].values().items()} or {"": np.zeros(1)}
        cycle = float(lead[1].cycle(columns, system.scale)[0])
    cycles = min(max(round(1.5 * first / cycle), 1), 3)
    return cycles, cycles * cycle


def observed(composition: Composition, solution: Solution, times: Array) -> Array:
    """Heights at many places, penetrations and voltages of the reference, over b and over their greatest."""
    length = composition.system.scale.length
    heights, depths = solution.heights(composition.places) / length, solution.depths(times) / length
    return np.concatenate((heights, depths.reshape(times.size, -1)), axis=1)


def recorded(composition: Composition, run: sb.Run) -> Array:
    """The same of a run."""
    data, system = run.dataset, composition.system
    shapes = np.array([system.model.shape_at(place) for place in composition.places])
    found = [data["modal_amplitude"].values @ shapes.T / system.scale.length]
    if len(system.contacts) > 1:
        found.append(data["striker_penetrations"].values)
    elif system.contacts:
        found.append(data["penetration_normalised"].values[:, None])
    return np.concatenate(found, axis=1)


def checked(seed: int, features: Features | None = None, levels: tuple[str, ...] = ("reference",)) -> Report:
    """Compare one system with the reference; failures are listed in the report."""
    report = Report(seed)
    try:
        composition = composed(seed, features)
        system = composition.system
        cycles, end = lasting(system)
        times = np.linspace(0.0, end, 121)[1:] * (1.0 - 1e-9)
        runs = {
            level: sb.simulate(system, sb.Integration(cycles=cycles, accuracy=level), sample_times=times)
            for level in levels
        }
    except InputError as error:
        report.refused = reason(error)
        return report
    kick = np.random.default_rng([seed, 2]).uniform(-KICK, KICK, 200)
    truth, moved = (
        Solution(composition.beam, composition.parts, times, longest=longest, kick=each)
        for longest, each in ((400.0, None), (700.0, kick))
    )
    expected = observed(composition, truth, times)
    growth = np.abs(observed(composition, moved, times) - expected).max(axis=1) / KICK
    amplified = np.maximum.accumulate(np.maximum(growth, 1.0))
    report.largest = float(amplified[-1])
    for level, run in runs.items():
        report.impacts = run.summary.impacts
        allowed = np.maximum(LIMIT[level], LOCAL[level] * amplified)
        within = allowed <= BEYOND * LIMIT[level]
        found = recorded(composition, run)
        error = np.abs(found - expected).max(axis=1)
        report.compared = float(within.mean())
        report.error[level] = float((error / allowed)[within].max()) if within.any() else math.nan
        report.balance[level] = abs(float(run.dataset.attrs["energy_error"]))
        if run.summary.status.name != "OK":
            report.failures.append(f"{level}: status {run.summary.status.name}")
        if not report.error[level] < 1.0:
            at = int(np.argmax((error / allowed) * within))
            worst = int(np.argmax(np.abs(found - expected)[at]))
            report.failures.append(
                f"{level}: error {error[at]:.2e} b at t = {times[at]:.5g} s of {end:.5g} s in column {worst}, "
                f"allowed {allowed[at]:.2e} b"
            )
        if not report.balance[level] < BALANCE[level]:
            report.failures.append(f"{level}: energy balance {report.balance[level]:.2e}")
        if len(system.harvesters) == 1:
            check_voltage(composition, truth, run, within, LIMIT[level], amplified, report)
    return report


def check_voltage(
    composition: Composition,
    truth: Solution,
    run: sb.Run,
    within: NDArray[np.bool_],
    limit: float,
    amplified: Array,
    report: Report,
) -> None:
    """Compare the voltage of one harvester."""
    expected = composition.volts[0] * truth.currents()[:, 0]
    error = np.abs(run.dataset["voltage"].values - expected) / float(np.abs(expected).max())
    # impacts change the velocity, which the voltage follows, within short times
    if within.any() and not float((error / amplified)[within].max()) < 100.0 * limit:
        report.failures.append(f"voltage: error {float(error[within].max()):.2e} of its greatest")
