"""xarray, with ``dataset.snapbeam`` added; each part of snapbeam that makes or opens a dataset takes it from here.

``import snapbeam`` alone does not import this module, because xarray takes a quarter of a second.
"""

from __future__ import annotations

import xarray as xr

from snapbeam.util.display import DatasetFigures

__all__ = ["xr"]

xr.register_dataset_accessor("snapbeam")(DatasetFigures)
