"""Probability maps: how likely each outcome is, with intervals, for no more runs than that takes."""
