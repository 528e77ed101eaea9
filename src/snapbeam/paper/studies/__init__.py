"""Computations beyond the figures that the claims need."""
