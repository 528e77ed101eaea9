"""What stands on a picture: numbers with prefixes that suit them, the beam and the drive, the class."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from snapbeam.core.prefixes import prefixed

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["beam_text", "caption"]


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
        if "reference_frequency" in attrs:
            text += f" ({prefixed(attrs['frequency_ratio'] * attrs['reference_frequency'], 'Hz')})"
        how.append(text)
    if "velocity_amplitude" in attrs and "velocity_amplitude" not in dataset.dims:
        text = f"$V$ = {attrs['velocity_amplitude']:.4g}"
        if {"reference_frequency", "length_scale"} <= set(attrs):
            speed = (
                attrs["velocity_amplitude"]
                * 2.0
                * np.pi
                * attrs["reference_frequency"]
                * attrs["length_scale"]
            )
            text += f" ({prefixed(speed, 'm/s')})"
        how.append(text)
    if "location" in attrs and "location" not in dataset.dims:
        how.append(rf"$x_\mathrm{{s}}$ = {attrs['location']:.3g}")
    parts = [", ".join(part for part in each if part) for each in (what, how)]
    text = ("\n" if lines > 1 else ", ").join(part for part in parts if part)
    kind = attrs.get("response_class")
    return f"{text}: {kind}" if isinstance(kind, str) and text else text
