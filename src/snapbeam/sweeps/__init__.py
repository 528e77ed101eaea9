"""Sweeps, thresholds, refinement, replicates and their checkpoints."""
