"""How runs are integrated: what may be given, and what may not be given together."""

from __future__ import annotations

import dataclasses

import pytest

import snapbeam as sb
from snapbeam.util.validation import InputError, InputTypeError


def test_what_is_not_given() -> None:
    asked = sb.Integration()
    assert (asked.cycles, asked.cycles_or_default) == (None, 200)
    assert (asked.step, asked.accuracy, asked.tolerance, asked.engine) == (None, "standard", None, "auto")
    assert not asked.early_termination
    assert asked == sb.Integration(accuracy="standard")
    assert sb.Integration(cycles=7).cycles_or_default == 7


def test_replace() -> None:
    asked = sb.Integration(cycles=5, step=1e-5)
    assert asked.replace(cycles=6) == sb.Integration(cycles=6, step=1e-5)
    assert asked.cycles == 5
    with pytest.raises(InputError, match="cycle: is not a parameter of an integration; must be one of cycles, step"):
        asked.replace(cycle=6)
    with pytest.raises(dataclasses.FrozenInstanceError):
        asked.cycles = 3  # type: ignore[misc]


@pytest.mark.parametrize(
    ("given", "error", "message"),
    [
        ({"cycles": 0}, InputError, r"cycles = 0: must be an integer in \[1, 10000000\]"),
        ({"cycles": 1.5}, InputError, "cycles = 1.5: must be an integer"),
        ({"step": 0.0}, InputError, "step = 0.0: must be a finite number greater than 0 s"),
        ({"accuracy": "best"}, InputError, "accuracy = 'best': must be one of 'standard', 'reference'"),
        ({"engine": "gpu"}, InputError, "engine = 'gpu': must be one of 'auto', 'native', 'python'"),
        ({"tolerance": 1e-12}, InputError, r"tolerance = 1e-12: must be a number in \[1e-10, 0.1\]"),
        ({"tolerance": 1e-3, "step": 1e-5}, InputError, "tolerance = 0.001 with step = 1e-05.*give one"),
        ({"tolerance": 1e-3, "accuracy": "reference"}, InputError, "accuracy = 'reference': give one"),
        ({"early_termination": "yes"}, InputTypeError, "early_termination = 'yes': must be True or False"),
        ({"threads": 0}, InputError, r"threads = 0: must be an integer in \[1, 4096\]"),
        ({"high_frequency_ratio": 0.0}, InputError, "high_frequency_ratio = 0.0"),
        ({"max_steps": 0}, InputError, "max_steps = 0: must be an integer"),
    ],
)
def test_refusals(given, error, message) -> None:
    with pytest.raises(error, match=message):
        sb.Integration(**given)
