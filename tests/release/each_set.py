"""A small map with each instruction set of the installed core: the same results up to rounding.  cibuildwheel runs it with each wheel."""

from __future__ import annotations

import os

import xarray as xr

import snapbeam as sb
from snapbeam import _core
from snapbeam.model import default_values

shaker = sb.Shaker(frequency_ratio=1.2, velocity_amplitude=0.2)
system = sb.System(
    sb.ReducedModel.from_beam(default_values.BEAM, modes=3), contacts=[sb.Contact(default_values.CONTACT, shaker)]
)
axes = {"drive.frequency_ratio": [1.0, 1.2, 1.4], "drive.velocity_amplitude": [0.1, 0.2, 0.4]}
found = {}
for name in _core.instruction_sets():
    os.environ["SNAPBEAM_SET"] = name
    found[name] = sb.sweep(system, axes, sb.Integration(cycles=5))
for each in found.values():
    assert (each.status == 0).all() and (each.impacts > 0).all()
    xr.testing.assert_allclose(each, found[_core.instruction_sets()[-1]], rtol=1e-6)
print("the same results with", *found)
