"""Many runs: grids of them as labelled datasets, kept, spread and refined, and thresholds."""

from snapbeam.maps.grid import response_map
from snapbeam.maps.long import Tally, long_map
from snapbeam.maps.threshold import threshold_curve

__all__ = ["Tally", "long_map", "response_map", "threshold_curve"]
