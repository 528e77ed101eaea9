"""Decays whose damping depends on amplitude by laws of many kinds, and what is made of them.

``python tests/lab/random_damping.py COUNT [SEED [SHORTEST LONGEST]]`` prints the coverage of two standard errors of the damping
ratio at zero amplitude; no rule was set with the seeds 921 and 7007.
"""

from __future__ import annotations

import sys
from collections import Counter

import numpy as np
from scipy.integrate import cumulative_trapezoid

from snapbeam.lab import identify_decay, make_signal

LAWS = {
    "viscous": lambda a, _: 0.0 * a,
    "exponential": lambda a, scale: -np.expm1(-a / scale),
    "root": lambda a, _: np.sqrt(a),
    "rational": lambda a, scale: a / (a + scale),
    "tanh": lambda a, scale: np.tanh(a / scale),
    "logarithm": lambda a, scale: np.log1p(a / scale),
    "drag": lambda a, _: a,
    "cubic": lambda a, _: a * a,
    "power": lambda a, scale: a ** (0.5 + scale),
}


def decay(rng, law, span=(3.0, 6.0)):
    """A noisy decay damped by *law*, its damping ratio and frequency at zero amplitude; its length lies in *span*.

    The unit of length is the time constant at zero amplitude.
    """
    freq, zeta = rng.uniform(50.0, 150.0), float(np.exp(rng.uniform(np.log(0.002), np.log(0.008))))
    scale, rise = float(np.exp(rng.uniform(np.log(0.15), np.log(1.0)))), rng.uniform(0.3, 2.0)
    omega, rate = 2.0 * np.pi * freq, 5000.0
    a = np.exp(np.linspace(0.0, -16.0, 20_000))
    shape = LAWS[law](a, scale)
    damping = zeta * (1.0 + rise * shape / max(shape[0], 1e-9))
    clock = cumulative_trapezoid(1.0 / (omega * damping), -np.log(a), initial=0.0)
    time = np.arange(int(rng.uniform(*span) / (omega * zeta) * rate)) / rate
    fall = np.exp(np.interp(time, clock, np.log(a)))
    soft = rng.uniform(0.0, 0.02)
    turn = omega * np.sqrt(1.0 - zeta**2) * (
        time - soft * cumulative_trapezoid(fall**2, time, initial=0.0)
    ) + rng.uniform(-3.0, 3.0)
    noise = 10.0 ** (-rng.uniform(20.0, 50.0) / 20.0) / np.sqrt(2.0)
    values = fall * np.cos(turn) + noise * rng.standard_normal(time.size)
    return make_signal(values, "m", rate), zeta, freq


def judged(seed, k, span=(3.0, 6.0)):
    """Law of record *k*; errors of damping ratio and frequency in standard errors, that of damping over it; codes."""
    law = tuple(LAWS)[k % len(LAWS)]
    signal, zeta, freq = decay(np.random.default_rng((seed, k)), law, span)
    fit = identify_decay(signal)
    mode = fit.modes[0]
    off = (mode.damping_ratio - zeta) / mode.damping_ratio_se
    other = (mode.natural_frequency - freq) / mode.natural_frequency_se
    codes = [one.code.partition(".")[2] for one in fit.diagnostics]
    return law, off, other, mode.damping_ratio_se / zeta, mode.damping.name, codes


if __name__ == "__main__":
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else 921
    span = tuple(map(float, sys.argv[3:5])) or (3.0, 6.0)
    found = [judged(seed, k, span) for k in range(int(sys.argv[1]))]
    for law in (*LAWS, ""):
        mine = [one for one in found if law in ("", one[0])]
        off = np.abs([one[1:3] for one in mine])
        print(f"{law or 'all':12} {len(mine)} within two errors: damping {(off[:, 0] < 2.0).mean():.3f} frequency "
              f"{(off[:, 1] < 2.0).mean():.3f}; largest {off.max(0).round(1)}; error over damping, median "
              f"{np.median([one[3] for one in mine]):.3f} {dict(Counter(one[4] for one in mine))} "
              f"{dict(Counter(code for one in mine for code in one[5]))}")  # fmt: skip
