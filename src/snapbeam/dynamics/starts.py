"""Many starts of one system, each from its own number alone: a beam that rings faintly, a drive at any phase."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.core.validate import InputError, InputTypeError, flag, integer, nonnegative, shown
from snapbeam.model.start import rest_state
from snapbeam.model.state import State
from snapbeam.model.system import System
from snapbeam.sweeps.replicas import MEASURING_ERROR, Replicates, perturbed_start

__all__ = ["InitialConditions", "held_in_space", "leaving", "starts_of"]


@dataclass(frozen=True, kw_only=True)
class InitialConditions:
    """Starts that differ a little, or in the phase of the drive; number s is the same whatever it is run with.

    Parameters
    ----------
    count : int
        Starts, at least 1.
    displacement : float
        Root mean square of the change of the centre, m: every linear mode rings with equal mean energy.  0 for none;
        by default the error of reading a position to a pixel of the paper's camera.  A start that would press the beam
        into the tip begins on the other side of its rest: the overlap would hold energy that nothing put there.
    phase : bool
        Whether the drive begins at any phase of the half of its cycle in which the tip is drawn back, so that none
        presses a beam at rest.
    seed : int
        Chooses them: start s comes from Philox with the key (seed, s).
    """

    count: int = 32
    displacement: float = MEASURING_ERROR
    phase: bool = False
    seed: int = 0

    def __post_init__(self) -> None:
        integer("starts", self.count, 1, 100_000)
        nonnegative("displacement", self.displacement, "m")
        flag("phase", self.phase)
        integer("seed", self.seed, 0, 2**63 - 1)
        if self.count > 1 and self.displacement == 0.0 and not self.phase:
            raise InputError(
                f"starts = {self.count} with displacement = 0 and phase = False: all would be the same"
            )

    def describe(self) -> dict[str, Any]:
        """What tells these starts from others."""
        return {
            "count": self.count,
            "displacement": self.displacement,
            "phase": self.phase,
            "seed": self.seed,
            "side": "away from the tip",
        }

    def state(
        self, system: System, number: int, state: State | None = None, location: ArrayLike | None = None
    ) -> State:
        """Start *number* of a system, or that start added to *state* or a batch of states.

        *location* is where the tip strikes, x_s/L, or that of each of several runs; the system's by default.
        """
        found = state if state is not None else system.initial_state
        if found is None:
            found = rest_state(system.model, system.striker)
        if self.displacement > 0.0:
            rung = perturbed_start(system, Replicates(1, self.displacement, seed=self.seed), number, found)
            found = leaving(system, found, rung, location)
        if not self.phase:
            return found
        generator = np.random.Generator(np.random.Philox(key=[self.seed, number]).jumped())
        phase = math.pi * (1.0 + generator.random())
        return dataclasses.replace(
            found,
            phase=np.array(phase),
            contact_time=np.array(np.nan),
            tangent=None,
            statistics=None,
            modal=None,
        )


def leaving(system: System, rest: State, begun: State, location: ArrayLike | None = None) -> State:
    """A state beside *rest*, turned about it where it would move the beam towards the tip.

    *location* is x_s/L, or that of each of several runs; then the state is a batch.
    """
    striker = system.striker
    if striker is None:
        return begun
    workspace = np.asarray(striker.location if location is None else location, dtype=np.float64)
    change: list[NDArray[np.float64]] = [begun.amplitude - rest.amplitude, begun.velocity - rest.velocity]
    away = 1.0 if striker.side == "below" else -1.0
    reach = np.sum(system.model.shape_at(workspace) * change[0], axis=-1)
    turn = np.where(away * reach < 0.0, -1.0, 1.0)[..., None]
    return dataclasses.replace(
        begun,
        amplitude=rest.amplitude + turn * change[0],
        velocity=rest.velocity + turn * change[1],
        contact_time=np.array(np.nan),
        tangent=None,
        statistics=None,
        modal=None,
    )


def starts_of(given: InitialConditions | int) -> InitialConditions:
    """Starts, or that many of them.

    Raises
    ------
    InputTypeError
    """
    if isinstance(given, InitialConditions):
        return given
    if isinstance(given, (bool, np.bool_)) or not isinstance(given, (int, np.integer)):
        raise InputTypeError(f"starts = {shown(given)}: must be a number of starts, or Starts")
    return InitialConditions(count=int(given))


def held_in_space(system: System) -> System:
    """The system with its tip's mid-position fixed in space, where it is at its own start.

    A tip that touches the beam wherever that is makes another system of every start.

    Raises
    ------
    InputError
        For a recorded drive, whose periods differ.
    """
    striker = system.striker
    if system.further_contacts:
        raise InputError(
            "striker: the tools of dynamics know where one striker stands and since when it touches; of several "
            "strikers ask for whole runs, by simulate or a sweep"
        )
    if system.harvester is not None:
        raise InputError(
            "harvester: has a state of its own, which the tools of dynamics do not carry; march such a system by "
            "sb.advance(system, every=True), which lands after each cycle"
        )
    _require_common_period(system)
    if striker is None:
        return system
    if striker.mass is not None:
        raise InputError(
            f"striker.mass = {striker.mass:g}: the tools of dynamics know a tip that moves as prescribed; "
            "march a system with a body of its own by sb.advance(system, every=True), which lands after each cycle"
        )
    if not striker.drive.harmonic:
        raise InputError("striker.drive: is recorded; dynamics need a drive that repeats, such as a Sine")
    from snapbeam.engines.assemble import make_ensemble
    from snapbeam.model.integration import Integration

    offset = float(make_ensemble(system, Integration()).runs["offset"][0])
    held = system.replace(**{"striker.gap": -offset + 0.0})
    start = system.initial_state
    if start is None or np.isnan(start.striker_position).all():
        return held
    free = State(amplitude=start.amplitude, velocity=start.velocity, phase=start.phase)
    return held.replace(initial_state=free)


def _require_common_period(system: System) -> None:
    """Refuse a base or an axial load that does not repeat with the cycle that is asked about."""
    if len(system.moving) == 0:
        return
    (section, first), *others = system.moving
    for name, drive in system.moving if system.has_environment else ():
        if not drive.harmonic:
            raise InputError(f"{name}: is no sine; dynamics need what repeats")
    for name, drive in others:
        times = float(drive.frequency_ratio) / float(first.frequency_ratio)  # type: ignore[attr-defined]
        if round(times) < 1 or abs(times - round(times)) > 1e-12 * times:
            raise InputError(
                f"{name}.frequency_ratio = {drive.frequency_ratio:g}: must be a whole multiple of that of {section}, "  # type: ignore[attr-defined]
                f"{first.frequency_ratio:g}, after whose period the system is seen"  # type: ignore[attr-defined]
            )
