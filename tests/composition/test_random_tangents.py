"""Derivatives of runs of random systems, along changes of the whole state and of a parameter, against differences.

``SNAPBEAM_COMPOSITIONS=200 pytest tests/composition/test_random_tangents.py -m slow`` tests 200 systems in place of 80.
"""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable

import numpy as np
import pytest
from generator import composed
from numpy.typing import NDArray
from test_composition import PHYSICAL, reason

import snapbeam as sb
from snapbeam.solver import native
from snapbeam.solver.assemble import make_ensemble, run_columns
from snapbeam.solver.ensemble import Ensemble
from snapbeam.util.validation import InputError

Array = NDArray[np.float64]
COUNT = int(os.environ.get("SNAPBEAM_COMPOSITIONS", "80"))
EXACT = 1e-6
"""Greatest distance from differences of runs with the same steps, over the norm of a derivative."""
TYPICAL, GREATEST = (1e-6, 1e-4), (5e-5, 5e-2)
"""Errors of the levels reference and standard that nine of ten derivatives keep, and that all keep: those of the runs themselves."""
SIZES = 10.0 ** np.arange(-3.0, -7.5, -0.5)
"""Changes that differences are taken over, relative to the motion or to the parameter."""
ORDER_SIX = ((1.0, 0.75), (2.0, -0.15), (3.0, 1.0 / 60.0))
"""Places and weights of a central difference."""
FINER = 4.0
"""Steps of level reference over those of the differences: where an impact moves across a step, their error jumps."""
DIRECTIONS = 2


def differences(ends: Callable[[Array], Array], scale: Array) -> tuple[Array, float]:
    """The derivative at 0 of what has *ends* at several changes, and its error: that of the two sizes which agree best."""
    places = np.concatenate([[-k * size, k * size] for size in SIZES for k, _ in ORDER_SIX])
    found = ends(places).reshape(SIZES.size, len(ORDER_SIX), 2, -1)
    weights = np.array([weight for _, weight in ORDER_SIX])
    slopes = np.einsum("k,skn->sn", weights, found[:, :, 1] - found[:, :, 0]) / SIZES[:, None]
    gaps = np.linalg.norm(np.diff(slopes, axis=0) * scale, axis=1)
    best = int(np.nanargmin(gaps))
    return slopes[best + 1], float(gaps[best])


def errors_of(seed: int) -> list[tuple[str, list[float], float]]:
    """Change, errors of its derivative (short steps, both levels) and that of the differences, over the norm of the derivative.

    Compared with differences of runs are derivatives with the same short steps, at level reference and at level standard: the
    first shows that derivatives are exact, the others what the error of a run adds.
    """
    system, rng = composed(seed).system, np.random.default_rng([seed, 7])
    how = sb.Integration(accuracy="reference")
    begun = sb.advance(system, system.start_state, 1, integration=how)
    if not np.isfinite(begun.amplitude).all():
        return []  # it left the range of a law, as its status says
    name = str(rng.choice([name for name, values in run_columns(system, {}).items() if values[0] != 0.0] or [""]))

    finer = how.replace(step=make_ensemble(system, how, None, start=begun, periods=1).step_times[0] / FINER)

    def batch(moved: Array, points: dict[str, Array] | None = None, level: sb.Integration = how) -> Ensemble:
        many = begun.flat[np.zeros(len(moved), int)]
        modal = many.modal._replace(q=many.modal.q + moved[:, 0], p=many.modal.p + moved[:, 1])
        return make_ensemble(system, level, points, start=dataclasses.replace(many, modal=modal), periods=1)

    def run(ensemble: Ensemble) -> Array:
        found = native.integrate_with_output_states(ensemble, threads=1)
        return np.concatenate((found.q[:, -1], found.p[:, -1]), axis=1)

    start = np.stack((begun.modal.q, begun.modal.p)).reshape(2, -1)
    none = np.zeros((1, *start.shape))
    one = batch(none)
    rate = np.where(one.structure.omega > 0.0, one.structure.omega, one.structure.omega.max())
    size = np.sqrt(np.mean(start[0] ** 2) + np.mean((start[1] / rate) ** 2)) + 1e-3 * np.linalg.norm(one.structure.well)
    scale = np.concatenate((rate, np.ones_like(rate)))
    changes = rng.standard_normal((DIRECTIONS, 2, start.shape[1])) * size * np.stack((np.ones_like(rate), rate))
    levels = (finer, how, sb.Integration())
    found = [
        np.concatenate(native.tangents(batch(none, level=each), changes[None, :, 0], changes[None, :, 1], 1), axis=2)[0]
        for each in levels
    ]
    pairs = []
    for change, *own in zip(changes, *found, strict=True):

        def moved(places: Array, along: Array = change) -> Array:
            return run(batch(places[:, None, None] * along, level=finer))

        pairs.append(("state", own, *differences(moved, scale)))
    if name:
        value = float(run_columns(system, {})[name][0])

        def varied(places: Array) -> Array:
            return run(batch(np.zeros((places.size, *start.shape)), {name: value * (1.0 + places)}, finer))

        step = 1e-5
        own = []
        for level in levels:
            at = [{name: np.array([value * (1.0 + sign * step)])} for sign in (0.0, 1.0, -1.0)]
            here, *beside = (batch(none, each, level) for each in at)
            if native.differentiable(*beside):
                moved_by = native.tangents(here, none[:, :1], none[:, 1:], 1, (*beside, 2.0 * step))
                own.append(np.concatenate(moved_by, axis=2)[0, 0])
        if len(own) == len(levels):
            pairs.append((name, own, *differences(varied, scale)))
    judged = []
    for what, own, other, gap in pairs:
        norm = float(np.linalg.norm(other * scale)) or 1.0
        judged.append((what, [float(np.linalg.norm((each - other) * scale)) / norm for each in own], gap / norm))
    return judged


def judge(seeds: range) -> None:
    """No derivative is wrong; those are compared whose differences are certain, away from grazing and chaos."""
    wrong, compared, doubtful, rough, refused = [], 0, 0, np.zeros(2, int), 0
    for seed in seeds:
        try:
            found = errors_of(seed)
        except InputError as error:
            assert reason(error) in PHYSICAL
            refused += 1
            continue
        for what, (exact, *levels), gap in found:
            certain = gap <= 0.1 * EXACT
            compared, doubtful = compared + certain, doubtful + (not certain)
            if certain:
                rough += np.array(levels) > TYPICAL
                if exact > EXACT or (np.array(levels) > GREATEST).any():
                    wrong.append((seed, what, exact, levels, gap))
    print(f"{compared} derivatives are right, {doubtful} have no certain differences, {refused} systems are refused")
    print(f"beyond {TYPICAL}: {rough}")
    assert not wrong
    assert compared > 3 * doubtful and (rough <= 0.1 * compared).all()


@pytest.mark.slow
def test_derivatives_of_some_systems() -> None:
    judge(range(5, 9))


@pytest.mark.slow
def test_derivatives_of_random_systems() -> None:
    judge(range(COUNT))
