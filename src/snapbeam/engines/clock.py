"""The clock of a run: time in ticks, so that halved steps and located events are whole numbers."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.validate import InputError
from snapbeam.engines.plan import Plan
from snapbeam.model.drive import HORIZON, RecordedMotion
from snapbeam.model.integration import Integration
from snapbeam.model.system import System

__all__ = ["SUBDIVISION", "Clocked", "clocked", "most_steps", "require_resolved", "seconds_of"]

_Array = NDArray[np.float64]

SUBDIVISION = 1 << 20
"""Ticks of a flight step."""
_MOST_TICKS = 2.0**61
_HOUR = 3600.0
_STEP_COST, _MODE_COST = 0.5e-6, 0.07e-6
"""Seconds of one core for a step, and more of it for each mode."""
_FEWEST = 4.0
"""Flight steps, at least, in a cycle of excitation and in a period of the first mode, of a step that was asked for."""


class Clocked(NamedTuple):
    """How long runs last."""

    cycles: float


def clocked(
    table: NDArray[Any],
    system: System,
    integration: Integration,
    cycle: _Array,
    plans: list[Plan],
    periods: float | None,
) -> Clocked:
    """Enter the ticks of every run in the table of runs.

    *cycle* holds the seconds of one cycle of excitation of each run.

    Raises
    ------
    InputError
        If a run has more steps than can be counted in ticks, or a record ends before it.
    """
    require_resolved(system, integration, cycle)
    lengths = np.array([plan.step for plan in plans])
    drive = system.primary_excitation[1] if system.primary_excitation is not None else None
    repeats = drive is None or (drive.is_periodic and len(system.moving) < 2)
    table["step"] = SUBDIVISION
    table["coarsest"] = [plan.coarsest for plan in plans]
    table["finest"] = [plan.finest for plan in plans]
    if isinstance(drive, RecordedMotion):
        turn = np.full(table.size, drive.duration)
        left = 1.0 - table["phase"] / (2.0 * math.pi)
        kernel_input = _asked_cycles(drive, integration, periods, float(left.min()))
        steps = _whole_steps(turn, lengths, 1.0)
        table["period"] = steps * SUBDIVISION
        table["tick"] = turn / table["period"]
        held = drive.duration * drive.frequency
        table["landing"] = np.rint(table["period"] / held)
        share = kernel_input / drive.frequency / drive.duration
        table["end"] = np.rint(
            share * table["period"] if periods is None else kernel_input * table["landing"]
        )
        table["end"] = np.minimum(table["end"], np.rint(left * table["period"]))
        cycles = float(table["end"][0] * table["tick"][0] * drive.frequency)
    else:
        cycles = float(integration.cycles_or_default if periods is None else periods)
        steps = _whole_steps(cycle, lengths, cycles)
        table["period"] = steps * SUBDIVISION
        table["tick"] = cycle / table["period"]
        table["end"] = table["period"] * int(cycles)
        if not cycles.is_integer():
            table["end"] = np.rint(table["period"] * cycles).astype(np.int64)
        table["landing"] = table["period"]
        if not repeats:
            _whole_steps(cycle, lengths, float(HORIZON))  # refused if that cannot be counted
            table["period"] *= HORIZON
    require_affordable(integration, system.model.modes, lengths, table["end"] / SUBDIVISION)
    if periods is None:
        table["landing"] = table["end"]
    table["last_quarter"] = table["end"] // 4 * 3
    return Clocked(cycles)


def _asked_cycles(
    drive: RecordedMotion, integration: Integration, periods: float | None, left: float
) -> float:
    """Cycles to march, of a record of which a share *left* is still to come."""
    held = drive.duration * drive.frequency * left
    kernel_input = integration.cycles if periods is None else periods
    if kernel_input is None and held > 0.0:
        return held
    if kernel_input is None or kernel_input > held + 1e-6:  # states stand on ticks
        of = "of" if left == 1.0 else "that are left of"
        raise InputError(
            f"cycles = {kernel_input}: must be at most the {max(held, 0.0):.1f} cycles {of} the recorded drive"
        )
    return min(float(kernel_input), held)


def require_resolved(system: System, integration: Integration, cycle: _Array) -> None:
    """Refuse a step that was asked for and does not resolve a *cycle* (s) of excitation or the first mode's period.

    Raises
    ------
    InputError
    """
    if integration.step is None:
        return
    shortest, first = float(cycle.min()), 1.0 / system.model.reference_frequency
    for length, words in ((shortest, "a cycle of excitation"), (first, "a period of the first mode")):
        if integration.step * _FEWEST > length * (1.0 + 1e-12):
            raise InputError(
                f"step = {integration.step:g} s: does not resolve {words} of {length:.4g} s; must be at most "
                f"{length / _FEWEST:.4g} s, a quarter of it"
            )


def seconds_of(steps: float, modes: int) -> float:
    """What so many steps take on one core, s, to a factor of two or three."""
    return steps * (_STEP_COST + _MODE_COST * modes)


def most_steps(integration: Integration, modes: int) -> int:
    """Steps that one run may take: those that were asked for, or what one core does in an hour."""
    if integration.max_steps is not None:
        return integration.max_steps
    return int(_HOUR / seconds_of(1.0, modes))


def require_affordable(integration: Integration, modes: int, lengths: _Array, steps: _Array) -> None:
    """Refuse runs that take more steps than they may, before they begin; *lengths* of the steps in s.

    Raises
    ------
    InputError
    """
    most, longest = most_steps(integration, modes), int(np.argmax(steps))
    if steps[longest] > most:
        allowed = "an hour's" if integration.max_steps is None else "max_steps"
        spent = _words(seconds_of(float(steps[longest]), modes))
        raise InputError(
            f"a run of {steps[longest]:.3g} steps of {lengths[longest]:.3g} s, some {spent} on one core: must be at "
            f"most {most:.3g} steps ({allowed}); ask for fewer cycles or longer steps, or for a larger max_steps"
        )


def _words(seconds: float) -> str:
    for size, unit in ((86400.0 * 365.25, "years"), (86400.0, "days"), (3600.0, "hours"), (60.0, "minutes")):
        if seconds >= size:
            return f"{seconds / size:.2g} {unit}"
    return f"{seconds:.2g} seconds"


def _whole_steps(period: _Array, step: _Array, cycles: float) -> NDArray[np.int64]:
    """Flight steps in each period, the step made a little shorter to fit."""
    steps = np.ceil(period / step * (1.0 - 1e-12))
    most = float(steps.max()) * max(cycles, 1.0)
    if not most <= _MOST_TICKS / SUBDIVISION:
        raise InputError(
            f"step = {float(step.min()):g} s with cycles = {cycles:g} of up to {float(period.max()):g} s: makes "
            f"{most:.2g} steps, must be at most {_MOST_TICKS / SUBDIVISION:.2g}"
        )
    return np.asarray(steps.astype(np.int64))
