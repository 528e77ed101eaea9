"""What all tests of a campaign have in common, from a TOML file or by name."""

from __future__ import annotations

import dataclasses
import hashlib
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from snapbeam.core.provenance import __version__
from snapbeam.core.validate import InputError, integer
from snapbeam.lab.compare.response import LEAST_CYCLES
from snapbeam.lab.tracking.settings import TrackingSettings

__all__ = ["CampaignSettings", "load_settings"]

_CAMERA = ("frame_rate", "pixel_size", "region")
_SIGNAL = ("channel", "units", "sensitivity", "sampling_frequency", "columns")


@dataclass(frozen=True)
class CampaignSettings:
    """Settings of every test.

    Attributes
    ----------
    camera
        ``frame_rate`` [Hz], ``pixel_size`` [m] and ``region`` as for :func:`snapbeam.lab.open_recording`.
    tracking
        How to track; the buckling level is needed for the response.
    signal
        ``channel``, ``units``, ``sensitivity``, ``sampling_frequency`` and ``columns`` as for
        :func:`snapbeam.lab.read_signal`.
    cycles
        Cycles of excitation that the response class is asked for; the rule needs 20.
    """

    camera: Mapping[str, Any] = field(default_factory=dict)
    tracking: TrackingSettings = field(default_factory=TrackingSettings)
    signal: Mapping[str, Any] = field(default_factory=dict)
    cycles: int = 200

    def __post_init__(self) -> None:
        for name, known in (("camera", _CAMERA), ("signal", _SIGNAL)):
            for key in getattr(self, name):
                if key not in known:
                    raise InputError(f"{name} {key}: unknown; must be among {', '.join(known)}")
        object.__setattr__(self, "cycles", integer("cycles", self.cycles, LEAST_CYCLES))
        if self.tracking.buckling_level is None:
            raise InputError(
                "buckling_level (--buckling-level): must be given, in m, or no response can be told"
            )
        if not self.tracking.shaker:
            raise InputError("shaker: must be followed in a campaign")

    def fingerprint(self, *files: Path) -> str:
        """A number that changes with any setting and any of the files."""
        tracking = {
            item.name: getattr(self.tracking, item.name) for item in dataclasses.fields(self.tracking)
        }
        parts = [
            __version__,
            repr(sorted(self.camera.items())),
            repr(sorted(tracking.items())),
            repr(sorted(self.signal.items())),
        ]
        parts.append(repr(self.cycles))
        for file in files:
            whole = sorted(file.iterdir()) if file.is_dir() else [file, file.with_suffix(".mraw")]
            for one in whole:
                if one.exists():
                    state = one.stat()
                    parts.append(f"{one.name} {state.st_size} {state.st_mtime_ns}")
        return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:24]


def load_settings(path: Path | None, changes: Mapping[str, Mapping[str, Any]]) -> CampaignSettings:
    """Settings from a TOML file with sections camera, tracking, signal and campaign, and changes to them.

    Parameters
    ----------
    path
        The file; none if None.
    changes
        Values by section and name that go before the file's.

    Raises
    ------
    InputError
        If the file cannot be read or holds an unknown section or name.
    """
    sections: dict[str, dict[str, Any]] = {"camera": {}, "tracking": {}, "signal": {}, "campaign": {}}
    if path is not None:
        try:
            read = tomllib.loads(path.read_text(encoding="utf-8"))
        except OSError as error:
            raise InputError(f"settings = {str(path)!r}: cannot be read, {error.strerror}") from error
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise InputError(f"{path}: is no TOML, {error}") from error
        for name, values in read.items():
            if name not in sections or not isinstance(values, dict):
                raise InputError(f"{path}: [{name}]: unknown section; must be among {', '.join(sections)}")
            sections[name] |= values
    for name, given in changes.items():
        sections[name] |= {key: value for key, value in given.items() if value is not None}
    for key in sections["campaign"]:
        if key != "cycles":
            raise InputError(f"[campaign] {key}: unknown; must be cycles")
    region = sections["camera"].get("region")
    if region is not None:
        sections["camera"]["region"] = tuple(region)
    tracking = TrackingSettings().changed(**sections["tracking"])
    return CampaignSettings(
        sections["camera"], tracking, sections["signal"], sections["campaign"].get("cycles", 200)
    )
