"""Strikers: where a tip is, on which side of the beam, and how it moves."""

from snapbeam.model.striker.shaker import Shaker
from snapbeam.model.striker.striker import SIDES, Striker

__all__ = ["SIDES", "Shaker", "Striker"]
