"""What one page may ask of the machine that it runs on; beyond it a request is refused with words."""

from __future__ import annotations

from snapbeam import InputError, Integration, System

__all__ = [
    "ADDRESS",
    "BODY",
    "CYCLES",
    "MODES",
    "RUN_SECONDS",
    "SAMPLES",
    "SESSIONS",
    "UPLOAD",
    "WINDOW_POINTS",
    "check_run",
    "samples_of",
    "too_large",
]

SESSIONS = 24
"""Open pages."""
MODES = 256
CYCLES = 20_000
SAMPLES = 120_000
"""Regular samples of a recorded run."""
SAMPLE_BYTES = 160 * 2**20
"""Bytes that those samples take."""
RUN_SECONDS = 60.0
"""A run that takes longer is given up."""
WINDOW_POINTS = 60_000
"""Points of one window that is computed."""
WINDOW_SECONDS = 1800.0
UPLOAD = 2 * 2**20
"""Bytes of a file given to the page."""
ADDRESS = 4096
"""Characters of what stands behind the page's address."""
BODY = 8 * 2**20
"""Bytes of one message from a page."""

_FEWEST = 200
"""Regular samples of a cycle of the excitation, or of the first mode, that a run is recorded with by itself."""


def too_large(name: str, size: int) -> str:
    """Words for a file that is too large for a page to give."""
    return f"{name[:80]}: has {size / 2**20:.1f} MiB; a page takes at most {UPLOAD // 2**20} MiB"


def check_run(system: System, integration: Integration) -> None:
    """Refuse a run that one page may not ask for.

    Raises
    ------
    InputError
        For too many modes or cycles.
    """
    if system.model.modes > MODES:
        raise InputError(f"model.modes = {system.model.modes}: a page may ask for at most {MODES}")
    if integration.cycles_or_default > CYCLES:
        raise InputError(
            f"integration.cycles = {integration.cycles_or_default}: a page may ask for at most {CYCLES}"
        )


def samples_of(system: System, integration: Integration) -> int | None:
    """Samples to record a run with; None if it may have all that it is recorded with by itself."""
    striker = system.striker
    if striker is None or not striker.drive.harmonic:
        return None
    ratio = float(striker.drive.frequency_ratio)  # type: ignore[attr-defined]
    wanted = integration.cycles_or_default * max(1.0, 1.0 / ratio) * _FEWEST
    row = 8 * (4 * system.model.modes + 20)
    most = min(SAMPLES, SAMPLE_BYTES // row)
    return None if wanted <= most else most
