"""The threshold of a slow striker in closed form (Eq. 21)."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.model.beam import Beam
from snapbeam.util.validation import InputError, checked, finite_array

_OTHER = ("force", "base_excitation", "axial_load", "harvester")


def quasi_static_objection(attributes: Mapping[Hashable, Any]) -> str | None:
    """Reason why Eq. (21) does not describe the system of a dataset, given by its attributes; None if it does."""
    form = "the closed form of the quasi-static threshold (Eq. 21) is of a clamped beam with equal wells and no forces"
    for section in _OTHER:
        if (kind := attributes.get(f"{section}_type")) is not None:
            return f"{section} of type {kind!r}: {form}"
    return f"unequal wells: {form}" if "reference_well" in attributes else None


@checked
def quasi_static_threshold(
    location: ArrayLike, frequency_ratio: ArrayLike, beam: Beam | None = None
) -> NDArray[np.float64]:
    """Velocity amplitude V_QS1 at which a slow shaker carries one mode over the unstable equilibrium.

    Eq. (21), V_QS1 = Omega phi_1(x_s)/phi_1(1/2) = Omega (1 - cos 2 pi x_s)/2: the shaker's highest
    position reaches the straight beam.

    Parameters
    ----------
    location : array_like
        x_s, each in (0, 1).
    frequency_ratio : array_like
        Omega, each greater than 0, broadcast against *location*.
    beam : Beam, optional
        Buckled beam, if its ends turn; the first mode between clamps is the same for all.

    Returns
    -------
    array of the broadcast shape

    See Also
    --------
    snapbeam.threshold, snapbeam.sweep
    """
    x = finite_array("location", location)
    ratio = finite_array("frequency_ratio", frequency_ratio)
    if ((x <= 0.0) | (x >= 1.0)).any():
        bad = x[(x <= 0.0) | (x >= 1.0)].flat[0]
        raise InputError(f"location = {bad:g}: must lie in (0, 1)")
    if (ratio <= 0.0).any():
        raise InputError(f"frequency_ratio = {ratio[ratio <= 0.0].flat[0]:g}: must be greater than 0")
    try:
        np.broadcast_shapes(x.shape, ratio.shape)
    except ValueError:
        raise InputError(
            f"location of shape {x.shape}, frequency_ratio of shape {ratio.shape}: must go together"
        ) from None
    if beam is not None and not beam.is_buckled:
        raise InputError(
            f"beam with axial_load = {beam.axial_load:g} N: must be buckled, by more than {beam.critical_load:g} N; "
            "a beam that is not has no unstable equilibrium at 0 to be carried over"
        )
    if beam is not None and beam.boundary.is_elastic:
        shape = beam.buckling_modes(1).shape
        share = shape(x * beam.length)[0] / float(shape(0.5 * beam.length)[0])
        return np.asarray(ratio * share)
    threshold: NDArray[np.float64] = np.asarray(ratio * np.sin(np.pi * x) ** 2)
    return threshold
