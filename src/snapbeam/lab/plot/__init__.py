"""Figures of the lab part."""
