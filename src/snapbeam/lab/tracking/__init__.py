"""Tracking of beam and shaker in camera recordings."""
