"""What a decay identification returns, and the law of a softening mode it rests on.

With linear damping the action of a free oscillation falls as exp(-2 zeta omega_0 t).  A mode about a well
of a bistable beam softens: at amplitude a its frequency is

    f(a) = f_0 (1 - kappa a^2 - q kappa^2 a^4),
    a(t) = a_0 E (1 + r kappa a_0^2 E^2),    E = exp(-zeta omega_0 t),

and kappa = 0.75/b^2 for the displacement of one mode with two wells at -b and b.  The exact orbits of that
oscillator give q = 17/12 and r = 1/3 with a measured by the square root of the action (r = -2/3 for the
velocity); a real beam has other values of the same size.  So both are fitted with a prior, wide enough to
hold 0 as well, and what is not known about them is in the standard errors.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.findings import Diagnostic, doubtful
from snapbeam.lab.decay.drift import Line
from snapbeam.lab.decay.poles import Stabilisation

__all__ = ["DecayFit", "ModeEstimate", "law_priors"]

_Array = NDArray[np.float64]


@dataclass(frozen=True)
class ModeEstimate:
    """One mode of a free decay, as one method sees it.

    ``natural_frequencies`` [Hz] at zero amplitude and ``damping_ratio``, with standard errors; ``amplitude`` at
    the start of the analysed part, in the unit of the signal; ``softening`` kappa in f = natural_frequencies (1 -
    kappa a^2), per squared unit of the signal, where a is the amplitude of the first mode.  ``law`` is how it
    is damped, "viscous", "dry" or "quadratic", the latter two beside viscous damping and ``law_strength``
    times as strong at the start; the damping ratio is that of the viscous part.
    """

    natural_frequencies: float
    natural_frequencies_se: float
    damping_ratio: float
    damping_ratio_se: float
    amplitude: float
    amplitude_se: float
    phase: float
    softening: float
    softening_se: float
    method: str
    law: str = "viscous"
    law_strength: float = 0.0
    law_strength_se: float = 0.0


@dataclass(frozen=True)
class DecayFit:
    """The modes of a free decay, strongest first, with what is needed to judge and to draw the result.

    ``snr`` [dB] is that of the first mode at the start; ``backbone_amplitude`` and ``backbone_frequency`` [Hz],
    with ``backbone_frequencies_se``, are the amplitude and frequency of the first mode over successive parts of
    the decay; ``envelope_time``, ``envelope`` its amplitude cycle by cycle; ``residual_whiteness`` the
    noise near the first mode over the noise elsewhere; ``misfit`` what the fit leaves at the first mode over
    what the noise about it explains, 1 if the model says it all.  ``lines`` are sines that do not decay, taken
    out; ``poles`` the stabilisation diagram, where one was needed; ``diagnostics`` what makes the result doubtful.
    """

    modes: tuple[ModeEstimate, ...]
    noise_rms: float
    snr: float
    start: float
    stop: float
    units: str
    residual_whiteness: float
    misfit: float
    lines: tuple[Line, ...]
    poles: Stabilisation | None = field(repr=False)
    diagnostics: tuple[Diagnostic, ...]
    backbone_amplitude: _Array = field(repr=False)
    backbone_frequency: _Array = field(repr=False)
    backbone_frequencies_se: _Array = field(repr=False)
    envelope_time: _Array = field(repr=False)
    envelope: _Array = field(repr=False)

    @property
    def notes(self) -> tuple[str, ...]:
        """The diagnostics that make the result doubtful, in words."""
        return tuple(one.message for one in doubtful(self.diagnostics))

    @property
    def natural_frequencies(self) -> float:
        """Natural frequency of the first mode at zero amplitude [Hz]."""
        return self.modes[0].natural_frequencies

    @property
    def damping_ratio(self) -> float:
        """Damping ratio of the first mode."""
        return self.modes[0].damping_ratio

    def summary(self) -> dict[str, Any]:
        """The figures as plain numbers and words, for a table or a JSON file."""
        names = (
            "natural_frequencies",
            "natural_frequencies_se",
            "damping_ratio",
            "damping_ratio_se",
            "amplitude",
            "amplitude_se",
            "softening",
            "softening_se",
            "law_strength",
            "law_strength_se",
        )
        return {
            "method": self.modes[0].method,
            "units": self.units,
            "modes": [
                {"law": mode.law, **{name: float(getattr(mode, name)) for name in names}}
                for mode in self.modes
            ],
            "noise_rms": self.noise_rms,
            "snr_db": self.snr,
            "start_s": self.start,
            "stop_s": self.stop,
            "residual_whiteness": self.residual_whiteness,
            "misfit": self.misfit,
            "lines_hz": [line.frequency for line in self.lines],
            "diagnostics": [one.plain() for one in self.diagnostics],
        }


def law_priors(units: str) -> dict[str, tuple[float, float]]:
    """Mean and standard deviation of q and r for a displacement, or for a velocity or acceleration."""
    if units in ("m/s", "m/s^2"):
        return {"q": (0.7, 0.7), "r": (-1.0 / 3.0, 1.0 / 3.0)}
    return {"q": (0.7, 0.7), "r": (1.0 / 6.0, 1.0 / 6.0)}
