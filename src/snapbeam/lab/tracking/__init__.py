"""Tracking of beam and striker in recordings."""
