"""Periodic orbits, stable or not: shooting, multipliers, branches along a parameter."""
