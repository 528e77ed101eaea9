"""Sweeps every parameter of an extended system, each killed at its second task and resumed; says what was not as it should be.

Run as a program, since forks go before threads: ``python killed_systems.py SYSTEM [...]``.
"""

from __future__ import annotations

import argparse
import json
import os
import pickle
import signal
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import zarr.storage  # noqa: F401  (loaded before the first fork)
from systems import SYSTEMS

import snapbeam as sb
from snapbeam.model.parameters import lookup, parameters
from snapbeam.sweeps.compute import CheckpointOptions
from snapbeam.sweeps.tasks import PointWork

NOT_SWEPT = {
    "integration.engine": "which engine",
    "integration.threads": "how many threads",
    "integration.tolerance": "steps that follow from a run",
    "drive.displacement": "a record",
    "drive.velocity": "a record",
    "imperfection.profile": "a table",
}
VALUES: dict[str, list[Any]] = {
    "drive.ramp_down_cycles": [0.5, 1.5],
    "axial_load.hold_periods": [0.2, 0.6],
    "beam.axial_load": [600.0, 620.0],
    "boundary.left_rotational_stiffness": [20.0, 60.0],
    "boundary.right_rotational_stiffness": [20.0, 60.0],
    "boundary.axial_support_stiffness": [1e7, 1e8],
    "contact.gap": [1e-6, 2e-5],
    "contact.mass": [0.01, 0.03],
    "contact.suspension_stiffness": [500.0, 900.0],
    "contact.suspension_damping": [0.3, 0.9],
    "imperfection.midspan_amplitude": [1e-6, 3e-6],
    "imperfection.antisymmetric_amplitude": [1e-6, 3e-6],
    "imperfection.point_load": [0.003, 0.006],
    "imperfection.uniform_load": [0.003, 0.006],
    "imperfection.gravity": [0.003, 0.006],
    "model.modes": [2, 4],
    "model.reference_frequency": [80.0, 82.0],
    "integration.cycles": [1, 2],
    "integration.step": [3e-5, 4e-5],
    "integration.max_steps": [10**7, 2 * 10**7],
    "integration.accuracy": ["standard", "reference"],
}


def values_of(system: sb.System, name: str) -> list[Any]:
    """Two values of a parameter, about its own where it has one."""
    row = lookup(name).quantity
    if name in VALUES:
        return VALUES[name]
    if row.choices:
        return list(row.choices[:2])
    if row.kind is bool:
        return [False, True]
    section, _, field = name.partition(".")
    own = getattr(sb.Integration(), field) if section == "integration" else system.get(name)
    if row.kind is int:
        return [int(own), int(own) + 1]
    return [0.1, 0.2] if not own else sorted([float(own), 1.03 * float(own)])


def has_row(name: str) -> bool:
    """Whether it is a parameter of the table, a further striker's too, and no word for a kind of part."""
    try:
        lookup(name)
    except sb.InputError:
        return False
    return True


def in_child(work: Callable[[], Any], answer: Path | None = None) -> int:
    """Fork and do *work* there; what it gives is pickled.  Returns the status as ``waitpid`` has it."""
    child = os.fork()
    if child == 0:
        status = 1
        try:
            found = work()
            if answer is not None:
                answer.write_bytes(pickle.dumps(found))
            status = 0
        finally:
            os._exit(status)
    return os.waitpid(child, 0)[1]


def doomed(sweep: Callable[[Path], Any], store: Path) -> None:
    """Compute until the second task begins; then SIGKILL."""
    begin, begun = PointWork.compute, [0]

    def counted(self: Any, *arguments: Any) -> Any:
        begun[0] += 1
        if begun[0] == 2:
            os.kill(os.getpid(), signal.SIGKILL)
        return begin(self, *arguments)

    PointWork.compute = counted  # type: ignore[method-assign]
    sweep(store)


def plain(ds: Any) -> dict[str, Any]:
    return {str(name): ds[name].values for name in ds.variables}


def try_one(system: sb.System, name: str, folder: Path) -> str:
    """What went wrong with one parameter; nothing if nothing did."""
    axes = {name: values_of(system, name)}
    # a base lifts the beam off its stop first; a burst and a ramp have to end
    ends = any(type(drive).name in ("burst", "ramp_force") for _, drive in system.moving)
    integration = sb.Integration(cycles=6 if ends else 2 if system.base_excitation is None else 4)

    def sweep(store: Path | None) -> Any:
        return sb.sweep(
            system, axes, integration, checkpoint=None if store is None else CheckpointOptions(store, points_per_task=1)
        )

    try:
        whole = plain(sweep(None))
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    status = in_child(lambda: doomed(sweep, folder / "store"))
    if not os.WIFSIGNALED(status):
        return "was not killed"
    done = (folder / "store" / "tasks.jsonl").read_text(encoding="utf-8").count("\n")
    if done != 1:
        return f"{done} tasks done when it was killed"
    if in_child(lambda: plain(sweep(folder / "store")), folder / "found") != 0:
        return "was not resumed"
    found = pickle.loads((folder / "found").read_bytes())
    if set(found) != set(whole):
        return "other variables"
    for key, value in whole.items():
        if not np.array_equal(value, found[key], equal_nan=value.dtype.kind == "f"):
            return f"{key} differs"
    same = all(
        np.array_equal(value[0], value[1], equal_nan=value.dtype.kind == "f")
        for key, value in whole.items()
        if value.shape == (2,) and key != lookup(name).short
    )
    return "changes nothing" if same and name not in UNSEEN else ""


UNSEEN = {
    "integration.max_steps",
    "integration.early_termination",
    "base_excitation.striker_on_base",
    "integration.high_frequency_ratio",
}
"""What two cycles may not show."""
NOTHING = {("still", "contact.gap"), ("a measured shape", "imperfection.point_location")}
"""What changes nothing: nothing moves there from rest, and a load of zero stands nowhere."""


COMMON = ("beam", "boundary", "imperfection", "integration", "model")
"""Sections whose parameters mean the same in every system: each is swept in the first that has it."""


def swept_names(key: str) -> list[str]:
    """Return the parameters of a system that are swept."""
    system = SYSTEMS[key].system()
    names = [name for name in system.parameters if has_row(name)]
    names += [name for name in parameters() if name.startswith("integration.")]
    return [name for name in names if name not in NOT_SWEPT and not (SYSTEMS[key].modes == 1 and name == "model.modes")]


def main() -> None:
    """Print what was seen as JSON."""
    parser = argparse.ArgumentParser()
    parser.add_argument("systems", nargs="+")
    arguments = parser.parse_args()
    failures: list[str] = []
    count = 0
    for key in arguments.systems:
        system = SYSTEMS[key].system()
        earlier = {name for other in list(SYSTEMS)[: list(SYSTEMS).index(key)] for name in swept_names(other)}
        names = [name for name in swept_names(key) if name not in earlier or name.partition(".")[0] not in COMMON]
        if system.base_excitation is not None and type(system.base_excitation.motion).name in (
            "chirp",
            "acceleration_chirp",
        ):
            names.remove("base_excitation.striker_on_base")  # a sweep is refused under a striker in space
        if "contact.suspension_damping" in names and not system.get("contact.suspension_stiffness"):
            names.remove("contact.suspension_damping")  # of a suspension, which a mass in flight has not
        for name in names:
            with tempfile.TemporaryDirectory() as folder:
                said = try_one(system, name, Path(folder))
            count += 1
            if said and not ((key, name) in NOTHING and said == "changes nothing"):
                failures.append(f"{key}, {name}: {said}")
                print(failures[-1], file=sys.stderr, flush=True)
    print(json.dumps({"swept": count, "failures": failures}))


if __name__ == "__main__":
    main()
