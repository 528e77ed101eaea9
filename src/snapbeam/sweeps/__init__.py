"""Many runs: sweeps over any parameters as labelled datasets, kept, spread and refined, and thresholds."""
