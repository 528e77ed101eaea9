"""What goes wrong with stores and clusters."""

from __future__ import annotations

__all__ = ["CheckpointError"]


class CheckpointError(OSError):
    """A store that cannot be written, read or trusted, or workers that cannot compute; the message says what to do."""
