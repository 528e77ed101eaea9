"""The native core on random systems of the parts it has, against the independent reference; nothing is compiled.

``SNAPBEAM_COMPOSITIONS=100 pytest tests/composition/test_native.py -m slow`` tests 100 seeds in place of 1,000.
"""

from __future__ import annotations

import os

import pytest
from generator import BASES, DRIVES, FORCES, LOADS, Features, native_features
from test_composition import CHUNK, checked, judge

COUNT = int(os.environ.get("SNAPBEAM_COMPOSITIONS", "1000"))


def reports(seeds):
    return [
        checked(seed, native_features(seed), ("reference", "standard"), engine="native") for seed in seeds
    ]


@pytest.mark.parametrize("seed", range(8))
def test_random_systems(seed):
    judge(reports([seed]))


MOTIONS = [
    *(
        Features(
            2,
            (("hertz", drive, False),),
            base="acceleration_sine" if drive == "recorded_motion" else None,
            started=drive == "fixed",
        )
        for drive in sorted(set(DRIVES))
    ),
    *(Features(2, (("hertz", "fixed", False),), base=base) for base in BASES),
    *(Features(2, external=(force,), started=True) for force in FORCES),
    *(Features(2, load=load, started=True) for load in LOADS),
]


@pytest.mark.parametrize(
    "features",
    MOTIONS,
    ids=lambda each: str(each.contacts[:1] or each.external or each.load)[:40] + str(each.base or ""),
)
def test_every_motion(features):
    judge([checked(5, features, ("reference", "standard"), engine="native")])


@pytest.mark.slow
@pytest.mark.parametrize("first", range(8, COUNT, CHUNK))
def test_many_random_systems(first):
    judge(reports(range(first, min(first + CHUNK, COUNT))))
