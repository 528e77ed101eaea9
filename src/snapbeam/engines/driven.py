"""What moves in every run of an ensemble, and as which drive kernels march it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.engines.ensemble import Ensemble
from snapbeam.engines.scalar.tip import tip_motion
from snapbeam.model.drive import Drive, Sine
from snapbeam.model.drive.joined import HORIZON, joined
from snapbeam.model.system import System

__all__ = ["Driven", "begun_at", "cycles_of", "driven_of", "fastest_of", "motions_of", "phases_of", "tip_of"]

_Array = NDArray[np.float64]


class Driven(NamedTuple):
    """What the drive is, for every run."""

    kind: type[Drive]
    numbers: _Array
    period: _Array
    """Of one cycle, s."""
    highest: _Array
    """From the mid-position, m."""
    speed: _Array
    samples: _Array


def cycles_of(system: System, columns: Mapping[str, _Array]) -> _Array:
    """Seconds of one cycle of excitation of each run, or of the first mode where nothing moves, shape (runs,)."""
    runs = next(iter(columns.values())).size if columns else 1
    leads = system.primary_excitation
    if leads is None:
        return 2.0 * math.pi / (np.ones(runs) * system.scale.omega)
    section, drive = leads
    return drive.cycle(_own(columns, section, runs), system.scale)


def phases_of(system: System, columns: Mapping[str, _Array], runs: int) -> _Array:
    """Argument of the drive at the start of each run: of several motions their own phases count instead."""
    if len(system.moving) > 1:
        return np.zeros(runs)
    name = next((f"{section}.phase" for section, _ in system.moving), "drive.phase")
    return columns.get(name, np.zeros(runs))


def _own(columns: Mapping[str, _Array], section: str, runs: int) -> dict[str, _Array]:
    """Parameters of a drive in a section, of which there may be none."""
    names = len(section) + 1
    own = {name[names:]: values for name, values in columns.items() if name.startswith(f"{section}.")}
    return own or {"": np.zeros(runs)}


def driven_of(system: System, columns: Mapping[str, _Array], runs: int) -> Driven:
    """Arrange the striker's drive, or it and what else moves, for kernels."""
    if any(section != "drive" for section, _ in system.moving):
        return _together(system, columns, runs)
    scale, striker = system.scale, system.striker
    if striker is None:
        numbers = np.tile([1.0 * scale.omega, 0.0], (runs, 1))
        return Driven(
            Sine, numbers, cycles_of(system, columns), np.full(runs, -np.inf), np.zeros(runs), np.empty(0)
        )
    drive = striker.drive
    own = _own(columns, "drive", runs)
    found = drive.numbers(own, scale)
    highest, speed = drive.bounds(own, scale)
    samples = drive.samples() * (1.0 if striker.side == "below" else -1.0)
    if striker.side == "above":
        highest = drive.mirrored_bounds(own, scale)
    table = np.stack([found[name] for name in drive.number_names], axis=1)
    return Driven(
        drive.integrated_as or type(drive), table, cycles_of(system, columns), highest, speed, samples
    )


def _together(system: System, columns: Mapping[str, _Array], runs: int) -> Driven:
    """The motions of a system with a base, a load or several strikers as one drive.

    Nothing is said of how high the tip comes to be used: no such run is decided by it.
    """
    scale, names = system.scale, {"drive": "tip", "base": "base", "axial": "load"}
    names |= {f"drive_{number}": f"tip{number - 1}" for number in range(2, 2 + len(system.further_contacts))}
    kinds: dict[str, type[Drive]] = {}
    found: dict[str, _Array] = {}
    speed, fastest = np.zeros(runs), np.zeros(runs)
    for section, drive in system.moving:
        part, own = names[section], _own(columns, section, runs)
        numbers = drive.numbers(own, scale)
        kinds[part] = drive.integrated_as or type(drive)
        found |= {f"{part}_{name}": numbers[name] for name in drive.number_names}
        found[f"{part}_phase"] = columns.get(f"{section}.phase", np.zeros(runs))
        fastest = np.maximum(fastest, numbers["fastest" if "fastest" in numbers else "omega"])
        if section == "drive":
            speed = speed + drive.bounds(own, scale)[1]
    if system.base_excitation is not None:
        own, base = _own(columns, "base", runs), system.base_excitation
        sign = 1.0 if base.direction == "up" else -1.0
        side = -1.0 if system.striker is not None and system.striker.side == "above" else 1.0
        follow = 0.0 if base.striker_on_base or system.striker is None else -side * sign
        found["base_hardest"] = base.motion.peak_acceleration(own, scale)
        found["base_sign"], found["base_follow"] = np.full(runs, sign), np.full(runs, follow)
        speed = speed + abs(follow) * base.motion.bounds(own, scale)[1]
    kind, cycle = joined(kinds), cycles_of(system, columns)
    only = next(iter(kinds)) if kind.alone else ""
    found["omega"] = found[f"{only}_omega"] if only else 2.0 * math.pi / (HORIZON * cycle)
    found["fastest"] = fastest
    table = np.stack([found[name] for name in kind.number_names], axis=1)
    return Driven(kind, table, cycle, np.full(runs, np.inf), speed, np.empty(0))


def fastest_of(system: System, columns: Mapping[str, _Array], runs: int) -> _Array:
    """Greatest angular frequency of the base and of the axial load, rad/s; 0 without them."""
    found = np.zeros(runs)
    for section, drive in system.moving:
        if section in ("base", "axial"):
            numbers = drive.numbers(_own(columns, section, runs), system.scale)
            found = np.maximum(found, numbers["fastest" if "fastest" in numbers else "omega"])
    return found


def motions_of(ensemble: Ensemble, system: System, times: _Array) -> dict[str, tuple[_Array, _Array]]:
    """Displacement (m) and velocity (m/s) of the base in space, and change (N) and rate of the load, at instants.

    *ensemble* is that of the one run, which may begin in the middle of its drives.
    """
    found = {}
    begun, alone = float(ensemble.runs["phase"][0]), getattr(ensemble.drive, "alone", True)
    if not alone:
        times = times + begun / float(ensemble.drive_numbers[0, ensemble.drive.number_names.index("omega")])
    for section, drive in system.moving:
        if section not in ("base", "axial"):
            continue
        own = {name: np.array([value]) for name, value in drive.values().items()}
        numbers, kind = drive.numbers(own, system.scale), drive.integrated_as or type(drive)
        table = kind.numbers_type()(*(float(numbers[name][0]) for name in kind.number_names))
        arguments = numbers["omega"][0] * times + (begun if alone else float(getattr(drive, "phase", 0.0)))
        pairs = np.array([tip_motion(table, np.empty(0), at) for at in arguments.tolist()]).reshape(-1, 2)
        sign = (
            -1.0
            if section == "base"
            and system.base_excitation is not None
            and system.base_excitation.direction == "down"
            else 1.0
        )
        found[section] = sign * pairs[:, 0], sign * pairs[:, 1]
    return found


def tip_of(system: System, number: int, times: _Array) -> tuple[_Array, _Array]:
    """Displacement from its mid-position (m) and velocity (m/s) of a striker of several, the first being 1.

    Seen from its own side, in the frame of the ends but without what a base does to it.  Of systems whose run begins
    with their drives.
    """
    striker = system.further_contacts[number - 2].striker if number > 1 else system.striker
    assert striker is not None
    drive = striker.drive
    own = {name: np.array([value]) for name, value in drive.values().items()} or {"": np.zeros(1)}
    numbers, kind = drive.numbers(own, system.scale), drive.integrated_as or type(drive)
    table = kind.numbers_type()(*(float(numbers[name][0]) for name in kind.number_names))
    arguments = numbers["omega"][0] * times + float(getattr(drive, "phase", 0.0))
    pairs = np.array([tip_motion(table, np.empty(0), at) for at in arguments.tolist()]).reshape(-1, 2)
    return pairs[:, 0], pairs[:, 1]


def begun_at(driven: Driven, phase: _Array) -> _Array:
    """How far the tip is from its mid-position at the start, m."""
    if driven.kind.harmonic:
        amplitude = driven.numbers[:, driven.kind.number_names.index("amplitude")]
        return np.where(phase == 0.0, 0.0, amplitude * np.sin(phase))
    numbers = driven.kind.numbers_type()
    begun = [
        tip_motion(numbers(*row), driven.samples, at)[0]
        for row, at in zip(driven.numbers, phase, strict=True)
    ]
    return np.array(begun)
