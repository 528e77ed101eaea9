"""Over many random scenes and signals no number is off by more than five standard errors without a word."""

from collections import Counter

import numpy as np
import pytest
import random_scenes
import random_signals

SURE = 5.0
FALSE = 0.02
MAKERS = {
    "scene": (
        random_scenes.DEFECTS,
        lambda kind, rng, folder: random_scenes.judged(
            random_scenes.spoiled_scene(rng, kind) if kind else random_scenes.good_scene(rng), folder, rng
        ),
    ),
    "drive": (random_signals.DRIVE_DEFECTS, lambda kind, rng, folder: random_signals.judged_drive(rng, kind)),
    "decay": (random_signals.DECAY_DEFECTS, lambda kind, rng, folder: random_signals.judged_decay(rng, kind)),
}


def outcomes(what, folder, *, good, spoiled, seed):
    """Outcomes of *good* scenes or signals, and of *spoiled* ones, each kind of defect as often as another."""
    kinds, judged = MAKERS[what]
    for k in range(good + spoiled):
        kind = "" if k < good else kinds[(k - good) % len(kinds)]
        yield k, kind, judged(kind, np.random.default_rng((seed, k)), folder)


def hold(what, folder, *, good, spoiled, seed=20):
    """Assert both promises, and print the figures."""
    silent, false, flagged = [], [], Counter()
    for k, kind, outcome in outcomes(what, folder, good=good, spoiled=spoiled, seed=seed):
        flagged[kind] += outcome.flagged
        if outcome.ratio > SURE and not outcome.flagged:
            silent.append((k, kind, outcome))
        if outcome.flagged and not kind:
            false.append((k, outcome))
    print(f"{what}: {len(silent)} of {good + spoiled} off in silence; {len(false)} of {good} good ones flagged;",
          dict(flagged))  # fmt: skip
    assert not silent
    assert len(false) <= FALSE * good, false


@pytest.mark.parametrize(("what", "good", "spoiled"), [("scene", 3, 5), ("drive", 30, 24), ("decay", 10, 12)])
def test_a_few(what, good, spoiled, tmp_path):
    hold(what, tmp_path, good=good, spoiled=spoiled)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("what", "good", "spoiled"), [("scene", 100, 200), ("drive", 200, 100), ("decay", 200, 100)]
)
def test_hundreds(what, good, spoiled, tmp_path):
    hold(what, tmp_path, good=good, spoiled=spoiled, seed=21)
