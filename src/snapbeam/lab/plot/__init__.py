"""Plots of the laboratory part."""
