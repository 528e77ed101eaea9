"""Arguments at random: the entries of the module take them or raise ValueError or TypeError, and nothing else happens."""

from __future__ import annotations

import contextlib

import numpy as np
import pytest
from core_systems import arrays, crowded, struck

from snapbeam import _core
from snapbeam.solver import native
from snapbeam.solver.channels import LAWS

FIELDS = ("force", "potential", "stiffness", "damping", "low", "high")
REFUSED = (ValueError, TypeError)


def spoiled(rng, value):
    """A value of another shape, type, order or size, not finite, negative, or none."""
    if not isinstance(value, np.ndarray):
        others = ["text", None, -1, -(2**40), 2**70, 0, 1.5, float("nan"), float("inf"), np.zeros(2), []]
        return others[rng.integers(len(others))]
    kind, flat = rng.integers(11), value.astype(value.dtype.newbyteorder("="), order="C")
    if kind == 0:
        return flat.reshape(-1)[: rng.integers(value.size + 1)]
    if kind == 1:
        return flat[..., None]
    if kind == 2:
        return np.concatenate([flat, flat], axis=rng.integers(flat.ndim)) if flat.ndim else flat
    if kind == 3:
        return np.repeat(flat, 2, axis=-1)[..., ::2] if flat.ndim else flat
    if kind == 4:
        return np.asfortranarray(flat[..., ::-1]) if flat.ndim else flat
    if kind == 5:
        types = [np.float32, np.int64, np.int32, np.complex128, np.bool_, object, ">f8"]
        with np.errstate(all="ignore"):
            return np.nan_to_num(flat).astype(types[rng.integers(len(types))])
    if kind == 6:
        return [None, "text", -1, flat.tolist(), np.zeros((0,) * max(flat.ndim, 1), flat.dtype)][rng.integers(5)]
    if flat.size:
        at = rng.integers(flat.size)
        if flat.dtype == np.float64:
            flat.reshape(-1)[at] = rng.choice([np.nan, np.inf, -np.inf, -1.0, 0.0, 1e300, -1e300, 1e-300])
        elif flat.dtype.kind in "iu":
            limits = np.iinfo(flat.dtype)
            flat.reshape(-1)[at] = rng.choice([limits.min, limits.max, 99, 0])
    flat.setflags(write=kind != 10)
    return flat


def copies(mapping):
    return {name: each.copy() if isinstance(each, np.ndarray) else each for name, each in mapping.items()}


def changed(rng, *mappings):
    """The mappings, of which one to three entries are spoiled or missing."""
    found = [dict(each) for each in mappings]
    for _ in range(rng.integers(1, 4)):
        chosen = found[rng.integers(len(found))]
        name = sorted(chosen)[rng.integers(len(chosen))]
        if rng.random() < 0.05:
            del chosen[name]
        else:
            chosen[name] = spoiled(rng, chosen[name])
    return found


@pytest.mark.parametrize("made", [struck, crowded], ids=["struck", "crowded"])
@pytest.mark.parametrize("layout", ["runs", "modes", "thread"])
def test_integrate(made, layout):
    rng, refused = np.random.default_rng(["runs", "modes", "thread"].index(layout)), 0
    fresh = arrays(made(2), 1, {"drive.frequency_ratio": [1.0, 1.1, 1.2]}, max_steps=2_000)
    for _ in range(150):
        problem, batch = changed(rng, copies(fresh.problem), copies(fresh.batch))
        try:
            _core.integrate(problem, batch, layout, "", 2, None)
        except REFUSED:
            refused += 1
    assert refused > 30


def test_integrate_tangents():
    rng, refused = np.random.default_rng(11), 0
    fresh = arrays(crowded(2), 1, {"drive.frequency_ratio": [1.0, 1.1, 1.2]}, max_steps=500)
    for _ in range(50):
        seeds = {name: rng.normal(size=each.shape) for name, each in fresh.no_change().items()}
        problem, batch, seeds = changed(rng, copies(fresh.problem), copies(fresh.batch), seeds)
        try:
            _core.integrate_tangents(problem, batch, seeds, "", 2, None)
        except REFUSED:
            refused += 1
    assert refused > 10


class _Given(Exception):
    """Arguments of the module's record, in place of a run."""


@pytest.fixture
def recording(monkeypatch):
    """Copies of the arguments of a recorded run, as a function."""
    given = []

    def kept(problem, batch, recorder, layout, which):
        given.append((problem, batch, recorder))
        raise _Given

    with monkeypatch.context() as patch, contextlib.suppress(_Given):
        patch.setattr(native._core, "record", kept)
        next(native.record(arrays(crowded(2), 1).ensemble, np.linspace(0.0, 1e-3, 20), True))
    return lambda: [copies(part) for part in given[0]]


@pytest.mark.parametrize("at", range(5))
@pytest.mark.parametrize("bad", [-1, -(2**31), 2**31 - 1])
def test_marks_beyond_the_records_are_refused(recording, at, bad):
    """They are places in the records, which are read and written there."""
    problem, batch, recorder = recording()
    recorder["marks"][at] = bad
    with pytest.raises(ValueError, match="marks"):
        _core.record(problem, batch, recorder, "thread", "")


def test_record(recording):
    rng, refused = np.random.default_rng(3), 0
    for number in range(200):
        problem, batch, recorder = recording()
        problem, batch = changed(rng, problem, batch) if number % 2 else (problem, batch)
        (recorder,) = (recorder,) if number % 4 == 1 else changed(rng, recorder)
        try:
            _core.record(problem, batch, recorder, ("thread", "modes")[number % 3 % 2], "")
        except REFUSED:
            refused += 1
    assert refused > 50


def test_other_arguments():
    fresh = arrays(struck(1), 1)
    for given in (
        ("columns", "", 1, None), ("runs", "mmx", 1, None), ("runs", "", -1, None), ("runs", "", 10**12, None), (None, "", 1, None),
        ("runs", None, 1, None), ("runs", "", 1, 3), ("runs", "", 1.5, None), ("\ud800", "", 1, None),
    ):  # fmt: skip
        with contextlib.suppress(*REFUSED):
            _core.integrate(fresh.problem, fresh.batch, *given)
    for bad in (None, 1, [], "text", {}, {1: 2}):
        for problem, batch in ((bad, fresh.batch), (fresh.problem, bad)):
            with pytest.raises(REFUSED):
                _core.integrate(problem, batch, "runs", "", 1, None)


def test_law_values():
    rng, refused = np.random.default_rng(7), 0
    for _ in range(2000):
        law = int(rng.choice([*(number for number, _ in LAWS.values()), -1, 99, 2**31 - 1]))
        given = {name: rng.normal(size=5) for name in ("x", "y")} | {name: np.empty(5) for name in FIELDS}
        (given,) = changed(rng, given | {"numbers": np.abs(rng.normal(size=3))})
        try:
            _core.law_values(law, given)
        except REFUSED:
            refused += 1
    assert refused > 500
