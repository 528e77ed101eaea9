"""Frequency responses: of an oscillator whose response is known, with noise on either side, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from scipy.signal import cont2discrete, dlsim, lfilter
from typer.testing import CliRunner

from snapbeam import InputError, lab
from snapbeam.cli.app import app
from snapbeam.lab.coherence import windowed_pole
from snapbeam.util.diagnostics import diagnostics_of

RATE = 2000.0  # Hz
MASS, FREQUENCY, DAMPING = 0.02, 81.3, 0.03  # kg, Hz, 1
TURN = 2.0 * np.pi * FREQUENCY
OSCILLATOR = cont2discrete(
    tuple(
        np.array(each)
        for each in ([[0.0, 1.0], [-(TURN**2), -2.0 * DAMPING * TURN]], [[0.0], [1.0 / MASS]], [[1.0, 0.0]], [[0.0]])
    ),
    1.0 / RATE,
)[:4]


def exact(frequency):
    """Response of the sampled oscillator [m/N] to a force that is constant between samples."""
    a, b, c, _ = OSCILLATOR
    turned = np.exp(2j * np.pi * np.asarray(frequency) / RATE)
    return np.array([(c @ np.linalg.solve(z * np.eye(2) - a, b)).item() for z in turned])


def records(seed, noise=(0.0, 0.0), count=60_000):
    """Force and displacement with noise of given shares of their root mean squares."""
    rng = np.random.default_rng(seed)
    force = rng.standard_normal(count)
    _, motion, _ = dlsim((*OSCILLATOR, 1.0 / RATE), force[:, None])
    pair = [
        values + share * values.std() * rng.standard_normal(count)
        for values, share in zip((force, motion[:, 0]), noise, strict=True)
    ]
    return lab.make_signal(pair[0], "N", RATE, name="force"), lab.make_signal(pair[1], "m", RATE, name="beam")


def struck(seed, frequency, damping, count):
    """Signals of an oscillator of unit mass and impulse-invariant response with 3 % of noise, and its height at resonance."""
    rng = np.random.default_rng(seed)
    force = rng.standard_normal(count)
    turn = 2.0 * np.pi * frequency / RATE
    free, fall = turn * np.sqrt(1.0 - damping**2), np.exp(-damping * turn)
    above = [0.0, fall * np.sin(free) * turn / free / (2.0 * np.pi * frequency) / RATE]
    motion = lfilter(above, [1.0, -2.0 * fall * np.cos(free), fall**2], force)
    motion += 0.03 * motion.std() * rng.standard_normal(count)
    height = 1.0 / (2.0 * damping * (2.0 * np.pi * frequency) ** 2)
    return lab.make_signal(force, "N", RATE), lab.make_signal(motion, "m", RATE), height


@pytest.mark.parametrize("estimator", ["h1", "h2"])
@pytest.mark.parametrize(
    ("frequency", "damping", "lines"), [(150.0, 0.004, 1.0), (90.0, 0.01, 2.0), (70.3, 0.02, 4.0), (210.0, 0.012, 9.0)]
)
def test_the_mode_at_the_peak_has_no_bias_by_the_window(frequency, damping, lines, estimator):
    resolution = 2.0 * damping * frequency / lines
    force, motion, height = struck(11, frequency, damping, int(60 * RATE / resolution))
    found = lab.frequency_response(force, motion, resolution=resolution, estimator=estimator)
    for name, true in (("frequency", frequency), ("magnitude", height), ("damping_ratio", damping)):
        value, error = found.attrs[f"peak_{name}"], found.attrs[f"peak_{name}_se"]
        assert abs(value - true) < 3.0 * error + 2e-3 * true * (name != "frequency"), name
        assert error < 0.15 * true
    top = found.isel(frequency=int(np.argmax(found.magnitude.values)))
    assert abs(top.magnitude - height) < 3.0 * top.magnitude_se
    told = "response.coarse" in [one.code for one in diagnostics_of(found)]
    assert told == (abs(float(top.window_bias)) > 0.02)
    assert told == (estimator == "h1" and lines < 8.0)


def test_a_response_without_a_peak_has_no_mode():
    rng = np.random.default_rng(12)
    force = lab.make_signal(rng.standard_normal(20_000), "N", RATE)
    flat = lab.make_signal(2.0 * force.values + 0.01 * rng.standard_normal(20_000), "m", RATE)
    found = lab.frequency_response(force, flat, resolution=5.0)
    assert not diagnostics_of(found) and "peak_magnitude" not in found.attrs
    assert not found.window_bias.any()


@pytest.mark.parametrize("lines", [3.0, 6.0, 12.0, 25.0])
def test_a_pole_through_a_window_is_lowered_as_its_closed_form_says(lines):
    """-4/(3 L**2) with L lines in the half-power width, and the transform of the window's autocorrelation by a sum."""
    turn = np.array([np.pi * lines + 0j, np.pi * lines + 3.0j])
    found = windowed_pole(turn) * turn
    assert found[0].real - 1.0 == pytest.approx(-4.0 / (3.0 * lines**2), rel=5.0 / lines**2)
    time = (np.arange(200_000) + 0.5) / 200_000
    shape = (1.0 - time) * (2.0 + np.cos(2.0 * np.pi * time)) / 3.0 + np.sin(2.0 * np.pi * time) / (2.0 * np.pi)
    for k in range(2):
        assert found[k] == pytest.approx((shape * np.exp(-turn[k] * time)).mean() * turn[k], rel=1e-6)


def test_standard_errors_cover_the_response_of_an_oscillator():
    """Two standard errors of magnitude and phase cover 95 % of the lines, also where noise limits them."""
    covered = []
    for seed in range(2):
        found = lab.frequency_response(*records(seed, (0.0, 0.5)), resolution=1.0)
        found = found.sel(frequency=slice(5.0, 150.0))
        truth = exact(found.frequency)
        covered.append(np.abs(found.magnitude - np.abs(truth)) < 2.0 * found.magnitude_se)
        turned = np.angle(np.exp(1j * (found.phase.values - np.angle(truth))))
        covered.append(np.abs(turned) < 2.0 * found.phase_se)
    assert 0.90 < np.mean(covered) < 0.985


def test_noise_of_one_signal_biases_the_other_estimator():
    for noise, unbiased, biased, side in (((0.0, 0.5), "h1", "h2", 1.0), ((0.5, 0.0), "h2", "h1", -1.0)):
        pair = records(7, noise)
        gain = {}
        for name in (unbiased, biased):
            found = lab.frequency_response(*pair, estimator=name).sel(frequency=slice(110.0, 160.0))
            gain[name] = float((found.magnitude / np.abs(exact(found.frequency))).mean())
        assert gain[unbiased] == pytest.approx(1.0, abs=0.06)
        assert side * (gain[biased] - 1.0) > 0.15


def test_coherence_of_noise_and_its_limit():
    """Signal to noise of 1 in power makes a coherence of 1/2; unrelated signals exceed the limit at 5 % of the lines."""
    rng = np.random.default_rng(3)
    x, y = rng.standard_normal((2, 400_000))
    force = lab.make_signal(x, "N", RATE)
    half = lab.frequency_response(force, lab.make_signal(x + y, "N", RATE), resolution=2.0)
    assert float(half.coherence.mean()) == pytest.approx(0.5, abs=0.01)
    assert half.magnitude.attrs["units"] == "1"
    none = lab.frequency_response(force, lab.make_signal(y, "N", RATE), resolution=2.0)
    assert float((none.coherence > none.attrs["coherence_limit"]).mean()) == pytest.approx(0.05, abs=0.02)
    assert [one.code for one in diagnostics_of(none)] == ["response.incoherent"]
    assert float(none.phase_se.max()) == pytest.approx(np.pi / np.sqrt(3.0))


def test_a_delay_is_a_phase_and_the_common_part_is_used():
    x = np.random.default_rng(4).standard_normal(50_000)
    force = lab.make_signal(x, "N", RATE)
    later = lab.make_signal(2.0 * np.roll(x, 3)[100:], "N", RATE, start=100 / RATE)
    found = lab.frequency_response(force, later, resolution=10.0)
    turn = -2.0 * np.pi * found.frequency * 3 / RATE
    assert float(np.abs(np.exp(1j * found.phase) - np.exp(1j * turn)).max()) < 0.05
    np.testing.assert_allclose(found.magnitude, 2.0, rtol=0.05)


def test_a_sine_and_a_coarse_peak_are_found():
    force, motion = records(5)
    coarse = lab.frequency_response(force, motion, resolution=8.0)
    assert [one.code for one in diagnostics_of(coarse)] == ["response.coarse"]
    time = force.time.values
    rng = np.random.default_rng(6)
    sine = [
        lab.make_signal(np.sin(2.0 * np.pi * 50.0 * time) + 1e-3 * rng.standard_normal(time.size), unit, RATE)
        for unit in ("N", "m")
    ]
    codes = [one.code for one in diagnostics_of(lab.frequency_response(*sine, resolution=1.0))]
    assert "response.incoherent" in codes


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"rate": 2001.0}, "both must have the same sampling frequency"),
        ({"start": 0.3 / RATE}, "0.30 of a sample"),
        ({"start": 99.0}, "no time in common"),
        ({"values": np.zeros(4000)}, "must not be constant"),
        ({"resolution": 0.1}, "must be from 1 to 250 Hz for 4 s"),
        ({"resolution": 2e3}, "must be from 1 to 250 Hz"),
        ({"resolution": -1.0}, "resolution"),
        ({"estimator": "h3"}, "estimator"),
    ],
)
def test_refusals(change, words):
    values = np.random.default_rng(0).standard_normal(8000)
    force = lab.make_signal(values, "N", RATE)
    own = change.pop("values", values[: change.pop("count", 8000)])
    motion = lab.make_signal(own, "m", change.pop("rate", RATE), start=change.pop("start", 0.0))
    if own.size < 8000:
        force = force[: own.size]
    with pytest.raises(InputError, match=words):
        lab.frequency_response(force, motion, **change)


def test_the_advised_limits_of_the_resolution_are_accepted():
    force, motion = records(8, count=8000)
    for resolution in (1.0, 250.0):
        assert lab.frequency_response(force, motion, resolution=resolution).sizes["frequency"] >= 4


@pytest.mark.slow
def test_the_command_writes_what_can_be_drawn_and_exported(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    force, motion = records(9, (0.0, 0.1))
    table = np.column_stack([force.time, force, motion])
    np.savetxt("hammer.csv", table, delimiter=",", header="time [s],force [N],beam [m]", comments="")
    run = CliRunner().invoke
    words = ["--excitation", "force", "--response", "beam", "--resolution", "0.5"]
    answer = run(app, ["frf", "hammer.csv", *words, "-o", "found.nc", "--plot", "found.png"])
    assert answer.exit_code == 0, answer.output
    assert "beam over force" in answer.output and " m/N at 81" in answer.output
    for more in (["plot", "found.nc", "-o", "again.svg"], ["info", "found.nc", "--export", "found.uff"]):
        answer = run(app, more)
        assert answer.exit_code == 0, answer.output
    import pyuff

    found = xr.open_dataset("found.nc", engine="h5netcdf")
    response, coherence = (pyuff.UFF("found.uff").read_sets(k) for k in (0, 1))
    assert (response["func_type"], coherence["func_type"]) == (4, 6)
    np.testing.assert_allclose(np.abs(response["data"]), found.magnitude)
    np.testing.assert_allclose(coherence["data"], found.coherence)
    np.testing.assert_allclose(response["x"], found.frequency, rtol=1e-5)
    assert response["ordinate_axis_units_lab"].strip() == "m" and response["orddenom_axis_units_lab"].strip() == "N"


def test_the_command_names_no_peak_of_unrelated_signals(tmp_path, monkeypatch):
    """Single lines exceed the limit by chance; none of them is a peak."""
    monkeypatch.chdir(tmp_path)
    values = np.random.default_rng(0).standard_normal((20_000, 2))
    table = np.column_stack([np.arange(20_000) / RATE, values])
    np.savetxt("noise.csv", table, delimiter=",", header="time [s],force [N],beam [m]", comments="")
    answer = CliRunner().invoke(app, ["frf", "noise.csv", "--excitation", "force", "--response", "beam"])
    assert answer.exit_code == 0 and "response.incoherent" in answer.output and "highest peak" not in answer.output
