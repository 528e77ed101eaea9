"""Checkpoints of sweeps on disk."""
