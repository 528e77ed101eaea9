"""Contact stress: Hertzian pressure, onset of yield, bending of the beam."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.util.diagnostics import Diagnostic
from snapbeam.util.validation import (
    InputError,
    InputTypeError,
    checked,
    finite_array,
    integer,
    nonnegative,
    positive,
    shown,
)

_Array = NDArray[np.float64]
_YIELD = 1.60
"""Maximum pressure over the yield stress at which a sphere on a flat first yields, below the surface (nu = 0.3)."""


@dataclass(frozen=True)
class HertzStress:
    """Stress state of a sphere pressed on a flat by a given force.

    Attributes
    ----------
    pressure : float
        Maximum pressure p_0, in the middle of the contact, Pa.
    contact_radius : float
        Radius of the circle of contact, m.
    yield_force : float or None
        Force at which the softer of the two begins to yield, N; None without a yield stress.
    """

    pressure: float
    contact_radius: float
    yield_force: float | None
    force: float

    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """Diagnostic if the force exceeds the elastic limit."""
        if self.yield_force is None or self.force <= self.yield_force:
            return ()
        return (
            Diagnostic(
                "contact-yields",
                f"the contact force of {self.force:.3g} N presses with {1e-9 * self.pressure:.3g} GPa, beyond the "
                f"onset of yield at {self.yield_force:.3g} N: Hertz's law is elastic, and the contact is softer "
                "and loses energy",
                {"pressure": self.pressure, "yield_force": self.yield_force},
            ),
        )


def _held(value: Callable[[], float]) -> float:
    try:
        found = value()
    except (OverflowError, ZeroDivisionError):
        found = math.inf
    if not math.isfinite(found):
        raise InputError("force, stiffness, radius, yield_stress: their stress is more than a number holds")
    return found


def hertz_stress(force: float, stiffness: float, radius: float, yield_stress: float | None = None) -> HertzStress:
    """Pressure of a sphere on a flat under Hertz's law.

    With E* = 3 k_c/(4 sqrt(R)) the pressure is p_0 = (6 F E*^2/(pi^3 R^2))^(1/3) and the circle of contact has the
    radius (3 F R/(4 E*))^(1/3); the onset of yield is at p_0 = 1.60 times the yield stress (Johnson, Contact
    Mechanics, 1985, chapters 4 and 6, for a Poisson ratio of 0.3).

    Parameters
    ----------
    force : float
        F, N, such as ``run.summary.peak_force``.
    stiffness : float
        k_c, N/m^1.5.
    radius : float
        Radius of the sphere, m.
    yield_stress : float, optional
        Yield stress of the softer of the two, Pa.

    See Also
    --------
    snapbeam.model.bending_stress, snapbeam.HertzContact
    """
    force, radius = nonnegative("force", force, "N"), positive("radius", radius, "m")
    modulus = 0.75 * positive("stiffness", stiffness, "N/m^1.5") / math.sqrt(radius)
    limit = None
    if yield_stress is not None:
        pressure = _YIELD * positive("yield_stress", yield_stress, "Pa")
        limit = _held(lambda: math.pi**3 * radius**2 * pressure**3 / (6.0 * modulus**2))
    return HertzStress(
        pressure=_held(lambda: (6.0 * force * modulus**2 / (math.pi**3 * radius**2)) ** (1.0 / 3.0)),
        contact_radius=_held(lambda: (0.75 * force * radius / modulus) ** (1.0 / 3.0)),
        yield_force=limit,
        force=force,
    )


@checked
def bending_stress(model: Any, amplitude: ArrayLike, count: int = 201) -> _Array:
    """Maximum bending stress along the beam, E (h/2) max abs(w''), Pa, of amplitudes of shape (..., N), shape (...).

    Bending stress of a beam made straight; the axial stress is not included.

    See Also
    --------
    snapbeam.model.hertz_stress
    """
    if not hasattr(model, "beam"):
        raise InputTypeError(f"model = {shown(model)}: must be a ReducedModel")
    beam = model.beam
    if beam is None:
        raise InputError("model: a structure given by matrices has no curvature; give a model made from a beam")
    alpha = finite_array("amplitude", amplitude)
    if alpha.shape[-1:] != (model.modes,):
        raise InputError(f"amplitude of shape {alpha.shape}: must have the shape (..., {model.modes})")
    places = np.linspace(0.0, beam.length, integer("count", count, 2, 10**6))
    shapes = beam.buckling_modes(model.modes).curvature(places)
    found: _Array = 0.5 * beam.young_modulus * beam.thickness * np.abs(alpha @ shapes).max(axis=-1)
    return found
