"""Replicates of runs with perturbed initial conditions and with half the step.

If the replicates of a point have different response classes, its class is a matter of chance.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from snapbeam.model.state import State
from snapbeam.model.system import System
from snapbeam.util.validation import InputError, flag, integer, positive

MEASURING_ERROR = 12e-6 / 12.0**0.5
"""Standard deviation of a position that is rounded to one pixel of the paper's camera (12 um), in m."""


@dataclass(frozen=True)
class Replicates:
    """Replicates of every point of a sweep.

    Attributes
    ----------
    count : int
        Number of replicates with a perturbed initial condition, in addition to the unperturbed run.
    perturbation_rms : float
        Root mean square of the perturbation of the mid-span displacement, m.
    check_half_step : bool
        Add a run with the unperturbed initial condition and half the step.
    seed : int
        Seed of the random perturbations.

    See Also
    --------
    snapbeam.sweep, snapbeam.perturbation_growth

    Examples
    --------
    >>> import snapbeam as sb
    >>> replicates = sb.Replicates(count=8, seed=1)
    """

    count: int
    perturbation_rms: float = MEASURING_ERROR
    check_half_step: bool = False
    seed: int = 0

    def __post_init__(self) -> None:
        integer("replicates", self.count, 0, 10_000)
        flag("check_half_step", self.check_half_step)
        positive("perturbation_rms", self.perturbation_rms, "m")
        integer("replicate_seed", self.seed, 0, 2**63 - 1)
        if self.count == 0 and not self.check_half_step:
            raise InputError("replicates = 0: must be at least 1; or set check_half_step = True")

    @property
    def runs(self) -> int:
        """Runs of each point, the unperturbed run included."""
        return 1 + self.count + int(self.check_half_step)


def perturbed_start(system: System, replicates: Replicates, repeat: int, state: State | None = None) -> State:
    """Return the perturbed initial condition of one replicate; the perturbation is the same at every point of a sweep.

    The perturbation is added to *state*, which may be a batch, or to the initial condition of the system.  Each
    linear mode gets a normally distributed displacement and velocity of equal mean energy, q_j ~ N(0, s/omega_j) and
    q_j' ~ N(0, s).  The factor s gives the mid-span displacement its root mean square, ``perturbation_rms``.
    """
    model = system.struck_model
    rest = state if state is not None else system.start_state
    sign = -1.0 if system.striker is not None and system.striker.side == "above" else 1.0
    moving = model.omega > 0.0
    per_unit = np.where(moving, 1.0 / np.where(moving, model.omega, 1.0), 0.0)
    reach = float(np.sqrt(np.sum(((model.midspan_shape @ model.linear_modes) * per_unit) ** 2)))
    if reach == 0.0:
        raise InputError("replicates: no mode of this model moves the mid-span; use another model, or no replicates")
    speed = replicates.perturbation_rms / reach
    generator = np.random.Generator(np.random.Philox(key=[replicates.seed, repeat]))
    q, velocity = generator.standard_normal((2, model.modes)) * speed
    return dataclasses.replace(
        rest,
        amplitude=rest.amplitude + sign * (model.linear_modes @ (q * per_unit)),
        velocity=rest.velocity + sign * (model.linear_modes @ velocity),
        contact_time=np.array(np.nan),
        tangent=None,
        statistics=None,
        modal=None,
    )
