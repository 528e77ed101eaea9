"""Which of the modes about a well is meant: symmetric and antisymmetric ones change places at b/r = 6.2."""

from __future__ import annotations

from snapbeam.core.findings import Diagnostic
from snapbeam.lab.calibration.measurements import Measurements
from snapbeam.lab.plausibility.calibration import KINDS
from snapbeam.model.beam import Beam
from snapbeam.model.galerkin.reduction import ReducedModel

__all__ = ["either_well", "shape_findings"]

_CROSSING = 0.05  # share within which the first two frequencies may be in the other order


def shape_findings(beam: Beam, measured: Measurements, modes: int) -> list[Diagnostic]:
    """Whether the order of the modes about a well is in doubt where nothing else tells them apart."""
    told = [measured.lower_well_shape, measured.upper_well_shape]
    given = [freq for freq in (measured.lower_well_frequencies, measured.upper_well_frequencies) if freq]
    if modes < 2 or any(told) or not given:
        return []
    model = ReducedModel.from_beam(beam, modes)
    if not (model.parity > 0).any():  # unequal ends: no mode is either
        return []
    symmetric = float(model.natural_frequencies[model.parity > 0][0])
    other = model.natural_frequencies[model.parity < 0]
    if not other.size:
        return []
    antisymmetric = float(other[0])
    if antisymmetric < symmetric:
        return [KINDS["antisymmetric"].found(frequency=antisymmetric)]
    if symmetric > (1.0 - _CROSSING) * antisymmetric:
        return [KINDS["crossing"].found(symmetric=symmetric, antisymmetric=antisymmetric)]
    return []


def either_well(beam: Beam, measured: Measurements, modes: int) -> tuple[float, ...]:
    """Buckling level [m] that the first symmetric frequency of each well alone asks for; empty if they agree."""
    from scipy.optimize import newton

    goals = []
    for state in ("lower_well", "upper_well"):
        values, shapes = getattr(measured, f"{state}_frequencies"), getattr(measured, f"{state}_shape")
        fitting = (
            [f for f, shape in zip(values, shapes, strict=True) if shape == "symmetric"] if shapes else values
        )
        goals += list(fitting[:1])
    if len(goals) < 2 or goals[0] == goals[1]:
        return ()
    level, levels = beam.buckling_level, []

    def symmetric(at: float) -> float:
        model = ReducedModel.from_beam(beam.replace(buckling_level=abs(at) * level), modes)
        own = (
            model.natural_frequencies[model.parity > 0]
            if (model.parity > 0).any()
            else model.natural_frequencies
        )
        return float(own[0])

    here = symmetric(1.0)
    for goal in goals:

        def miss(factor: float, goal: float = goal) -> float:
            return symmetric(factor) / goal - 1.0

        try:
            levels.append(level * float(newton(miss, 1.0, x1=goal / here + 1e-6, tol=1e-7, maxiter=12)))
        except RuntimeError:  # no level gives that frequency
            return ()
    return tuple(levels)
