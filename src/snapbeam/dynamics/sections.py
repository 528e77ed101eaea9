"""Poincare sections: a run seen once a period, at the onset of every impact, or wherever something passes a level."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize.elementwise import find_root

from snapbeam.dynamics.results import in_unit, labelled
from snapbeam.dynamics.stroboscope import Stroboscope, settling_periods
from snapbeam.model.integration import Integration
from snapbeam.model.system import System
from snapbeam.simulation.simulate import simulate
from snapbeam.util.validation import InputError, InputTypeError, checked, choice, finite, instance, integer, shown

if TYPE_CHECKING:
    import xarray as xr

_Array = NDArray[np.float64]
SECTIONS = ("stroboscopic", "impact")
_STATES = ("displacement_at_striker", "midspan_displacement", "velocity_at_striker", "midspan_velocity")
_DIRECTIONS = ("up", "down", "both")
_SAMPLES = 128
"""A period of the drive or, where that is shorter, of the first mode, to find passages in."""
_ROUNDS = 40
"""Maximum number of rounds that place a passage on its level."""


@checked
def poincare_section(
    system: System,
    section: str | tuple[str, float, str] = "stroboscopic",
    periods: int = 500,
    *,
    transient: int | None = None,
    phase: float | None = None,
    integration: Integration | None = None,
) -> xr.Dataset:
    """States of a run on a section.

    Parameters
    ----------
    system : System
        System to simulate.
    section : {"stroboscopic", "impact"} or tuple
        Instants: once a period of the drive, the onset of every impact, or ``(variable, level, direction)`` with a
        variable of a run (``"midspan_displacement"``, ``"displacement_at_striker"``, their velocities or
        ``"penetration_normalised"``), a level in its unit and ``"up"``, ``"down"`` or ``"both"``.
    periods : int
        Periods to record.
    transient : int, optional
        Periods before them; by default 16 time constants of the slowest mode, in [200, 20,000].
    phase : float, optional
        Phase of the primary excitation, rad, of the stroboscopic section; that at the start by default.
    integration : Integration, optional
        Solver settings.

    Returns
    -------
    xarray.Dataset
        Variables over ``point``: ``time`` (s, since the transient), ``drive_phase`` (rad), displacements and velocities
        of the contact point and the centre, ``modal_amplitude`` and ``modal_velocity`` over ``mode``. Passages of a
        level are found between 128 samples a period; the attribute ``level_error`` is the maximum distance from the
        level. ``termination_reason`` states the transient and why the search stopped.

    See Also
    --------
    snapbeam.dynamics.bifurcation_diagram, snapbeam.plot.plot_section

    Examples
    --------
    >>> import snapbeam as sb
    >>> system = sb.paper.struck_beam(frequency_ratio=1.6, velocity_amplitude=0.03, damping_ratio=0.05)
    >>> section = sb.dynamics.poincare_section(system, "impact", 20, transient=20)
    >>> sorted(section.data_vars)[:3]
    ['displacement_at_striker', 'drive_phase', 'midspan_displacement']
    """
    instance("system", system, System, "a System")
    if system.primary_excitation is None:
        raise InputError("contacts = []: a section needs a drive, a base excitation or an axial load")
    total = integer("periods", periods, 1, 10**6)
    flow = Stroboscope(system, Integration() if integration is None else integration, phase)
    level = _level(section)
    before, rule = settling_periods(flow, transient)
    begun = flow.coordinates()
    if before:
        begun = flow.advance(begun, before).states
    if not np.isfinite(begun).all():
        raise InputError("transient: the run failed before the section; use a smaller step")
    held, how = flow.starting(begun[0]), flow.during(total)
    end = total * flow.period
    reason, off = f"{total} periods after a transient of {before} periods ({rule})", None
    if section == "stroboscopic":
        times = np.arange(total + 1) * flow.period
    elif level is None:
        onset = simulate(held, how, sample_times=[0.0]).impacts["onset"].values
        times = np.unique(onset[(onset > 0.0) & (onset <= end)])
    else:
        times, off, words = _passages(held, how, level, end, flow.period)
        reason += f"; {words}"
    if not times.size:
        raise InputError(f"section = {shown(section)}: is never met within the periods asked for")
    times = np.minimum(times, end)
    data = simulate(held, how, sample_times=times).dataset
    kept = data[[*_STATES[::2], *_STATES[1::2], "modal_amplitude", "modal_velocity"]]
    kept = kept.rename(time="point").reset_coords(drop=True)
    phases = (flow.clock.striker_phase + 2.0 * np.pi * times / flow.clock.cycle) % (2.0 * np.pi)
    attrs = {"title": "Poincare section", "section": str(section), "transient": before, "termination_reason": reason}
    return labelled(
        {str(name): (kept[name].dims, kept[name].values, kept[name].attrs) for name in kept.data_vars}
        | {"drive_phase": ("point", phases, in_unit("rad", "phase of the drive"))},
        {"time": ("point", times, in_unit("s", "time since the transient"))},
        data.attrs | attrs | ({} if off is None else {"level_error": off}),
    )


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
    choice("section[0]", name, (*_STATES, "penetration_normalised"))
    return name, finite("section[1]", value), choice("section[2]", direction, _DIRECTIONS)


def _passages(
    system: System, how: Integration, level: tuple[str, float, str], end: float, period: float
) -> tuple[_Array, float, str]:
    """Instants at which a run passes a level, the maximum distance from it there, and why the search stopped."""
    name, value, direction = level
    spacing = min(period, 1.0 / system.model.reference_frequency) / _SAMPLES
    grid = np.linspace(0.0, end, int(np.ceil(end / spacing)) + 1)
    seen = simulate(system, how, sample_times=grid).dataset[name].values - value
    rising = (seen[:-1] < 0.0) & (seen[1:] >= 0.0)
    falling = (seen[:-1] > 0.0) & (seen[1:] <= 0.0)
    at = np.flatnonzero({"up": rising, "down": falling, "both": rising | falling}[direction])
    if not at.size:
        return np.empty(0), 0.0, "no passage"

    def off(times: _Array) -> _Array:
        """Distances from the level at instants in any order."""
        instants, back = np.unique(times, return_inverse=True)
        return np.asarray((simulate(system, how, sample_times=instants).dataset[name].values - value)[back])

    found = find_root(off, (grid[at], grid[at + 1]), maxiter=_ROUNDS)
    words = f"{int(found.nit.max())} rounds of Chandrupatla's rule" + ("" if found.success.all() else ", the maximum")
    return np.unique(found.x), float(np.abs(found.f_x).max()), words
