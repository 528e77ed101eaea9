"""How sure is a point: repeats of every run with slightly different starts and with a finer step.

Where neighbouring starts give different classes, the class is a matter of chance; where they agree, it
is a property of the system.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from snapbeam.model.state import State, rest_state
from snapbeam.model.system import System
from snapbeam.util.validation import InputError, flag, integer, positive

__all__ = ["MEASURING_ERROR", "Replicates", "perturbed_start"]


MEASURING_ERROR = 12e-6 / 12.0**0.5
"""Error of a position read to one pixel of the paper's camera, 12 um: the rms of rounding to a pixel, m."""


@dataclass(frozen=True)
class Replicates:
    """Repeats of every point of a map.

    Attributes
    ----------
    count : int
        Repeats with a changed start, beside the run from rest.
    perturbation_rms : float
        Root mean square of the change of the centre displacement, m.
    check_half_step : bool
        One repeat more, from rest with every step halved.
    seed : int
        Chooses the changes.
    """

    count: int
    perturbation_rms: float = MEASURING_ERROR
    check_half_step: bool = False
    seed: int = 0

    def __post_init__(self) -> None:
        integer("replicas", self.count, 0, 10_000)
        flag("check_half_step", self.check_half_step)
        positive("perturbation_rms", self.perturbation_rms, "m")
        integer("replicate_seed", self.seed, 0, 2**63 - 1)
        if self.count == 0 and not self.check_half_step:
            raise InputError("replicas = 0: must be at least 1, or with the step halved")

    @property
    def runs(self) -> int:
        """Runs of each point, the one from rest included."""
        return 1 + self.count + int(self.check_half_step)


def perturbed_start(system: System, replicas: Replicates, repeat: int, state: State | None = None) -> State:
    """The start of one repeat: a beam that still rings faintly in all its modes, the same for every point of a map.

    It is added to *state*, or a batch of states, or else to the system's own start.

    Each linear mode gets a normally distributed displacement and velocity of equal mean energy,
    q_j ~ N(0, s/omega_j) and q_j' ~ N(0, s), with s such that the displacement of the centre has the
    root mean square asked for.
    """
    model = system.model
    rest = state if state is not None else system.initial_state
    if rest is None:
        rest = rest_state(model, system.striker)
    sign = -1.0 if system.striker is not None and system.striker.side == "above" else 1.0
    moving = model.omega > 0.0
    per_unit = np.where(moving, 1.0 / np.where(moving, model.omega, 1.0), 0.0)
    reach = float(np.sqrt(np.sum(((model.midspan_shape @ model.linear_modes) * per_unit) ** 2)))
    if reach == 0.0:
        raise InputError("replicas: no mode moves the centre, so its start cannot be changed")
    speed = replicas.perturbation_rms / reach
    generator = np.random.Generator(np.random.Philox(key=[replicas.seed, repeat]))
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
