"""Functions that draw random numbers take ``rng``: a seed, a generator or None (SPEC 7)."""

from __future__ import annotations

import importlib
import inspect

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.util.validation import seed_of


def summed(x):
    return x[0] + 0.5 * x[1]


def test_a_seed_gives_the_same_numbers_and_a_generator_gives_a_seed() -> None:
    one, again = (sb.uncertainty.sobol_indices(summed, 2, 64, rng=3) for _ in range(2))
    np.testing.assert_array_equal(one.first.estimate, again.first.estimate)
    drawn = sb.uncertainty.sobol_indices(summed, 2, 64, rng=np.random.default_rng(3))
    by_hand = sb.uncertainty.sobol_indices(summed, 2, 64, rng=seed_of(np.random.default_rng(3)))
    np.testing.assert_array_equal(drawn.first.estimate, by_hand.first.estimate)
    assert (drawn.first.estimate != one.first.estimate).any()


def test_a_generator_goes_on_and_none_differs() -> None:
    generator = np.random.default_rng(0)
    assert seed_of(generator) != seed_of(generator)
    assert seed_of(None) != seed_of(None)


@pytest.mark.parametrize("rng", [-1, 1.5, "seven", [1, 2]])
def test_anything_else_is_refused(rng) -> None:
    with pytest.raises(sb.InputError, match="rng"):
        seed_of(rng)


@pytest.mark.parametrize("name", ["snapbeam", "snapbeam.dynamics", "snapbeam.uncertainty"])
def test_no_public_function_has_a_seed(name) -> None:
    module = importlib.import_module(name)
    functions = {each: getattr(module, each) for each in dir(module) if not each.startswith("_")}
    named = [
        each
        for each, function in functions.items()
        if inspect.isfunction(function) and "seed" in inspect.signature(function).parameters
    ]
    assert not named
