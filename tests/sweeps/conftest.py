"""A small cheap map, and its results computed in one go."""

from __future__ import annotations

from small_map import contact, model, small, whole, work

__all__ = ["contact", "model", "small", "whole", "work"]
