"""Exact derivatives of statistics of random systems by a parameter of the structure, against differences of runs.

``SNAPBEAM_COMPOSITIONS=200 pytest tests/composition/test_random_gradients.py -m slow`` tests 200 systems in place of 40.
"""

from __future__ import annotations

import os

import numpy as np
import pytest
from generator import composed
from test_composition import PHYSICAL, reason
from test_random_tangents import ORDER_SIX

import snapbeam as sb
from snapbeam.model.parameters import lookup
from snapbeam.solver import native
from snapbeam.solver.assemble import make_ensemble
from snapbeam.solver.ensemble import Ensemble
from snapbeam.solver.statistics import statistics_of
from snapbeam.util.validation import InputError

COUNT = int(os.environ.get("SNAPBEAM_COMPOSITIONS", "40"))
STATISTICS = ("rms_displacement", "rms_midspan_velocity", "striker_work", "energy_dissipated", "impulse")
LIMIT = 1e-5
"""Greatest error at level reference over the value or its elasticity, whichever is larger."""
SIZES = (1e-3, 3e-4, 1e-4, 3e-5, 1e-5)


def structural(system: sb.System) -> list[str]:
    """Numbers that change the modes, and are not zero."""
    given = ((name, value) for name, value in system.parameters.items() if isinstance(value, float) and value != 0.0)
    return [name for name, _ in given if not lookup(name).is_run and not name.startswith("initial_state")]


def errors_of(seed: int) -> list[tuple[str, str, float, float]]:
    """Parameter, statistic, error of its derivative and that of the differences."""
    system, rng = composed(seed).system, np.random.default_rng([seed, 11])
    names = structural(system)
    if not names:
        return []
    name = str(rng.choice(names))
    how, value = sb.Integration(accuracy="reference", cycles=1, early_termination=False), float(system.get(name))

    def ensemble(share: float) -> Ensemble:
        return make_ensemble(system.replace(**{name: value * share}), how)

    def run(share: float) -> dict[str, float]:
        one = ensemble(share)
        found = statistics_of(one, native.run_ensemble(one, threads=1))
        return {each: float(found[each][0]) for each in (*STATISTICS, "impacts")}

    above, below = ensemble(1.0 + 1e-5), ensemble(1.0 - 1e-5)
    if not native.differentiable(above, below):
        return []
    pairs, _, _ = native.changed_accumulators(ensemble(1.0), [(above, below, 2e-5 * value)], threads=1)
    high, low = (statistics_of(near, records) for near, records in zip((above, below), pairs[0], strict=True))
    here = run(1.0)
    tables = []
    for size in SIZES:
        ends = [(run(1.0 + k * size), run(1.0 - k * size), weight) for k, weight in ORDER_SIX]
        same = {end["impacts"] for pair in ends for end in pair[:2]} == {here["impacts"]}
        tables.append(
            [sum(w * (a[each] - b[each]) for a, b, w in ends) / size if same else np.nan for each in STATISTICS]
        )
    slopes = np.array(tables)
    gaps = np.nan_to_num(np.abs(np.diff(slopes, axis=0)), nan=np.inf)
    found = []
    for k, each in enumerate(STATISTICS):
        best = int(gaps[:, k].argmin())
        exact, other = float(high[each][0] - low[each][0]) / 2e-5, slopes[best + 1, k]
        size = max(abs(here[each]), abs(other)) or 1.0
        found.append((name, each, abs(exact - other) / size, float(gaps[best, k]) / size))
    return found


def judge(seeds: range) -> None:
    wrong, compared, doubtful = [], 0, 0
    for seed in seeds:
        try:
            found = errors_of(seed)
        except InputError as error:
            assert reason(error) in PHYSICAL
            continue
        for name, statistic, error, gap in found:
            certain = gap <= 0.1 * LIMIT
            compared, doubtful = compared + certain, doubtful + (not certain)
            if certain and not error <= LIMIT:
                wrong.append((seed, name, statistic, error, gap))
    print(f"{compared} derivatives are right, {doubtful} have no certain differences")
    assert not wrong
    assert compared > doubtful


@pytest.mark.slow
def test_derivatives_of_some_systems() -> None:
    judge(range(5, 7))


@pytest.mark.slow
def test_derivatives_of_random_systems() -> None:
    judge(range(COUNT))
