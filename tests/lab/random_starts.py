"""Records of a shaker with starts and noise of many kinds, good and behind a high-pass filter, and what is told of them.

``python tests/lab/random_starts.py GOOD FILTERED [SEED]`` prints the rates of ``docs/data/verification.md``, of the
seed 811; records of it set the rule for white noise, and 5500 none.
"""

from __future__ import annotations

import sys
from collections import Counter

import numpy as np
from scipy.signal import butter, freqz, lfilter

from snapbeam import InputError
from snapbeam.lab import make_signal, measure_drive
from snapbeam.util.diagnostics import diagnostics_of, doubtful

STARTS = ("linear", "overshoot", "regulated", "sudden", "slow", "cosine", "resonance", "steps")
NOISES = ("white", "drifting", "rising", "drifting over white", "hissing")


def envelope(rng, start, cycles):
    """Amplitude over the steady one at a number of cycles after the onset."""
    long = float(np.exp(rng.uniform(np.log(0.5), np.log(15.0))))
    since = np.maximum(cycles, 0.0)
    if start == "linear":
        return np.minimum(since / long, 1.0)
    if start == "overshoot":
        return 1.0 + rng.uniform(0.1, 0.6) * np.exp(-since / long)
    if start == "regulated":  # an amplitude control with a damping ratio below 1
        damping = rng.uniform(0.2, 0.8)
        turn = 2.0 * np.pi * since / (2.0 * long)
        return 1.0 - np.exp(-damping * turn) * np.cos(np.sqrt(1.0 - damping**2) * turn)
    if start == "slow":
        return 1.0 - rng.uniform(0.5, 1.0) * np.exp(-since / long)
    if start == "cosine":
        return 0.5 - 0.5 * np.cos(np.pi * np.minimum(since / long, 1.0))
    if start == "steps":
        return np.minimum(np.floor(1.0 + 3.0 * since / long), 4.0) / 4.0
    return np.ones_like(since)


def noise(rng, kind, size, rate):
    """Noise of standard deviation 1."""
    white = rng.standard_normal(size)
    if kind == "white":
        return white
    freq = np.fft.rfftfreq(size, 1.0 / rate)
    freq[0] = freq[1]
    power = {
        "drifting": freq ** -rng.uniform(0.3, 1.5),
        "rising": freq ** rng.uniform(0.5, 2.0),  # of a decoder of displacements
        "drifting over white": 1.0 + (rng.uniform(3.0, 60.0) / freq) ** rng.uniform(1.0, 2.0),
        "hissing": 1.0 + (freq / rng.uniform(100.0, 1000.0)) ** 2,
    }[kind]
    values = np.fft.irfft(np.fft.rfft(white) * np.sqrt(power), size)
    return values / values.std()


def record(rng, start, *, filtered):
    """A record with a start, what is true of it, and the corner of its high-pass filter [Hz], 0 for none."""
    freq = float(np.exp(rng.uniform(np.log(20.0), np.log(400.0))))
    rate = freq * float(np.exp(rng.uniform(np.log(25.0), np.log(300.0))))
    rest = max(rng.uniform(4.0, 20.0) / freq, 0.03)
    count = int((rest + float(np.exp(rng.uniform(np.log(45.0), np.log(250.0)))) / freq) * rate)
    time = np.arange(count) / rate
    since = time - rest
    turn = 2.0 * np.pi * freq * since + rng.uniform(-np.pi, np.pi)
    wave = np.cos(turn) + rng.uniform(0.0, 0.02) * np.cos(2.0 * turn + rng.uniform(-3.0, 3.0))
    clean = envelope(rng, start, freq * since) * wave * (since >= 0.0)
    amplitude = 0.02
    if start == "resonance":  # the table on its suspension, struck by the sine
        own, damping = freq * float(np.exp(rng.uniform(np.log(0.08), np.log(0.6)))), rng.uniform(0.05, 1.2)
        speed = rate / (np.pi * own)  # of the bilinear transform
        below = np.array([speed**2, 2.0 * damping * speed, 1.0]) @ [[1.0, -2.0, 1.0], [1.0, 0.0, -1.0], [1.0, 2.0, 1.0]]
        above = speed**2 * np.array([1.0, -2.0, 1.0])
        clean = lfilter(above / below[0], below / below[0], clean)
        amplitude *= abs(freqz(above, below, [freq], fs=rate)[1][0])
    clean *= 0.02
    kind = NOISES[rng.integers(len(NOISES))]
    values = clean + 0.02 / np.sqrt(2.0) * 10.0 ** (-rng.uniform(20.0, 50.0) / 20.0) * noise(rng, kind, count, rate)
    corner = 0.0
    if filtered:
        corner = freq * float(np.exp(rng.uniform(np.log(0.12), np.log(1.5))))
        values = lfilter(*butter(1, corner, "high", fs=rate), values)
    values = values + 0.02 * rng.uniform(-0.1, 0.1)
    return (
        make_signal(values, "m/s", rate, name="velocity"),
        {"amplitude": amplitude, "frequency": freq},
        corner,
        kind,
    )


def judged(seed, k, *, filtered):
    """Codes told of record *k*, its worst error in standard errors, its start and noise, and the corner over the drive."""
    start = STARTS[k % len(STARTS)]
    signal, truth, corner, kind = record(np.random.default_rng((seed, k, filtered)), start, filtered=filtered)
    try:
        drive = measure_drive(signal)
    except InputError as error:
        return [f"refused: {error}"], 0.0, start, kind, corner / truth["frequency"]
    off = max(
        abs(getattr(drive.steady, name) - true) / getattr(drive.steady, f"{name}_se") for name, true in truth.items()
    )
    codes = [one.code.partition(".")[2] for one in doubtful(diagnostics_of(drive))]
    return codes, off, start, kind, corner / truth["frequency"]


if __name__ == "__main__":
    seed = int(sys.argv[3]) if len(sys.argv) > 3 else 811
    for filtered, count in enumerate(map(int, sys.argv[1:3])):
        found = [judged(seed, k, filtered=bool(filtered)) for k in range(count)]
        told = Counter(code for codes, *_ in found for code in codes)
        silent = [(round(off, 1), *rest) for codes, off, *rest in found if off > 5.0 and not codes]
        alarms = Counter((start, kind) for codes, _, start, kind, _ in found if "high_pass" in codes)
        print(("good", "high-passed")[filtered], count, dict(told), "silent", silent)
        print({name: sum(n for key, n in alarms.items() if name in key) for name in (*STARTS, *NOISES)})
        print("covered by two standard errors", np.mean([off < 2.0 for _, off, *_ in found]))
        if filtered:
            missed = sorted(
                (round(c, 2), round(off, 1), kind, start)
                for codes, off, start, kind, c in found
                if "high_pass" not in codes
            )
            print("not told", missed)
