"""Settings made by hand over a picture of a recording, and the file of them that ``snapbeam track`` reads."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import tomli_w

from snapbeam.lab.camera import Recording, open_recording
from snapbeam.lab.tracking.settings import TrackingSettings
from snapbeam.util.files import atomic_path, check_writable
from snapbeam.util.validation import InputError

BEGIN = "# settings of a recording, made by snapbeam look\n"
"""First line of the file, by which it is known."""
Sections = Mapping[str, Mapping[str, Any]]


def moved(tracking: Mapping[str, Any], region: tuple[int, int, int, int] | None, sign: int) -> dict[str, Any]:
    """Settings of the tracking in rows and columns of the whole frame (*sign* 1), from those of a region, or back (-1)."""
    top, left = (0, 0) if region is None else (sign * region[0], sign * region[2])
    found = dict(tracking)
    if found.get("contact_column") is not None:
        found["contact_column"] += top if found.get("side") in ("left", "right") else left
    if found.get("fixed_marks"):
        found["fixed_marks"] = [[a + top, b + top, c + left, d + left] for a, b, c, d in found["fixed_marks"]]
    return found


def opened_with(path: Path, sections: Sections) -> tuple[Recording, TrackingSettings]:
    """Open a recording with the settings of a file, each checked as the options of ``snapbeam track`` are."""
    settings = TrackingSettings().changed(**sections["tracking"])
    recording = open_recording(path, **sections["camera"])
    try:
        return recording, settings.checked_for(recording.shape, len(recording))
    except InputError:
        recording.close()
        raise


def write_look(path: Path, sections: Sections, output: Path) -> Path:
    """Check settings on the recording and write them, whole or not at all."""
    opened_with(path, sections)[0].close()
    target = check_writable(output, "output", (".toml",), BEGIN)
    with atomic_path(target) as temporary:
        text = BEGIN + tomli_w.dumps({name: values for name, values in sections.items() if values})
        temporary.write_text(text, encoding="utf-8")
    return target
