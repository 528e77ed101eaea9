"""Signals drawn at random, good ones and ones with one thing wrong, and how far off a measurement of them is."""

from __future__ import annotations

import sys
import warnings
from collections import Counter
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.signal import butter, iirnotch, lfilter

from snapbeam import InputError
from snapbeam.lab import identify_decay, make_signal, measure_drive, render_vibrometer
from snapbeam.util.diagnostics import diagnostics_of, doubtful

DRIVE_DEFECTS = (
    "dropout", "hold", "spikes", "clipped", "clipped on one side", "clipped before the noise", "gentle start",
    "begins in motion", "amplitude wanders", "interrupted", "wrong frequency set", "drifting zero",
)  # fmt: skip
SENSOR_DEFECTS = (
    "slew limit", "crossover", "notch", "AC coupling", "amplitude drifts", "beat", "samples lost", "unit by ten",
    "rate twice", "displacement as velocity", "slow slew", "notch of 60 Hz", "AC coupling near", "lost in step",
    "hysteresis", "jitter", "clock drifts", "gain switched", "folded line", "few bits", "sign flipped", "interpolated",
)  # fmt: skip
DECAY_DEFECTS = (
    "clipped", "clipped before the noise", "drift", "close modes", "quadratic damping", "dry friction", "second hit",
    "hum", "dropout", "release within", "more modes", "asked off",
)  # fmt: skip
MODE_DEFECTS = (
    "frequency creeps", "shaker touches", "gain switched", "sign flipped", "few bits", "AC coupling near", "jitter",
    "folded line", "interpolated",
)  # fmt: skip
CAUSES = {
    "dropout": "dropout dropout_in_start disturbed", "hold": "dropout dropout_in_start", "spikes": "dropout",
    "clipped": "clipped clipped_throughout", "clipped on one side": "clipped",
    "clipped before the noise": "clipped clipped_throughout saturated", "begins in motion": "no_rest",
    "gentle start": "slow_start unsteady", "amplitude wanders": "unsteady beat drifts second_line",
    "interrupted": "interrupted dropout", "wrong frequency set": "frequency", "slew limit": "slew",
    "slow slew": "slew", "crossover": "crossover", "notch": "notch", "notch of 60 Hz": "notch",
    "AC coupling": "high_pass", "AC coupling near": "high_pass", "amplitude drifts": "drifts",
    "beat": "beat second_line unsteady", "samples lost": "samples_lost", "lost in step": "samples_lost",
    "unit by ten": "amplitude beyond_shakers", "rate twice": "frequency not_there",
    "displacement as velocity": "amplitude beyond_shakers", "hysteresis": "hysteresis", "jitter": "jitter",
    "clock drifts": "clock_drifts", "gain switched": "gain disturbed", "folded line": "hum second_line",
    "few bits": "few_bits", "sign flipped": "sign disturbed", "interpolated": "interpolated",
    "close modes": "close_modes misfit", "quadratic damping": "damping_law misfit",
    "dry friction": "damping_law misfit", "second hit": "disturbed faint", "hum": "hum", "drift": "drift",
    "release within": "release", "asked off": "off_asked", "frequency creeps": "frequency_drift",
    "shaker touches": "touches",
}  # fmt: skip
"""Codes of the diagnostics that name the cause of a defect."""


@dataclass
class Outcome:
    """How a signal came out: the worst error in standard errors, of which number, and what was said."""

    ratio: float
    worst: str
    codes: tuple[str, ...]
    refusal: str = ""

    @property
    def flagged(self) -> bool:
        return bool(self.codes) or bool(self.refusal)


def drive_signal(rng, kind):
    """A vibrometer's record, what is true of it, and what a person says of it."""
    freq, amplitude = rng.uniform(40.0, 300.0), 0.03
    onset = rng.uniform(0.05, 0.2)
    start_up = float(np.exp(rng.uniform(np.log(0.003), np.log(0.03))))
    share = float(rng.choice([0.0, 0.4, -0.3]))
    if kind == "gentle start":
        start_up, share = float(np.exp(rng.uniform(np.log(0.02), np.log(0.15)))), 1.0
    length = onset + max(60.0 / freq, 10.0 * start_up)
    signal = render_vibrometer(
        freq, amplitude, duration=length, onset=onset, start_up=start_up, start_up_share=share,
        phase=rng.uniform(-3.0, 3.0), distortion=float(rng.choice([0.0, 0.01, 0.03])), snr_db=rng.uniform(20.0, 42.0),
        rng=int(rng.integers(2**31)),
    )  # fmt: skip
    values, time, rate = signal.values.copy(), signal["time"].values, 20_000.0
    truth = {"amplitude": amplitude, "frequency": freq, "onset": onset}
    options = {"frequency": freq * rng.uniform(0.999, 1.001)}
    at = int(rate * rng.uniform(onset + 0.5 * (length - onset), length - 0.02))
    size = int(rate * rng.uniform(0.001, 0.015))
    if kind == "dropout":
        values[at : at + size] = 0.0
    elif kind == "hold":
        values[at : at + size] = values[at]
    elif kind == "spikes":
        values[rng.integers(int(rate * onset), values.size, 6)] += rng.choice([-3.0, 3.0], 6) * amplitude
    elif kind == "clipped":
        values = np.clip(values, *(np.array([-1.0, 1.0]) * rng.uniform(0.5, 0.93) * amplitude))
    elif kind == "clipped on one side":
        values = np.minimum(values, rng.uniform(0.5, 0.9) * amplitude)
    elif kind == "clipped before the noise":
        level = rng.uniform(0.55, 0.9) * amplitude
        noise = 0.01 * amplitude * rng.standard_normal(values.size)
        clean = render_vibrometer(
            freq, amplitude, duration=length, onset=onset, start_up=start_up, start_up_share=share, snr_db=200.0
        )
        values = np.clip(clean.values, -level, level) + noise[: clean.size]
    elif kind == "begins in motion":
        keep = time > onset + 6.0 * start_up + 5.0 / freq
        values, time = values[keep], time[keep]
        del truth["onset"]
    elif kind == "amplitude wanders":
        values = values * (1.0 + rng.uniform(0.03, 0.1) * np.sin(2.0 * np.pi * 2.0 * time))
        del truth["amplitude"]  # there is no one amplitude
    elif kind == "interrupted":
        hole = int(rate * (onset + 0.5 * (length - onset)))
        values[hole : hole + int(12.0 * rate / freq)] *= 0.0
    elif kind == "wrong frequency set":
        options["frequency"] = freq * float(rng.choice([0.992, 1.008]))
    elif kind == "drifting zero":
        values = values + 0.3 * amplitude * time / time[-1]
    return make_signal(values, "m/s", time=time, name="velocity"), truth, options


def tracking(values, step):
    """The output of an amplifier that follows *values* by at most *step* a sample."""
    out = np.empty_like(values)
    at = values[0]
    for k, value in enumerate(values.tolist()):
        at += min(max(value - at, -step), step)
        out[k] = at
    return out


def played(values, width):
    """The output of a gear with a play of *width* on either side of zero."""
    out, at = np.empty_like(values), values[0]
    for k, value in enumerate(values.tolist()):
        at = min(max(at, value - width), value + width)
        out[k] = at
    return out


def common_defect(rng, kind, values, at, freq, size, rate):
    """A record with an error of its converter or its handling, from sample *at* on; *size* is that of the motion."""
    time = np.arange(values.size) / rate
    if kind == "gain switched":
        values = values * np.where(time < time[at], 1.0, rng.choice([0.1, 0.5, 0.9, 1.08, 2.0, 10.0]))
    elif kind == "sign flipped":
        values = values * np.where(time < time[at], 1.0, -1.0)
    elif kind == "few bits":
        step = size * 2.0 ** -rng.uniform(0.5, 4.0)
        values = np.round(values / step) * step
    elif kind == "folded line":
        line = rng.uniform(0.0, 0.5 * rate)
        values = values + rng.uniform(0.02, 0.2) * size * np.cos(2.0 * np.pi * line * time + rng.uniform(-3.0, 3.0))
    elif kind == "interpolated":
        coarse = np.arange(0.0, time[-1], 1.0 / (freq * rng.uniform(5.0, 15.0)))
        values = np.interp(time, coarse, np.interp(coarse, time, values))
    elif kind == "AC coupling near":
        values = lfilter(*butter(1, freq * rng.uniform(0.4, 1.5), "high", fs=rate), values)
    return values


def sensor_signal(rng, kind):
    """A record through electronics with one thing wrong, or a hard but good one ("hard"); the noise is the laser's."""
    rate, amplitude = 20_000.0, 0.03
    freq = float(np.exp(rng.uniform(np.log(30.0), np.log(300.0))))
    if kind in ("notch", "notch of 60 Hz"):
        freq = (50.0 if kind == "notch" else 60.0) * rng.uniform(0.9, 1.1)
    if kind == "lost in step":
        parts = int(rng.integers(1, 4))
        freq = rate / (parts * int(rng.integers(70, 500) / parts))
    onset, start_up = rng.uniform(0.1, 0.3), float(np.exp(rng.uniform(np.log(0.003), np.log(0.03))))
    length = onset + max(80.0 / freq, 10.0 * start_up)
    time = np.arange(int(length * rate)) / rate
    taken = time + (rng.uniform(0.02, 0.15) / (2.0 * np.pi * freq) * rng.standard_normal(time.size)) * (
        kind == "jitter"
    )
    since = np.maximum(taken - onset, 0.0)
    if kind == "clock drifts":
        since = since * (1.0 + rng.choice([-1.0, 1.0]) * float(np.exp(rng.uniform(-7.6, -4.6))) * since / since[-1])
    turn = 2.0 * np.pi * freq * since + rng.uniform(-3.0, 3.0)
    second, third = rng.uniform(0.0, 0.03), rng.choice([0.0, rng.uniform(0.0, 0.02)])
    if kind == "hard":
        third = rng.uniform(0.0, 0.03)
    wave = np.cos(turn) + second * np.cos(2.0 * turn + rng.uniform(-3.0, 3.0))
    wave += third * np.cos(3.0 * turn + rng.uniform(-3.0, 3.0))
    envelope = 1.0 - float(rng.choice([0.0, 0.4, -0.3])) * np.exp(-since / start_up)
    if kind == "amplitude drifts":
        envelope *= 1.0 + rng.choice([-1.0, 1.0]) * rng.uniform(0.03, 0.12) * since / since[-1]
    elif kind == "beat":
        other = freq + rng.choice([-1.0, 1.0]) * rng.uniform(0.3, 1.5) / since[-1]
        wave += rng.uniform(0.03, 0.2) * np.cos(2.0 * np.pi * other * since + rng.uniform(-3.0, 3.0))
    clean = amplitude * envelope * wave * (time >= onset)
    white = rng.standard_normal(time.size)
    if kind == "hard" and rng.random() < 0.5:
        spectrum = np.fft.rfft(white) / np.sqrt(np.maximum(np.fft.rfftfreq(white.size), 30.0 / rate))
        white = np.fft.irfft(spectrum, white.size)
        white /= white.std()
    values = clean + amplitude / np.sqrt(2.0) * 10.0 ** (-rng.uniform(22.0, 50.0) / 20.0) * white
    truth = {"amplitude": amplitude, "frequency": freq, "onset": onset}
    known = {"frequency": freq * rng.uniform(0.999, 1.001), "amplitude": amplitude * rng.uniform(0.98, 1.02)}
    options = known if rng.random() < 0.5 else {}
    if kind == "slew limit":
        share = float(np.exp(rng.uniform(np.log(0.7), np.log(0.97))))
    elif kind == "slow slew":
        share = rng.uniform(0.97, 0.995)
    if kind in ("slew limit", "slow slew"):
        values = tracking(values, share * amplitude * 2.0 * np.pi * freq / rate)
    elif kind == "crossover":
        dead = rng.uniform(0.02, 0.1) * amplitude
        values = np.sign(values) * np.maximum(np.abs(values) - dead, 0.0)
    elif kind == "notch":
        values = lfilter(*iirnotch(50.0, rng.uniform(3.0, 10.0), rate), values)
    elif kind == "notch of 60 Hz":
        values = lfilter(*iirnotch(60.0, rng.uniform(3.0, 10.0), rate), values)
    elif kind == "hysteresis":
        values = played(clean, rng.uniform(0.01, 0.08) * amplitude) + values - clean
    elif kind == "AC coupling":
        values = lfilter(*butter(1, freq * rng.uniform(0.1, 0.4), "high", fs=rate), values)
    elif kind == "amplitude drifts":
        truth["amplitude"] = amplitude * envelope[-1]  # in the end, or anything between it and the start
    elif kind == "samples lost":
        every = int(rng.integers(20, 200))
        values = np.delete(values, np.arange(every, values.size, every))
        truth["onset"] = None
    elif kind == "lost in step":
        every = round(rate / freq / parts)
        values = np.delete(values, np.arange(int(rng.integers(every)), values.size, every))
        truth["onset"] = None
    elif kind == "clock drifts":
        del truth["frequency"]  # there is no one frequency
    elif kind == "unit by ten":
        values = values * float(rng.choice([0.1, 10.0, 0.001]))
    elif kind == "rate twice":
        rate *= float(rng.choice([0.5, 2.0]))
        truth["onset"] = None
    elif kind == "displacement as velocity":
        values = 50.0 * np.cumsum(values - values.mean()) / rate * 2.0 * np.pi
    at = int(rate * (onset + rng.uniform(0.4, 0.8) * (length - onset)))
    values = common_defect(rng, kind, values, min(at, values.size - 1), freq, amplitude, rate)
    if kind in ("unit by ten", "rate twice", "displacement as velocity"):
        options = known  # the record alone cannot tell
    truth = {name: value for name, value in truth.items() if value is not None}
    return make_signal(values, "m/s", rate, name="velocity"), truth, options


def touching_decay(rng, freq, zeta, time):
    """A free decay of a mode that still strikes a soft stop on one side while it is large."""
    omega, gap = 2.0 * np.pi * freq, rng.uniform(0.1, 0.4)
    stiff, damp = omega**2 * rng.uniform(0.05, 0.5), omega * rng.uniform(0.02, 0.2)

    def moved(t, state):
        x, v = state
        force = max(stiff * (x - gap) + damp * v, 0.0) if x > gap else 0.0
        return v, -(omega**2) * x - 2.0 * zeta * omega * v - force

    start = [np.cos(rng.uniform(-3.0, 3.0)), 0.0]
    start[1] = omega * np.sqrt(1.0 - start[0] ** 2)
    return solve_ivp(moved, (0.0, time[-1]), start, t_eval=time, rtol=1e-8, max_step=0.1 / freq).y[0]


def fading(time, freq, zeta):
    """A sine that dies away."""
    return np.exp(-zeta * 2.0 * np.pi * freq * time) * np.cos(2.0 * np.pi * freq * time)


def decay_signal(rng, kind):
    """A free decay, what is true of it, and what a person says of it."""
    freq, zeta, rate = (rng.uniform(40.0, 200.0), float(np.exp(rng.uniform(np.log(0.002), np.log(0.015)))), 5000.0)
    length = float(np.clip(3.0 / (2.0 * np.pi * freq * zeta), 20.0 / freq, 1.2))
    time = np.arange(int(length * rate)) / rate
    omega = 2.0 * np.pi * freq
    fall = np.exp(-zeta * omega * time)
    if kind == "quadratic damping":
        strength = rng.uniform(0.5, 4.0)
        fall = fall / (1.0 + strength * (1.0 - fall))
    elif kind == "dry friction":
        strength = rng.uniform(0.05, 0.4)
        fall = np.maximum((1.0 + strength) * fall - strength, 0.0)
    soft = rng.uniform(0.0, 0.02) if kind in ("", "drift", "hum", "release within") else 0.0
    clock = time - soft * np.cumsum(fall**2) / rate
    phase = rng.uniform(-3.0, 3.0)
    values = fall * np.cos(omega * np.sqrt(1.0 - zeta**2) * clock + phase)
    if (kind == "" and rng.random() < 0.4) or kind == "more modes":
        other, damping = freq * rng.uniform(1.8, 6.0), zeta * rng.uniform(0.7, 2.0)
        values = values + rng.uniform(0.1, 0.5) * np.exp(-damping * 2.0 * np.pi * other * time) * np.cos(
            2.0 * np.pi * other * time
        )
    noise = 10.0 ** (-rng.uniform(18.0, 40.0) / 20.0) / np.sqrt(2.0)
    truth, options = {"natural_frequency": freq, "damping_ratio": zeta}, {}
    at = int(rng.uniform(0.25, 0.5) * time.size)
    if kind == "close modes":
        other = freq * (1.0 + rng.uniform(0.02, 0.12))
        values = values + rng.uniform(0.3, 0.7) * np.exp(-zeta * 1.1 * 2.0 * np.pi * other * time) * np.cos(
            2.0 * np.pi * other * time
        )
    elif kind == "second hit":
        since = np.maximum(time - time[at], 0.0)
        values = values + rng.uniform(0.3, 1.0) * (time >= time[at]) * np.exp(-zeta * omega * since) * np.sin(
            omega * since
        )
    elif kind == "drift":
        shape = rng.integers(3)
        values = (
            values
            + rng.uniform(0.3, 2.0)
            * (time / length, np.exp(-time / rng.uniform(0.1, 0.4)), np.sin(4.0 * time / length))[shape]
        )
    elif kind == "hum":
        hum = float(rng.choice([50.0, 60.0, 100.0, 120.0])) * rng.uniform(0.999, 1.001)
        values = values + rng.uniform(0.05, 0.5) * np.cos(2.0 * np.pi * hum * time + 1.0)
    elif kind == "release within":
        before = np.full(int(rng.uniform(0.05, 0.3) * rate), rng.choice([0.0, 1.0]))
        values = np.concatenate([before, values])
    elif kind == "asked off":
        options = {"frequencies": [freq * rng.uniform(0.93, 1.07)]}
    elif kind == "frequency creeps":
        creep = rng.choice([-1.0, 1.0]) * rng.uniform(0.002, 0.02)
        values = fall * np.cos(omega * (time + 0.5 * creep * time**2 / length) + phase)
    elif kind == "shaker touches":
        values = touching_decay(rng, freq, zeta, time)
    elif kind == "jitter":
        taken = time + rng.uniform(0.02, 0.15) / omega * rng.standard_normal(time.size)
        values = np.interp(taken, time, values)
    level = rng.uniform(0.45, 0.8)
    if kind == "clipped before the noise":
        values = np.clip(values, -level, level)
    values = values + noise * rng.standard_normal(values.size)
    if kind == "clipped":
        values = np.clip(values, -level, level)
    elif kind == "dropout":
        values[at : at + int(rate * rng.uniform(0.004, 0.02))] = 0.0
    values = common_defect(rng, kind, values, at, freq, 1.0, rate)
    units = str(rng.choice(["m", "m/s"]))
    return make_signal(values, units, rate, name="decay"), truth, options


def judged_drive(rng, kind):
    """The outcome of a vibrometer's record."""
    made = sensor_signal if kind in (*SENSOR_DEFECTS, "hard", "easy") else drive_signal
    signal, truth, options = made(rng, kind)
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        try:
            drive = measure_drive(signal, **options)
        except InputError as error:
            return Outcome(0.0, "", (), str(error))
    ratios = {}
    for name in ("amplitude", "frequency"):
        if name in truth:
            ratios[name] = abs(getattr(drive.steady, name) - truth[name]) / getattr(drive.steady, f"{name}_se")
    if "onset" in truth and drive.startup is not None:
        ratios["onset"] = abs(drive.startup.onset - truth["onset"]) / drive.startup.onset_uncertainty
    worst = max(ratios, key=ratios.get, default="")
    return Outcome(ratios.get(worst, 0.0), worst, tuple(one.code for one in doubtful(diagnostics_of(drive))))


def judged_decay(rng, kind):
    """The outcome of a decay."""
    signal, truth, options = decay_signal(rng, kind)
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        try:
            fit = identify_decay(signal, **options)
        except InputError as error:
            return Outcome(0.0, "", (), str(error))
    mode = fit.modes[0]
    ratios = {name: abs(getattr(mode, name) - truth[name]) / getattr(mode, f"{name}_se") for name in truth}
    worst = max(ratios, key=ratios.get)
    return Outcome(ratios[worst], worst, tuple(one.code for one in doubtful(fit.diagnostics)))


def figures(judged, kinds, count, seed=60):
    """Print by kind: records, off by more than 5 standard errors in silence, doubted or refused, within two errors."""
    for kind in kinds:
        outcomes = [judged(np.random.default_rng((seed, hash_of(kind), k)), kind) for k in range(count)]
        silent = [f"{one.worst} {one.ratio:.0f}" for one in outcomes if one.ratio > 5.0 and not one.flagged]
        codes = Counter(code for one in outcomes for code in one.codes)
        doubted, refused = sum(one.flagged for one in outcomes), sum(bool(one.refusal) for one in outcomes)
        within = np.mean([one.ratio < 2.0 for one in outcomes if not one.refusal])
        print(f"{kind or 'good':26} {count} silent {len(silent)} doubted {doubted} refused {refused} "
              f"covered {within:.2f} {silent} {dict(codes)}", flush=True)  # fmt: skip


def hash_of(kind):
    """A number of a kind's name, alike in every process."""
    return sum(ord(letter) * 31**k for k, letter in enumerate(kind)) % 2**31


if __name__ == "__main__":
    count = int(sys.argv[1])
    figures(judged_drive, ("", "easy", "hard", *SENSOR_DEFECTS), count)
    figures(judged_decay, ("", *MODE_DEFECTS), count)
