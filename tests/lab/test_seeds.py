"""The functions of the experiment that draw random numbers take ``rng`` (SPEC 7) and keep the seed."""

from __future__ import annotations

import inspect

import numpy as np

from snapbeam import lab


def test_the_seed_that_was_drawn_is_in_the_result() -> None:
    signal = lab.render_vibrometer(100.0, 7e-3, duration=0.3, rng=np.random.default_rng(5))
    again = lab.render_vibrometer(100.0, 7e-3, duration=0.3, rng=signal.attrs["seed"])
    np.testing.assert_array_equal(signal.values, again.values)


def test_no_public_function_has_a_seed() -> None:
    functions = [getattr(lab, name) for name in dir(lab) if not name.startswith("_")]
    named = [each for each in functions if inspect.isfunction(each) and "seed" in inspect.signature(each).parameters]
    assert not named
