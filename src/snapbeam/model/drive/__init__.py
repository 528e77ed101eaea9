"""Motions of strikers and bases in ``DRIVES``, forces in ``FORCES``; importing the package registers all of them."""

from snapbeam.model.drive import (  # noqa: F401, I001  the order of DRIVES
    burst,
    chirp,
    constant_velocity,
    half_sine,
    noise,
    recorded_acceleration,
    recorded_motion,
    random_vibration,
    shock,
    sine,
    fixed_stop,
    force,
    sum,
)
