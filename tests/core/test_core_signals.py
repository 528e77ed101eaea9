"""Signals of the native core: bounds, layouts and restarts with motions of every kind."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest
from core_systems import arrays, beam, stop

import snapbeam as sb
from snapbeam import _core
from snapbeam.dynamics.stroboscope import Stroboscope
from snapbeam.model import default_values
from snapbeam.model.drive.base import DRIVES, Drive, Timed
from snapbeam.model.drive.components import Tone, fitted, in_pieces
from snapbeam.model.quantity import RUN, quantity
from snapbeam.solver import channels, native
from snapbeam.solver.excitation import motion_of
from snapbeam.util.validation import InputError

TIMES = np.arange(4000) / 1e4
RECORD = 30.0 * np.sin(700.0 * TIMES) + 10.0 * np.cos(330.0 * TIMES)
BURST = sb.Burst(frequency_ratio=1.1, velocity_amplitude=0.3, duration_cycles=4.0, retraction=0.5)
PULSE = sb.HalfSine(displacement_amplitude=0.6, duration=0.7)
SINE = sb.Sine(frequency_ratio=1.3, velocity_amplitude=0.01, phase=0.4)
MOTIONS = [
    SINE,
    SINE + BURST,
    SINE + PULSE,
    PULSE,
    BURST,
    sb.Sine(frequency_ratio=1.2, velocity_amplitude=0.1) + sb.Sine(frequency_ratio=1.8, velocity_amplitude=0.02, phase=0.9),
    sb.Chirp(start_ratio=0.5, stop_ratio=2.0, velocity_amplitude=0.1, sweep_cycles=4.0),
    sb.Shock(acceleration_g=20.0, duration_ms=11.0),
    sb.Shock(acceleration_g=20.0, duration_ms=11.0, shape="trapezoid", rise_fraction=0.2),
    sb.BandLimitedNoise(low_ratio=0.5, high_ratio=3.0, velocity_rms=0.2, seed=7),
    sb.RecordedAcceleration(record=RECORD, sampling_frequency=1e4),
]  # fmt: skip


def driven(drive: sb.Drive, modes: int = 1, **parts) -> sb.System:
    contact = sb.Contact(default_values.CONTACT, sb.Striker(drive=drive, location=1 / 2.1))
    return sb.System(beam(modes), contacts=[contact, *parts.pop("more", ())], **parts)


def moved_by_everything(modes: int) -> sb.System:
    """Pieces, windows, sweeps, jumps and tones on a striker, a second one, the base, a force and the load."""
    chirp = sb.Chirp(start_ratio=0.5, stop_ratio=2.0, velocity_amplitude=0.1, sweep_cycles=1.0, sweep_type="log")
    second = sb.Contact(default_values.CONTACT, sb.Striker(drive=chirp, location=0.6, side="above", gap=1e-4))
    return driven(
        sb.Sine(frequency_ratio=1.3, velocity_amplitude=0.2, phase=0.4) + PULSE,
        modes,
        more=[second, stop(sb.KelvinVoigt(2e5, 1.0))],
        base_excitation=sb.BaseExcitation(
            motion=sb.BandLimitedNoise(low_ratio=0.5, high_ratio=3.0, velocity_rms=0.02, seed=3), striker_on_base=False
        ),
        forces=[
            sb.ExternalForce(history=sb.RecordedForce(record=1e-4 * RECORD, sampling_frequency=1e4), location=0.4)
        ],
        axial_load=sb.AxialLoadModulation(motion=sb.RampForce(change=2.0, duration=0.6, hold_periods=0.3)),
    )  # fmt: skip


@pytest.mark.parametrize("drive", MOTIONS, ids=lambda each: each.name)
def test_bounds_cover_the_motion(drive):
    """The signals of a motion together bound its speed: an onset is not looked for where they exclude it."""
    system = driven(drive)
    found, scale = arrays(system, 2).batch["signals"][0], system.scale
    value, slope = found[:, -3].sum(), found[:, -2].sum()
    moved, speed, _ = np.abs(motion_of(drive, scale, 0.05)(np.linspace(0.0, 0.05, 4001))).max(axis=1)
    assert value >= moved * (1.0 - 1e-12)
    assert speed * (1.0 - 1e-12) <= slope


@pytest.mark.parametrize("modes", [1, 3, 8])
def test_lanes_of_runs_and_single_runs_have_the_same_bits(modes):
    points = {"base_excitation.velocity_rms": np.linspace(0.01, 0.05, 11)}
    found = {}
    for layout in ("runs", "thread"):
        own = arrays(moved_by_everything(modes), 2, points)
        _core.integrate(own.problem, own.batch, layout, "", 1, None)
        found[layout] = own.batch["statistics"], own.batch["of_channels"]
    for one, other in zip(found["runs"], found["thread"], strict=True):
        assert np.array_equal(one, other, equal_nan=True)
    assert (found["runs"][0][:, native.OF_CORE.index("status")] == 0).all()
    assert (found["runs"][1][:, :3, native.OF_CHANNEL.index("impacts")].sum(axis=0) > 0).any()


@pytest.mark.parametrize("modes", [1, 3, 20])
def test_a_run_in_pieces_is_the_run(modes, monkeypatch):
    system = moved_by_everything(modes)
    how = sb.Integration(cycles=2, engine="native")
    whole = sb.simulate(system, how).dataset
    monkeypatch.setattr(native, "_SAMPLES", 400)
    monkeypatch.setattr(native, "_BUDGET", 37)
    again = sb.simulate(system, how).dataset
    for name in whole.data_vars:
        assert np.array_equal(whole[name].values, again[name].values, equal_nan=True), name


NOISE = sb.BandLimitedNoise(low_ratio=0.5, high_ratio=3.0, velocity_rms=0.2, seed=7)


@pytest.mark.sampled(2)
@pytest.mark.parametrize("modes", [2, 40])
@pytest.mark.parametrize("drive", [NOISE, SINE + NOISE], ids=["noise", "sine+noise"])
def test_a_sum_of_many_tones_is_its_tones_and_has_their_derivatives(drive, modes, monkeypatch):
    how = sb.Integration(cycles=2, accuracy="reference")
    system, found = driven(drive, modes), []
    names = [name for name in system.parameters if name.startswith(("drive.velocity", "drive.low", "drive.frequency"))]
    for few in (channels._FEW_TONES, 1000):
        monkeypatch.setattr(channels, "_FEW_TONES", few)
        assert (channels.PARTIAL in arrays(system, 2).problem["signal_kinds"]) == (few < 1000)
        run = sb.simulate(system, how)
        assert run.summary.impacts > 0
        slopes = sb.uncertainty.gradient(system, "rms_displacement", names[:3], integration=how)
        statistics = [run.summary[name] for name in ("rms_displacement", "peak_force", "max_displacement")]
        found.append((statistics, slopes["derivative"].values))
    for one, other, close in zip(*found, (1e-9, 1e-6), strict=True):
        np.testing.assert_allclose(one, other, rtol=close)


@dataclass(frozen=True, kw_only=True)
class OwnPulse(Timed):
    """Half a period of a sine: the velocity jumps at its end."""

    height: float = quantity("m", "height", low=0.0, scope=RUN)
    name = "own_pulse"
    discontinuities = ("duration",)

    def cycle(self, columns, scale):
        return np.full(columns["height"].size, 2.0 * math.pi / scale.omega)

    def shape_numbers(self, columns, scale):
        duration = np.full(columns["height"].size, 1.3 * math.pi / scale.omega)
        return {"fastest": math.pi / duration, "amplitude": columns["height"], "duration": duration}

    def bounds(self, columns, scale):
        return columns["height"], columns["height"] * scale.omega / 1.3

    @staticmethod
    def motion(drive, t):
        if t >= drive.duration:
            return 0.0, 0.0
        return drive.amplitude * math.sin(drive.fastest * t), drive.amplitude * drive.fastest * math.cos(drive.fastest * t)  # fmt: skip


del DRIVES["own_pulse"]


def test_a_users_motion_without_components_is_approximated(monkeypatch):
    """Runs as those of the same motion given as tone and window; heights differ between runs."""
    monkeypatch.setitem(DRIVES, "own_pulse", OwnPulse)

    def components(self, columns, scale):
        numbers = self.shape_numbers(columns, scale)
        window = in_pieces((np.zeros(1), {0: np.ones(1)}), (numbers["duration"], {}))
        return [Tone(numbers["amplitude"], numbers["fastest"], window=window)]

    striker = sb.Striker(drive=OwnPulse(height=1e-4))
    system = sb.System(beam(3), contacts=[sb.Contact(default_values.CONTACT, striker)])
    how, axes = (sb.Integration(cycles=1, engine="native", accuracy="reference"), {"drive.height": [5e-5, 1e-4, 4e-4]})
    found = sb.sweep(system, axes, how)
    monkeypatch.delattr(OwnPulse, "motion")
    monkeypatch.setattr(OwnPulse, "components", components)
    wanted = sb.sweep(system, axes, how)
    for name in ("peak_force", "max_displacement", "work", "impulse"):
        if name in wanted:
            np.testing.assert_allclose(found[name], wanted[name], rtol=1e-6)
    assert (found.impacts > 0).all()


@pytest.mark.filterwarnings("ignore:engine = .python.")
def test_a_users_motion_is_one_for_every_engine_and_in_a_sum(monkeypatch):
    """As the half-sine of the package: on a striker by both engines, in a sum, and as a motion at given times."""
    monkeypatch.setitem(DRIVES, "own_pulse", OwnPulse)
    model = beam(2)
    height = 0.3 * model.length_scale
    own, known = OwnPulse(height=height), sb.HalfSine(displacement_amplitude=0.3, duration=0.65)
    scale, times = driven(known).scale, np.linspace(0.0, 0.03, 301)
    found, wanted = motion_of(own, scale, 0.03)(times), motion_of(known, scale, 0.03)(times)
    for each, of, close in zip(found, wanted, (1e-9, 1e-6, 1e-3), strict=True):
        np.testing.assert_allclose(each, of, rtol=0.0, atol=close * np.abs(of).max())
    for one, other in ((own, known), (SINE + own, SINE + known)):
        for engine in ("native", "python"):
            how = sb.Integration(cycles=1, engine=engine, accuracy="reference")
            runs = [sb.simulate(driven(drive, 2), how).summary for drive in (one, other)]
            assert runs[0].impacts == runs[1].impacts > 0
            assert runs[0].peak_force == pytest.approx(runs[1].peak_force, rel=1e-6)


@dataclass(frozen=True, kw_only=True)
class OwnCycle(Drive):
    """A motion that repeats, by its phase: a sine with an overtone."""

    height: float = quantity("m", "height", low=0.0, scope=RUN)
    phase: float = quantity("rad", "phase at the start", default=0.0, scope=RUN)
    name = "own_cycle"

    def numbers(self, columns, scale):
        return {"omega": np.full(columns["height"].size, 1.1 * scale.omega), "amplitude": columns["height"]}

    def cycle(self, columns, scale):
        return 2.0 * math.pi / self.numbers(columns, scale)["omega"]

    def bounds(self, columns, scale):
        return 1.2 * columns["height"], 1.4 * columns["height"] * 1.1 * scale.omega

    @staticmethod
    def motion(drive, t):
        x, a = drive.omega * t, drive.amplitude
        return a * (math.sin(x) + 0.2 * math.sin(2.0 * x)), a * drive.omega * (math.cos(x) + 0.4 * math.cos(2.0 * x))


del DRIVES["own_cycle"]


@pytest.mark.filterwarnings("ignore:engine = .python.")
@pytest.mark.parametrize("engine", ["native", "python"])
@pytest.mark.parametrize("beside", [False, True], ids=["alone", "beside another motion"])
def test_a_users_motion_begins_at_its_phase(monkeypatch, engine, beside):
    """Displacement of the tip over time: a later phase is the motion some time later, whatever else moves."""
    monkeypatch.setitem(DRIVES, "own_cycle", OwnCycle)
    load = sb.AxialLoadModulation(motion=sb.HarmonicForce(frequency_ratio=2.0, amplitude=1e-3))
    parts = {"axial_load": load} if beside else {}
    system = driven(OwnCycle(height=1e-6, phase=0.8), 1, **parts)
    times = np.linspace(0.0, 0.9, 40) * 2.0 * math.pi / (1.1 * system.scale.omega)
    run = sb.simulate(system, sb.Integration(cycles=1, engine=engine), sample_times=times).dataset
    x = 1.1 * system.scale.omega * times + 0.8
    wanted = 1e-6 * (np.sin(x) + 0.2 * np.sin(2.0 * x))
    moved = run.striker_displacement.values * system.scale.length
    np.testing.assert_allclose(moved - moved[0], wanted - wanted[0], rtol=0.0, atol=1e-13)


@pytest.mark.slow
def test_a_derivative_by_a_users_motion(monkeypatch):
    """Its table of pieces depends on the parameter: differences between runs, not the table held still."""
    monkeypatch.setitem(DRIVES, "own_cycle", OwnCycle)
    flow = Stroboscope(driven(OwnCycle(height=1e-4), 2), sb.Integration(accuracy="reference"))
    x = flow.advance(flow.coordinates(), 9).states[0]
    found = flow.slope(x, 2, {"drive.height": 1e-4}, "drive.height", 1e-9)
    ends = [
        flow.advance(x[None], 2, points={"drive.height": np.array([at])}).states[0] for at in (1e-4 + 3e-9, 1e-4 - 3e-9)
    ]
    expected = (ends[0] - ends[1]) / 6e-9
    assert np.abs(expected).max() > 1e3
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-5 * np.abs(expected).max())


def test_a_discontinuity_that_no_number_has_is_refused(monkeypatch):
    monkeypatch.setitem(DRIVES, "own_pulse", OwnPulse)
    monkeypatch.setattr(OwnPulse, "discontinuities", ("later",))
    with pytest.raises(InputError, match=r"later is not among the numbers omega, fastest, amplitude, duration"):
        sb.simulate(driven(OwnPulse(height=1e-4)), sb.Integration(cycles=1))


@pytest.mark.parametrize(
    "motion",
    [lambda t: (abs(t - 0.3331), math.copysign(1.0, t - 0.3331)), lambda t: (math.nan, 0.0)],
    ids=["corner", "nan"],
)
def test_a_motion_that_is_not_smooth_is_refused(motion):
    with pytest.raises(
        InputError, match=r"Own\.motion at .* name the times of its jumps in discontinuities, or define components"
    ):
        fitted("Own", motion, 1.0, 0.1, [])


def test_pieces_of_a_motion_are_close_to_it():
    def motion(t):
        return (math.exp(-3.0 * t) * math.sin(40.0 * t), math.exp(-3.0 * t) * (40.0 * math.cos(40.0 * t) - 3.0 * math.sin(40.0 * t)))  # fmt: skip

    made = fitted("Own", motion, 2.0, 0.05, [0.7])
    t = np.linspace(0.0, 2.0, 3001)
    piece = np.searchsorted(made.begins[0], t, side="right") - 1
    x = t - made.begins[0][piece]
    value = sum(made.coefficients[0][piece, k] * x**k for k in range(6))
    rate = sum(k * made.coefficients[0][piece, k] * x ** (k - 1) for k in range(1, 6))
    wanted = np.array([motion(each) for each in t])
    assert np.abs(value - wanted[:, 0]).max() < 3e-9 and np.abs(rate - wanted[:, 1]).max() < 1e-6 * 40.0
