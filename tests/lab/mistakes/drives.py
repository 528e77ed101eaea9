"""Mistakes in the vibrometer's record, and between it and the camera."""

from __future__ import annotations

import numpy as np

import snapbeam.lab as lab
from snapbeam.runs.schema import trajectory_dataset

from .case import Case, Outcome, off

FREQ, SPEED = 98.0, 0.03
SIZE = SPEED / (2.0 * np.pi * FREQ)
DROPOUT = "Dropout of the vibrometer"
CLIPPED = "Range of the vibrometer too small"
TURNED = "Vibrometer upside down against the camera"
ONSET = "Start of the shaker"


def record(seed=0, snr_db=30.0, **options):
    """A vibrometer's record of a shaker that starts after 0.1 s."""
    known = {"duration": 0.8, "onset": 0.1, "start_up": 0.02} | options
    return lab.render_vibrometer(FREQ, SPEED, seed=seed, snr_db=snr_db, **known)


TRUE = record(snr_db=200.0)


def judged(signal, onset=0.1):
    """What is measured of a record, the drive made of it included."""
    drive = lab.measure_drive(signal, FREQ)
    ratio = max(
        off(drive.steady.amplitude, SPEED, drive.steady.amplitude_se),
        off(drive.steady.frequency, FREQ, drive.steady.frequency_se),
        off(drive.startup.onset, onset, drive.startup.onset_uncertainty),
    )
    made = lab.recorded_drive(signal, 20_000.0, measurement=drive)
    highest = 0.5 * np.ptp(made["displacement"].values)
    assert abs(highest / SIZE - 1.0) < 0.03, f"drive of {1e6 * highest:.4g} um for {1e6 * SIZE:.4g}"
    return Outcome(drive.findings, "", ratio)


def dropout(length, at=0.5):
    def look(folder):
        signal = record()
        values = signal.values.copy()
        first = int(at * 20_000.0)
        values[first : first + int(length * 20_000.0)] = 0.0
        return judged(signal.copy(data=values))

    return look


def clipped(share):
    def look(folder):
        signal = record()
        return judged(signal.copy(data=np.clip(signal.values, -share * SPEED, share * SPEED)))

    return look


def seen_by_camera(polarity=1, gain=1.0, shift=0.03):
    """The shaker's displacement as a camera of 5000 frames/s tracks it."""
    shown = lab.displacement_from_velocity(TRUE)
    time = np.arange(0.0, 0.7, 1.0 / 5000.0)
    values = polarity * gain * np.interp(time, shown["time"].values - shift, shown.values)
    noise = 0.2e-6 * np.random.default_rng(1).standard_normal(time.size)
    return lab.make_signal(values + noise, "m", time=time, name="shaker")


def upside_down(folder):
    """The drive made with the camera beside it has the camera's sign."""
    signal = record()
    alignment = lab.align(seen_by_camera(polarity=-1), signal, FREQ)
    made = lab.recorded_drive(signal, 20_000.0, alignment=alignment)
    right = lab.recorded_drive(TRUE, 20_000.0)
    both = min(made.sizes["time"], right.sizes["time"])
    turned = -right["velocity"].values[:both]
    assert np.abs(made["velocity"].values[:both] - turned).max() < 0.15 * SPEED
    assert alignment.polarity == -1
    return Outcome(alignment.findings, "", off(alignment.delay, -0.03, alignment.delay_se))


def half_the_amplitude(folder):
    signal = record()
    alignment = lab.align(seen_by_camera(gain=1.1), signal, FREQ)
    return Outcome(alignment.findings, "", off(alignment.gain, 1.1, alignment.gain_se))


def run(rest=0.0):
    """A run with a shaker that starts after *rest* seconds, and a beam that follows it."""
    time = np.arange(0.0, 0.5, 1.0 / 5000.0)
    since = np.maximum(time - rest, 0.0)
    shaker = -1.2 + 0.2 * np.sin(2.0 * np.pi * FREQ * since) * (1.0 - 0.4 * np.exp(-since / 0.01))
    beam = -1.0 + 0.3 * np.sin(2.0 * np.pi * FREQ * since) ** 3
    cycle = {} if rest else {"cycle": FREQ * time}
    return trajectory_dataset(time, attrs={}, displacement=beam, shaker_displacement=shaker, **cycle)


def compared_upside_down(folder):
    measured, simulated = run(0.03), run()
    turned = simulated["shaker_displacement"]
    simulated["shaker_displacement"] = (turned.dims, 2.0 * float(turned[0]) - turned.values, turned.attrs)
    return Outcome(lab.compare_waveforms(measured, simulated, FREQ).findings)


def gentle(start_up):
    def look(folder):
        return judged(record(start_up=start_up, start_up_share=1.0, duration=1.5))

    return look


CASES = (
    Case(TURNED, "a drive made of the record", upside_down, "right", "alignment.polarity",
         sees="the drive is turned over as the camera says"),
    Case(TURNED, "a measured run compared with a simulation driven upside down", compared_upside_down, "flagged",
         "comparison.turned_over"),
    Case(TURNED, "ten percent more amplitude in the camera", half_the_amplitude, "flagged", "alignment.amplitude"),
    Case(DROPOUT, "5 ms at zero", dropout(0.005), "flagged", "vibrometer.dropout"),
    Case(DROPOUT, "10 ms at zero", dropout(0.010), "flagged", "vibrometer.dropout"),
    Case(DROPOUT, "5 ms at zero while the shaker starts", dropout(0.005, 0.107), "refused", words="dropout",
         sees="values that stand still, or jump, while the shaker starts"),
    Case(CLIPPED, "tops cut at 0.7 of the amplitude", clipped(0.7), "flagged", "vibrometer.clipped"),
    Case(CLIPPED, "tops cut at 0.95 of the amplitude", clipped(0.95), "flagged", "vibrometer.clipped"),
    Case(ONSET, "a start-up over 20 ms from rest", gentle(0.02), "right", sees="the first motion above the noise, "
         "continued backwards by its own growth, with an interval that says how well"),
    Case(ONSET, "a start-up over 100 ms from rest", gentle(0.1), "right", sees="the same"),
)  # fmt: skip
