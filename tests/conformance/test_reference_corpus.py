"""Statistics of random runs of every system are the recorded ones within their conditioning, and so is the interface."""

from __future__ import annotations

import numpy as np
import pytest
import recorded_interface
import reference_corpus as rc

CASES = list(enumerate(rc.cases()))


@pytest.mark.parametrize("accuracy", ["standard", "reference"])
@pytest.mark.parametrize(("number", "case"), CASES, ids=[case.name for _, case in CASES])
def test_statistics(number: int, case: rc.Case, accuracy: str) -> None:
    lines, compared = rc.differences(case, number, accuracy)
    assert lines == []
    assert compared > 20


def test_a_difference_is_named() -> None:
    """A statistic that is off by a hundredth of a per cent at level reference."""
    number, case = CASES[0]

    class Off(rc.Case):
        def statistics(self, accuracy: str, *more: float, **named: float) -> dict[str, np.ndarray]:
            found = super().statistics(accuracy, *more, **named)
            return found | {"peak_force": found["peak_force"] * (1.0 + 1e-4)}

    lines, _ = rc.differences(Off(*case), number, "reference")
    assert lines and all("peak_force" in line for line in lines)


def test_most_is_compared() -> None:
    with np.load(rc.DATA) as file:
        shares = [np.isfinite(file[f"{number} reference"]).mean() for number, _ in CASES]
    assert np.mean(shares) > 0.9


def test_quick_interface() -> None:
    """Signatures, options and statistics."""
    changed = recorded_interface.differences(recorded_interface.QUICK_PARTS)
    assert not changed, "\n".join(changed)


@pytest.mark.slow
def test_interface() -> None:
    """Dataset schemas and printed results too."""
    changed = recorded_interface.differences()
    assert not changed, "\n".join(changed)
