"""Comparison of a measured run with a simulated one, on one time axis: waveforms, spectra, impacts (Fig. 4 of the paper)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.lab.diagnostics import KINDS_COMPARISON, holding
from snapbeam.lab.signals import check_signal, make_signal
from snapbeam.lab.vibrometer import measure_drive
from snapbeam.simulation.dataset import check_trajectory
from snapbeam.util.diagnostics import Diagnostic
from snapbeam.util.singular_values import lstsq
from snapbeam.util.status_codes import ResponseClass, classify
from snapbeam.util.validation import InputError, checked, choice, finite, finite_array, integer, nonnegative, positive

if TYPE_CHECKING:
    import xarray as xr

_Array = NDArray[np.float64]
_APART = 0.1  # b, by which two beams must differ to have parted
_SHIFTED = 0.15  # cycles by which a known start may be off
_RATIO = 0.05  # share by which the shakers' amplitudes may differ
_BAND = ("simulated_low", "simulated_high")
_LEAST_RUNS = 20  # for quantiles of 5 and 95 %
_PLACES = ("displacement_at_striker", "midspan_displacement")
_HYSTERESIS = 5.0  # in standard deviations of the noise
TOO_SHORT = "too short"
"""First words of the reason that too few cycles were recorded; the status of such a test."""
LEAST_CYCLES = 20  # the rule of more than n/5 crossings in n cycles means nothing below n = 5
_WHOLE = 0.98  # share of the wanted cycles that counts as all of them


def start_of_shaker(run: xr.Dataset, frequency: float) -> float | None:
    """The time [s] at which the shaker of a run starts to move, where the run shows it at rest before; else None."""
    time = np.asarray(run["time"].values, dtype=np.float64)
    values = np.asarray(run["striker_displacement"].values, dtype=np.float64)
    known = np.isfinite(values)
    if np.count_nonzero(known) < 64:
        return None
    even = np.linspace(time[0], time[-1], time.size)
    # only when it starts is asked, which no unit changes
    signal = make_signal(np.interp(even, time[known], values[known]), "m", time=even, name="shaker")
    try:
        startup = measure_drive(signal, frequency).startup
    except InputError:
        return None
    return None if startup is None else startup.onset


@dataclass(frozen=True)
class WaveformComparison:
    """A measured and a simulated run over the same cycles of excitation.

    ``waveforms`` over ``cycle``: displacement and shaker displacement of both [b], the measured shaker NaN if
    it was not recorded.  ``spectra`` over ``frequency_ratio`` (multiples of the excitation): amplitude spectra
    of the two displacements [b].  ``at`` names the variable that is compared.  ``shift`` [cycles] was added to
    the measured clock.  ``rms_difference`` [b] and ``correlation`` are those of the beam,
    ``shaker_rms_difference`` [b] that of the shaker; ``measured_rms`` and ``simulated_rms`` [b] are the beam's
    motion about its mean.  ``parted`` [cycles] is where the two beams first stay more than ``apart`` [b] from
    each other for half a cycle, NaN if they never do.  ``diagnostics`` contains the diagnostics.

    With an ensemble, ``waveforms`` also has ``simulated_low`` and ``simulated_high``, the 5 % and the 95 % quantile of
    its runs, and ``within`` is the share of the measured samples between them (NaN without an ensemble); a correct model
    has 90 % there.
    """

    waveforms: xr.Dataset
    spectra: xr.Dataset
    shift: float
    rms_difference: float
    correlation: float
    shaker_rms_difference: float
    measured_rms: float
    simulated_rms: float
    amplitude_ratio: float
    parted: float
    apart: float
    measured_impacts: _Array
    simulated_impacts: _Array
    diagnostics: tuple[Diagnostic, ...]
    at: str = "displacement_at_striker"
    within: float = math.nan


def run_of_signal(signal: xr.DataArray, length: float, at: str = "midspan_displacement") -> xr.Dataset:
    """A measured displacement as a run, without a shaker.

    The signal is a displacement [m], zero midway between the wells, measured *at* midspan or at the shaker; *length* is
    the length scale b of the structure [m], over which the run is.
    """
    from snapbeam.util.datasets import xr

    choice("at", at, _PLACES)
    scale = positive("length", length, "m")
    samples = check_signal(signal, "m", "measured")
    return xr.Dataset(
        {at: ("time", samples.values / scale, {"units": "1"})}, {"time": ("time", samples.time, {"units": "s"})}
    )


@checked
def compare_waveforms(
    measured: xr.Dataset | xr.DataArray,
    simulated: xr.Dataset,
    frequency: float | None = None,
    *,
    at: str = "displacement_at_striker",
    start: float | None = None,
    cycles: tuple[float, float] | None = None,
    measured_onsets: ArrayLike | None = None,
    simulated_onsets: ArrayLike | None = None,
    ensemble: Sequence[xr.Dataset] = (),
) -> WaveformComparison:
    """Compare a measured run with a simulated one, aligned by the phase of the shaker.

    Parameters
    ----------
    measured : xarray.Dataset or xarray.DataArray
        A run with *at* and ``striker_displacement`` [b] over ``time`` [s], as tracking gives it, or the signal of a
        displacement sensor [m], zero midway between the wells.  Without the shaker, *start* alone aligns the runs.
    simulated : xarray.Dataset
        A run of :func:`~snapbeam.simulate`.
    at : {"displacement_at_striker", "midspan_displacement"}
        Where the displacement was measured.
    frequency : float, optional
        Excitation frequency [Hz] of the measured run, where it has no coordinate ``cycle``.
    start : float, optional
        Start of the excitation in the measured run [s]; it determines the first cycle; the phase of the shaker
        determines the rest. By default the onset of the shaker, or the first sample if it begins in motion.
    cycles : (float, float), optional
        Part to compare, counted from the start; by default the common part.
    measured_onsets, simulated_onsets : array_like, optional
        Times of impacts [s], to be shown over cycles.
    ensemble : sequence of xarray.Dataset, optional
        At least 20 further runs of the same test, with parameters drawn from their uncertainty
        (:func:`snapbeam.uncertainty.sample_systems`), for the band of errors of the model.

    Raises
    ------
    InputError
        If a run lacks a variable, the runs share fewer than 2 cycles, or the ensemble is too small or too short.

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import lab, paper
    >>> model = sb.ReducedModel.from_beam(paper.BEAM, modes=1, damping_ratio=0.005)
    >>> shaker = sb.Shaker(frequency_ratio=1.2, velocity_amplitude=0.18)
    >>> system = sb.System(model, contacts=[sb.Contact(paper.CONTACT, shaker)])
    >>> run = sb.simulate(system, sb.Integration(cycles=20))
    >>> frequency = 1.2 * model.reference_frequency  # Hz
    >>> comparison = lab.compare_waveforms(run.dataset, run.dataset, frequency, cycles=(2, 18))
    >>> f"{comparison.amplitude_ratio:.2f}"
    '1.00'
    """
    from snapbeam.util.datasets import xr

    choice("at", at, _PLACES)
    onsets = [
        np.empty(0) if times is None else finite_array(name, times, 1)
        for name, times in (("measured_onsets", measured_onsets), ("simulated_onsets", simulated_onsets))
    ]
    if isinstance(measured, xr.DataArray):
        if "length_scale" not in simulated.attrs:
            raise InputError("simulated: has no attribute length_scale, m, to compare a displacement in m with")
        measured = run_of_signal(measured, float(simulated.attrs["length_scale"]), at)
    shaker_seen = "striker_displacement" in measured
    needs = (at, "striker_displacement") if shaker_seen else (at,)
    for name, run in (("measured", measured), ("simulated", simulated)):
        try:
            check_trajectory(run, require=needs)
        except InputError as error:
            raise InputError(f"{name}: {error}") from error
    if start is None and frequency is not None and shaker_seen:
        start = start_of_shaker(measured, positive("frequency", frequency, "Hz"))
    if start is None and not shaker_seen and "cycle" not in measured.coords:
        raise InputError(
            "start (--start): must be given, s, since the shaker was not recorded: the time at which it starts to move"
        )
    clock, rate = _clock(measured, frequency, start)
    if "cycle" not in simulated.coords:
        raise InputError("simulated: must have the coordinate cycle")
    model_clock = np.asarray(simulated["cycle"].values, dtype=np.float64)
    model_rate = _cycles_per_second(simulated)
    shift, ratio = 0.0, math.nan
    if shaker_seen:
        seen = _shaker_sine(measured, clock)
        wanted = _shaker_sine(simulated, model_clock)
        # cos(2 pi cycle + phase) of the measured shaker must turn with that of the simulated one
        shift = ((seen[1] - wanted[1]) / (2.0 * math.pi) + 0.5) % 1.0 - 0.5
        ratio = seen[0] / wanted[0]
    clock = np.asarray(clock + shift, dtype=np.float64)
    low, high = max(clock[0], model_clock[0], 0.0), min(clock[-1], model_clock[-1])
    if cycles is not None:
        low, high = max(low, float(cycles[0])), min(high, float(cycles[1]))
    if high - low < 2.0:
        raise InputError(f"runs share {max(high - low, 0.0):.1f} cycles: must share at least 2")
    low = float(clock[np.searchsorted(clock, low)])  # a sample, so that no measured value lies between two
    step = max(float(np.median(np.diff(clock))), 1.0 / 400.0)
    grid = np.asarray(low + step * np.arange(int((high - low) / step + 1e-9) + 1), dtype=np.float64)
    columns = {}
    for word, name in (("displacement", at), ("shaker", "striker_displacement")):
        for kind, run, cycle in (("measured", measured, clock), ("simulated", simulated, model_clock)):
            seen_here = name in run
            columns[f"{kind}_{word}"] = _on(grid, cycle, run[name].values) if seen_here else np.full(grid.size, np.nan)
    waveforms = xr.Dataset(
        {name: ("cycle", value, {"units": "1"}) for name, value in columns.items()},
        {"cycle": ("cycle", grid, {"long_name": "cycles of excitation", "units": "1"})},
    )
    within = math.nan
    if len(ensemble):
        low_high = _band(grid, ensemble, at, simulated.attrs.get("length_scale"))
        waveforms = waveforms.assign(
            {name: ("cycle", each, {"units": "1"}) for name, each in zip(_BAND, low_high, strict=True)}
        )
        seen_now = columns["measured_displacement"]
        known = np.isfinite(seen_now)
        within = float(np.mean(((seen_now >= low_high[0]) & (seen_now <= low_high[1]))[known]))
    one, two = columns["measured_displacement"], columns["simulated_displacement"]
    both = np.isfinite(one) & np.isfinite(two)
    if both.sum() < 16:
        raise InputError("measured: hardly any valid sample in the cycles that both runs have")
    shaker = columns["measured_shaker"] - columns["simulated_shaker"]
    shaker = shaker[np.isfinite(shaker)]
    spread = float(np.std(one[both])), float(np.std(two[both]))
    same = float(np.corrcoef(one[both], two[both])[0, 1]) if min(spread) > 0.0 else math.nan
    apart = max(_APART, 5.0 * float(measured.attrs.get("displacement_error_b", 0.0)))
    if shaker_seen:
        diagnostics = _diagnostics(columns, grid, shift, ratio, start is not None or frequency is None)
    else:
        diagnostics = [KINDS_COMPARISON["no_shaker"].found()]
    missing = float(np.mean(~np.isfinite(one)))
    if missing > 0.1:
        diagnostics.append(KINDS_COMPARISON["gaps"].found(share_percent=100.0 * missing))
    return WaveformComparison(
        waveforms=waveforms,
        spectra=_spectra(grid, step, columns),
        shift=shift,
        rms_difference=float(np.sqrt(np.mean((one[both] - two[both]) ** 2))),
        correlation=same,
        shaker_rms_difference=float(np.std(shaker)) if shaker.size else math.nan,
        measured_rms=spread[0],
        simulated_rms=spread[1],
        amplitude_ratio=ratio,
        parted=_parted(grid, one - two, apart),
        apart=apart,
        diagnostics=tuple(diagnostics),
        at=at,
        within=within,
        measured_impacts=_impacts(onsets[0], start or float(measured["time"][0]), rate, shift, low, high),
        simulated_impacts=_impacts(onsets[1], 0.0, model_rate, 0.0, low, high),
    )


def _band(grid: _Array, ensemble: Sequence[xr.Dataset], at: str, length: float | None) -> _Array:
    """Quantiles of an ensemble of simulated runs on a grid of cycles, over *length* [m], of shape (2, cycles)."""
    if len(ensemble) < _LEAST_RUNS:
        raise InputError(f"ensemble of {len(ensemble)} run(s): must have at least {_LEAST_RUNS}")
    rows = []
    for k, run in enumerate(ensemble):
        try:
            check_trajectory(run, require=(at,))
        except InputError as error:
            raise InputError(f"ensemble[{k}]: {error}") from error
        if "cycle" not in run.coords or not run["cycle"].values[-1] >= grid[-1] - 1e-6:
            raise InputError(f"ensemble[{k}]: must have the coordinate cycle up to {grid[-1]:.6g} cycles")
        # each run is over the buckling level of its own beam
        share = 1.0 if length is None else float(run.attrs.get("length_scale", length)) / float(length)
        rows.append(share * _on(grid, np.asarray(run["cycle"].values, dtype=np.float64), run[at].values))
    return np.asarray(np.quantile(np.array(rows), (0.05, 0.95), axis=0))


def _diagnostics(
    columns: dict[str, _Array], grid: _Array, shift: float, ratio: float, started: bool
) -> list[Diagnostic]:
    """Diagnostics of a comparison from the two shaker motions; *started*: their first cycle is known."""
    same = _same_way(columns, grid, shift)
    over = abs(abs(shift) - 0.5) < 0.2 and same < -0.5
    return holding(
        KINDS_COMPARISON,
        ("no_start", not started, {}),
        ("turned_over", started and over, {"correlation": same}),
        ("shifted", started and not over and abs(shift) > _SHIFTED, {"shift": shift}),
        ("amplitude", abs(ratio - 1.0) > _RATIO, {"ratio": ratio}),
    )


def _same_way(columns: dict[str, _Array], grid: _Array, shift: float) -> float:
    """Correlation of the two shakers over the first cycles as they were started, the shift undone."""
    early = grid <= grid[0] + 6.0
    moved = np.interp(grid[early], grid - shift, columns["measured_shaker"], left=np.nan, right=np.nan)
    other = columns["simulated_shaker"][early]
    both = np.isfinite(moved) & np.isfinite(other)
    if both.sum() < 32 or min(np.std(moved[both]), np.std(other[both])) == 0.0:
        return 0.0
    return float(np.corrcoef(moved[both], other[both])[0, 1])


def _parted(grid: _Array, difference: _Array, apart: float) -> float:
    """Cycle from which two runs stay apart for half a cycle on average; NaN if they never do."""
    step = float(grid[1] - grid[0])
    width = max(1, round(0.5 / step))
    square = np.where(np.isfinite(difference), difference, 0.0) ** 2
    mean = np.sqrt(np.convolve(square, np.ones(width) / width, mode="valid"))
    beyond = np.flatnonzero(mean > apart)
    return float(grid[beyond[0]]) if beyond.size else math.nan


def _clock(run: xr.Dataset, frequency: float | None, start: float | None) -> tuple[_Array, float]:
    time = np.asarray(run["time"].values, dtype=np.float64)
    if frequency is None:
        if "cycle" not in run.coords:
            raise InputError("measured: has no coordinate cycle; state frequency (--frequency), Hz")
        return np.asarray(run["cycle"].values, dtype=np.float64), _cycles_per_second(run)
    rate = positive("frequency", frequency, "Hz")
    begin = float(time[0]) if start is None else float(start)
    return (time - begin) * rate, rate


def _cycles_per_second(run: xr.Dataset) -> float:
    time, cycle = run["time"].values, run["cycle"].values
    return float((cycle[-1] - cycle[0]) / (time[-1] - time[0]))


def _shaker_sine(run: xr.Dataset, clock: _Array) -> tuple[float, float]:
    """Amplitude and phase of the shaker's sine over cycles, fitted to the samples of the later two thirds of the run."""
    values = np.asarray(run["striker_displacement"].values, dtype=np.float64)
    good = np.isfinite(values) & (clock >= 0.0)
    if good.sum() < 64:
        raise InputError("run: the shaker was measured in fewer than 64 samples after the start")
    span = clock[good][-1] - clock[good][0]
    if span < 3.0:
        raise InputError(f"run: {span:.1f} cycles of the shaker: must be at least 3")
    good &= clock >= clock[good][0] + (span / 3.0 if span > 6.0 else 0.0)
    turn = 2.0 * math.pi * clock[good]
    columns = np.column_stack([np.cos(turn), np.sin(turn), np.ones_like(turn), turn])
    cosine, sine = lstsq(columns, values[good])[:2]
    return math.hypot(cosine, sine), math.atan2(-sine, cosine)


def _on(grid: _Array, clock: _Array, values: NDArray[Any]) -> _Array:
    """Values on a grid by straight lines, NaN where a neighbouring sample is missing."""
    good = np.isfinite(values)
    result = np.interp(grid, clock[good], np.asarray(values, dtype=np.float64)[good])
    missing = np.interp(grid, clock, (~good).astype(np.float64)) > 0.0
    result[missing] = np.nan
    return result


def _spectra(grid: _Array, step: float, columns: dict[str, _Array]) -> xr.Dataset:
    from snapbeam.util.datasets import xr

    window = np.hanning(grid.size)
    data = {}
    for name in ("measured_displacement", "simulated_displacement"):
        values = columns[name]
        good = np.isfinite(values)
        filled = np.where(good, values, np.interp(grid, grid[good], values[good]))
        amplitude = 2.0 * np.abs(np.fft.rfft((filled - filled.mean()) * window)) / window.sum()
        data[name] = ("frequency_ratio", amplitude, {"units": "1"})
    ratio = np.fft.rfftfreq(grid.size, step)
    return xr.Dataset(data, {"frequency_ratio": ("frequency_ratio", ratio, {"units": "1"})})


def _impacts(onsets: _Array, start: float, rate: float, shift: float, low: float, high: float) -> _Array:
    at = (onsets - start) * rate + shift
    return at[(at >= low) & (at <= high)]


# A measured displacement is noisy and may be short or have dropouts.  A crossing of zero counts only when the
# displacement has gone beyond a hysteresis on the other side, several times the noise; what dropouts could hide
# and what a record too short cannot show leave the class unknown, with the reason.


@dataclass(frozen=True)
class MeasuredResponse:
    """Class and counts of a measured run.

    ``response_class`` is UNKNOWN if ``reasons`` lists a cause. ``zero_crossings`` is a lower bound, because
    dropouts can hide crossings.  ``noise`` and ``hysteresis`` are in units of b; ``final_well`` is -1 or 1, the
    sign at the end.

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import lab, paper
    >>> model = sb.ReducedModel.from_beam(paper.BEAM, modes=1, damping_ratio=0.005)
    >>> shaker = sb.Shaker(frequency_ratio=1.2, velocity_amplitude=0.18)
    >>> system = sb.System(model, contacts=[sb.Contact(paper.CONTACT, shaker)])
    >>> run = sb.simulate(system, sb.Integration(cycles=20))
    >>> lab.measure_response(run.dataset, cycles=20).response_class.label
    'continuous interwell'
    """

    response_class: ResponseClass
    zero_crossings: int
    zero_crossings_last_quarter: int
    last_zero_crossing: float
    final_well: int
    cycles: float
    noise: float
    hysteresis: float
    longest_dropout: float
    reasons: tuple[str, ...]

    @property
    def description(self) -> str:
        """The result in words."""
        counts = f"{self.zero_crossings} crossing(s) in {self.cycles:.1f} cycles"
        if self.response_class is ResponseClass.UNKNOWN:
            return f"class not told: {'; '.join(self.reasons)} ({counts})"
        return f"{self.response_class.label} ({counts}, {self.zero_crossings_last_quarter} in the last quarter)"


def measure_response(
    run: xr.Dataset,
    frequency: float | None = None,
    *,
    cycles: int = 200,
    at: str = "displacement_at_striker",
    noise: float | None = None,
    start: float | None = None,
) -> MeasuredResponse:
    """Class a measured run by the zero crossings of its displacement.

    Parameters
    ----------
    run : xarray.Dataset
        A run (see :mod:`snapbeam.simulation.dataset`): displacements in units of b over time [s], zero midway between
        the wells, and ``valid`` = 0 where nothing was found.
    frequency : float, optional
        Excitation frequency [Hz]; not needed if the run has the coordinate ``cycle``.
    cycles : int
        Number of cycles for the response class; the paper's experiments have 200.
    at : {"displacement_at_striker", "midspan_displacement"}
        Where to count: at the shaker, which for a shaker near the centre serves as well, or at the centre.
    noise : float, optional
        Standard deviation of the displacement's noise, in units of b; estimated from its third differences if
        left out.
    start : float, optional
        Start of the excitation [s]; the first sample by default.

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import lab, paper
    >>> model = sb.ReducedModel.from_beam(paper.BEAM, modes=1, damping_ratio=0.005)
    >>> shaker = sb.Shaker(frequency_ratio=1.2, velocity_amplitude=0.18)
    >>> system = sb.System(model, contacts=[sb.Contact(paper.CONTACT, shaker)])
    >>> run = sb.simulate(system, sb.Integration(cycles=8))
    >>> lab.measure_response(run.dataset, cycles=8).zero_crossings
    8
    """
    choice("at", at, _PLACES)
    check_trajectory(run, require=(at,))
    wanted = integer("cycles", cycles, 1)
    time = np.asarray(run["time"].values, dtype=np.float64)
    values = np.array(run[at].values, dtype=np.float64)
    good = np.isfinite(values)
    if "valid" in run:
        good &= run["valid"].values.astype(bool)
    if start is not None:
        good &= time >= finite("start", start)
    if good.sum() < 16:
        raise InputError(f"run: {int(good.sum())} valid sample(s) of {at}: must be at least 16")
    if "cycle" in run.coords:
        count = np.asarray(run["cycle"].values, dtype=np.float64)
    else:
        if frequency is None:
            raise InputError("frequency: must be given, the run has no coordinate cycle")
        begin = float(time[0]) if start is None else start
        count = (time - begin) * positive("frequency", frequency, "Hz")
    sigma = _noise(values, good) if noise is None else nonnegative("noise", noise, "b")
    hysteresis = max(_HYSTERESIS * sigma, 1e-9)
    shown, when, covered = values[good], time[good], count[good]

    side, crossed = _crossings(shown, hysteresis)
    total = min(float(covered[-1]), float(wanted))
    crossed = crossed[covered[crossed] <= wanted]
    late = int(np.count_nonzero(covered[crossed] > 0.75 * wanted))
    final = int(side[np.flatnonzero(covered <= wanted)[-1]])
    first = int(side[np.flatnonzero(side)[0]]) if side.any() else 0

    gaps = np.diff(covered)
    longest = float(gaps.max()) if gaps.size else 0.0
    reasons = []
    if hysteresis > 0.25:
        reasons.append(f"the noise, {sigma:.2g} b, hides crossings (hysteresis {hysteresis:.2g} b)")
    if first == 0 or final == 0:
        reasons.append("the displacement never leaves the hysteresis about zero")
    if wanted < LEAST_CYCLES:
        reasons.append(f"{TOO_SHORT} to tell: {wanted} cycles, the rule needs {LEAST_CYCLES}")
    certain_continuous = late > wanted / 20.0
    if total < _WHOLE * wanted and not certain_continuous:
        reasons.append(f"{TOO_SHORT} to tell: {total:.1f} of {wanted} cycles recorded")
    typical = float(np.median(gaps)) if gaps.size else 0.0
    if longest > max(0.25, 4.0 * typical) and not certain_continuous:
        reasons.append(f"a dropout of {longest:.2f} cycles could hide crossings")
    told = (
        ResponseClass.UNKNOWN if reasons else ResponseClass(int(classify(crossed.size, late, wanted, -first * final)))
    )
    return MeasuredResponse(
        response_class=told,
        zero_crossings=int(crossed.size),
        zero_crossings_last_quarter=late,
        last_zero_crossing=float(when[crossed[-1]]) if crossed.size else math.nan,
        final_well=final,
        cycles=total,
        noise=sigma,
        hysteresis=hysteresis,
        longest_dropout=longest,
        reasons=tuple(reasons),
    )


def _noise(values: _Array, good: NDArray[np.bool_]) -> float:
    """Standard deviation of white noise from third differences of neighbouring valid samples."""
    whole = good[:-3] & good[1:-2] & good[2:-1] & good[3:]
    thirds = (values[3:] - 3.0 * values[2:-1] + 3.0 * values[1:-2] - values[:-3])[whole]
    if thirds.size < 8:
        raise InputError("run: too few neighbouring valid samples to estimate the noise; state noise, in units of b")
    return float(np.median(np.abs(thirds)) / 0.6745 / math.sqrt(20.0))


def _crossings(values: _Array, hysteresis: float) -> tuple[NDArray[np.int8], NDArray[np.intp]]:
    """Side of each sample (0 until it first leaves the hysteresis) and where that changes."""
    beyond = np.where(values > hysteresis, 1, np.where(values < -hysteresis, -1, 0)).astype(np.int8)
    index = np.where(beyond != 0, np.arange(values.size), -1)
    held = np.maximum.accumulate(index)
    side = np.where(held >= 0, beyond[np.maximum(held, 0)], 0).astype(np.int8)
    return side, np.flatnonzero((side[1:] != side[:-1]) & (side[:-1] != 0)) + 1
