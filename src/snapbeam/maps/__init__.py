"""Many runs: grids of them as labelled datasets."""

from snapbeam.maps.grid import response_map

__all__ = ["response_map"]
