"""A beam's parameters from what was measured on it."""
