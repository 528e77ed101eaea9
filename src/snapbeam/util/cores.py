"""Cores and the instruction set that this process may use."""

from __future__ import annotations

import os

from snapbeam.util.validation import choice


def usable_cores() -> int:
    """Return how many cores this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:
        return os.cpu_count() or 1


def instruction_set() -> str:
    """Return the instruction set of the native core: the one that ``SNAPBEAM_SET`` names, or the best of build and processor."""
    from snapbeam import _core  # ``snapbeam --version`` loads it not

    sets = _core.instruction_sets()
    return choice("SNAPBEAM_SET", os.environ.get("SNAPBEAM_SET") or sets[0], tuple(sets))
