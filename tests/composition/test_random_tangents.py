"""Derivatives of runs of random systems, along changes of the whole state and of a parameter, against differences.

``SNAPBEAM_COMPOSITIONS=50 pytest tests/composition/test_random_tangents.py -m slow`` tests 50 systems in place of 200.
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
COUNT = int(os.environ.get("SNAPBEAM_COMPOSITIONS", "200"))
LIMIT = 5e-6
"""Greatest error over the norm of a derivative at level reference; the median of 200 was 4e-11, and 3e-7 the maximum without a circuit much faster than a step."""
STANDARD, TYPICAL = 2e-2, 1e-4
"""Greatest error at level standard, that of 32 modes between five tips, and one that nine of ten derivatives keep."""
SIZES = 10.0 ** np.arange(-3.0, -7.5, -0.5)
"""Changes that differences are taken over, relative to the motion or to the parameter."""
ORDER_SIX = ((1.0, 0.75), (2.0, -0.15), (3.0, 1.0 / 60.0))
"""Places and weights of a central difference."""
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


def errors_of(seed: int) -> list[tuple[str, float, float, float]]:
    """Change, errors of its derivative at the levels and that of the differences, over the norm of the derivative.

    At level reference it is compared with differences of the runs, at level standard with that at level reference: what the
    steps of a run add to it, as a step that ends at an impact moves, is an error of the run.
    """
    system, rng = composed(seed).system, np.random.default_rng([seed, 7])
    how = sb.Integration(accuracy="reference")
    begun = sb.advance(system, system.start_state, 1, integration=how)
    if not np.isfinite(begun.amplitude).all():
        return []  # it left the range of a law, as its status says
    name = str(rng.choice([name for name, values in run_columns(system, {}).items() if values[0] != 0.0] or [""]))

    def batch(moved: Array, points: dict[str, Array] | None = None, accuracy: str = "reference") -> Ensemble:
        many = begun.flat[np.zeros(len(moved), int)]
        modal = many.modal._replace(q=many.modal.q + moved[:, 0], p=many.modal.p + moved[:, 1])
        level = sb.Integration(accuracy=accuracy)
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
    found, coarse = (
        np.concatenate(native.tangents(each, changes[None, :, 0], changes[None, :, 1], threads=1), axis=2)[0]
        for each in (one, batch(none, accuracy="standard"))
    )
    pairs = []
    for own, other, change in zip(found, coarse, changes, strict=True):

        def moved(places: Array, along: Array = change) -> Array:
            return run(batch(places[:, None, None] * along))

        pairs.append(("state", own, other, *differences(moved, scale)))
    if name:
        value = float(run_columns(system, {})[name][0])

        def varied(places: Array) -> Array:
            return run(batch(np.zeros((places.size, *start.shape)), {name: value * (1.0 + places)}))

        step = 1e-5
        both = []
        for level in ("reference", "standard"):
            at = [{name: np.array([value * (1.0 + sign * step)])} for sign in (0.0, 1.0, -1.0)]
            here, *beside = (batch(none, each, level) for each in at)
            if native.differentiable(*beside):
                moved_by = native.tangents(here, none[:, :1], none[:, 1:], 1, (*beside, 2.0 * step))
                both.append(np.concatenate(moved_by, axis=2)[0, 0])
        if len(both) == 2:
            pairs.append((name, *both, *differences(varied, scale)))
    judged = []
    for what, own, coarser, other, gap in pairs:
        norm = float(np.linalg.norm(other * scale)) or 1.0
        errors = [float(np.linalg.norm(each * scale)) / norm for each in (own - other, coarser - own)]
        judged.append((what, *errors, gap / norm))
    return judged


def judge(seeds: range) -> None:
    """No derivative is wrong; those are compared whose differences are certain, away from grazing and chaos."""
    wrong, compared, doubtful, rough, refused = [], 0, 0, 0, 0
    for seed in seeds:
        try:
            found = errors_of(seed)
        except InputError as error:
            assert reason(error) in PHYSICAL
            refused += 1
            continue
        for what, fine, coarse, gap in found:
            certain = gap <= 0.1 * LIMIT
            compared, doubtful = compared + certain, doubtful + (not certain)
            rough += certain and coarse > TYPICAL
            if certain and (fine > LIMIT or coarse > STANDARD):
                wrong.append((seed, what, fine, coarse, gap))
    print(f"{compared} derivatives are right, {doubtful} have no certain differences, {refused} systems are refused")
    assert not wrong
    assert compared > 3 * doubtful and rough <= 0.1 * compared


def test_derivatives_of_some_systems() -> None:
    judge(range(5, 12))


@pytest.mark.slow
def test_derivatives_of_random_systems() -> None:
    judge(range(COUNT))
