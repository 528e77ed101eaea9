"""Calibration with its whole uncertainty: what is known of a beam after it was measured, and what follows from it."""
