"""Figures of the source paper."""
