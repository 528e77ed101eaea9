"""Natural frequencies and damping ratios from free decays."""
