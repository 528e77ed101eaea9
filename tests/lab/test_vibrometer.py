"""The shaker's measured motion: sine fit, start-up, integration, alignment, drive for the model."""

from __future__ import annotations

import numpy as np
import pytest
import random_signals
import scipy.signal

from snapbeam.lab.drive_alignment import align, recorded_drive
from snapbeam.lab.sensor_errors import beyond_shakers
from snapbeam.lab.signals import SignalSamples, make_signal
from snapbeam.lab.sine_fit import fit_sine, spectral_peak
from snapbeam.lab.synthetic import render_vibrometer
from snapbeam.lab.vibrometer import displacement_from_velocity, measure_drive
from snapbeam.util.validation import InputError

V, ONSET, TAU = 0.03, 0.0504, 0.015


def shaker(time, freq: float = 100.0, over: float = 0.3):
    """Displacement and velocity of a shaker that starts at ONSET, *over* times above its steady motion."""
    s = np.clip(time - ONSET, 0.0, None)
    w, swell = 2.0 * np.pi * freq, 1.0 + over * np.exp(-s / TAU)
    x = V / w * np.sin(w * s) * swell
    v = V * np.cos(w * s) * swell - V / w * np.sin(w * s) * over / TAU * np.exp(-s / TAU)
    return x, np.where(time >= ONSET, v, 0.0)


def record(snr: float = 25.0, freq: float = 100.0, over: float = 0.3, cycles: int = 100, rate=2e4, seed=0):
    time = np.arange(int((0.1 + cycles / freq) * rate)) / rate
    x, v = shaker(time, freq, over)
    noise = V / np.sqrt(2.0) * 10.0 ** (-snr / 20.0)
    noisy = v + 1e-3 + noise * np.random.default_rng(seed).standard_normal(time.size)
    return make_signal(noisy, "m/s", rate, name="velocity"), x


def test_sine_fit_is_exact_without_noise():
    time = 0.37 + np.arange(1500) / 1e4
    y = 0.1 + 0.03 * np.cos(2.0 * np.pi * 99.3 * time + 1.1) + 0.001 * np.cos(4.0 * np.pi * 99.3 * time)
    fit = fit_sine(SignalSamples(y, time, 1e4))
    assert fit.frequency == pytest.approx(99.3, rel=1e-11)
    assert fit.amplitude == pytest.approx(0.03, rel=1e-10)
    assert fit.phase == pytest.approx(1.1, abs=1e-8)
    assert fit.offset == pytest.approx(0.1, rel=1e-10)
    assert fit.distortion == pytest.approx(1.0 / 30.0, rel=1e-8)
    np.testing.assert_allclose(fit.waveform(time), y, atol=1e-10)


def test_standard_errors_of_the_sine_fit_cover_the_truth():
    rng, time = np.random.default_rng(1), 0.37 + np.arange(1500) / 1e4
    truth = 0.1 + 0.03 * np.cos(2.0 * np.pi * 99.3 * time + 1.1)
    scores = []
    for _ in range(150):
        fit = fit_sine(SignalSamples(truth + 0.004 * rng.standard_normal(1500), time, 1e4), 99.0, 3)
        turn = np.angle(np.exp(1j * (fit.phase - 1.1)))
        scores.append(
            [
                (fit.amplitude - 0.03) / fit.amplitude_se,
                (fit.frequency - 99.3) / fit.frequency_se,
                turn / fit.phase_se,
                (fit.offset - 0.1) / fit.offset_se,
            ]
        )
    spread = np.std(scores, axis=0)
    assert (np.mean(np.abs(scores) < 2.0, axis=0) > 0.90).all()
    assert (spread > 0.85).all() and (spread < 1.15).all()


@pytest.mark.slow
def test_a_frequency_that_is_pulled_has_the_error_of_its_mean():
    time = np.arange(18_000) / 2e4
    noise = 5e-4 * np.random.default_rng(0).standard_normal(time.size)
    steady = make_signal(0.03 * np.sin(2.0 * np.pi * 97.9 * time) + noise, "m/s", 2e4)
    pulled = make_signal(
        0.03 * np.sin(2.0 * np.pi * (97.9 + 0.025 * time / 0.9) * time) + noise, "m/s", 2e4
    )  # by 0.05 Hz from one end to the other
    lost = make_signal(np.delete(steady.values, slice(9000, 9200)), "m/s", 2e4)
    sine = measure_drive(steady, 97.9).steady
    assert sine.frequency_se < 1e-3 and abs(sine.frequency - 97.9) < 5.0 * sine.frequency_se
    for signal, mean in ((pulled, 97.925), (lost, 97.9)):
        sine = measure_drive(signal, 97.9).steady
        assert abs(sine.frequency - mean) < 3.0 * sine.frequency_se
        assert sine.frequency_se < 0.05


def test_snr_and_distortion_are_told_apart():
    time = np.arange(20_000) / 2e4
    rng = np.random.default_rng(2)
    y = np.cos(2.0 * np.pi * 100.0 * time) + 0.1 * np.cos(2.0 * np.pi * 300.0 * time + 0.5)
    fit = fit_sine(SignalSamples(y + np.sqrt(0.5) * 0.1 * rng.standard_normal(time.size), time, 2e4))
    assert fit.snr == pytest.approx(20.0, abs=0.1)
    assert fit.distortion == pytest.approx(0.1, rel=0.02)
    assert fit.sinad == pytest.approx(20.0 - 10.0 * np.log10(2.0), abs=0.1)
    assert fit.distortion_floor < 0.01


def test_the_start_is_found_and_described():
    signal, _ = record()
    drive = measure_drive(signal)
    start = drive.startup
    assert start.onset == pytest.approx(ONSET, abs=2e-4)
    assert abs(start.onset - ONSET) <= 2.0 * start.onset_uncertainty
    assert start.cycles in (2.0, 3.0, 4.0)  # 0.3 exp(-t/15 ms) falls below 5 % after 27 ms
    assert start.first_cycle_ratio == pytest.approx(1.22, abs=0.02)  # mean of the swell over one cycle
    assert start.overshoot == pytest.approx(0.22, abs=0.02)
    assert drive.steady.amplitude == pytest.approx(V, rel=1e-3)
    assert drive.steady.frequency == pytest.approx(100.0, abs=3.0 * drive.steady.frequency_se)
    assert drive.accepted and drive.steady.snr == pytest.approx(25.0, abs=0.2)
    assert "overshoot" in start.description and drive.summary()["accepted"] is True


@pytest.mark.parametrize("ramp", [0.0, 0.01])
def test_the_start_of_a_record_without_noise(ramp):
    """Sums as large as one over the square of no noise must not hide where the motion begins."""
    time = np.arange(0.0, 0.5, 5e-5)
    moving = np.clip(time - 0.1003, 0.0, None)
    swell = 1.0 - np.exp(-moving / ramp) if ramp else 1.0
    signal = make_signal(0.1 * swell * np.sin(2.0 * np.pi * 100.0 * moving), "m/s", 20_000.0)
    start = measure_drive(signal).startup
    assert abs(start.onset - 0.1003) <= 2.0 * start.onset_uncertainty


def test_a_steady_start_and_a_start_outside_the_record():
    prompt = measure_drive(record(over=0.0)[0]).startup
    assert prompt.duration == 0.0 and prompt.overshoot == 0.0 and "at once" in prompt.description
    running = measure_drive(record()[0].isel(time=slice(3000, None)))
    assert running.startup is None and "in motion" in running.summary()["startup"]


@pytest.mark.sampled(2)
@pytest.mark.parametrize(("snr", "accepted"), [(14.0, False), (16.0, True)])
def test_fifteen_decibels_decide(snr, accepted):
    drive = measure_drive(record(snr=snr)[0])
    assert drive.accepted is accepted
    assert any("noise" in note for note in drive.notes) is not accepted


def test_distortion_alone_refuses_a_test():
    time = np.arange(20_000) / 2e4
    y = 0.03 * (np.cos(2.0 * np.pi * 100.0 * time) + 0.25 * np.cos(2.0 * np.pi * 200.0 * time))
    drive = measure_drive(make_signal(y, "m/s", 2e4))
    assert not drive.accepted and "distortion" in drive.notes[-1]
    assert drive.steady.snr > 60.0


@pytest.mark.sampled(2)
@pytest.mark.parametrize(("snr", "share"), [(60.0, 0.003), (25.0, 0.02)])
def test_integration_does_not_drift(snr, share):
    signal, truth = record(snr=snr, cycles=200)
    found = displacement_from_velocity(signal)
    size = V / (2.0 * np.pi * 100.0)
    error = (found.values - truth) / size
    assert found.attrs["units"] == "m"
    assert np.std(error) < share and np.abs(error).max() < 8.0 * share
    late = error[-4000:]
    assert abs(late.mean()) < share  # plain integration of the 1 mm/s offset ends 40 amplitudes away


@pytest.mark.slow
@pytest.mark.parametrize(
    ("freq", "over", "polarity", "delay"),
    [
        pytest.param(100.0, 0.3, 1, 0.01234, marks=pytest.mark.slow),
        (300.0, 0.0, -1, -0.0301234),
        pytest.param(60.0, 0.3, 1, 0.1, marks=pytest.mark.slow),
    ],
)
def test_alignment_with_a_camera(freq, over, polarity, delay):
    signal, _ = record(freq=freq, over=over, cycles=60)
    time = np.arange(int((0.1 + abs(delay) + 50 / freq) * 1e4)) / 1e4
    noise = 2e-6 * np.random.default_rng(3).standard_normal(time.size)
    seen = make_signal(polarity * shaker(time - delay, freq, over)[0] + noise + 1e-3, "m", 1e4)
    found = align(seen, signal)
    assert found.certain and found.polarity == polarity
    assert abs(found.delay - delay) < max(3.0 * found.delay_se, 1e-6)
    assert found.delay_se < 1e-5  # a tenth of a frame
    assert found.gain == pytest.approx(1.0, abs=0.02)
    # with the start out of sight the cycle stays open, unless a trigger tells it
    cut = seen.isel(time=slice(int((0.07 + max(delay, 0.0)) * 1e4), None))
    open_cycle = align(cut, signal)
    assert not open_cycle.certain and "whole cycles" in open_cycle.description
    turns = (open_cycle.delay - delay) * freq * 2.0
    assert abs(turns - round(turns)) < 0.05
    told = align(cut, signal, polarity=polarity, near=delay + 0.2 / freq)
    assert told.certain and abs(told.delay - delay) < 2e-5


@pytest.mark.slow
def test_alignment_refuses_two_motions():
    other = make_signal(1e-4 * np.cos(2.0 * np.pi * 90.0 * np.arange(8000) / 1e4), "m", 1e4)
    with pytest.raises(InputError, match="same motion"):
        align(other, record()[0])


def test_the_recorded_drive_keeps_shape_and_adds_no_energy():
    signal, _ = record(snr=20.0, cycles=100)
    drive = recorded_drive(signal, 1e5)
    truth, _ = shaker(drive["time"].values + drive.attrs["source_start"])
    size = V / (2.0 * np.pi * 100.0)
    inner = slice(300, -300)
    assert np.std((drive["displacement"].values - truth)[inner]) < 0.03 * size
    measured = signal.values - 1e-3
    assert np.mean(drive["velocity"].values ** 2) < np.mean(measured[1008:] ** 2)
    spectrum = np.abs(np.fft.rfft(drive["velocity"].values * np.hanning(drive.sizes["time"]))) ** 2
    freq = np.fft.rfftfreq(drive.sizes["time"], 1e-5)
    assert spectrum[freq > 1.3 * drive.attrs["bandwidth"]].sum() < 1e-5 * spectrum.sum()
    # displacement and velocity belong together
    slope = np.gradient(drive["displacement"].values, 1e-5)
    assert np.abs(slope - drive["velocity"].values)[5:-5].max() < 2e-3 * V
    assert drive["displacement"].values[0] == 0.0 and drive.attrs["begins_at_rest"] == 1


def test_resampling_noise_free_is_faithful():
    signal, _ = record(snr=100.0, over=0.0, cycles=60)
    drive = recorded_drive(signal, 5e4, bandwidth=4000.0)
    truth, _ = shaker(drive["time"].values + drive.attrs["source_start"], over=0.0)
    error = (drive["displacement"].values - truth) / (V / (2.0 * np.pi * 100.0))
    assert np.std(error[200:]) < 2e-3


@pytest.mark.parametrize(
    ("make", "word"),
    [
        (lambda: measure_drive(make_signal(np.zeros(4000), "m/s", 1e4)), "no oscillation"),
        (lambda: measure_drive(make_signal(np.ones(4000), "m/s", 1e4), 97.9), r"is 1 everywhere.*--channel"),
        (lambda: measure_drive(make_signal(np.cos(np.arange(400) * 0.06), "m/s", 1e4)), "at least 8"),
        (lambda: measure_drive(make_signal(np.cos(np.arange(4000)), "V", 1e4)), "must be in m/s or m"),
        (lambda: measure_drive(np.zeros(5)), "DataArray"),
        (lambda: measure_drive(record()[0], 2e4), "half the sampling rate"),
        (lambda: measure_drive(record()[0], tolerance=0.7), "tolerance"),
        (lambda: fit_sine(SignalSamples(np.cos(np.arange(100) * 0.06), np.arange(100) / 1e4, 1e4), 95.0), "2"),
        (lambda: recorded_drive(record()[0], 1500.0), "sampling_frequency"),
        (lambda: recorded_drive(record()[0], 1e5, bandwidth=110.0), "bandwidth"),
        (lambda: align(record()[0], record()[0]), "units 'm/s'"),
        (lambda: align(record()[0], record()[0], polarity=0), "polarity"),
        (lambda: spectral_peak(SignalSamples(np.ones(100), np.arange(100.0), 1.0)), "no oscillation"),
    ],
)
def test_refusals(make, word):
    with pytest.raises(InputError, match=word):
        make()


def _of_the_sensor(change):
    """A record of the usual shaker with one thing wrong, as the change of its values over time."""
    time = np.arange(20_000) / 2e4
    noise = 3e-4 * np.random.default_rng(2).standard_normal(time.size)  # after 0.15 s of rest
    return make_signal(change(shaker(time - 0.1)[1] + noise, time), "m/s", 2e4, name="velocity")


@pytest.mark.sampled(3)
@pytest.mark.parametrize(
    ("kind", "change"),
    [
        ("low_pass", lambda v, t: scipy.signal.lfilter(*scipy.signal.butter(2, 150.0, fs=2e4), v)),
        ("crosstalk", lambda v, t: v + 0.05 * V * np.cos(2.0 * np.pi * 100.0 * t + 1.0)),
        ("saturated", lambda v, t: 1.5 * V * np.tanh(v / (1.5 * V))),
        ("one_sided", lambda v, t: v**2 / V),
        ("not_there", lambda v, t: np.abs(v)),
        ("beyond_shakers", lambda v, t: 1e3 * v),
    ],
)
def test_an_error_of_the_sensor_is_told(kind, change):
    code = f"vibrometer.{kind}"
    assert code not in [d.code for d in measure_drive(_of_the_sensor(lambda v, t: v), 100.0).diagnostics]
    assert code in [d.code for d in measure_drive(_of_the_sensor(change), 100.0).diagnostics]


def test_the_amplitude_behind_a_filter_and_a_saturated_amplifier_is_covered():
    for change in (
        lambda v, t: scipy.signal.lfilter(*scipy.signal.butter(2, 150.0, fs=2e4), v),
        lambda v, t: 1.5 * V * np.tanh(v / (1.5 * V)),
    ):
        steady = measure_drive(_of_the_sensor(change), 100.0).steady
        assert abs(steady.amplitude - V) < 2.0 * steady.amplitude_se


def told_of_noise(noise):
    """Diagnostics of a record of the shaker with this noise, by code."""
    values = shaker(np.arange(noise.size) / 2e4)[1] + 3e-4 * noise / noise.std()
    signal = make_signal(values, "m/s", 2e4, name="velocity")
    return {one.code[11:]: one for one in measure_drive(signal, 100.0).diagnostics}


@pytest.mark.slow
def test_integrated_noise_is_no_filter():
    rng = np.random.default_rng(3)
    for _ in range(3):
        drifting = np.cumsum(rng.standard_normal(12_000))
        told = told_of_noise(drifting - np.linspace(drifting[0], drifting[-1], 12_000))
        assert not {"low_pass", "high_pass", "notch"} & set(told)


def test_noise_behind_a_filter_of_first_order_tells_its_corner():
    noise = np.random.default_rng(3).standard_normal(20_000)
    told = told_of_noise(scipy.signal.lfilter(*scipy.signal.butter(1, 300.0, fs=2e4), noise))
    assert told["low_pass"].numbers["corner"] == pytest.approx(300.0, rel=0.6)


@pytest.mark.sampled(5)
@pytest.mark.parametrize(
    ("kind", "least"),
    [
        ("notch", 1),
        ("AC coupling", 1),
        ("slew limit", 2),
        ("hysteresis", 1),
        ("jitter", 1),
        *(
            pytest.param(*case, marks=pytest.mark.slow)
            for case in (("clock drifts", 1), ("gain switched", 2), ("few bits", 2), ("sign flipped", 2),
                         ("interpolated", 2), ("lost in step", 2))
        ),
    ],
)  # fmt: skip
def test_an_error_of_electronics_is_told_by_its_name(kind, least):
    outcomes = [
        random_signals.judged_drive(np.random.default_rng((9, random_signals.hash_of(kind), k)), kind) for k in range(2)
    ]
    names = random_signals.CAUSES[kind].split()
    assert sum(any(f"vibrometer.{name}" in one.codes for name in names) for one in outcomes) >= least
    assert all(one.flagged or one.ratio < 5.0 for one in outcomes)


@pytest.mark.sampled(2)
@pytest.mark.parametrize(("k", "kind", "told"), [(62, "notch", True), (93, "notch of 60 Hz", False)])
def test_a_notch_rings_whatever_the_start_is(k, kind, told):
    """They were wrong without a word where a start that no filter explains to the noise spoke for none."""
    outcome = random_signals.judged_drive(np.random.default_rng((22, k)), kind)
    assert ("vibrometer.notch" in outcome.codes) >= told and outcome.ratio < 5.0


@pytest.mark.slow
def test_a_third_harmonic_of_the_shaker_itself_is_no_saturation():
    rng = np.random.default_rng(4)
    for third in (0.06, 0.11, 0.11, 0.15):
        turn = np.pi + (0.05 if third == 0.11 else rng.uniform(-0.3, 0.3))
        found = measure_drive(
            _of_the_sensor(
                lambda v, t, third=third, turn=turn: v + third * V * (t > 0.1) * np.cos(6e2 * np.pi * (t - 0.1) + turn)
            ),
            100.0,
        )
        assert "vibrometer.saturated" not in [one.code for one in found.diagnostics]


@pytest.mark.sampled(4)
@pytest.mark.parametrize("kind", ["slew", "crossover", "samples_lost", "drifts", "beat", "high_pass", "notch"])
def test_an_error_of_electronics_is_named_and_covered(kind):
    rng = np.random.default_rng(5)
    frequency = 55.0 if kind == "notch" else 100.0
    time = np.arange(40_000) / 2e4
    since, noise = np.maximum(time - 0.2, 0.0), 3e-4 * rng.standard_normal(time.size)
    clean = V * np.cos(2.0 * np.pi * frequency * since) * (time >= 0.2)
    values = clean + noise
    if kind == "slew":
        values = random_signals.tracking(clean, 0.9 * V * 2.0 * np.pi * frequency / 2e4) + noise
    elif kind == "crossover":
        values = np.sign(clean) * np.maximum(np.abs(clean) - 0.05 * V, 0.0) + noise
    elif kind == "samples_lost":
        values = np.delete(values, np.arange(107, values.size, 107))
    elif kind == "drifts":
        values = clean * (1.0 + 0.08 * since) + noise
    elif kind == "beat":
        values = values + 0.1 * V * np.cos(2.0 * np.pi * (frequency + 0.3) * since + 1.0) * (time >= 0.2)
    elif kind == "high_pass":
        values = scipy.signal.lfilter(*scipy.signal.butter(1, 30.0, "high", fs=2e4), values)
    elif kind == "notch":
        values = scipy.signal.lfilter(*scipy.signal.iirnotch(50.0, 4.0, 2e4), values)
    drive = measure_drive(make_signal(values, "m/s", 2e4, name="velocity"))
    told = [one.code.partition(".")[2] for one in drive.diagnostics]
    assert kind in told and set(told) <= {kind, "unsteady", "slow_start"}
    assert abs(drive.steady.amplitude - V) < 3.0 * drive.steady.amplitude_se or kind == "drifts"
    assert abs(drive.steady.frequency - frequency) < 3.0 * drive.steady.frequency_se


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda v, a: (v, a), None),
        (lambda v, a: (10.0 * v, a), "power of ten"),
        (lambda v, a: (v, a / 9.80665), "g was read as"),
        (lambda v, a: (v / (2e2 * np.pi), a), "a displacement was read"),
    ],
)
def test_an_acceleration_tells_units_and_quantity(change, words):
    time = np.arange(20_000) / 2e4
    velocity = V * np.sin(2e2 * np.pi * time) + 3e-4 * np.random.default_rng(1).standard_normal(time.size)
    v, a = change(velocity, V * 2e2 * np.pi * np.cos(2e2 * np.pi * time))
    drive = measure_drive(make_signal(v, "m/s", 2e4), acceleration=make_signal(a, "m/s^2", 2e4))
    told = [one.message for one in drive.diagnostics if one.code == "vibrometer.acceleration"]
    assert bool(told) is (words is not None) and (not told or words in told[0])
    late = measure_drive(make_signal(v, "m/s", 4e4), acceleration=make_signal(a, "m/s^2", 2e4))
    assert "vibrometer.clocks" in [one.code for one in late.diagnostics]


def test_a_motion_that_no_shaker_makes_says_which_limit_it_passes():
    fast = beyond_shakers(fit_sine(SignalSamples(*_tone(4.0, 20.0), 2e4), 20.0), "m/s")
    assert [one.code for one in fast] == ["vibrometer.beyond_shakers"]
    assert fast[0].message.startswith("4 m/s are above 3 m/s, more than")
    assert beyond_shakers(fit_sine(SignalSamples(*_tone(1.0, 100.0), 2e4), 100.0), "m/s") == []


def _tone(amplitude, frequency):
    time = np.arange(20_000) / 2e4
    return amplitude * np.cos(2.0 * np.pi * frequency * time), time


@pytest.mark.sampled(2)
@pytest.mark.parametrize(("frequency", "start_up"), [(200.0, 0.02), (300.0, 0.01)])
def test_a_start_that_is_not_over_is_in_the_standard_error(frequency, start_up):
    """Twenty cycles of a shaker that is within a percent of its amplitude: 10 to 20 standard errors in silence once."""
    for seed in range(3):
        record = render_vibrometer(
            frequency, 0.01, duration=0.1 + 20.0 / frequency, onset=0.1, start_up=start_up, snr_db=40.0, rng=seed
        )
        steady = measure_drive(record).steady
        assert abs(steady.amplitude - 0.01) < 3.0 * steady.amplitude_se < 0.1 * 0.01
