"""Recordings and signals with a known truth."""
