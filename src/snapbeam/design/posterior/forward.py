"""The frequencies that a beam would show, beside those that were measured."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.validate import InputError
from snapbeam.lab.calibration.measurements import Measurements
from snapbeam.model.beam import Beam
from snapbeam.model.galerkin.reduction import ReducedModel

__all__ = ["Forward"]

_Array = NDArray[np.float64]
_STATES = ("straight", "lower_well", "upper_well")


@dataclass(frozen=True, eq=False)
class Forward:
    """From a beam to every measured frequency, in the order in which they are listed.

    Raises
    ------
    InputError
        If no frequency was measured, one has no standard error, or there are more than the model has modes.
    """

    measured: Measurements
    modes: int

    def __post_init__(self) -> None:
        for state in _STATES:
            values, errors = (
                getattr(self.measured, f"{state}_frequencies"),
                getattr(self.measured, f"{state}_frequencies_se"),
            )
            if values and errors is None:
                raise InputError(
                    f"{state}_frequencies_se: is needed; without standard errors nothing can be said of the rest"
                )
            if len(values) > self.modes:
                raise InputError(f"{state}_frequencies: {len(values)} frequencies for a model of {self.modes} modes")
        if not self.target.size:
            raise InputError("measured: has no frequency")

    def _listed(self, ending: str) -> _Array:
        parts: list[Any] = [getattr(self.measured, f"{state}_frequencies{ending}") or () for state in _STATES]
        return np.concatenate([np.asarray(part, dtype=np.float64) for part in parts])

    @property
    def target(self) -> _Array:
        """Measured frequencies, Hz."""
        return self._listed("")

    @property
    def errors(self) -> _Array:
        """Their standard errors, Hz."""
        return self._listed("_se")

    def frequencies(self, beam: Beam) -> _Array:
        """Those of a beam, Hz."""
        found = []
        for state in _STATES:
            count = len(getattr(self.measured, f"{state}_frequencies"))
            if not count:
                continue
            own = beam.replace(axial_load=0.0) if state == "straight" else beam
            model = ReducedModel.from_beam(own, self.modes)
            shapes = getattr(self.measured, f"{state}_shape", ())
            if not shapes:
                found += model.natural_frequencies[:count].tolist()
                continue
            seen = {1: 0, -1: 0}
            for shape in shapes:
                parity = 1 if shape == "symmetric" else -1
                found.append(float(model.natural_frequencies[model.parity == parity][seen[parity]]))
                seen[parity] += 1
        return np.array(found)

    def misfit(self, beam: Beam) -> _Array:
        """(model - measured)/standard error of each."""
        return (self.frequencies(beam) - self.target) / self.errors
