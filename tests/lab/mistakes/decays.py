"""Mistakes in free decays, and what no one damping ratio describes."""

from __future__ import annotations

import numpy as np

from snapbeam.lab import identify_decay, make_signal

from .case import Case, Outcome, off

FREQ, ZETA, RATE = 81.0, 0.005, 5000.0
DECAY = "Free decays"
TIME = np.arange(5000) / RATE


def ringing(freq=FREQ, zeta=ZETA, time=TIME, phase=0.3):
    """A mode that rings from the start on."""
    own = 2.0 * np.pi * freq
    return np.exp(-zeta * own * time) * np.cos(own * np.sqrt(1.0 - zeta**2) * time + phase)


def hammer(rate=41_000.0):
    """A second of a hammer's impact on a plate: six modes, after a rest."""
    time = np.arange(int(rate)) / rate
    modes = (
        (81.0, 0.004, 0.3, 0.1), (220.0, 0.006, 1.0, 0.2), (433.0, 0.01, 0.8, 1.0), (712.0, 0.01, 1.2, 2.0),
        (1800.0, 0.004, 2.0, 1.0), (3700.0, 0.003, 1.5, 0.0),
    )  # fmt: skip
    ring = sum(share * ringing(freq, zeta, time, phase) for freq, zeta, share, phase in modes)
    return modes, np.concatenate([np.zeros(1500), ring])


def judged(values, *, noise=0.02, freq=FREQ, zeta=ZETA, units="m/s", **options):
    """The errors of the first mode, against what is true."""
    values = values + noise * np.random.default_rng(0).standard_normal(values.size)
    return outcome(make_signal(values, units, RATE), freq, zeta, **options)


def outcome(signal, freq, zeta, **options):
    fit = identify_decay(signal, **options)
    mode = fit.modes[0]
    ratio = max(
        off(mode.natural_frequency, freq, mode.natural_frequency_se),
        off(mode.damping_ratio, zeta, mode.damping_ratio_se),
    )
    return Outcome(fit.diagnostics, "", ratio)


def impact(folder):
    """Four modes asked of a hammer's impact; each must be one of the six."""
    modes, values = hammer()
    values = values + 0.02 * np.random.default_rng(0).standard_normal(values.size)
    fit = identify_decay(make_signal(values, "m/s", 41_000.0), modes=4)
    assert len(fit.modes) == 4
    ratio = 0.0
    for mode in fit.modes:
        freq, zeta, *_ = min(modes, key=lambda one: abs(one[0] - mode.natural_frequency))
        ratio = max(ratio, off(mode.natural_frequency, freq, mode.natural_frequency_se))
        ratio = max(ratio, off(mode.damping_ratio, zeta, mode.damping_ratio_se))
    return Outcome(fit.diagnostics, "", ratio)


def clipped(level):
    def look(folder):
        noisy = ringing() + 0.02 * np.random.default_rng(1).standard_normal(TIME.size)
        return judged(np.clip(noisy, -level, level), noise=0.0)

    return look


def two_close(folder):
    return judged(ringing(80.0) + 0.6 * ringing(83.0, 0.006, phase=1.0), freq=80.0)


def with_law(quadratic=0.0, dry=0.0):
    """A mode whose amplitude falls by a viscous damping and another law besides."""

    def look(folder):
        fall = np.exp(-ZETA * 2.0 * np.pi * FREQ * TIME)
        if quadratic:
            fall = fall / (1.0 + quadratic * (1.0 - fall))
        if dry:
            fall = np.maximum((1.0 + dry) * fall - dry, 0.0)
        return judged(fall * np.cos(2.0 * np.pi * FREQ * TIME + 0.3))

    return look


def second_hit(folder):
    since = np.maximum(TIME - 0.3, 0.0)
    return judged(ringing() + 0.8 * (TIME >= 0.3) * ringing(time=since, phase=-0.5 * np.pi))


def hum(share, freq=100.2, **options):
    def look(folder):
        return judged(ringing() + share * np.cos(2.0 * np.pi * freq * TIME + 1.0), **options)

    return look


def only_hum(folder):
    return judged(np.cos(2.0 * np.pi * 100.0 * TIME), frequencies=[FREQ])


def windowed(constant, **options):
    """A record that an analyser has multiplied by an exponential window, its noise too."""

    def look(folder):
        noisy = ringing() + 0.02 * np.random.default_rng(3).standard_normal(TIME.size)
        return judged(noisy * np.exp(-TIME / constant), noise=0.0, **options)

    return look


def softened(freq, share, zeta):
    """A mode whose frequency lies lower by *share* of itself at the start."""
    fall = np.exp(-zeta * 2.0 * np.pi * freq * TIME)
    phase = 2.0 * np.pi * freq * np.cumsum(1.0 - share * fall**2) / RATE
    return fall * np.cos(phase + 0.3)


def folded(folder):
    """3000 Hz sampled at 5000: all that is in the record is 2000 Hz."""
    outcome = judged(softened(3000.0, 0.005, 81.0 * ZETA / 3000.0), freq=3000.0)
    return Outcome(outcome.diagnostics)


def just_folded(folder):
    return Outcome(judged(ringing(2600.0, 81.0 * ZETA / 2600.0), freq=2600.0).diagnostics)


def warming(share):
    """A frequency that changes at a steady rate, by *share* over the second of the record."""

    def look(folder):
        phase = 2.0 * np.pi * FREQ * (TIME + 0.5 * share * TIME**2)
        return judged(np.exp(-ZETA * 2.0 * np.pi * FREQ * TIME) * np.cos(phase + 0.3))

    return look


def drifting(folder):
    return judged(ringing() + 1.5 * np.exp(-TIME / 0.4))


def released_within(folder):
    return judged(np.concatenate([np.ones(1500), ringing()]), units="m")


def decay(mistake, look, end, code="", sees="", words=""):
    return Case(DECAY, mistake, look, end, code, words, sees)


CASES = (
    decay("four modes asked of a hammer's impact with six, after a rest of 37 ms", impact, "right", "decay.release",
          "matrix pencil over many orders; poles that stay are modes"),
    decay("the record begins with the beam held away from its well", released_within, "right", "decay.release",
          "the largest of all falls of the envelope"),
    decay("tops cut at 0.6 of the amplitude", clipped(0.6), "flagged", "decay.clipped"),
    decay("tops cut at 0.05 of the amplitude", clipped(0.05), "flagged", "decay.clipped_throughout"),
    decay("a drift as large as the decay", drifting, "right", "decay.drift"),
    decay("two modes 3 Hz apart, and one asked for", two_close, "right", "decay.close_modes",
          "poles that stay in the stabilisation diagram"),
    decay("viscous and quadratic damping", with_law(quadratic=3.0), "right", "decay.damping_law",
          "laws and free curves of damping fitted to the envelope, and the one that the data ask for"),
    decay("viscous damping and dry friction", with_law(dry=0.2), "right", "decay.damping_law", "the same"),
    decay("a second hit after 0.3 s", second_hit, "flagged", "decay.disturbed"),
    decay("hum of 100 Hz half as large as the decay", hum(0.5), "right", "decay.hum", "a line that does not decay"),
    decay("the same, with --frequencies 81", hum(0.5, frequencies=[FREQ]), "right", "decay.hum", "the same"),
    decay("an exponential window of half a second", windowed(0.5), "flagged", "decay.window"),
    decay("the same, and its time constant is given", windowed(0.5, exponential_window=0.5), "right",
          "", "exponential_window (--exponential-window) undoes it"),
    decay("a frequency that falls by 1 % in a second, as in the sun", warming(-0.01), "flagged",
          "decay.frequency_drift"),
    decay("a frequency that rises by 0.3 % in a second", warming(0.003), "flagged", "decay.frequency_drift"),
    decay("a softening mode of 3000 Hz, sampled at 5000 Hz", folded, "flagged", "decay.hardening"),
    decay("a mode of 2600 Hz, sampled at 5000 Hz", just_folded, "flagged", "decay.above_band"),
    decay("nothing but hum, with --frequencies 81", only_hum, "refused", sees="a line that does not decay",
          words="does not decay"),
)  # fmt: skip
