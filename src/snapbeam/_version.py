"""The version, alone: who only asks for it loads nothing else."""

from __future__ import annotations

__version__ = "0.3.0"
