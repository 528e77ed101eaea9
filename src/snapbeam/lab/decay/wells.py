"""Whether the two wells of a beam have one natural frequency.

The paper tests both and finds 81.3 and 80.5 Hz (section 2).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from snapbeam.core.validate import nonnegative, positive
from snapbeam.lab.decay.model import DecayFit

__all__ = ["WellComparison", "compare_wells"]


@dataclass(frozen=True)
class WellComparison:
    """The natural frequencies [Hz] of the two wells, their difference, and whether they agree."""

    lower: float
    upper: float
    difference: float
    difference_se: float | None
    relative: float

    @property
    def agree(self) -> bool | None:
        """Whether the difference is within two standard errors; None if none were given."""
        return None if self.difference_se is None else abs(self.difference) <= 2.0 * self.difference_se

    @property
    def statement(self) -> str:
        """The comparison in words."""
        text = (
            f"wells at {self.lower:.5g} and {self.upper:.5g} Hz differ by {abs(self.difference):.3g} Hz "
            f"({abs(self.relative):.2%} of their mean)"
        )
        if self.difference_se is not None:
            text += f", standard error {self.difference_se:.2g} Hz"
        if self.agree:
            return text + ": equal within two standard errors"
        return text + ": the symmetric model has one frequency for both and cannot show this difference"


def compare_wells(
    lower: DecayFit | float,
    upper: DecayFit | float,
    lower_se: float | None = None,
    upper_se: float | None = None,
) -> WellComparison:
    """Compare the first natural frequency about the two wells.

    Parameters
    ----------
    lower, upper : DecayFit or float
        Decays about either well, or their frequencies [Hz].
    lower_se, upper_se : float, optional
        Standard errors of frequencies given as numbers.
    """
    values, errors = [], []
    for name, well, se in (("lower", lower, lower_se), ("upper", upper, upper_se)):
        if isinstance(well, DecayFit):
            values.append(well.natural_frequencies)
            errors.append(well.modes[0].natural_frequencies_se)
        else:
            values.append(positive(name, well, "Hz"))
            errors.append(math.nan if se is None else nonnegative(f"{name}_se", se, "Hz"))
    difference = values[0] - values[1]
    error = math.hypot(*errors)
    return WellComparison(
        lower=values[0],
        upper=values[1],
        difference=difference,
        difference_se=error if math.isfinite(error) else None,
        relative=difference / (0.5 * (values[0] + values[1])),
    )
