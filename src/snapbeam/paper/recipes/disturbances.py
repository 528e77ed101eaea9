"""Effect of small perturbations: start-up transient of the shaker, initial offset, impact without ripples.

Each of many random points of Fig. 6 is run with the shaker's first cycles larger than the steady state, with
the beam starting 1e-3 b off its rest, and, as the measure for both, with V changed by 1e-9.  And impacts of many
runs are repeated from the instant of touch, with the state of the run and with its first mode alone.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import snapbeam as sb
from snapbeam.model.default_values import CONTACT, CYCLES, LOCATION
from snapbeam.paper.system import paper_map, paper_model
from snapbeam.plot.style import BEAM_COLOR, SHAKER_COLOR, figure_style, fix_ticks, new_figure, panel_letters
from snapbeam.util.provenance import made_by

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from snapbeam.paper.recipe import Results

_Array = NDArray[np.float64]

EXCESS, OFFSET = 0.2, 1e-3
"""Initial excess of the shaker amplitude, falling by e per cycle; and initial offset of the beam, in b."""
VARIANTS = {
    "perturbed": "$V$ times\n$1 + 10^{-9}$",
    "offset": "start $10^{-3} b$\noff the well",
    "startup": "first cycle\n20 % larger",
}
_SEED = 118291
_RANGES = ((0.3, 4.0), (0.05, 0.65))
_NEIGHBOUR = (4.0 / 160, 0.65 / 66)  # a cell of Fig. 6
_PER_CYCLE = 128  # samples of a drive


def compute(results: Results) -> dict[str, xr.Dataset]:
    """The class of every point in every variant, and the impacts."""
    modes, count = results.pick(4, 32), results.pick(12, 240)
    draw_from = np.random.default_rng(_SEED)
    points = np.column_stack([draw_from.uniform(low, high, count) for low, high in _RANGES])
    model, cycles = paper_model(modes), results.pick(30, CYCLES)
    kinds: dict[str, list[int]] = {name: [] for name in ("base", *VARIANTS)}
    border = []
    for at, (omega, drive) in enumerate(points):
        for name, given in _variants(model, float(omega), float(drive), cycles).items():
            run = sb.simulate(
                sb.System(model, **given), sb.Integration(cycles=cycles, early_termination=True), sample_times=[0.0]
            )
            kinds[name].append(int(run.summary.response_class))
        border.append(_at_border(model, float(omega), float(drive), cycles))
        results.progress("disturbances, classes")(at + 1, count)
    impacts = _impacts(results, model, points)
    stamp: dict[str, Any] = made_by({"modes": modes, "seed": _SEED, "points": count})
    stamp |= {"modes": modes, "cycles": cycles, "reference_frequency": model.reference_frequency}
    return {"classes": _class_table(points, kinds, border, stamp), "impacts": _impact_table(impacts, stamp)}


def _variants(model: sb.ReducedModel, omega: float, drive: float, cycles: int) -> dict[str, dict[str, Any]]:
    """Contacts and initial state of each variant; all drives are recordings, so that nothing else differs."""
    rest = model.well_amplitude
    steady = _record(model, omega, drive, cycles)
    return {
        "base": {"contacts": [steady]},
        "perturbed": {"contacts": [_record(model, omega, drive * (1.0 + 1e-9), cycles)]},
        "offset": {"contacts": [steady], "initial_state": sb.State(amplitude=rest * (1.0 - OFFSET))},
        "startup": {"contacts": [_record(model, omega, drive, cycles, EXCESS)]},
    }


def _record(
    model: sb.ReducedModel, omega: float, drive: float, cycles: int, excess: float = 0.0, phase: float = 0.0
) -> sb.Contact:
    """w_s' = V b omega_1 cos(omega t + phase), its displacement first (1 + *excess*) times as large, as samples."""
    angular = 2.0 * math.pi * omega * model.reference_frequency
    height = drive * float(model.length_scale or 0.0) / omega
    cycle = np.arange(cycles * _PER_CYCLE + 1) / _PER_CYCLE
    angle = 2.0 * math.pi * cycle + phase
    size = 1.0 + excess * np.exp(-cycle)
    slope = -excess * np.exp(-cycle) / (2.0 * math.pi)  # by the angle
    offset = math.sin(phase) * size[0]
    striker = sb.Striker(
        drive=sb.RecordedMotion(
            displacement=height * (size * np.sin(angle) - offset),
            velocity=height * angular * (size * np.cos(angle) + slope * np.sin(angle)),
            sampling_frequency=_PER_CYCLE * omega * model.reference_frequency,
            frequency=omega * model.reference_frequency,
        ),
        location=LOCATION,
    )
    return sb.Contact(CONTACT, striker)


def _at_border(model: sb.ReducedModel, omega: float, drive: float, cycles: int) -> bool:
    """Return whether a neighbouring point, one cell of Fig. 6 away, has another class."""
    around = paper_map(
        model, frequency_ratio=omega + _NEIGHBOUR[0] * np.array([-1.0, 0.0, 1.0]),
        velocity_amplitude=drive + _NEIGHBOUR[1] * np.array([-1.0, 0.0, 1.0]),
        cycles=cycles, early_termination=True,
    ).response_class.values  # fmt: skip
    return bool((around != around[1, 1]).any())


def _impacts(results: Results, model: sb.ReducedModel, points: _Array) -> _Array:
    """One hard impact of each run, repeated with the whole state and with the first mode alone."""
    wanted, rows = results.pick(6, 80), []
    for omega, drive in points[:wanted]:
        row = _repeat(model, float(omega), float(drive))
        if row is not None:
            rows.append(row)
        results.progress("disturbances, impacts")(len(rows), wanted)
    return np.array(rows).reshape(-1, len(_IMPACT_COLUMNS))


def _repeat(model: sb.ReducedModel, omega: float, drive: float) -> list[float] | None:
    """Impulse and work within a quarter of the first period, and the time of the next impact, of both repetitions.

    The impact is the one of the maximum impulse after four periods of the first mode; None if there is none.
    """
    first = 1.0 / model.reference_frequency
    shaker = sb.Shaker(frequency_ratio=omega, velocity_amplitude=drive, location=LOCATION)
    cycles = max(math.ceil(8.0 * omega), 2)
    run = sb.simulate(
        sb.System(model, contacts=[sb.Contact(CONTACT, shaker.striker())]),
        sb.Integration(cycles=cycles, accuracy="reference"),
        sample_times=[0.0],
    )
    onset, impulse = run.impacts.onset.values, run.impacts.impulse.values
    near = 1e-7 * first
    late = np.flatnonzero((onset > 4.0 * first) & (onset < (cycles / omega - 1.5) * first))
    if late.size == 0:
        return None
    at = float(onset[late[np.argmax(impulse[late])]])
    around = sb.simulate(
        sb.System(model, contacts=[sb.Contact(CONTACT, shaker.striker())]),
        sb.Integration(cycles=cycles, accuracy="reference"),
        sample_times=[at - near, at, at + near],
    ).dataset.modal_amplitude.values
    alpha, velocity = around[1], (around[2] - around[0]) / (2.0 * near)
    record = _record(model, omega, drive, cycles, phase=2.0 * math.pi * ((at / first * omega) % 1.0))
    alone = np.arange(model.modes) == 0
    within = (onset >= at - near) & (onset <= at + 0.25 * first)
    found = [omega, drive, at, float(impulse[within].sum())]
    for kept in (np.ones_like(alone), alone):
        start = sb.State(amplitude=alpha * kept, velocity=velocity * kept)
        again = sb.simulate(
            sb.System(model, contacts=[record], initial_state=start),
            sb.Integration(cycles=cycles, accuracy="reference"),
            sample_times=[0.25 * first],
        )
        hits, impulses = again.impacts.onset.values, again.impacts.impulse.values
        later = hits[hits > 0.25 * first]
        found += [
            float(impulses[hits <= 0.25 * first].sum()),
            float(again.dataset.striker_work.values[-1]),
            float(later[0]) if later.size else math.nan,
        ]
    return found


_IMPACT_COLUMNS = {
    "frequency_ratio": ("1", "frequency ratio Omega"),
    "velocity_amplitude": ("1", "velocity amplitude V"),
    "onset": ("s", "time of touch"),
    "impulse_run": ("N s", "impulse within a quarter of the first period in the run itself"),
    "impulse": ("N s", "the same impulse, repeated with the whole state"),
    "work": ("J", "work of the shaker in that time, repeated with the whole state"),
    "next_onset": ("s", "next touch after that time, repeated with the whole state"),
    "impulse_alone": ("N s", "the same impulse from the first mode alone"),
    "work_alone": ("J", "the same work from the first mode alone"),
    "next_onset_alone": ("s", "the same touch from the first mode alone"),
}


def _class_table(points: _Array, kinds: dict[str, list[int]], border: list[bool], attrs: dict[str, Any]) -> xr.Dataset:
    from snapbeam.util.datasets import xr

    names = list(kinds)
    data: dict[str, Any] = {
        "response_class": (("variant", "point"), np.array([kinds[name] for name in names], dtype=np.int8)),
        "at_border": ("point", np.array(border)),
        "frequency_ratio": ("point", points[:, 0], {"units": "1"}),
        "velocity_amplitude": ("point", points[:, 1], {"units": "1"}),
    }
    return xr.Dataset(data, {"variant": names}, attrs)


def _impact_table(rows: _Array, attrs: dict[str, Any]) -> xr.Dataset:
    from snapbeam.util.datasets import xr

    data = {
        name: (("impact",), rows[:, i], {"units": units, "long_name": words})
        for i, (name, (units, words)) in enumerate(_IMPACT_COLUMNS.items())
    }
    return xr.Dataset(data, attrs=attrs)


def draw(results: Results) -> Figure:
    """Left: share of the points that change class in each variant; right: the repeated impacts."""
    data = results["disturbances"]
    with figure_style():
        figure = new_figure("double", 72.0)
        axes = figure.subplots(1, 2)
        _changes(axes[0], data["classes"])
        _comparison(axes[1], data["impacts"])
        fix_ticks(*axes)
        panel_letters(axes)
    return figure


def _changes(ax: Axes, classes: xr.Dataset) -> None:
    base = classes.response_class.sel(variant="base").values
    border = classes.at_border.values.astype(bool)
    for at, name in enumerate(VARIANTS):
        changed = classes.response_class.sel(variant=name).values != base
        for offset, where, color, words in (
            (-0.17, border, SHAKER_COLOR, "beside another class"),
            (0.17, ~border, BEAM_COLOR, "elsewhere"),
        ):
            share = 100.0 * changed[where].mean() if where.any() else 0.0
            ax.bar(at + offset, share, 0.32, color=color, label=words if at == 0 else None)
            ax.annotate(f"{share:.0f}", (at + offset, share), (0, 2), textcoords="offset points",
                        ha="center", fontsize=7)  # fmt: skip
    ax.set_xticks(range(len(VARIANTS)), list(VARIANTS.values()))
    ax.set(ylabel="Points of another class (%)", ylim=(0.0, 60.0))
    ax.legend(loc="upper left")


def _comparison(ax: Axes, impacts: xr.Dataset) -> None:
    whole, alone = 1e3 * impacts.impulse.values, 1e3 * impacts.impulse_alone.values
    top = 1.05 * max(whole.max(initial=1e-3), alone.max(initial=1e-3))
    ax.plot([0.0, top], [0.0, top], color="0.7", linewidth=0.5)
    ax.plot(whole, alone, ".", color=BEAM_COLOR, markersize=3)
    ax.set(xlabel="Impulse, all modes (mN s)", ylabel="Impulse, first mode alone (mN s)")
    ax.set(xlim=(0.0, top), ylim=(0.0, top))
