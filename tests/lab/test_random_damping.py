"""Damping that depends on amplitude by laws of no list; the coverage of hundreds of records is in ``random_damping``."""

from __future__ import annotations

import numpy as np
import pytest
import random_damping
from random_signals import decay_signal

from snapbeam.lab import identify_decay, make_signal
from snapbeam.lab.decay.model import CURVE, DampingLaw, envelope

RISING = ("exponential", "root", "rational", "tanh", "logarithm", "cubic")


@pytest.mark.slow
def test_damping_by_a_law_of_no_list_is_within_the_standard_error_at_zero_amplitude():
    """By laws of a list alone nearly all of them were off by 3 to 35 standard errors, or two modes."""
    places = [k for k in range(27) if tuple(random_damping.LAWS)[k % len(random_damping.LAWS)] in RISING]
    found = [random_damping.judged(31, k) for k in places]
    assert np.mean([abs(off) < 2.5 for _, off, *_ in found]) > 0.8
    assert max(abs(off) for _, off, *_ in found) < 6.0
    assert not [law for law, *_, codes in found if "close_modes" in codes]
    assert sum("damping_curve" in codes for *_, codes in found) > 0.5 * len(found)


@pytest.mark.parametrize(("seed", "k"), [(5102, 33), (5102, 70), (7008, 6)])
def test_a_short_decay_of_few_amplitudes_leaves_its_law_open(seed, k):
    """Of fewer than ten amplitudes no law was doubted: 33 % off, and 18.7 standard errors."""
    _, off, other, *_ = random_damping.judged(seed, k, (0.8, 2.5))
    assert max(abs(off), abs(other)) < 3.0


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "k"), [(6001, 4), (6001, 52), (6001, 195), (6001, 215)])
def test_a_curve_begins_at_the_amplitude_of_the_start_and_is_no_mode(seed, k):
    """Off by 3 to 15 standard errors: the start by the mean rate, or what a law leaves taken out as another mode."""
    _, off, other, *_, codes = random_damping.judged(seed, k)
    assert max(abs(off), abs(other)) < 2.5 and set(codes) & {"damping_curve", "damping_law"}


@pytest.mark.parametrize(
    "damping", [lambda a: 0.0035 - 0.0030 * np.expm1(-a / 0.4), lambda a: 0.0025 + 0.0045 * np.sqrt(a)]
)
def test_a_curve_follows_the_damping_where_the_record_has_it(damping):
    rate, freq = 4000.0, 70.0
    time = np.arange(8000) / rate
    a, step = np.empty(time.size), 2.0 * np.pi * freq / rate
    a[0] = 1.0
    for k in range(time.size - 1):
        a[k + 1] = a[k] * np.exp(-step * damping(a[k]))
    noise = 3e-3 * np.random.default_rng(4).standard_normal(time.size)
    fit = identify_decay(make_signal(a * np.cos(2.0 * np.pi * freq * time) + noise, "m", rate))
    mode = fit.modes[0]
    assert mode.damping.name == "free" and len(fit.modes) == 1
    seen = CURVE * mode.amplitude > 0.05
    curve = mode.damping_ratio * mode.damping.curve
    assert curve[seen] == pytest.approx(damping(CURVE[seen] * mode.amplitude), rel=0.05)
    assert abs(mode.damping_ratio - damping(0.0)) < 2.5 * mode.damping_ratio_se
    assert np.all(np.diff(mode.damping.curve) <= 1e-12)


def test_the_envelope_of_a_free_form_is_that_of_the_law_in_closed_form():
    time = np.linspace(0.0, 4.0, 50)
    drag = envelope(DampingLaw("free", 0.7, 0.0, 1.0 + 0.7 * CURVE), time, 1.3)
    assert drag == pytest.approx(envelope(DampingLaw("quadratic", 0.7), time, 1.3), rel=1e-3)


@pytest.mark.slow
def test_beats_are_still_two_modes():
    found = [decay_signal(np.random.default_rng((17, k)), "close modes")[0] for k in range(6)]
    codes = [{one.code for one in identify_decay(signal).diagnostics} for signal in found]
    assert sum("decay.close_modes" in one for one in codes) >= 4
    assert not any("decay.damping_curve" in one for one in codes)
