"""Poincare sections: a run seen once a period, at the onset of every impact, or wherever something passes a level."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.dynamics.flow import Stroboscope
from snapbeam.model.integration import Integration
from snapbeam.model.system import System
from snapbeam.simulation.simulate import simulate
from snapbeam.util.validation import InputError, InputTypeError, checked, choice, finite, integer, shown

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["poincare_section"]


_Array = NDArray[np.float64]
SECTIONS = ("stroboscopic", "impact")
_LEVELS = (
    "displacement_at_striker",
    "midspan_displacement",
    "velocity_at_striker",
    "midspan_velocity",
    "penetration_normalised",
)
_DIRECTIONS = ("up", "down", "both")
_SAMPLES = 128
"""A period of the drive or, where that is shorter, of the first mode, to find passages in."""
_RATES = {"displacement_at_striker": "velocity_at_striker", "midspan_displacement": "midspan_velocity"}


@checked
def poincare_section(
    system: System,
    section: str | tuple[str, float, str] = "stroboscopic",
    periods: int = 500,
    *,
    transient: int = 100,
    phase: float | None = None,
    integration: Integration | None = None,
) -> xr.Dataset:
    """States of a run on a section.

    Parameters
    ----------
    system : System
    section : {"stroboscopic", "impact"} or tuple
        Once a period of the drive; at the onset of every impact; or ``(variable, level, direction)`` with a variable of
        a run (``"midspan_displacement"``, ``"displacement_at_striker"``, their velocities or ``"penetration_normalised"``), a level in its
        unit and ``"up"``, ``"down"`` or ``"both"``.
    periods : int
        Periods of the drive to look at.
    transient : int
        Periods before them.
    phase : float, optional
        Of the primary excitation, rad, for the stroboscopic section; that at the start by default.
    integration : Integration, optional

    Returns
    -------
    xarray.Dataset
        Over ``point``: ``time`` (s, since the transient), ``drive_phase`` (rad), displacements and velocities of the
        contact point and the centre as of a run, ``modal_amplitude`` and ``modal_velocity`` over ``mode``.  Passages of
        a level are found between 128 samples a period and placed on it by the run itself, to 1e-9 of a period or so.

    Raises
    ------
    InputError
        For bad input.
    """
    if not isinstance(system, System):
        raise InputTypeError(f"system = {shown(system)}: must be a System")
    if system.primary_excitation is None:
        raise InputError("striker = None: a section needs a drive, a base excitation or an axial load")
    total, before = integer("periods", periods, 1, 10**6), integer("transient", transient, 0, 10**7)
    flow = Stroboscope(system, Integration() if integration is None else integration, phase)
    level = _level(section)
    begun = flow.coordinates()
    if before:
        begun = flow.march(begun, before).states
    if not np.isfinite(begun).all():
        raise InputError("transient: the run failed before the section; use a smaller step")
    held = flow.starting(flow.state(begun[0]))
    how = flow.integration.replace(cycles=total * flow.cycles_per_period, early_termination=False)
    end = total * flow.period
    if section == "stroboscopic":
        times = np.arange(total + 1) * flow.period
    elif level is None:
        onset = simulate(held, how, sample_times=[0.0]).impacts["onset"].values
        times = np.unique(onset[(onset > 0.0) & (onset <= end)])
    else:
        times = _passages(held, how, level, end, flow.period)
    return _dataset(held, how, np.minimum(times, end), flow, section)


def _level(section: Any) -> tuple[str, float, str] | None:
    if isinstance(section, str):
        choice("section", section, SECTIONS)
        return None
    try:
        name, value, direction = section
    except (TypeError, ValueError):
        raise InputTypeError(
            f"section = {shown(section)}: must be one of {', '.join(SECTIONS)}, or (variable, level, direction)"
        ) from None
    choice("section[0]", name, _LEVELS)
    return name, finite("section[1]", value), choice("section[2]", direction, _DIRECTIONS)


def _passages(
    system: System, how: Integration, level: tuple[str, float, str], end: float, period: float
) -> _Array:
    """Instants at which a variable passes its level: between samples, then by the secant rule on the run itself."""
    name, value, direction = level
    spacing = min(period, 1.0 / system.model.reference_frequency) / _SAMPLES
    grid = np.linspace(0.0, end, int(np.ceil(end / spacing)) + 1)
    seen = simulate(system, how, sample_times=grid).dataset[name].values - value
    rising = (seen[:-1] < 0.0) & (seen[1:] >= 0.0)
    falling = (seen[:-1] > 0.0) & (seen[1:] <= 0.0)
    at = np.flatnonzero({"up": rising, "down": falling, "both": rising | falling}[direction])
    if not at.size:
        return np.empty(0)
    low, high, f_low, f_high = grid[at], grid[at + 1], seen[at], seen[at + 1]
    side = np.zeros(at.size)
    middle = low
    for _ in range(6):
        middle = np.where(f_high == f_low, high, (low * f_high - high * f_low) / (f_high - f_low))
        middle = np.clip(middle, low, high)
        order = np.argsort(middle, kind="stable")
        times, back = np.unique(middle[order], return_inverse=True)
        f = np.empty(at.size)
        f[order] = (simulate(system, how, sample_times=times).dataset[name].values - value)[back]
        above = f * f_high > 0.0
        f_low = np.where(above & (side == 1), 0.5 * f_low, np.where(above, f_low, f))
        f_high = np.where(~above & (side == -1), 0.5 * f_high, np.where(above, f, f_high))
        low, high = np.where(above, low, middle), np.where(above, middle, high)
        side = np.where(above, 1, -1)
    return np.unique(middle)


def _dataset(system: System, how: Integration, times: _Array, flow: Stroboscope, section: Any) -> xr.Dataset:
    import xarray as xr

    if not times.size:
        raise InputError(f"section = {shown(section)}: is never met within the periods asked for")
    data = simulate(system, how, sample_times=times).dataset
    kept = data[["displacement_at_striker", "velocity_at_striker", "midspan_displacement", "midspan_velocity", "modal_amplitude",
                 "modal_velocity"]]  # fmt: skip
    kept = kept.rename(time="point").reset_coords(drop=True)
    cycle = flow.period / flow.cycles_per_period
    phase = (flow.striker_phase + 2.0 * np.pi * times / cycle) % (2.0 * np.pi)
    result = xr.Dataset(
        {name: (kept[name].dims, kept[name].values, kept[name].attrs) for name in kept.data_vars},
        {"time": ("point", times, {"units": "s", "long_name": "time since the transient"})},
        data.attrs | {"title": "Poincare section", "section": str(section)},
    )
    result["drive_phase"] = ("point", phase, {"units": "rad", "long_name": "phase of the drive"})
    return result
