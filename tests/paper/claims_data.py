"""Results made by formula, for the rules of the claims: maps whose classes are known point by point."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from snapbeam.paper.recipe import Results
from snapbeam.util.status_codes import ResponseClass

RATIO = np.round(np.linspace(0.1, 4.0, 79), 6)
DRIVE = np.round(np.linspace(0.01, 0.65, 65), 6)


class Given(Results):
    """Results that hold what they are given and compute nothing."""

    def __init__(self, **data: dict[str, xr.Dataset]) -> None:
        super().__init__("quick", compute=False)
        self._known.update(data)


def response_map(kinds: Any, modes: int = 32, cycles: int = 200, **more: Any) -> xr.Dataset:
    """A map over RATIO and DRIVE of classes given as an array or as a threshold along RATIO."""
    kinds = np.asarray(kinds)
    if kinds.ndim == 1:
        above = DRIVE[None, :] >= kinds[:, None] - 1e-9
        kinds = np.where(above, ResponseClass.TRANSIENT_2, ResponseClass.INTRAWELL)
    ds = xr.Dataset(
        {
            "response_class": (("frequency_ratio", "velocity_amplitude"), kinds.astype(np.int8)),
            "zero_crossings": (("frequency_ratio", "velocity_amplitude"), np.where(kinds > 0, 1, 0)),
            "final_well_proven": (("frequency_ratio", "velocity_amplitude"), np.ones(kinds.shape, dtype=bool)),
        },
        {"frequency_ratio": RATIO, "velocity_amplitude": DRIVE},
        {"modes": modes, "cycles": cycles, "reference_frequency": 83.93 if modes == 1 else 81.85},
    )
    return ds.assign_attrs(more)


def calm_sensitivity(one: xr.Dataset, many: xr.Dataset) -> dict[str, xr.Dataset]:
    """A study of sensitivity in which nothing changes anything: no chaos."""
    names = ("", "perturbed", "half_step", "long", "perturbed_long")
    found = {name or "base": many for name in names}
    found |= {"_".join(part for part in ("one_mode", name) if part): one for name in names}
    return found | {"double_modes": many, "soft_contact": many, "buckling_damping": many, "one_mode_reference": one}


def two_maps(one: Any, many: Any, **data: Any) -> Given:
    """Fig. 6 of one mode and of many, and sensitivity without chaos."""
    few, more = response_map(one, 1), response_map(many)
    fig6 = {"modes_1": few, "modes_32": more}
    return Given(**({"fig6": fig6, "sensitivity": calm_sensitivity(few, more)} | data))
