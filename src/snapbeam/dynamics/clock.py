"""Common period of the motions of a system, and the phase at which a map takes its states."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.drive.base import HORIZON, Drive
from snapbeam.model.quantity import split_name
from snapbeam.model.state import State
from snapbeam.model.system import System
from snapbeam.simulation.request import cycle_of
from snapbeam.solver.assemble import cycles_of, phases_of, run_columns
from snapbeam.util.validation import InputError, shown

_SAME_PHASE = 1e-6
"""Difference of two phases, rad, that rounding can make."""
_MOST_CYCLES = 100
"""Cycles of the primary excitation in a common period, at most."""
_SAME_RATIO = 1e-12
"""Relative difference of a ratio of frequencies from a fraction that rounding can make."""


def frequencies_of(
    system: System, columns: Mapping[str, NDArray[np.float64]]
) -> list[tuple[str, Drive, list[NDArray[np.float64]] | None]]:
    """Section, drive and angular frequencies (rad/s) of every motion; None: it does not repeat."""
    runs, found = cycles_of(system, columns).size, []
    for section, drive in system.moving:
        own = {split_name(name)[1]: values for name, values in columns.items() if split_name(name)[0] == section}
        found.append((section, drive, drive.frequencies(own or {"": np.zeros(runs)}, system.scale)))
    return found


def common_cycles(system: System, columns: Mapping[str, NDArray[np.float64]]) -> NDArray[np.int64]:
    """Cycles of the primary excitation after which every motion repeats, for each run, shape (runs,)."""
    cycle = cycles_of(system, columns)
    found = np.ones(cycle.size, dtype=np.int64)
    for section, drive, rates in frequencies_of(system, columns):
        if rates is None:
            raise InputError(
                f"{section}: a motion of type {drive.name!r} does not repeat; the dynamics tools need a common period of "
                "all motions; use sb.advance or simulate"
            )
        for rate in rates:
            turns = rate * cycle / (2.0 * math.pi)
            for ratio in np.unique(turns):
                which, fraction = turns == ratio, Fraction(float(ratio)).limit_denominator(_MOST_CYCLES)
                found[which] = np.lcm(found[which], fraction.denominator)
                apart = abs(float(fraction) - ratio) > _SAME_RATIO * ratio
                if apart or found[which].max() > _MOST_CYCLES:
                    leads = system.moving[0][0]
                    raise InputError(
                        f"{section}: no common period with {leads}; the ratio of its frequency to that of {leads} is "
                        f"{ratio:.12g} and must make all motions repeat within {_MOST_CYCLES} cycles of {leads}; choose "
                        "frequencies in ratios of small whole numbers, or use sb.advance or simulate"
                    )
    return found


@dataclass(frozen=True, eq=False)
class Clock:
    """Period of a system whose states are taken at a phase, rad; None: that at which a run of the system begins."""

    system: System
    phase: float | None = None

    @cached_property
    def cycles_per_period(self) -> int:
        """Cycles of the primary excitation in the common period of all motions."""
        return int(common_cycles(self.system, run_columns(self.system, {}))[0])

    @cached_property
    def period(self) -> float:
        """Common period of all motions, s."""
        return self.cycles_per_period * self.cycle

    @cached_property
    def cycle(self) -> float:
        """Cycle of the primary excitation, s."""
        return cycle_of(self.system)

    @property
    def _turns(self) -> int:
        """Cycles of the primary excitation in one turn of the phase of a state."""
        leads = self.system.primary_excitation
        return 1 if leads is None or (leads[1].is_periodic and len(self.system.moving) < 2) else HORIZON

    @property
    def given_phase(self) -> float:
        """The ``phase`` of a state that begins a period, rad; NaN: every motion begins at its own phase."""
        if self.phase is not None:
            if self._turns == 1:
                return self.phase
            return (self.phase - self._own_phase) % (2.0 * math.pi) / self._turns
        return math.nan if self.system.initial_state is None else float(self.system.initial_state.phase)

    @property
    def striker_phase(self) -> float:
        """Phase of the primary excitation at the beginning of a period, rad; 0 if nothing moves."""
        own, given = self._own_phase, self.given_phase
        if self.system.primary_excitation is None or math.isnan(given):
            return own
        # several motions share one clock, which counts from the time at which all have their own phases
        return given if self._turns == 1 else own + self._turns * given

    @property
    def _own_phase(self) -> float:
        """Phase of the primary excitation at the start of a run, rad."""
        leads = self.system.primary_excitation
        return 0.0 if leads is None else float(getattr(leads[1], "phase", 0.0))

    @cached_property
    def state_phase(self) -> float:
        """The argument of the engine's clock at the beginning of a period, rad."""
        own = phases_of(self.system, run_columns(self.system, {}), 1)
        return float(own[0]) if math.isnan(self.given_phase) else self.given_phase

    def starting(self, state: State) -> System:
        """The system with *state* as its start, at the phase at which the map takes states."""
        changes: dict[str, Any] = {"initial_state": state}
        section, drive = self.system.primary_excitation or ("", None)
        if self.phase is not None and self._turns == 1 and section == "drive" and hasattr(drive, "phase"):
            changes["drive.phase"] = self.phase
        return self.system.replace(**changes)

    def require_free(self, name: str) -> None:
        """Refuse to change a phase that another value would override."""
        section, field = split_name(self.system.parameter(name).name)
        leads = self.system.moving[:1]
        if field != "phase" or not leads or section != leads[0][0]:
            return
        if self.phase is not None or (len(self.system.moving) == 1 and not math.isnan(self.given_phase)):
            source = "phase" if self.phase is not None else "initial_state.phase"
            raise InputError(
                f"{source} = {self.given_phase:g}: must not be given if {section}.phase changes; leave {source} out"
            )

    def require_phase(self, state: State) -> None:
        """Refuse a state at another phase of the motions than the one at which the map takes states."""
        apart = (state.phase - self.state_phase) * self._turns
        apart = np.abs(apart - 2.0 * math.pi * np.rint(apart / (2.0 * math.pi)))
        if self.system.primary_excitation is not None and (apart > _SAME_PHASE).any():
            raise InputError(
                f"state phase = {shown(state.phase)}: must be the phase at which the system is observed, "
                f"{self.state_phase:g} rad, or NaN; advance the state to that phase with sb.advance"
            )

    def require_period(self, own: Mapping[str, NDArray[np.float64]]) -> None:
        """Refuse parameters of runs with which the motions have a common period of another number of cycles."""
        found = common_cycles(self.system, run_columns(self.system, own))
        if (found != self.cycles_per_period).any():
            raise InputError(
                f"{', '.join(own)}: the common period of all motions must have the same number of cycles in every run; it "
                f"has {self.cycles_per_period} cycles in the system and {int(found[found != self.cycles_per_period][0])} "
                "in one of the runs; change all frequencies together, or ask for each value by itself"
            )
