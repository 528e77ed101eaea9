"""What a page computes of a point: a first look, the run whole, and how it stands beside the map."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import snapbeam as sb
from snapbeam import InputError, Integration, Run, RunStatus, System
from snapbeam.explorer.jobs import Token
from snapbeam.explorer.limits import samples_of
from snapbeam.explorer.maps.layers import chances
from snapbeam.explorer.maps.points import Point, compared

if TYPE_CHECKING:
    from snapbeam.explorer.cards.map import MapCard
    from snapbeam.explorer.shared import Shared

__all__ = ["beside_the_map", "quick_run", "whole_run"]

_QUICK = 4000
"""Samples of a run that is shown at once; all others follow."""


def quick_run(system: System, integration: Integration, token: Token) -> Run | None:
    """The run at a few instants, all that its pictures need made; None where those instants cannot be known."""
    if system.striker is None or not system.striker.drive.harmonic or integration.early_decision:
        return None
    run = sb.simulate(
        system, integration, sample_times=_even_times(system, integration, _QUICK), progress=token.check
    )
    if run.outcome.status is not RunStatus.OK:
        return None
    _ = run.dataset  # made here and not on the page's thread, which others wait for
    return run


def whole_run(system: System, integration: Integration, token: Token) -> tuple[Run, str]:
    """The run with all the samples that a page may ask for, and words where those are not all there are."""
    count = samples_of(system, integration)
    if count is None:
        return sb.simulate(system, integration, progress=token.check), ""
    times = _even_times(system, integration, count)
    run = sb.simulate(system, integration, sample_times=times, progress=token.check)
    return run, f"; recorded at {times.size} instants, the most that a page may ask for"


def beside_the_map(shared: Shared, card: MapCard, point: Point, run: Run) -> tuple[bool, str, str]:
    """Whether the run is what the map holds, words that say so, and the point's probabilities if the map has any."""
    likely = ""
    try:
        held = card.expected(point)
        likely = chances(shared.source.layers, held)
        same, words = compared(held, run.outcome, str(shared.source.attrs.get("engine", "cpu")))
    except InputError as error:  # the run stands, although its map cannot be read any more
        return False, str(error), likely
    return same, words, likely


def _even_times(system: System, integration: Integration, count: int) -> NDArray[np.float64]:
    """Instants evenly over a run with a sinusoidal drive."""
    drive: Any = None if system.striker is None else system.striker.drive
    frequency = drive.frequency_ratio * system.model.reference_freq
    return np.linspace(0.0, integration.cycles_or_default / frequency, count)
