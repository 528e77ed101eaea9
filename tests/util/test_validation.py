"""Arguments of another kind than a public function's annotations say."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.util.validation import checked

if TYPE_CHECKING:
    import xarray as xr


@checked
def asked(
    system: sb.System | None,
    dataset: xr.Dataset | None = None,
    *,
    count: int = 3,
    share: float = 0.5,
    loud: bool = False,
    names: Sequence[str] = (),
    between: tuple[float, float] = (0.0, 1.0),
    report: Callable[[int], object] | None = None,
    unknown: SomethingElse = None,  # noqa: F821
):
    """What a public function may look like."""
    return count


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"system": 3}, "system = 3: must be System or None, not int"),
        ({"dataset": "map.nc"}, "dataset = 'map.nc': must be Dataset or None, not str"),
        ({"count": "3"}, "count = '3': must be a number, not str"),
        ({"share": None}, "share = None: must be a number, not NoneType"),
        ({"loud": 1}, "loud = 1: must be True or False"),
        ({"names": "abc"}, "names = 'abc': must be a sequence, not str"),
        ({"between": 0.3}, "between = 0.3: must be two numbers, not float"),
        ({"report": 3}, "report = 3: must be callable or None, not int"),
    ],
)
def test_another_kind_is_refused_by_name(given, words):
    """The message names the parameter, the value and what it must be."""
    with pytest.raises(sb.InputTypeError) as refusal:
        asked(**{"system": None} | given)
    assert str(refusal.value).startswith(words)


def test_what_suits_or_cannot_be_told_passes():
    """Numbers of NumPy, lists and tuples, None where it may be; an annotation that cannot be read refuses nothing."""
    assert asked(None, count=np.int64(4), share=np.float32(0.1), names=["a"], unknown=object()) == 4
    assert asked(None, names=("a",), report=print, share=np.array(0.2), between=[0.1, 0.2]) == 3
    assert asked(None, between=np.array([0.1, 0.2])) == 3


def test_missing_arguments_are_pythons_own_error():
    """As of any function."""
    with pytest.raises(TypeError, match=r"asked\(\) missing 1 required positional argument: .system"):
        asked()
