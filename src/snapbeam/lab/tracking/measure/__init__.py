"""Rows of beam and shaker in every frame, and what is wrong with each."""
