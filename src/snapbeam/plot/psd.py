"""The power spectral density of an acceleration with its confidence band."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from snapbeam.plot.style import BEAM_COLOR, SHAKER_COLOR, axes_or_new, figure_style, fix_ticks
from snapbeam.util.validation import InputError, checked, instance

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["plot_psd"]


@checked
def plot_psd(dataset: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw an estimated power spectral density with its interval, and the density that it was drawn from, on logarithmic axes.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of ``estimated_psd`` of a recorded acceleration or a random vibration.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure one column wide by default.

    Raises
    ------
    InputError
        If the dataset holds no such density.

    Examples
    --------
    >>> import snapbeam as sb
    >>> motion = sb.RecordedAcceleration.from_psd("NAVMAT P-9492", duration_s=2.0)
    >>> ax = sb.plot.plot_psd(motion.estimated_psd())
    """
    from snapbeam.util.datasets import xr

    instance("dataset", dataset, xr.Dataset, "an xarray.Dataset")
    missing = [name for name in ("psd", "psd_low", "psd_high") if name not in dataset]
    if missing:
        raise InputError(f"dataset without {', '.join(missing)}: must be a result of estimated_psd")
    data = dataset.sel(frequency=dataset["frequency"] > 0.0)
    with figure_style():
        ax = axes_or_new(ax)
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
            ax.plot(f[inside], target, "--", color=SHAKER_COLOR, linewidth=1.2, label="drawn from")
        ax.set(xscale="log", yscale="log", xlabel="Frequency (Hz)", ylabel="Acceleration density (g$^2$/Hz)")
        ax.set_title(f"{data.attrs['rms_g']:.3g} g root mean square")
        ax.legend()
        fix_ticks(ax)
    return ax
