"""What a store says that it holds: read, compared with what is asked for, and refused in words."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from snapbeam.core.provenance import parameter_hash
from snapbeam.core.validate import InputError, file_path, shown
from snapbeam.sweeps.errors import CheckpointError
from snapbeam.sweeps.keep.durable import PARTIAL

__all__ = [
    "FORMAT", "axes_apart", "read_description", "read_stored_config", "read_stored_points", "refuse_foreign",
    "refuse_other", "store_folder",
]  # fmt: skip

FORMAT = {"format": "snapbeam map", "format_version": 3}
"""Of a new store."""
_VERSIONS = (3, 4)
"""4: a store that has grown, which earlier versions would take for another map."""
_KNOWN = {"map.json", "ledger.jsonl", "lock", "runs.zarr"}


def axes_apart(there: Mapping[str, Any], here: Mapping[str, Any]) -> dict[str, int]:
    """How many values of each axis of one map another one has not."""
    return {
        name: len(set(values) - set(here[name]))
        for name, values in there.items()
        if isinstance(values, list) and isinstance(here.get(name), list)
    }


def store_folder(path: str | Path) -> Path:
    if not isinstance(path, (str, Path)):
        raise InputError(f"store = {shown(path)}: must be a folder")
    folder = file_path("store", path)
    if folder.exists() and not folder.is_dir():
        raise InputError(f"store = {str(path)!r}: must be a folder, not a file")
    if not folder.parent.is_dir():
        raise InputError(f"store = {str(path)!r}: {str(folder.parent)!r} is not an existing folder")
    return folder


def refuse_foreign(folder: Path) -> None:
    """Refuse a folder that holds something and no map, before anything is written into it."""
    names = {entry.name for entry in folder.iterdir() if not entry.name.endswith(PARTIAL)}
    if "map.json" not in names and names - _KNOWN:
        raise InputError(f"store = {str(folder)!r}: is not empty and holds no map")


def read_description(file: Path) -> dict[str, Any]:
    damaged = CheckpointError(
        f"store = {str(file.parent)!r}: map.json is damaged; put it back from a copy, or start another store"
    )
    try:
        held = json.loads(file.read_bytes())
        sound = (
            isinstance(held, dict)
            and isinstance(held["parameters"], dict)
            and held["parameter_hash"] == parameter_hash(held["parameters"])
            and isinstance(held["chunk"], int)
            and held["chunk"] >= 1
        )
    except (ValueError, KeyError, RecursionError):
        raise damaged from None
    if not sound:
        raise damaged
    if held.get("format") != FORMAT["format"] or held.get("format_version") not in _VERSIONS:
        raise InputError(
            f"store = {str(file.parent)!r}: was written in another format ({held.get('format_version')})"
        )
    return held


def read_stored_config(path: str | Path) -> dict[str, Any] | None:
    """The parameter file a store keeps, as nested plain values; None if there is none."""
    file = store_folder(path) / "map.json"
    if not file.exists():
        return None
    if file.is_symlink():
        raise InputError(f"store = {str(path)!r}: 'map.json' is a link or no plain file")
    config = read_description(file).get("config")
    return config if isinstance(config, dict) else None


def read_stored_points(path: str | Path) -> dict[str, Any] | None:
    """What a store says of its points, by dotted name; None if there is none."""
    file = Path(path) / "map.json"
    if file.is_symlink() or not file.is_file():
        return None
    points = read_description(file)["parameters"].get("points")
    return points if isinstance(points, dict) else None


def refuse_other(path: Path, held: dict[str, Any], wanted: dict[str, Any]) -> None:
    there, here = _flat(held), _flat(wanted)
    lines = [
        f"  {name}: {_brief(there.get(name))} in the store, {_brief(here.get(name))} asked for"
        for name in sorted(there.keys() | here.keys())
        if there.get(name) != here.get(name)
    ]
    if lines:
        lines += [f"  {words}" for words in _advice(held, wanted)]
        raise InputError(f"store = {str(path)!r}: holds a map of other parameters\n" + "\n".join(lines))


def _advice(held: dict[str, Any], wanted: dict[str, Any]) -> list[str]:
    """What to do about parameters by which people would have a store go on."""
    found = []
    cycles = [each.get("integration", {}).get("cycles") for each in (held, wanted)]
    if cycles[0] != cycles[1]:
        found.append(
            "A finished run is not marched on: a store keeps what came of each run, not the state in which it "
            f"ended. Ask for the store's {cycles[0]} cycles, or give another folder for {cycles[1]}."
        )
    there, here = held.get("points", {}), wanted.get("points", {})
    for name, count in axes_apart(there, here).items():
        if count:
            found.append(
                f"A store only grows: {count} of its {len(there[name])} values of {name} are not among those asked "
                "for. Give values that hold them too, a list or a longer range of the same spacing, or another folder."
            )
    return found


def _flat(values: dict[str, Any], before: str = "") -> dict[str, Any]:
    """Nested parameters by dotted name."""
    found: dict[str, Any] = {}
    for name, value in values.items():
        full = f"{before}{name}"
        found |= _flat(value, f"{full}.") if isinstance(value, dict) else {full: value}
    return found


def _brief(value: Any) -> str:
    if isinstance(value, list) and len(value) > 4 and isinstance(value[0], (int, float)):
        return f"{len(value)} points from {value[0]:g} to {value[-1]:g}"
    if isinstance(value, list) and len(value) > 4:
        return f"an array of {len(value)} rows"
    return "nothing" if value is None else f"{value!r}"
