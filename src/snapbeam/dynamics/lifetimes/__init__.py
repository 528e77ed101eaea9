"""How long snapping lasts: many starts, censored maximum likelihood, kept as sweeps are."""
