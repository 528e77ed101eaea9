"""What stands on a picture: numbers with prefixes that suit them, the beam and the drive, the class."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.ticker import EngFormatter

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["beam_text", "caption", "prefixed", "prefixed_range", "scale_of"]


def prefixed(value: float, unit: str, digits: int = 3) -> str:
    """A number with a prefix of the SI: ``16.1 cm`` is not one, ``161 mm`` is."""
    if value == 0.0 or not np.isfinite(value):
        return f"{value:g} {unit}"
    step = int(np.floor(np.log10(abs(value)) / 3.0 + 1e-12))
    step = max(-8, min(8, step))
    prefix = EngFormatter.ENG_PREFIXES[3 * step]
    return f"{value / 1000.0**step:.{digits}g} {prefix}{unit}"


def scale_of(values: Any, unit: str) -> tuple[float, str]:
    """What to divide numbers by so that their axis is short, and the unit that makes; ``(1e-3, "mN")``."""
    most = float(np.nanmax(np.abs(np.asarray(values, dtype=float)))) if np.size(values) else 0.0
    if most == 0.0 or not np.isfinite(most):
        return 1.0, unit
    step = max(-8, min(8, int(np.floor(np.log10(most) / 3.0 + 1e-12))))
    return 1000.0**step, f"{EngFormatter.ENG_PREFIXES[3 * step]}{unit}"


def prefixed_range(low: float, high: float, unit: str) -> str:
    """Two numbers with one prefix."""
    factor, scaled = scale_of([low, high], unit)
    return f"{low / factor:.3g} to {high / factor:.3g} {scaled}"


def beam_text(attrs: Any) -> str:
    """The beam in a few words, from the attributes of a file; empty if they say nothing of one."""
    if not {"beam_length", "beam_thickness"} <= set(attrs):
        return ""
    words = [f"beam {prefixed(attrs['beam_length'], 'm')} × {prefixed(attrs['beam_thickness'], 'm')}"]
    if attrs.get("beam_buckling_level"):
        words.append(f"$b$ = {prefixed(attrs['beam_buckling_level'], 'm')}")
    return ", ".join(words)


def caption(dataset: xr.Dataset, lines: int = 1) -> str:
    """Beam, modes, drive and class of a run or a map, as far as its attributes say them, in one line or two."""
    attrs = dataset.attrs
    what, how = [beam_text(attrs)], []
    if "modes" in attrs:
        what.append(f"$N$ = {int(attrs['modes'])}")
    if "frequency_ratio" in attrs and "frequency_ratio" not in dataset.dims:
        text = rf"$\Omega$ = {attrs['frequency_ratio']:.4g}"
        if "reference_freq" in attrs:
            text += f" ({prefixed(attrs['frequency_ratio'] * attrs['reference_freq'], 'Hz')})"
        how.append(text)
    if "velocity_amplitude" in attrs and "velocity_amplitude" not in dataset.dims:
        text = f"$V$ = {attrs['velocity_amplitude']:.4g}"
        if {"reference_freq", "length_scale"} <= set(attrs):
            speed = (
                attrs["velocity_amplitude"] * 2.0 * np.pi * attrs["reference_freq"] * attrs["length_scale"]
            )
            text += f" ({prefixed(speed, 'm/s')})"
        how.append(text)
    if "location" in attrs and "location" not in dataset.dims:
        how.append(rf"$x_\mathrm{{s}}$ = {attrs['location']:.3g}")
    parts = [", ".join(part for part in each if part) for each in (what, how)]
    text = ("\n" if lines > 1 else ", ").join(part for part in parts if part)
    kind = attrs.get("response")
    return f"{text}: {kind}" if isinstance(kind, str) and text else text
