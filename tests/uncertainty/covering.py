"""How often intervals hold the truth: what is claimed as 95 %, counted over synthetic trials, and kept for the page.

``python tests/uncertainty/covering.py [name ...]`` counts and writes docs/data/coverage.json and coverage.md.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

import snapbeam as sb
from snapbeam.dynamics.lifetimes import fit_lifetime
from snapbeam.uncertainty.posterior import _population
from snapbeam.uncertainty.probability import allocate
from snapbeam.uncertainty.quantiles import crossing, local_crossing, search
from snapbeam.uncertainty.sensitivity_analysis import first_order
from snapbeam.util.files import atomic_path

DATA = Path(__file__).parents[2] / "docs" / "data"
TRIALS = 400
LEVELS = np.array([0.05, 0.5, 0.95])
MIDDLE, SCALE = 0.4, 0.05
"""Of the logistic truth of thresholds."""


class Counted(NamedTuple):
    """Intervals of one kind."""

    trials: int
    shares: dict[str, float]
    """Share of the intervals of 95 % that hold the truth, by what they are of."""

    @property
    def all(self) -> float:
        """Over all of them."""
        return float(np.mean(list(self.shares.values())))


def proportions() -> Counted:
    """Runs of a point stop once its interval is narrow; probabilities are spread evenly over (0, 1)."""
    truth = (np.arange(10 * TRIALS) + 0.5) / (10 * TRIALS)
    ranks = np.random.default_rng(5)

    def ask(which, numbers):
        hits = ranks.random(which.size) < truth[which]
        return np.stack([hits] * 4), np.zeros(which.size, dtype=bool)

    allocation = sb.uncertainty.SamplingPlan(half_width=0.05)
    _, low, high = allocate(ask, truth.size, allocation).limits(allocation, 0)
    return Counted(truth.size, {"probability": float(((low <= truth) & (truth <= high)).mean())})


def thresholds() -> Counted:
    """400 runs about a logistic truth."""
    true = MIDDLE + SCALE * np.log(LEVELS / (1.0 - LEVELS))
    held = np.zeros((TRIALS, LEVELS.size), dtype=bool)
    off = np.zeros((TRIALS, LEVELS.size))
    for trial in range(TRIALS):
        generator = np.random.default_rng(trial)

        def ask(columns, values, numbers, generator=generator):
            chance = 1.0 / (1.0 + np.exp(-(values - MIDDLE) / SCALE))
            return generator.random(values.size) < chance, np.zeros(values.size, dtype=bool)

        runs = search(ask, 1, (0.0, 1.0), sb.uncertainty.QuantileSearchSettings(runs=400, seed=trial))[0]
        for i, level in enumerate(LEVELS):
            _, low, high = crossing(runs.values, runs.hits, level)
            held[trial, i] = low <= true[i] <= high
            found = local_crossing(runs.values, runs.hits, level, max(low, 0.0), min(high, 1.0), 3.0)
            off[trial, i] = found - true[i]
    return Counted(TRIALS, {f"V at P = {p:g}": float(s) for p, s in zip(LEVELS, held.mean(axis=0), strict=True)})


def _indices(given: bool) -> Counted:
    from test_sensitivity import FIRST, TOTAL, ishigami

    held = []
    for seed in range(TRIALS):
        if given:
            ranks = np.random.default_rng(seed).random((2000, 3))
            one = first_order(ranks, ishigami(ranks.T), 0.95, seed)
            held.append(np.concatenate([(one.low <= FIRST) & (FIRST <= one.high)]))
            continue
        both = sb.uncertainty.sobol_indices(ishigami, 3, 64, rng=seed)
        parts = ((both.first, FIRST), (both.total, TOTAL))
        held.append(np.concatenate([(each.low <= truth) & (truth <= each.high) for each, truth in parts]))
    names = [f"{kind} {i + 1}" for kind in (("first",) if given else ("first", "total")) for i in range(3)]
    return Counted(TRIALS, dict(zip(names, np.mean(held, axis=0).tolist(), strict=True)))


def goals() -> Counted:
    """Mean and quantile of 200 normal numbers."""
    generator, found = np.random.default_rng(5), {}
    for name, goal, truth in (
        ("mean", sb.uncertainty.Objective(quantity="peak_force"), 0.0),
        ("quantile 0.9", sb.uncertainty.Objective(quantity="peak_force", quantile=0.9), 1.2815515655446004),
    ):
        rows = np.array([goal.estimate(generator.standard_normal(200), 0, 0.95) for _ in range(5 * TRIALS)])
        found[name] = float(((rows[:, 1] <= truth) & (truth <= rows[:, 2])).mean())
    return Counted(5 * TRIALS, found)


def lifetimes() -> Counted:
    """Of an exponential after a delay, complete and censored."""
    draw, found = np.random.default_rng(7), {}
    for runs in (12, 32):
        for limit in (np.inf, 60.0):
            time = 8.0 + draw.exponential(50.0, (5 * TRIALS, runs))
            fit = fit_lifetime(np.minimum(time, limit), time < limit)
            name = f"{runs} runs" + (", censored" if np.isfinite(limit) else "")
            found[name] = float(((fit.low <= 50.0) & (fit.high >= 50.0)).mean())
    return Counted(5 * TRIALS, found)


def posterior() -> Counted:
    """Beams from the prior, measured with errors of 2 %.

    Frequencies go as those of one mode: with the thickness h where it is straight, with the buckling level b about a
    well, and a third one with both.
    """
    draw, held, known = np.random.default_rng(11), [], np.array([0.1, 0.1])

    def frequencies(logs):
        h, b = np.exp(logs)
        return np.array([30.0 * h, 80.0 * b, 150.0 * np.sqrt(h**2 + 0.5 * b**2)])

    for trial in range(TRIALS):
        truth = known * draw.standard_normal(2)
        seen = frequencies(truth) * (1.0 + 0.02 * draw.standard_normal(3))

        def terms(logs, seen=seen, error=0.02 * frequencies(truth)):  # noqa: B008
            return np.concatenate([(frequencies(logs) - seen) / error, logs / known])

        logs, weights, *_ = _population(terms, np.zeros(2), 400, trial)
        limits = sb.uncertainty.Posterior(("beam.thickness", "beam.buckling_level"), logs, weights).interval()
        held.append([low <= value <= high for (_, low, high), value in zip(limits.values(), truth, strict=True)])
    return Counted(TRIALS, dict(zip(("thickness", "buckling level"), np.mean(held, axis=0).tolist(), strict=True)))


def waveforms(trials: int = TRIALS) -> Counted:
    """Beams and contacts from the prior, tracked for four cycles; three parameters sought.

    Trials whose samples are worth too few, which the result says, are left out.
    """
    from test_waveforms import PRIOR, found, measured, nominal_system

    from snapbeam.model import default_values

    nominal, draw, held = nominal_system(), np.random.default_rng(17), []
    known = np.array(list(PRIOR.values()))
    start = np.array(
        [default_values.BEAM.thickness, default_values.BEAM.buckling_level, default_values.CONTACT.stiffness]
    )
    for trial in range(trials):
        logs = known * draw.standard_normal(3)
        said = found(measured(nominal, logs, draw), trial)
        if said.is_doubtful:
            continue
        truth = np.exp(logs) * start
        limits = said.interval().values()
        held.append([low < value < high for (_, low, high), value in zip(limits, truth, strict=True)])
        if trial % 10 == 9:
            print(trial + 1, len(held), np.mean(held, axis=0), flush=True)
    names = ("thickness", "buckling level", "contact stiffness")
    return Counted(len(held), dict(zip(names, np.mean(held, axis=0).tolist(), strict=True)))


KINDS: dict[str, tuple[str, Callable[[], Counted]]] = {
    "wilson": ("probability, runs stop early (Wilson)", proportions),
    "thresholds": ("quantile thresholds", thresholds),
    "sobol": ("Sobol's indices of Ishigami's function", lambda: _indices(False)),
    "given": ("indices of given data", lambda: _indices(True)),
    "goals": ("objectives of designs", goals),
    "lifetimes": ("lifetimes", lifetimes),
    "posterior": ("posterior, frequencies", posterior),
    "waveforms": ("posterior, a tracked waveform", lambda: waveforms(100)),
}


def stored() -> dict[str, dict]:
    """What was counted."""
    file = DATA / "coverage.json"
    return json.loads(file.read_text(encoding="utf-8")) if file.is_file() else {}


def text() -> str:
    """A table; ± is two standard errors of counting."""
    lines = ["| 95 % interval | trials | coverage | coverage of each quantity |", "|---|---|---|---|"]
    for name, one in stored().items():
        shares = one["shares"]
        value = float(np.mean(list(shares.values())))
        error = 2.0 * (value * (1.0 - value) / (one["trials"] * len(shares))) ** 0.5
        each = ", ".join(f"{what} {100.0 * share:.1f} %" for what, share in shares.items()) if len(shares) > 1 else ""
        told = f"{100.0 * value:.1f} ± {100.0 * error:.1f} %"
        lines.append(f"| {KINDS[name][0]} | {one['trials']} | {told} | {each} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    for name in sys.argv[1:] or list(KINDS):
        counted = KINDS[name][1]()
        kept = stored() | {name: counted._asdict()}
        kept = {key: kept[key] for key in KINDS if key in kept}
        for file, words in (("coverage.json", json.dumps(kept, indent=1) + "\n"), ("coverage.md", None)):
            with atomic_path(DATA / file) as temporary:
                temporary.write_text(text() if words is None else words, encoding="utf-8")
        print(name, counted, counted.all, flush=True)
