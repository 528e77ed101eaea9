"""Position of the notch, measured at Omega = 1.4: shift by each effect that the model neglects.

The threshold over frequency, as in Fig. 6, of the paper's beam with one thing changed at a time: the shaker's mass and
suspension, its start-up, the ends, unequal wells, the contact, and dimensions as they were measured.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import snapbeam as sb
from snapbeam.model.default_values import BEAM, CONTACT, LOCATION
from snapbeam.paper.recipes.sensitivity import tip_contact
from snapbeam.plot.style import BEAM_COLOR, SHAKER_COLOR, figure_style, fix_ticks, new_figure, panel_letters
from snapbeam.sweeps.threshold import Notch

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from snapbeam.paper.recipe import Results

_Array = NDArray[np.float64]

WINDOW = (1.0, 1.6)
"""Omega between which the notch is looked for."""
MEASURED = 1.4
"""Position of the notch in the paper's experiment."""
BASE = "the model"
_CYCLES = 120
_UNIT = BEAM.bending_stiffness / BEAM.length
_PLACES = LOCATION + 0.002 * np.array([-1.0, 1.0])
"""A third of a millimetre to either side: how well a place is known."""


def _system(modes: int, beam: sb.Beam = BEAM, **parts: Any) -> sb.System:
    model = sb.ReducedModel.from_beam(
        beam, modes=modes, damping_ratio=parts.pop("damping_ratio", 0.005), imperfection=parts.pop("imperfection", None)
    )
    drive = parts.pop("drive", sb.Sine(frequency_ratio=1.0, velocity_amplitude=0.1))
    contact = parts.pop("contact", CONTACT)
    return sb.System(model, contacts=[sb.Contact(contact, sb.Striker(drive=drive, **parts))])


def _supported(**stiffness: float) -> sb.Beam:
    """The paper's beam on elastic supports."""
    changes: dict[str, Any] = {"boundary": sb.BoundaryConditions(**stiffness)}
    return BEAM.replace(**changes)


def _body(mass: float, frequency: float, zeta: float = 0.1) -> dict[str, Any]:
    """A shaker of moving mass (kg) on a suspension of its own frequency (Hz) and damping ratio."""
    omega = 2.0 * np.pi * frequency
    return {
        "mass": mass,
        "suspension_stiffness": float(mass * omega**2),
        "suspension_damping": float(2.0 * zeta * mass * omega),
    }


def _start_up(rise: float) -> sb.Burst:
    """A sine that rises over some cycles and stays."""
    return sb.Burst(
        frequency_ratio=1.0, velocity_amplitude=0.1, duration_cycles=1e6, ramp_up_cycles=rise, ramp_down_cycles=1.0
    )


_SOFT = {
    k: _supported(left_rotational_stiffness=k * _UNIT, right_rotational_stiffness=k * _UNIT) for k in (100.0, 30.0)
}
_GIVING = BEAM.young_modulus * BEAM.thickness * BEAM.width / BEAM.length

VARIANTS: dict[str, tuple[str, Callable[[int], sb.System]]] = {
    BASE: ("", lambda n: _system(n)),
    "2 g on 20 Hz": ("shaker", lambda n: _system(n, **_body(0.002, 20.0))),
    "10 g on 20 Hz": ("shaker", lambda n: _system(n, **_body(0.01, 20.0))),
    "20 g on 20 Hz": ("shaker", lambda n: _system(n, **_body(0.02, 20.0))),
    "50 g on 20 Hz": ("shaker", lambda n: _system(n, **_body(0.05, 20.0))),
    "200 g on 20 Hz": ("shaker", lambda n: _system(n, **_body(0.2, 20.0))),
    "50 g on 60 Hz": ("shaker", lambda n: _system(n, **_body(0.05, 60.0))),
    "50 g on 120 Hz": ("shaker", lambda n: _system(n, **_body(0.05, 120.0))),
    "rises over 20 cycles": ("start-up", lambda n: _system(n, drive=_start_up(20.0))),
    r"$k_\theta = 100\,EI/L$": ("ends", lambda n: _system(n, _SOFT[100.0])),
    r"$k_\theta = 30\,EI/L$": ("ends", lambda n: _system(n, _SOFT[30.0])),
    "supports give as the beam": ("ends", lambda n: _system(n, _supported(axial_support_stiffness=_GIVING))),
    "higher well struck": ("asymmetry", lambda n: _system(n, imperfection=sb.Imperfection(midspan_amplitude=1.2e-6))),
    "lower well struck": ("asymmetry", lambda n: _system(n, imperfection=sb.Imperfection(midspan_amplitude=-1.2e-6))),
    "crooked by 5 µm": ("asymmetry", lambda n: _system(n, imperfection=sb.Imperfection(antisymmetric_amplitude=5e-6))),
    r"$k_\mathrm{c}$ tenfold": ("contact", lambda n: _system(n, contact=sb.HertzContact(4e9))),
    r"$k_\mathrm{c}$ a tenth": ("contact", lambda n: _system(n, contact=sb.HertzContact(4e7))),
    "tip of common PLA": ("contact", lambda n: _system(n, contact=tip_contact())),
    "restitution 0.6": (
        "contact", lambda n: _system(n, contact=sb.HuntCrossley.from_restitution(4e8, 0.6, 0.05))
    ),
    "gap of 10 µm": ("contact", lambda n: _system(n, gap=1e-5)),
    "preload of 10 µm": ("contact", lambda n: _system(n, gap=-1e-5)),
    "twice the damping": ("beam", lambda n: _system(n, damping_ratio=0.01)),
    "both as measured": (
        "beam", lambda n: _system(n, BEAM.replace(thickness=0.44e-3, buckling_level=0.5e-3))
    ),
}  # fmt: skip
"""Variants and the group of each; each builds its system from a number of modes."""


def compute(results: Results) -> dict[str, xr.Dataset]:
    """First amplitude that snaps, over frequency and two places of the tip, for each variant."""
    from snapbeam.util.datasets import xr

    modes, cycles = results.pick(2, 8), results.pick(20, _CYCLES)
    ratio = np.round(np.arange(WINDOW[0], WINDOW[1] + 1e-9, results.pick(0.1, 0.025)), 6)
    drives = np.round(np.arange(0.05, results.pick(0.5, 0.351), results.pick(0.05, 0.01)), 6)
    names = results.pick(list(VARIANTS)[:3], list(VARIANTS))
    columns, freq = [], []
    for name in names:
        system = VARIANTS[name][1](modes)
        found = sb.threshold(
            system, "velocity_amplitude", drives, {"location": _PLACES, "frequency_ratio": ratio},
            sb.Integration(cycles=cycles), progress=results.progress(f"notch, {name}"),
        )  # fmt: skip
        columns.append(found.lower_threshold.transpose("location", "frequency_ratio").values)
        freq.append(system.model.reference_frequency)
    ds = xr.Dataset(
        {
            "threshold": (
                ("variant", "location", "frequency_ratio"), np.array(columns),
                {"units": "1", "long_name": "lowest velocity amplitude that snaps"},
            ),
            "reference_frequency": ("variant", np.array(freq), {"units": "Hz", "long_name": "omega_1/(2 pi)"}),
        },
        {"variant": names, "location": _PLACES, "frequency_ratio": ratio},
        {"modes": modes, "cycles": cycles, "amplitude_step": float(drives[1] - drives[0])},
    )  # fmt: skip
    return {"thresholds": ds}


def notches(ds: xr.Dataset, variant: str) -> list[Notch]:
    """The notch at each place of the tip: the lowest threshold that rises by two steps of V on either side.

    Its stretch is what lies within one step of it, without a break.  Nothing found is a notch of NaN.
    """
    ratio, step = ds.frequency_ratio.values.astype(float), float(ds.attrs["amplitude_step"])
    rows = ds.threshold.sel(variant=variant).values.astype(float)
    return [_dip(ratio, np.where(np.isnan(row), np.nanmax(rows) + step, row), step) for row in rows]


def _dip(ratio: _Array, row: _Array, step: float) -> Notch:
    found: Notch | None = None
    for i in range(1, row.size - 1):
        rises = min(row[:i].max(), row[i + 1 :].max()) - row[i] > 1.9 * step
        if rises and (found is None or row[i] < found.height - 0.1 * step):
            near = row <= row[i] + 1.1 * step
            first = i - int(np.argmin(near[i::-1])) + 1 if not near[: i + 1].all() else 0
            last = i + int(np.argmin(near[i:])) - 1 if not near[i:].all() else row.size - 1
            lowest = np.flatnonzero(row[first : last + 1] <= row[i] + 0.1 * step) + first
            at = 0.5 * (ratio[lowest[0]] + ratio[lowest[-1]])
            found = Notch(float(at), float(row[i]), float(ratio[first]), float(ratio[last]))
    return found if found is not None else Notch(np.nan, np.nan, np.nan, np.nan)


def moved(ds: xr.Dataset, variant: str) -> tuple[float, float, float]:
    """Position of the notch (Omega, median over tip locations), and its lower and upper bound from the data."""
    found = notches(ds, variant)
    at = float(np.median([each.position for each in found]))  # NaN if a place has none
    return at, min(each.low for each in found), max(each.high for each in found)


def draw(results: Results) -> Figure:
    """Thresholds of the model and of three variants; the notch of each, ranked by how far it moves."""
    ds = results["notch"]["thresholds"]
    names = [str(name) for name in ds.variant.values]
    where = {name: moved(ds, name) for name in names}
    base = where[BASE][0]
    ranked = sorted(names[1:], key=lambda name: -abs(np.nan_to_num(where[name][0] - base)))
    with figure_style():
        figure = new_figure("double", 125.0)
        left, right = figure.subplots(1, 2, width_ratios=(1.0, 0.85))
        shown = [(BASE, BEAM_COLOR, "-")]
        shown += list(zip(ranked[:3], (SHAKER_COLOR, "0.45", "#2E8B57"), ("-", "--", "-."), strict=False))
        for name, color, line in shown:
            rows = ds.threshold.sel(variant=name).values
            left.fill_between(
                ds.frequency_ratio, rows.min(axis=0), rows.max(axis=0), color=color, alpha=0.15, linewidth=0.0
            )
            left.plot(ds.frequency_ratio, np.median(rows, axis=0), line, color=color, label=name)
        left.axvline(MEASURED, color="0.4", linewidth=0.6, dashes=(4, 2))
        left.set(xlabel=r"Excitation frequency $\Omega$", ylabel="Interwell threshold $V$", xlim=WINDOW)
        left.set_ylim(0.0)
        left.legend(loc="upper left")
        order = [*ranked[::-1], BASE]
        for row, name in enumerate(order):
            at, low, high = where[name]
            color = BEAM_COLOR if name == BASE else SHAKER_COLOR
            if not np.isfinite(at):
                right.text(base, row, " none", fontsize=6, va="center", color=color)
                continue
            right.plot([low, high], [row, row], color=color, linewidth=1.0)
            right.plot([at], [row], "o", color=color, markersize=3)
        right.axvline(MEASURED, color="0.4", linewidth=0.6, dashes=(4, 2))
        right.axvline(base, color=BEAM_COLOR, linewidth=0.6, dashes=(1, 2))
        right.set(yticks=range(len(order)), yticklabels=order, xlabel=r"Notch $\Omega$", xlim=WINDOW)
        right.set_ylim(-0.7, len(order) - 0.3)
        right.tick_params(axis="y", labelsize=6, length=0)
        fix_ticks(left)
        panel_letters([left, right])
    return figure
