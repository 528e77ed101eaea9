"""Many runs: grids of them as labelled datasets, kept, spread and refined, and thresholds."""

from snapbeam.sweeps.grid import response_map
from snapbeam.sweeps.stored import Tally, long_map
from snapbeam.sweeps.threshold import threshold_curve

__all__ = ["Tally", "long_map", "response_map", "threshold_curve"]
