"""What a page computes of a point, beside the page: a first look at the run, the run, and how it compares."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

import snapbeam as sb
from snapbeam import InputError, Run, RunStatus
from snapbeam.explorer.cards.map import MapCard
from snapbeam.explorer.jobs import Token
from snapbeam.explorer.limits import check_run, samples_of
from snapbeam.explorer.maps.layers import chances as chances_of
from snapbeam.explorer.maps.points import Point, compared

__all__ = ["Answer", "answer"]

_QUICK = 4000
"""Samples of a run that is shown at once; all others follow."""


@dataclass(frozen=True, eq=False)
class Answer:
    """A run of a point, and what is said below it."""

    run: Run
    words: str
    """How it compares with what the map holds."""
    same: bool
    chances: str
    """Probabilities and lifetime of the point, where the map holds them."""


def answer(
    card: MapCard, point: Point, base: Any, how: Any, token: Token, look: Callable[[Run], None]
) -> Answer:
    """Compute a point of a card's map; *look* is given the run at a few instants before it is recorded whole."""
    system, integration = point.system(base, how.replace(engine="auto", threads=None))
    check_run(system, integration)
    quick = _quick(system, integration, token)
    if quick is not None:
        look(quick)
    count = samples_of(system, integration)
    times = None if count is None else _even_times(system, integration, count)
    run = sb.simulate(system, integration, sample_times=times, progress=token.check)
    chances, source = "", card.shared.source
    try:
        held = card.expected(point)
        chances = chances_of(source.layers, held)
        same, words = compared(held, run.summary, str(source.attrs.get("engine", "cpu")))
    except InputError as error:  # the run stands, although its map cannot be read any more
        same, words = False, str(error)
    if times is not None:
        words += f"; recorded at {times.size} instants, the most that a page may ask for"
    return Answer(run, words, same, chances)


def _quick(system: Any, integration: Any, token: Token) -> Run | None:
    """The run at a few instants, all that its pictures need made; None where those instants cannot be known."""
    if system.striker is None or not system.striker.drive.harmonic or integration.early_termination:
        return None
    times = _even_times(system, integration, _QUICK)
    run = sb.simulate(system, integration, sample_times=times, progress=token.check)
    if run.outcome.status is not RunStatus.OK:
        return None
    _ = run.dataset  # made here and not on the page's thread, which others wait for
    return run


def _even_times(system: Any, integration: Any, count: int) -> NDArray[np.float64]:
    """Instants evenly over a run with a sinusoidal drive."""
    frequency = system.striker.drive.frequency_ratio * system.model.reference_frequency
    return np.linspace(0.0, integration.cycles_or_default / frequency, count)
