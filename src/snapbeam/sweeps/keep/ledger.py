"""The ledger of a store: which tasks are done, by records that are written after the data and synced.

One line a record, a JSON object and its check sum.  A line that was torn or altered counts for nothing, and
its task is computed again.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass, fields
from pathlib import Path

from snapbeam.core.provenance import created_now
from snapbeam.sweeps.keep.durable import append_line, member

__all__ = ["Ledger", "Record"]

_CHECK_DIGITS = 16


@dataclass(frozen=True, kw_only=True)
class Record:
    """What the ledger says of one task."""

    stage: str
    task: int
    state: str
    """``"done"`` or ``"failed"``."""
    parameters: str
    """Hash of the parameters and of the task's points."""
    content: str
    """Hash of the results; of a failed task, why it failed."""
    engine: str
    step: float
    model: str
    """Hash of the model's numbers."""
    version: str
    code: str
    """Hash of the package's code, and of what a law or a drive of somebody else's brings along."""
    libraries: str
    """NumPy, Numba and Python with their versions."""
    arithmetic: str
    """Hash of how products, sums and functions were rounded."""
    processor: str
    created: str = ""

    def line(self) -> str:
        """The record as a line of the ledger."""
        text = json.dumps(asdict(self), sort_keys=True, separators=(",", ":"), allow_nan=False)
        return f"{text}\t{_check(text)}"

    @classmethod
    def from_line(cls, line: str) -> Record | None:
        """The record a line holds; None if it is torn, altered or none."""
        text, tab, check = line.rstrip("\n").rpartition("\t")
        if not tab or check != _check(text):
            return None
        values = json.loads(text)
        kinds = {field.name: field.type for field in fields(cls)}
        if not isinstance(values, dict) or values.keys() != kinds.keys():
            return None
        allowed: dict[str, tuple[type, ...]] = {"str": (str,), "int": (int,), "float": (int, float)}
        if not all(isinstance(values[name], allowed[str(kind)]) for name, kind in kinds.items()):
            return None
        return cls(**values) if values["state"] in ("done", "failed") else None


def _check(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:_CHECK_DIGITS]


class Ledger:
    """The records of a store, the last one of each task."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.records: dict[tuple[str, int], Record] = {}
        self.torn = 0
        if path.exists():
            with path.open(encoding="utf-8", errors="replace") as stream:
                for line in stream:
                    record = Record.from_line(line)
                    if record is None:
                        self.torn += bool(line.strip())
                    else:
                        self.records[member(record.stage), record.task] = record

    def write(self, record: Record) -> None:
        """Append a record and have it on the disk."""
        record = Record(**(asdict(record) | {"created": record.created or created_now()}))
        append_line(self.path, record.line())
        self.records[record.stage, record.task] = record
