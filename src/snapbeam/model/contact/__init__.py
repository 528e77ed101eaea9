"""Contact laws, one per module; importing the package registers all of them in ``LAWS``."""

from snapbeam.model.contact import (  # noqa: F401
    elastic_plastic,
    hertz,
    hunt_crossley,
    kelvin_voigt,
    layered_hertz,
    power_law,
    restitution,
)
