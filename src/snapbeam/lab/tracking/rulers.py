"""The pixel size by lengths that the recording shows: beam, striker and stroke against each other and the one given."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from snapbeam.lab.tracking.drive_clock import steady_striker
from snapbeam.lab.tracking.edges import Floats
from snapbeam.lab.tracking.settings import RULERS, Scene, TrackingSettings
from snapbeam.util.diagnostics import Severity

_SURE = 5.0  # standard errors of a disagreement
_LEAST = 0.01  # of the pixel size
_EXPLAINED = 0.05  # of a factor, by which a disagreement may be off it
_FACTORS = {10.0: "of ten", 25.4: "of 25.4, as of inches", 1000.0: "of a thousand, as of millimetres"}
_EDGE = 0.06  # px; error of the thickness that no scatter shows
_AMPLITUDE = 0.005  # px, of the amplitude


class Ruler(NamedTuple):
    """A pixel size [m] by name of what tells it, and its relative standard error."""

    name: str
    size: float
    error: float

    def __str__(self) -> str:
        error = f" +- {1e6 * self.size * self.error:.2g}" if self.error else ""
        return f"{1e6 * self.size:.5g}{error} um"


def option_name(name: str) -> str:
    """A setting with its option of the command line."""
    return f"{name} (--{name.replace('_', '-')})"


def seen_rulers(
    scene: Scene, shaker: Floats, settings: TrackingSettings, open_share: float
) -> tuple[list[Ruler], list[str]]:
    """Pixel sizes by the lengths that were given, and those lengths that the recording does not show.

    *shaker* holds rows [px]; over *open_share*, the exposure over the time between frames, the amplitude of a sine is
    averaged.
    """
    rulers, unseen = [], []
    for name, relative in RULERS.items():
        length = getattr(settings, name)
        if length is None:
            continue
        seen, error = math.nan, math.nan
        if name == "beam_thickness":
            seen = scene.beam.thickness * scene.straight
            error = math.hypot(scene.beam.thickness_error, _EDGE, 2.0 * scene.shape.shift)
        elif name == "tip_diameter" and scene.shaker is not None:
            seen, error = scene.shaker.width
        elif name == "drive_amplitude":
            steady = steady_striker(shaker)
            if steady is not None:
                fit = steady[1]
                seen = fit.amplitude * scene.straight / float(np.sinc(fit.frequency * open_share))
                error = math.hypot(fit.amplitude_se, _AMPLITUDE)
        if not math.isfinite(seen):
            unseen.append(name)
            continue
        given = getattr(settings, f"{name}_error")
        stated = relative if given is None else given / length
        rulers.append(Ruler(name, length / seen, math.hypot(stated, error / seen)))
    return rulers, unseen


def compare_rulers(rulers: Sequence[Ruler]) -> tuple[Severity, str, dict[str, float]] | None:
    """Severity, words and numbers of a disagreement of pixel sizes; None where all agree.

    Two disagree beyond five standard errors and 1 %.  The one is named without which all others agree.
    """

    def apart(one: Ruler, two: Ruler) -> bool:
        limit = max(_SURE * math.hypot(one.error, two.error), _LEAST)
        return abs(math.log(one.size / two.size)) > limit

    pairs = [pair for pair in itertools.combinations(rulers, 2) if apart(*pair)]
    if not pairs:
        return None
    named = [one for one in rulers if all(one in pair for pair in pairs)] if len(rulers) > 2 else []
    if len(named) == 1:
        wrong = named[0]
        others = [one for one in rulers if one is not wrong]
        weights = [1.0 / max(one.error, 1e-4) ** 2 for one in others]
        size = math.exp(np.average([math.log(one.size) for one in others], weights=weights))
        first, second = wrong, Ruler("the others", size, 1.0 / math.sqrt(sum(weights)))
        listed = " and ".join(option_name(one.name) for one in others)
        words = f"{option_name(wrong.name)} disagrees with {listed}: a pixel size of {wrong}, and of {second} by those"
    else:
        first, second = max(pairs, key=lambda pair: abs(math.log(pair[0].size / pair[1].size)))
        words = (
            f"{option_name(first.name)} and {option_name(second.name)} disagree: pixel sizes of {first} and {second}"
        )
    ratio = first.size / second.size
    error = math.hypot(first.error, second.error)
    near = min(_FACTORS, key=lambda factor: abs(abs(math.log(ratio)) - math.log(factor)))
    unit = abs(abs(math.log(ratio)) - math.log(near)) < max(_SURE * error, _EXPLAINED)
    words += f", a factor {_FACTORS[near]}" if unit else f", a factor of {ratio:.4g}"
    numbers = {"ratio": ratio, "error": ratio * error}
    numbers |= {f"pixel_size_um_by_{one.name}".replace("_by_pixel_size", ""): 1e6 * one.size for one in rulers}
    return (Severity.ERROR if unit else Severity.WARNING), words, numbers
