"""The waveform of one run: displacements, penetration and contact force (Fig. 3 of the paper)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from cmcrameri import cm
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.gridspec import GridSpec
from matplotlib.ticker import MaxNLocator

from snapbeam.model.drive.shock import GRAVITY
from snapbeam.plot.axes import wrapped
from snapbeam.plot.style import (
    BEAM_COLOR,
    CENTER_COLOR,
    SHAKER_COLOR,
    caption,
    color_bar,
    color_of,
    contains,
    extend_title,
    figure_style,
    figure_with,
    fix_ticks,
    frame,
    new_figure,
    plain_decades,
    say_scale_once,
    set_title,
)
from snapbeam.plot.units import in_symbols, scale_text
from snapbeam.simulation.dataset import check_trajectory
from snapbeam.simulation.run import Run
from snapbeam.util.diagnostics import diagnostics_of
from snapbeam.util.si_prefixes import prefixed, scale_of
from snapbeam.util.status_codes import is_of_matrices
from snapbeam.util.validation import InputError, checked, choice, integer, interval, positive

if TYPE_CHECKING:
    import xarray as xr

# ----------------------------------------------------------------------------------------------------
# Amplitudes of the modes, energies, spectrum and phase portrait of a run.


_ENERGIES = (
    ("energy_beam", "in the beam", BEAM_COLOR),
    ("energy_contact", "in the contact", SHAKER_COLOR),
    ("energy_dissipated", "dissipated", "#858585"),
    ("striker_work", "striker's work", CENTER_COLOR),
)


def dataset_of(run: Run | xr.Dataset, *needed: str) -> xr.Dataset:
    """The time series of a run, given as a run or as its dataset; refused if it lacks a variable."""
    found = check_trajectory(run.dataset if isinstance(run, Run) else run, require=needed)
    if found.sizes["time"] < 2:
        raise InputError(f"run with {found.sizes['time']} samples: has no figures; record and save its samples")
    return found


def across(dataset: xr.Dataset) -> tuple[str, str]:
    """The variable that a run is drawn over, and its label."""
    if "cycle" in dataset.variables:
        return "cycle", r"Cycles of excitation $\tau$"
    return "time", "Time (s)"


@checked
def plot_modal_amplitudes(run: Run | xr.Dataset, ax: Axes | None = None, *, modes: int = 5) -> Axes:
    """Draw the amplitudes of the first *modes* buckling modes, over that of the well.

    Parameters
    ----------
    run : Run or xarray.Dataset
    ax : matplotlib.axes.Axes, optional
        Axes to draw in; new ones by default.
    modes : int

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> system = paper.struck_beam(frequency_ratio=1.2, velocity_amplitude=0.18)
    >>> run = sb.simulate(system, sb.Integration(cycles=20))
    >>> ax = sb.plot.plot_modal_amplitudes(run, modes=2)
    """
    dataset = dataset_of(run, "modal_amplitude")
    count = min(integer("modes", modes, 1), dataset.sizes["mode"])
    name, label = across(dataset)
    alpha = dataset["modal_amplitude"].values
    well = _well_amplitude(dataset)
    with frame(ax, dataset, height=66.0) as ax:
        for i in range(count):
            look: dict[str, Any] = {"color": color_of(i, count), "zorder": -i}
            ax.plot(dataset[name], alpha[:, i] / (well or 1.0), label=rf"$\alpha_{{{i + 1}}}$", **look)
        unit = r"$\alpha_i\,/\,|\alpha_1|$ in the well" if well else r"$\alpha_i$ (m$^{1/2}$)"
        ax.set(xlabel=label, ylabel=f"Modal amplitude {unit}")
        ax.margins(x=0.0)
        _legend(ax, count)
    return ax


def _well_amplitude(dataset: xr.Dataset) -> float | None:
    """Amplitude of the first mode in a well: b = 2 sqrt(2 L)/(2 pi) alpha_1, from the attributes."""
    if {"beam_length", "beam_buckling_level"} <= set(dataset.attrs):
        return float(np.pi * dataset.attrs["beam_buckling_level"] / np.sqrt(2.0 * dataset.attrs["beam_length"]))
    return None


def _legend(ax: Axes, columns: int, room: float = 0.16) -> None:
    """A legend above the curves, where it crosses none, in a share of the height."""
    low, high = ax.get_ylim()
    ax.set_ylim(low, high + room * (high - low))
    ax.legend(loc="upper left", ncols=columns)


@checked
def plot_energies(run: Run | xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw the energy of the beam and the contact, the dissipated energy and the striker's work.

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> system = paper.struck_beam(frequency_ratio=1.2, velocity_amplitude=0.18)
    >>> run = sb.simulate(system, sb.Integration(cycles=20))
    >>> ax = sb.plot.plot_energies(run)
    """
    dataset = dataset_of(run, "energy_beam")
    name, label = across(dataset)
    found = [(key, words, color) for key, words, color in _ENERGIES if key in dataset]
    factor, unit = scale_of(np.concatenate([dataset[key].values for key, _, _ in found]), "J")
    with frame(ax, dataset, height=66.0) as ax:
        for key, words, color in found:
            ax.plot(dataset[name], dataset[key] / factor, color=color, label=words)
        ax.set(xlabel=label, ylabel=f"Energy ({unit})")
        ax.margins(x=0.0)
        _legend(ax, 2, 0.24)
    return ax


@checked
def plot_spectrum(
    run: Run | xr.Dataset, ax: Axes | None = None, *, variable: str | None = None, window: Any = None
) -> Axes:
    """Draw the amplitude spectrum of a run, from evenly spaced samples under a Hann window, or an estimated density.

    Parameters
    ----------
    run : Run or xarray.Dataset
        Run, or the power spectral density of ``estimated_psd``, which is drawn with its interval over the given
        density.
    variable : str, optional
        Variable over time; the displacement of mid-span, or at the striker, by default.
    window : pair of float, optional
        First and last cycle; all by default.

    Returns
    -------
    matplotlib.axes.Axes
        Over the excitation frequency where the run has cycles, else, as of a shock or random vibration, over hertz.

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> system = paper.struck_beam(frequency_ratio=1.2, velocity_amplitude=0.18)
    >>> run = sb.simulate(system, sb.Integration(cycles=20))
    >>> ax = sb.plot.plot_spectrum(run)
    >>> motion = sb.RecordedAcceleration.from_psd("NAVMAT P-9492", duration_s=2.0)
    >>> ax = sb.plot.plot_spectrum(motion.estimated_psd())
    """
    if not isinstance(run, Run) and "psd_low" in getattr(run, "data_vars", ()):
        return _plot_density(run, ax)
    dataset, variable, name, even, y = _even_samples(run, variable, window)
    weight = np.hanning(even.size)
    spectrum = 2.0 * np.abs(np.fft.rfft((y - y.mean()) * weight)) / weight.sum()
    frequency = np.fft.rfftfreq(even.size, float(even[1] - even[0]))
    unit = dataset[variable].attrs.get("units", "1")
    with frame(ax, dataset, height=66.0) as ax:
        frequency, top, label = _frequencies(dataset, name, frequency)
        ax.plot(frequency[1:], spectrum[1:], color=BEAM_COLOR, linewidth=0.6)
        shown = spectrum[1:][frequency[1:] <= top]
        ax.set(xlim=(0.0, top), yscale="log", ylim=(max(shown.max() * 1e-5, 1e-300), shown.max() * 2.0))
        ax.set_xlabel(label)
        words = _words(dataset, variable)
        ax.set_ylabel(wrapped(words if unit == "1" else f"{words} ({unit})", 40))
    return ax


def _frequencies(dataset: xr.Dataset, name: str, given: np.ndarray) -> tuple[np.ndarray, float, str]:
    """Frequencies in the unit of their axis, the highest to show, and the label; of no cycle in hertz."""
    if name == "cycle":
        return given, max(12.0, given[2]), r"Frequency $f\,/\,f_\mathrm{excitation}$"
    top = float(given[-1])
    if _is_of_one_event(dataset):
        top = min(top, 12.0 * float(dataset.attrs["reference_frequency"]))
    factor, unit = scale_of([top], "Hz")
    return given / factor, top / factor, f"Frequency ({unit})"


def _even_samples(run: Run | xr.Dataset, variable: str | None, window: Any) -> tuple[xr.Dataset, str, str, Any, Any]:
    """The dataset of a run, the variable that is drawn, the one it is drawn over, and even samples of both."""
    dataset = dataset_of(run)
    if variable is None:
        variable = "midspan_displacement" if "midspan_displacement" in dataset else "displacement_at_striker"
    choice("variable", variable, tuple(str(key) for key in dataset.data_vars if dataset[key].dims == ("time",)))
    part = cut(dataset, across(dataset)[0], window)
    name = "time" if _is_of_one_event(dataset) else across(dataset)[0]
    x, y = part[name].values, part[variable].values
    if x.size < 16:
        raise InputError(f"window = {window}: must hold at least 16 samples")
    if not np.isfinite(y).all():
        raise InputError(
            f"variable = {variable!r}: has {np.count_nonzero(~np.isfinite(y))} samples without a value; choose a window "
            "without them"
        )
    even = np.linspace(x[0], x[-1], min(x.size, 1 << 17))
    return dataset, variable, name, even, np.interp(even, x, y)


def _words(dataset: xr.Dataset, variable: str) -> str:
    """Long name of a variable, as the label of an axis."""
    words = in_symbols(str(dataset[variable].attrs.get("long_name", variable)))
    words = words.replace("beam ", "structure ") if is_of_matrices(dataset.attrs) else words
    words = scale_text(dataset.attrs, words) if "$b$" in words else words
    return f"{words[:1].upper()}{words[1:]}"


@checked
def plot_spectrogram(
    run: Run | xr.Dataset,
    ax: Axes | None = None,
    *,
    variable: str | None = None,
    window: Any = None,
    segment: float | None = None,
) -> Axes:
    """Draw the amplitude spectrum of a run over time, from Hann windows that overlap by three quarters.

    Parameters
    ----------
    variable : str, optional
        A variable over time, by name; the displacement of mid-span, or at the striker, by default.
    window : pair of float, optional
        First and last cycle to take; everything by default.
    segment : float, optional
        Length of a Hann window in cycles (or in s, without cycles): lines are 1/segment apart.  By default a twelfth of
        the run.

    Returns
    -------
    matplotlib.axes.Axes
        Levels in dB of the highest amplitude.

    Raises
    ------
    InputError
        If a segment holds fewer than 16 samples, or is longer than half the run.

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> system = paper.struck_beam(frequency_ratio=1.2, velocity_amplitude=0.18)
    >>> run = sb.simulate(system, sb.Integration(cycles=20))
    >>> ax = sb.plot.plot_spectrogram(run, segment=4.0)
    """
    from scipy.signal import ShortTimeFFT
    from scipy.signal.windows import hann

    dataset, variable, name, even, y = _even_samples(run, variable, window)
    step = float(even[1] - even[0])
    span = step * even.size
    size = round((span / 12.0 if segment is None else positive("segment", segment)) / step)
    if not 16 <= size <= even.size // 2:
        unit = "cycles" if name == "cycle" else "s"
        raise InputError(
            f"segment = {size * step:.4g} {unit}: must be from {16 * step:.4g} {unit}, 16 samples, to {span / 2.0:.4g} {unit}, "
            "half the run"
        )
    transform = ShortTimeFFT(hann(size, sym=False), max(size // 4, 1), 1.0 / step, scale_to="magnitude")
    # only windows that lie within the record
    first, last = transform.lower_border_end[1], transform.upper_border_begin(y.size)[1]
    level = np.abs(transform.stft_detrend(y, "constant", p0=first, p1=last))
    level = 20.0 * np.log10(np.maximum(level / level.max(), 1e-12)) if level.max() > 0.0 else level
    frequency, top, label = _frequencies(dataset, name, transform.f)
    rows = frequency <= top
    with frame(ax, dataset, height=66.0) as ax:
        mesh = ax.pcolormesh(
            transform.t(y.size, p0=first, p1=last) + even[0], frequency[rows], level[rows], vmin=-60.0, vmax=0.0,
            cmap=cm.batlow, shading="nearest", rasterized=True,
        )  # fmt: skip
        color_bar(mesh, ax, "Amplitude (dB of the maximum)")
        extend_title(ax, _words(dataset.assign_attrs(length_scale=None), variable))  # the heading states b
        ax.set(
            xlabel=across(dataset)[1] if name == "cycle" else "Time (s)", ylabel=label, ylim=(0.0, frequency[rows][-1])
        )
    return ax


@checked
def plot_frequency_response(dataset: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw a measured frequency response: magnitude and phase with two standard errors, and the coherence.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of :func:`snapbeam.lab.frequency_response`.
    ax : matplotlib.axes.Axes, optional
        Axes for the magnitude alone; by default a new figure shows everything.

    Returns
    -------
    matplotlib.axes.Axes
        Of the magnitude.

    Examples
    --------
    >>> import numpy as np
    >>> import snapbeam as sb
    >>> from snapbeam import lab
    >>> force = lab.make_signal(np.random.default_rng(0).standard_normal(20_000), "N", 2000.0)
    >>> motion = lab.make_signal(0.002 * force.values, "m", 2000.0)
    >>> ax = sb.plot.plot_frequency_response(lab.frequency_response(force, motion))
    """
    contains(dataset, "frequency response", "magnitude", "magnitude_se", "phase", "phase_se", "coherence")
    f = dataset["frequency"].values
    limit = float(dataset.attrs["coherence_limit"])
    coherent = dataset["coherence"].values > limit
    with figure_style():
        if ax is None:
            figure = figure_with(diagnostics_of(dataset), "single", 110.0)
            axes = figure.subplots(3, 1, sharex=True, height_ratios=(2.0, 1.0, 1.0))
        else:
            axes = np.array([ax])
        for each, name in zip(axes, ("magnitude", "phase"), strict=False):
            values, error = dataset[name].values, 2.0 * dataset[f"{name}_se"].values
            low = np.maximum(values - error, 1e-3 * values) if name == "magnitude" else values - error
            each.fill_between(f, low, values + error, where=coherent, color=BEAM_COLOR, alpha=0.25, linewidth=0.0)
            style = {"linewidth": 0.8} if name == "magnitude" else {"linestyle": "", "marker": ".", "markersize": 1.5}
            each.plot(f, values, color="0.75", **style)
            each.plot(f, np.where(coherent, values, np.nan), color=BEAM_COLOR, **style)
        axes[0].set(yscale="log", ylabel=f"Magnitude ({dataset['magnitude'].attrs['units']})", xlim=(f[0], f[-1]))
        plain_decades(axes[0].yaxis, *axes[0].get_ylim())
        if axes.size > 1:
            axes[1].set(ylabel="Phase (rad)", ylim=(-3.3, 3.3))
            axes[2].plot(f, dataset["coherence"].values, color=BEAM_COLOR, linewidth=0.8)
            axes[2].axhline(limit, color=SHAKER_COLOR, linewidth=0.8, dashes=(4, 2))
            axes[2].set(ylabel="Coherence", ylim=(0.0, 1.05))
        axes[-1].set_xlabel("Frequency (Hz)")
        fix_ticks(*axes)
    return axes[0]


@checked
def plot_field(dataset: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw the displacement along a beam over time, the result of :func:`snapbeam.lab.full_field`."""
    contains(dataset, "displacement field", "displacement", "displacement_se", "position", "time")
    values = dataset["displacement"].values
    size, unit = scale_of(values[np.isfinite(values)], "m")
    most = float(np.nanmax(np.abs(values))) / size or 1.0
    with frame(ax, None, height=60.0) as ax:
        mesh = ax.pcolormesh(
            dataset["time"], 1e3 * dataset["position"], values.T / size, cmap=cm.vik, vmin=-most, vmax=most,
            shading="nearest", rasterized=True,
        )  # fmt: skip
        color_bar(mesh, ax, f"Displacement ({unit})")
        ax.set(xlabel="Time (s)", ylabel="Place along the beam (mm)")
    return ax


@checked
def plot_perturbation(dataset: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw the growth of a small perturbation of a run, the result of :func:`snapbeam.perturbation_growth`."""
    contains(dataset, "perturbation", "separation")
    name, label = across(dataset)
    with frame(ax, dataset) as ax:
        ax.plot(
            dataset[name].values, np.where(dataset["separation"] > 0.0, dataset["separation"], np.nan), color=BEAM_COLOR
        )
        ax.set(yscale="log", xlabel=label)
        ax.set_ylabel(scale_text(dataset.attrs, "Maximum change of the displacement\n$w/b$"))
        ax.margins(x=0.0)
    return ax


def _plot_density(dataset: xr.Dataset, ax: Axes | None) -> Axes:
    """Draw an estimated power spectral density with its interval, on logarithmic axes."""
    data = dataset.sel(frequency=dataset["frequency"] > 0.0)
    with frame(ax) as ax:
        f = data["frequency"].values
        inside = np.ones(f.size, dtype=bool)
        if "psd_target" in data:
            inside = data["psd_target"].values > 0.0
        band = data["psd_low"].values[inside], data["psd_high"].values[inside]
        words = str(data["psd_low"].attrs["long_name"]).removeprefix("lower end of the ")
        ax.fill_between(f[inside], *band, color=BEAM_COLOR, alpha=0.25, linewidth=0.0, label=words)
        ax.plot(f[inside], data["psd"].values[inside], color=BEAM_COLOR, linewidth=0.8, label="estimate")
        if "psd_target" in data:
            target = data["psd_target"].values[inside]
            ax.plot(f[inside], target, "--", color=SHAKER_COLOR, linewidth=1.2, label="given density")
        ax.set(xscale="log", yscale="log", xlabel="Frequency (Hz)", ylabel="Acceleration PSD (g$^2$/Hz)")
        for axis in (ax.xaxis, ax.yaxis):
            plain_decades(axis, *axis.get_view_interval())
        set_title(ax, f"{data.attrs['rms_g']:.3g} g root mean square")
        ax.legend()
    return ax


@checked
def plot_phase_portrait(
    run: Run | xr.Dataset, ax: Axes | None = None, *, of: str = "midspan", strobe: bool = True
) -> Axes:
    """Draw velocity over displacement, with a dot at each whole cycle of excitation.

    Parameters
    ----------
    run : Run or xarray.Dataset
    of : {"midspan", "striker"}
        The point of the beam: mid-span, or the location of the striker.
    strobe : bool
        Whether to mark whole cycles.

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> system = paper.struck_beam(frequency_ratio=1.2, velocity_amplitude=0.18)
    >>> run = sb.simulate(system, sb.Integration(cycles=20))
    >>> ax = sb.plot.plot_phase_portrait(run)
    """
    at_midspan = choice("of", of, ("midspan", "striker")) == "midspan"
    names = ("midspan_displacement", "midspan_velocity")
    names = names if at_midspan else ("displacement_at_striker", "velocity_at_striker")
    dataset = dataset_of(run, *names)
    w, v = (dataset[name].values for name in names)
    with frame(ax, dataset, height=66.0) as ax:
        ax.plot(w, v, color="0.6", linewidth=0.4, rasterized=w.size > 20_000)
        if strobe and "cycle" in dataset.variables:
            cycle = dataset["cycle"].values
            whole = np.arange(np.ceil(cycle[0]), np.floor(cycle[-1]) + 1.0)
            ax.plot(
                np.interp(whole, cycle, w), np.interp(whole, cycle, v), ".", color=SHAKER_COLOR, markersize=3,
                label="whole cycles",
            )  # fmt: skip
            _legend(ax, 1)
        ax.set(xlabel=scale_text(dataset.attrs, "Displacement $w/b$"), ylabel=r"Velocity $\dot w\,/\,b\omega_1$")
    return ax


# ----------------------------------------------------------------------------------------------------


_CURVES = (
    ("midspan_displacement", "beam, centre", CENTER_COLOR),
    ("displacement_at_striker", "beam, at the striker", BEAM_COLOR),
    ("striker_displacement", "striker", SHAKER_COLOR),
)
_PANELS = {
    "penetration_normalised": ("Penetration\n$d$", "1"),
    "contact_force": ("Contact\nforce $f$", "N"),
    "voltage": ("Voltage\n$v$", "V"),
    "power_load": ("Power in\nthe load", "W"),
    "base_acceleration": ("Base\nacceleration", "g"),
}
"""Variables below the displacements: label and unit."""
_ENVELOPE = 100
"""Cycles above which a run over cycles is drawn by its range in intervals, of which there are about so many."""
_FEW = 200
"""Samples below which a close-up shows each of them, and a smooth curve through them."""
_MANY = 20_000  # samples above which a curve is stored as pixels in a vector file


@checked
def plot_run(run: Run | xr.Dataset, window: tuple[float, float] | None = None, ax: Axes | None = None) -> Axes:
    """Draw the displacements, the penetration and the contact force of a run, and its hardest impact closer.

    Left, over cycles: the whole run or a window; more than 100 cycles as the range, minimum to maximum, of whole
    cycles. Right, over time: the maximum contact force within the window. A measured run is drawn without force.

    Parameters
    ----------
    run : Run or xarray.Dataset
        A run, or a dataset that follows :data:`snapbeam.simulation.dataset.SCHEMA`.
    window : pair of float, optional
        First and last cycle; all by default.
    ax : matplotlib.axes.Axes, optional
        Axes for the displacements alone; a new figure of two columns by default.

    Returns
    -------
    matplotlib.axes.Axes
        Of the displacements.

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> system = paper.struck_beam(frequency_ratio=1.2, velocity_amplitude=0.18)
    >>> run = sb.simulate(system, sb.Integration(cycles=20))
    >>> ax = sb.plot.plot_run(run, window=(10.0, 15.0))
    """
    dataset = dataset_of(run, "displacement_at_striker")
    if "striker_forces" in dataset:  # the largest of all strikers
        most = {"contact_force": "striker_forces", "penetration_normalised": "striker_penetrations"}
        dataset = dataset.assign({name: dataset[every].max("striker") for name, every in most.items()})
    axis_name, label = across(dataset)
    part, period = cut(dataset, axis_name, window), 1.0
    if _is_of_one_event(dataset):
        part, axis_name = _with_base_acceleration(part), "time"
        period, unit = scale_of(part["time"].values, "s")
        part, label = part.assign_coords(time=part["time"] / period), f"Time ({unit})"
    has_force = "contact_force" in part and bool((part["contact_force"].values > 0.0).any())
    rows = 1 + sum(name in part for name in _PANELS)
    if ax is not None:
        with frame(ax) as ax:
            x = part[axis_name].values
            _displacements(ax, part, x)
            ax.set(
                xlabel=label, ylabel=scale_text(dataset.attrs, "Displacement $w/b$"), xlim=(_from(x[0], x[-1]), x[-1])
            )
            _legend(ax, 3, 0.15)
        return ax
    with figure_style():
        figure = new_figure("double", 35.0 + 28.0 * rows)
        grid = figure.add_gridspec(
            rows, 2 if has_force else 1, width_ratios=(2.2, 1.0) if has_force else None,
            height_ratios=(1.6, *(1.0,) * (rows - 1)),
        )  # fmt: skip
        scales = {
            name: (1.0, "g") if unit == "g" else scale_of(part[name].values, unit)
            for name, (_, unit) in _PANELS.items()
            if name in part
        }
        left = _column(figure, grid, 0, part, part[axis_name].values, scales, _interval(part, axis_name))
        if "power_load" in part:
            row = 1 + [name for name in _PANELS if name in part].index("power_load")
            _mean_power(left[row], dataset, dataset[axis_name].values / period, scales["power_load"])
        left[-1].set_xlabel(label)
        first, last = (float(part[axis_name].values[at]) for at in (0, -1))
        left[0].set_xlim(_from(first, last), last)
        left[0].set_ylabel(scale_text(dataset.attrs, "Displacement $w/b$\n").replace("\n (", "\n("))
        if axis_name == "time" and "length_scale" in dataset.attrs:
            size, unit = scale_of([float(dataset.attrs["length_scale"])], "m")
            metres = float(dataset.attrs["length_scale"]) / size
            turned = (lambda w: np.multiply(w, metres), lambda w: np.divide(w, metres))
            beside = left[0].secondary_yaxis("right", functions=turned)
            beside.set_ylabel(f"Displacement ({unit})")
        figure.legend(*left[0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
        set_title(left[0], caption(dataset, 2))
        say_scale_once(left[0])
        figure.align_ylabels(left)
        if has_force:
            near, seconds, peak = _hardest_impact(part)
            seconds = seconds * period
            scale, unit = scale_of(seconds, "s")
            around = seconds / scale
            right = _column(figure, grid, 1, near, around, scales)
            digits = _digits(near, axis_name)
            onset = f" after $\\tau$ = {peak:.{digits if peak else 0}f}" if axis_name == "cycle" else ""
            right[-1].set_xlabel(f"Hardest impact:\ntime ({unit}){onset}", loc="right")
            right[-1].xaxis.set_major_locator(MaxNLocator(3))
            right[0].set_xlim(min(around[0], -0.12 * around[-1]), around[-1])
    return left[0]


ONE_EVENT = ("shock", "half_sine", "recorded_acceleration", "random_vibration")
"""Types of excitation without a cycle: their runs are drawn over seconds."""


def _is_of_one_event(dataset: xr.Dataset) -> bool:
    """Return whether a base without a striker moves the beam by a shock or a record, which has no cycle."""
    moves = "striker_displacement" in dataset and np.ptp(dataset["striker_displacement"].values) > 1e-9
    return dataset.attrs.get("base_excitation_type") in ONE_EVENT and not moves


def _with_base_acceleration(part: xr.Dataset) -> xr.Dataset:
    """The run with the acceleration of its base, g."""
    unit = part.attrs["length_scale"] * 2.0 * np.pi * part.attrs["reference_frequency"]
    values = unit * np.gradient(part["base_velocity"].values, part["time"].values) / GRAVITY
    return part.assign(base_acceleration=("time", values))


def _curves(part: xr.Dataset) -> Iterator[tuple[np.ndarray, str, str]]:
    """The displacements that a run has; without a striker, that of the beam at the striker is left out."""
    struck = "striker_displacement" in part or "midspan_displacement" not in part
    several = "striker_displacements" in part
    for name, words, color in _CURVES:
        if name not in part or (name == "displacement_at_striker" and not struck):
            continue
        if several and name == "striker_displacement":
            for number, values in enumerate(part["striker_displacements"].transpose("striker", "time").values, 1):
                yield values, "strikers" if number == 1 else "_striker", color
        else:
            yield part[name].values, words.replace("beam", "structure") if is_of_matrices(part.attrs) else words, color


def _displacements(ax: Axes, part: xr.Dataset, x: np.ndarray) -> None:
    for values, words, color in _curves(part):
        ax.plot(x, values, color=color, label=words, rasterized=x.size > _MANY)
    _straight(ax)


def _straight(ax: Axes) -> None:
    """A line where the beam is straight, if the motion passes it."""
    if ax.get_ylim()[0] < 0.0 < ax.get_ylim()[1]:
        ax.axhline(0.0, color="0.6", linewidth=0.5, zorder=0)


def _from(first: float, last: float) -> float:
    """Lower limit of a time axis, slightly before the start of a run so that an immediate impact is visible."""
    return first if first > 0.0 else first - 0.01 * (last - first)


def cut(dataset: xr.Dataset, across: str, window: tuple[float, float] | None) -> xr.Dataset:
    """The samples of a run within a window."""
    if window is None:
        return dataset
    first, last = interval("window", window)
    inside = (dataset[across].values >= first) & (dataset[across].values <= last)
    if inside.sum() < 2:
        end = float(dataset[across].values[-1])
        raise InputError(f"window = ({first:g}, {last:g}): must hold at least two samples of a run of {end:g} cycles")
    return dataset.isel(time=_range(inside))


def _range(inside: np.ndarray) -> slice:
    """The samples from the first to the last that is *inside*; time increases, so that there is no other between them."""
    at = np.flatnonzero(inside)
    return slice(int(at[0]), int(at[-1]) + 1)


def _column(
    figure: Figure, grid: GridSpec, at: int, part: xr.Dataset, x: np.ndarray, scales: dict[str, tuple[float, str]],
    far: float = 0.0,
) -> list[Axes]:  # fmt: skip
    rows, axes = grid.nrows, list[Axes]()
    for row in range(rows):
        axes.append(figure.add_subplot(grid[row, at], sharex=axes[0] if axes else None))
        fix_ticks(axes[-1])
        axes[-1].tick_params(labelbottom=row == rows - 1)
        axes[-1].margins(x=0.0)
    pixels = x.size > _MANY
    for values, label, color in _curves(part):
        if far:
            _envelope(axes[0], x, values, far, color, f"{label} (range)")
        elif at == 1 and x.size < _FEW:
            axes[0].plot(*_smooth(x, values), color=color, label=label)
        else:
            axes[0].plot(x, values, color=color, label=label, rasterized=pixels)
    if at == 0:
        _straight(axes[0])
    elif "striker_displacements" in part:  # the beam, not a stop far from it
        low, high = (getattr(part["displacement_at_striker"], each)() for each in ("min", "max"))
        room = max(0.5 * float(high - low), 2.0 * float(part["penetration_normalised"].max()))
        axes[0].set_ylim(float(low) - room, float(high) + room)
    for row, name in enumerate((each for each in _PANELS if each in part), 1):
        factor, unit = scales[name]
        values = part[name].values / factor
        if name == "penetration_normalised":
            factor, unit = 1.0, "$10^{-3}\\,b$"
            values = 1e3 * np.maximum(part[name].values, 0.0)
        if far:
            _envelope(axes[row], x, values, far, BEAM_COLOR, None)
        elif at == 1 and x.size < _FEW:
            axes[row].plot(*_smooth(x, values), color=BEAM_COLOR)
            axes[row].plot(x, values, ".", color=BEAM_COLOR, markersize=2.5)
        else:
            axes[row].plot(x, values, color=BEAM_COLOR, rasterized=pixels)
        if name not in ("voltage", "base_acceleration"):
            axes[row].set_ylim(bottom=0.0)
        if at == 0:
            axes[row].set_ylabel(f"{_PANELS[name][0]} ({unit})")
    return axes


def _mean_power(ax: Axes, dataset: xr.Dataset, x: np.ndarray, scale: tuple[float, str]) -> None:
    """Draw the mean power over the last quarter of the run, which leaves out the transient before it."""
    time, power = (dataset[name].values for name in ("time", "power_load"))
    late = time >= time[0] + 0.75 * (time[-1] - time[0])
    if late.sum() < 2 or not np.isfinite(power[late]).all():
        return
    mean = float(np.trapezoid(power[late], time[late]) / (time[late][-1] - time[late][0]))
    ax.axvspan(x[late][0], x[late][-1], color="0.9", zorder=0)
    words = f"mean over the last quarter of the run: {prefixed(mean, 'W')}"
    ax.plot(x[late][[0, -1]], [mean / scale[0]] * 2, color=SHAKER_COLOR, linewidth=1.2, label=words)
    ax.set_ylim(0.0, 1.3 * ax.get_ylim()[1])
    ax.legend(loc="upper left")


def _digits(near: xr.Dataset, across: str) -> int:
    """Digits after the point of a cycle, so that rounding shifts the close-up by less than a hundredth of it."""
    span = float(np.ptp(near[across].values))
    return int(np.clip(np.ceil(-np.log10(max(span, 1e-12) / 50.0)), 0, 12))


def _smooth(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points of a curve through samples that has no maximum between them (monotone cubics of Fritsch and Butland)."""
    x, y = x[good := np.isfinite(y)], y[good]
    if x.size < 3:
        return x, y
    h, secant = np.diff(x), np.diff(y) / np.diff(x)
    before, after, weight = secant[:-1], secant[1:], (h[:-1] + 2.0 * h[1:]) / (3.0 * (h[:-1] + h[1:]))
    turns = before * after <= 0.0  # else a harmonic mean; scipy.interpolate takes a third of a second to import
    inner = np.where(turns, 0.0, before * after / np.where(turns, 1.0, weight * after + (1.0 - weight) * before))
    slope = np.concatenate(([_slope_at_end(h, secant)], inner, [_slope_at_end(h[::-1], secant[::-1])]))
    dense = np.union1d(x, np.linspace(x[0], x[-1], 600))
    i = np.clip(np.searchsorted(x, dense, side="right") - 1, 0, h.size - 1)
    t = (dense - x[i]) / h[i]
    bend = (1.0 - t) * (slope[i] - secant[i]) - t * (slope[i + 1] - secant[i])
    return dense, y[i] + h[i] * t * (secant[i] + (1.0 - t) * bend)


def _slope_at_end(h: np.ndarray, secant: np.ndarray) -> float:
    """Slope of the parabola through the first three points, limited so that the curve is monotone before the second."""
    slope = ((2.0 * h[0] + h[1]) * secant[0] - h[0] * secant[1]) / (h[0] + h[1])
    if slope * secant[0] <= 0.0:
        return 0.0
    turns = secant[0] * secant[1] <= 0.0
    return float(3.0 * secant[0] if turns and abs(slope) > 3.0 * abs(secant[0]) else slope)


def _interval(part: xr.Dataset, across: str) -> float:
    """Length of the intervals, whole cycles or times, of which the range is drawn; 0 where the curve itself is."""
    span = float(np.ptp(part["cycle"].values)) if "cycle" in part.variables else 0.0
    if across == "cycle":
        return float(np.ceil(span / _ENVELOPE)) if span > _ENVELOPE else 0.0
    return float(np.ptp(part[across].values)) / (5 * _ENVELOPE) if span > 10 * _ENVELOPE else 0.0  # an event is short


def _envelope(ax: Axes, x: np.ndarray, y: np.ndarray, width: float, color: str, label: str | None) -> None:
    """Draw the range of a curve in intervals."""
    interval = np.floor((x - x[0]) / width).astype(int)
    starts = np.flatnonzero(np.diff(interval, prepend=-1))
    low, high = (np.asarray(f.reduceat(y, starts)) for f in (np.fmin, np.fmax))
    at = np.append(x[starts], x[-1])
    look: dict[str, Any] = {"step": "post", "color": color, "linewidth": 0.6, "label": label}
    ax.fill_between(at, np.append(low, low[-1]), np.append(high, high[-1]), alpha=0.35, **look)


def hardest_impact(force: np.ndarray) -> tuple[int, int]:
    """The samples without contact before and after the maximum force, or the first and last one."""
    peak = int(np.nanargmax(force))
    apart = np.flatnonzero(~(force > 0.0))
    before, after = apart[apart < peak], apart[apart > peak]
    return int(before[-1]) if before.size else 0, int(after[0]) if after.size else len(force) - 1


def _hardest_impact(part: xr.Dataset) -> tuple[xr.Dataset, np.ndarray, float]:
    """Return the samples near the maximum force: the contact, and a margin of 0.6 of its length on either side."""
    time = part["time"].values
    start, stop = hardest_impact(part["contact_force"].values)
    margin = 0.6 * (time[stop] - time[start])
    inside = (time >= time[start] - margin) & (time <= time[stop] + margin)
    near = part.isel(time=_range(inside))
    cycle = float(part["cycle"].values[start]) if "cycle" in part.variables else 0.0
    return near, near["time"].values - time[start], cycle
