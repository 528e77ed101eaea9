"""What was taken silently and meant something else is refused, by name."""

from __future__ import annotations

import fractions

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.model.reduced_model import rank_one_eigenpairs
from snapbeam.util.validation import InputError, InputTypeError, finite, finite_array, integer

MODEL = sb.ReducedModel.from_beam(default_values.BEAM, modes=2)


class Metre(float):
    """A number with a unit of its own."""

    units = "mm"


HIDDEN = np.ma.array([0.1, 99.0], mask=[False, True])


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: finite_array("axis", HIDDEN), "masked array"),
        (lambda: finite("length", np.ma.masked), "masked array"),
        (lambda: finite("length", Metre(3.0)), "without a unit of their own"),
        (lambda: sb.Beam(**{**vars_of(default_values.BEAM), "length": Metre(3.0)}), "length.*without a unit"),
        (lambda: sb.classify([1, np.nan], 0, 4, 1), r"crossings\[1\] = .*must be finite"),
        (lambda: sb.classify([1j], 0, 4, 1), "zero_crossings"),
        (lambda: sb.classify([True], [False], 4, 1), "zero_crossings"),
        (lambda: sb.classify([1, 2], [0, 0, 0], 4, 1), "do not go together"),
        (lambda: sb.classify([1.5], [0], 4, 1), "whole numbers"),
        (lambda: sb.classify([1], [0], 4, 0), r"final_well: must be \+1 or -1"),
        (lambda: MODEL.potential_energy(1.0), r"alpha of shape \(\)"),
        (lambda: MODEL.potential_energy([1.0, 2.0, 3.0]), r"alpha of shape \(3,\): must have the shape \(..., 2\)"),
        (lambda: MODEL.kinetic_energy([[1.0]]), "alpha_velocity of shape"),
        (lambda: sb.Replicates(2, check_half_step="no"), "check_half_step = 'no': must be True or False"),
    ],
)  # fmt: skip
def test_refused_by_name(call, words, tried):
    tried("inputs once taken silently")
    with pytest.raises(InputError, match=words):
        call()


def vars_of(beam):
    return {name: getattr(beam, name) for name in ("length", "thickness", "width", "density", "young_modulus")} | {
        "buckling_level": beam.buckling_level
    }


NONE = {
    "huge": 10**400,
    "a huge fraction": fractions.Fraction(10**400, 3),
    "of 5000 digits": 10**5000,
    "a duration": np.timedelta64(3, "s"),
    "nan": float("nan"),
    "complex": 1j,
    "a list": [1],
}


@pytest.mark.parametrize("name", list(NONE))
def test_numbers_that_are_none_are_refused_whatever_they_are(name, tried):
    value = NONE[name]
    tried("numbers that are none")
    for check in (lambda: finite("x", value), lambda: integer("x", value, 0, 10)):
        with pytest.raises(InputError, match="x = "):
            check()


def test_ragged_and_strange_arrays():
    for value in ([1, [2, 3]], [[1], [2, 3]], object(), {"a": 1}, [10**400], [None], ["a"]):
        with pytest.raises(InputError):
            finite_array("x", value)


@pytest.mark.parametrize("path", [0, 1, 2, True, 3.5, None, b"x.nc", "\0"])
def test_what_is_no_path_closes_no_stream(path, tried):
    """A number names a stream of the process, which would be read, or closed."""
    tried("paths that are none")
    for load in (sb.load, sb.System.load):
        with pytest.raises(InputTypeError, match="must be a path"):
            load(path)


@pytest.mark.filterwarnings("ignore::RuntimeWarning:snapbeam.model.reduced_model")
def test_a_beam_beyond_all_numbers_ends(tried):
    """What once was an endless loop ends: refused, or finite."""
    tried("beams beyond all numbers", 3)
    with pytest.raises(InputError, match="beyond what a number holds"):
        rank_one_eigenpairs(np.array([1.0, np.inf]), 1.0)
    with pytest.raises(InputError, match="beyond what a number holds"):
        rank_one_eigenpairs(np.array([1.0, 2.0]), np.nan)
    values, _ = rank_one_eigenpairs(np.array([1e-300, 1.0, 1e300]), 1e-3)
    assert np.isfinite(values).all()
