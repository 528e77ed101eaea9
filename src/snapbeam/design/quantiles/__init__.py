"""Quantile thresholds: where the probability of snapping passes given values."""
