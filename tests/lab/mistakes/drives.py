"""Mistakes in the vibrometer's record, and between it and the camera."""

from __future__ import annotations

import numpy as np

import snapbeam.lab as lab
from snapbeam.simulation.dataset import trajectory_dataset

from .case import Case, Outcome, off

FREQ, SPEED = 98.0, 0.03
SIZE = SPEED / (2.0 * np.pi * FREQ)
DROPOUT = "Dropout of the vibrometer"
CLIPPED = "Range of the vibrometer too small"
TURNED = "Vibrometer upside down against the camera"
ONSET = "Start of the shaker"
LINES = "Other lines in a shaker's record"


def record(seed=0, snr_db=30.0, **options):
    """A vibrometer's record of a shaker that starts after 0.1 s."""
    known = {"duration": 0.8, "onset": 0.1, "start_up": 0.02} | options
    return lab.render_vibrometer(FREQ, SPEED, rng=seed, snr_db=snr_db, **known)


TRUE = record(snr_db=200.0)


def judged(signal, onset=0.1, one=True):
    """What is measured of a record, the drive made of it included if that is *one* sine."""
    drive = lab.measure_drive(signal, FREQ)
    ratio = max(
        off(drive.steady.amplitude, SPEED, drive.steady.amplitude_se),
        off(drive.steady.frequency, FREQ, drive.steady.frequency_se),
        off(drive.startup.onset, onset, drive.startup.onset_uncertainty),
    )
    made = lab.recorded_drive(signal, 20_000.0, measurement=drive)
    highest = 0.5 * np.ptp(made["displacement"].values)
    assert not one or abs(highest / SIZE - 1.0) < 0.03, f"drive of {1e6 * highest:.4g} um for {1e6 * SIZE:.4g}"
    return Outcome(drive.diagnostics, "", ratio)


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
    return Outcome(alignment.diagnostics, "", off(alignment.delay, -0.03, alignment.delay_se))


def half_the_amplitude(folder):
    signal = record()
    alignment = lab.align(seen_by_camera(gain=1.1), signal, FREQ)
    return Outcome(alignment.diagnostics, "", off(alignment.gain, 1.1, alignment.gain_se))


def run(rest=0.0):
    """A run with a shaker that starts after *rest* seconds, and a beam that follows it."""
    time = np.arange(0.0, 0.5, 1.0 / 5000.0)
    since = np.maximum(time - rest, 0.0)
    shaker = -1.2 + 0.2 * np.sin(2.0 * np.pi * FREQ * since) * (1.0 - 0.4 * np.exp(-since / 0.01))
    beam = -1.0 + 0.3 * np.sin(2.0 * np.pi * FREQ * since) ** 3
    cycle = {} if rest else {"cycle": FREQ * time}
    return trajectory_dataset(time, attrs={}, displacement_at_striker=beam, striker_displacement=shaker, **cycle)


def compared_upside_down(folder):
    measured, simulated = run(0.03), run()
    turned = simulated["striker_displacement"]
    simulated["striker_displacement"] = (turned.dims, 2.0 * float(turned[0]) - turned.values, turned.attrs)
    return Outcome(lab.compare_waveforms(measured, simulated, FREQ).diagnostics)


def gentle(start_up):
    def look(folder):
        return judged(record(start_up=start_up, start_up_share=1.0, duration=1.5))

    return look


def hum(share, freq, **options):
    """Mains hum in the record, at rest as in motion; the drive made of it must not move at that frequency."""

    def look(folder):
        signal = record(**options)
        line = share * SPEED * np.cos(2.0 * np.pi * freq * time_of(signal) + 1.0)
        return judged(signal.copy(data=signal.values + line))

    return look


def second_motion(share, away):
    """The shaker moves at a second frequency too, from its start on."""

    def look(folder):
        signal = record()
        time = time_of(signal)
        grown = np.clip((time - 0.1) / 0.02, 0.0, 1.0)
        other = share * SPEED * grown * np.cos(2.0 * np.pi * (FREQ + away) * time + 1.0)
        return judged(signal.copy(data=signal.values + other), one=False)

    return look


def time_of(signal):
    return signal["time"].values


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
    Case(ONSET, "under hum of 50 Hz, a tenth of the amplitude", hum(0.1, 50.0), "right", "vibrometer.hum"),
    Case(ONSET, "under hum of 100 Hz, three tenths of the amplitude, beside a drive of 98 Hz", hum(0.3, 100.0), "right",
         "vibrometer.hum"),
    Case(LINES, "a second motion 2 Hz above the drive, a fifth of it, in a record of 0.8 s", second_motion(0.2, 2.0),
         "flagged", "vibrometer.beat"),
    Case(LINES, "a second motion 8 Hz above the drive, a fiftieth of it", second_motion(0.02, 8.0), "flagged",
         "vibrometer.beat"),
    Case(ONSET, "a start-up over 100 ms from rest", gentle(0.1), "right", sees="the same"),
)  # fmt: skip
