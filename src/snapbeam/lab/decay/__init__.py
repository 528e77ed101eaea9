"""Natural frequencies and damping from free decays."""
