"""Energy criterion of early termination: the energy that a beam in the second well needs to leave it."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.model.equilibria import least_energy_through, pinned_load
from snapbeam.model.reduced_model import ReducedModel

# Energy kept in hand, as a share of the barrier.  The energy error of a damped free flight at the default step
# was measured as at most 1.2e-4 of it over 8 cycles, in which damping takes a thousand times as much; undamped,
# with random motion in all of 32 modes, as at most 5e-4.
RESERVE = 2e-3
_ITERATIONS = 100
_RESOLVED = 1e-11
"""Tolerance of Newton's last step, over the first critical load; the bound is flat there."""


def least_energy_at(model: ReducedModel, location: ArrayLike, displacement: ArrayLike) -> NDArray[np.float64]:
    """Minimum potential energy, J, 0 for the straight beam, of any shape through a point x_s in (0, 1), r (m).

    With c_i = phi_i(x_s) and S_1(Lambda) = sum c_i^2/(E I k_i^2 - Lambda), the minimum energy of a shape with w(x_s) =
    r is the maximum value of

        r^2/(2 S_1(Lambda)) - (P - Lambda)^2/(4 gamma)

    over Lambda below the first zero of S_1: Lagrange duality with the tension as the multiplier, and no gap, since the
    energy is convex in the shape once the tension is fixed below the load that buckles the beam pinned at x_s.  Any
    Lambda gives a valid lower bound.
    """
    x, r = np.broadcast_arrays(np.asarray(location, float), np.asarray(displacement, float))
    places, which = np.unique(x.ravel(), return_inverse=True)
    squares = np.array([model.shape_at(float(place)) ** 2 for place in places])
    k0, gamma = np.asarray(model.stiffness), model.nonlinear_stiffness
    pinned = np.array([pinned_load(square, k0) for square in squares])[which]
    squares, heights = squares[which], r.ravel() ** 2

    # the root of the slope of a concave function, by Newton's method inside a bracket; mu = Lambda - P
    high = pinned
    scale = np.abs(k0[0]) + 2.0 * np.sqrt(gamma * heights * np.abs(k0).max())
    low = np.minimum(-4.0 * scale, high - 4.0 * scale)
    resolved = _RESOLVED * scale
    mu = np.minimum(0.0, 0.5 * (low + high))
    for _ in range(_ITERATIONS):
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = 1.0 / (k0 - mu[:, None])
            terms = squares * inverse
            first, terms = terms.sum(axis=1), terms * inverse
            second, third = terms.sum(axis=1), (terms * inverse).sum(axis=1)
            steepness = second / first**2
            slope = -0.5 * heights * steepness - 0.5 * mu / gamma
            curvature = heights * (first * steepness**2 - third / first**2) - 0.5 / gamma
            new = mu - slope / curvature
        low, high = np.where(slope > 0.0, mu, low), np.where(slope > 0.0, high, mu)
        new = np.where((low <= new) & (new <= high), new, 0.5 * (low + high))
        done = bool(np.all(np.abs(new - mu) <= resolved))
        mu = new
        if done:
            break
    with np.errstate(divide="ignore", invalid="ignore"):
        held = 0.5 * heights / np.sum(squares / (k0 - mu[:, None]), axis=1)
    value: NDArray[np.float64] = np.where(heights > 0.0, held, 0.0) - mu * mu / (4.0 * gamma)
    # at the pinned load itself the sum vanishes, and what is rounding there must not pass for a bound
    return np.where(np.isfinite(value), value, -np.inf).reshape(x.shape)


def passed_heights(
    model: ReducedModel, location: NDArray[np.float64], highest: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Height of the contact point, m, above which early termination applies to a run in the second well.

    The tip's highest position, or that of the saddle between the wells if it is higher: to come down to the tip
    the beam must pass it.
    """
    if model.landscape is None or model.landscape.saddle is None:
        return np.maximum(highest, 0.0)
    places, which = np.unique(location, return_inverse=True)
    saddle = np.array([float(model.shape_at(float(x)) @ model.landscape.saddle.amplitude) for x in places])[which]
    return np.maximum(highest, saddle)


def crossing_energy(model: ReducedModel) -> float:
    """Energy, J, that a beam needs at least for its centre to pass from one well to the other."""
    if model.landscape is None or model.transverse_force is None or model.stiffness.ndim > 1:
        return model.saddle_energy
    bound = least_energy_through(
        model.stiffness,
        model.nonlinear_stiffness,
        model.transverse_force,
        model.midspan_shape[None],
        np.array([model.dividing_height]),
    )
    return min(float(bound[0]), model.saddle_energy)


def decidable_energy(
    model: ReducedModel, location: NDArray[np.float64], highest: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Energy above the well below which a beam in the far well stays there for ever, J.

    Free flight only loses energy, and the shaker rises to *highest* (m) at most: with less than this energy
    the beam can neither pass the lowest saddle nor come down to the shaker.  -inf where that can never
    be said: the shaker rises above the well, or without a bound, or the structure is not a buckled beam.
    """
    if model.beam is None or not model.is_bistable:
        return np.full(location.shape, -np.inf)
    if model.landscape is not None:
        return _uneven_energy(model, location, highest)
    bounded = highest < np.inf
    reach = np.where(bounded, np.maximum(highest, 0.0), 0.0)
    barrier = model.saddle_energy
    limit = np.minimum(least_energy_at(model, location, reach), barrier)
    places, which = np.unique(location, return_inverse=True)
    well = np.abs(np.array([float(model.shape_at(float(x)) @ model.well_amplitude) for x in places]))[which]
    energy = limit - model.well_energy - RESERVE * (barrier - model.well_energy)
    return np.where(bounded & (reach < well), energy, -np.inf)


def _uneven_energy(
    model: ReducedModel, location: NDArray[np.float64], highest: NDArray[np.float64]
) -> NDArray[np.float64]:
    """The same of unequal wells, above the first of them."""
    assert model.landscape is not None and model.transverse_force is not None
    bounded = highest < np.inf
    reach = passed_heights(model, location, np.where(bounded, highest, 0.0))
    places, which = np.unique(location, return_inverse=True)
    shapes = np.array([model.shape_at(float(x)) for x in places])[which.ravel()]
    through = least_energy_through(model.stiffness, model.nonlinear_stiffness, model.transverse_force, shapes, reach)
    limit = np.minimum(through, crossing_energy(model))
    kept = RESERVE * (model.saddle_energy - model.landscape.deepest.energy)
    well = shapes @ model.landscape.upper.amplitude
    return np.where(bounded & (reach < well), limit - model.well_energy - kept, -np.inf)
