"""The modal equations as plain numbers, for peers that build their own right-hand side from expressions."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.cases import CONTACT, Case

__all__ = ["Equations", "equations_of"]

_Array = NDArray[np.float64]


class Equations(NamedTuple):
    """q'' = -omega^2 q - 2 zeta omega q' - gamma [(q.Gq) g + (2 g.q + q.Gq) Gq] + c f, q over *scale*."""

    omega: _Array
    damping_ratio: _Array
    tension: _Array
    """G."""
    parity: NDArray[np.int_]
    g: _Array
    """g / scale."""
    contact: _Array
    """c scale: contact displacement, m, per unit of the state."""
    push: _Array
    """c / scale: acceleration of the state by a unit force."""
    gamma: float
    """gamma scale^2."""
    stiffness: float
    amplitude: float
    """Of the shaker, m."""
    drive: float
    """Angular frequency of the shaker, rad/s."""
    read_out: _Array
    """Displacement of the contact point from rest, b, per unit of the state."""


def equations_of(case: Case) -> Equations:
    """The equations of *case* about the well at rest, where q = 0 and the shaker is in touch."""
    model, shaker = case.model, case.shaker
    row = model.linear_modes.T @ model.shape_at(case.location)
    assert model.length_scale is not None
    scale = float(model.length_scale / np.abs(row).max())
    omega = 2.0 * np.pi * shaker.frequency_ratio * model.reference_frequency
    speed = shaker.velocity_amplitude * model.length_scale * 2.0 * np.pi * model.reference_frequency
    return Equations(
        omega=np.asarray(model.omega),
        damping_ratio=np.asarray(model.damping_ratio),
        tension=np.asarray(model.tension_matrix),
        parity=model.parity,
        g=np.asarray(model.linear_modes.T @ model.well_amplitude) / scale,
        contact=row * scale,
        push=row / scale,
        gamma=model.nonlinear_stiffness * scale**2,
        stiffness=CONTACT.stiffness,
        amplitude=speed / omega,
        drive=omega,
        read_out=scale * case.at_contact,
    )
