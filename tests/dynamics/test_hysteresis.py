"""Sweeps up and down: the state is carried on, with the circuit of a harvester too."""

from __future__ import annotations

import dataclasses

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

import snapbeam as sb
from snapbeam.cli.app import app
from snapbeam.model.default_values import BEAM

NAME = "base_excitation.acceleration_amplitude"
STEPS = sb.Integration(cycles=12)


@pytest.fixture(scope="module")
def shaken():
    layers = sb.PiezoelectricHarvester(moment_per_volt=-1.245e-4, capacitance=3.085e-7, resistance=1e4)
    motion = sb.AccelerationSine(frequency_ratio=0.9, acceleration_amplitude=0.02)
    model = sb.ReducedModel.from_beam(BEAM, modes=2, damping_ratio=0.02)
    return sb.System(model, harvesters=[layers], base_excitation=sb.BaseExcitation(motion=motion))


@pytest.mark.slow
def test_each_run_begins_with_the_last_state_of_the_run_before(shaken):
    found = sb.dynamics.hysteresis(shaken, NAME, [0.02, 0.06], STEPS)
    assert found["harvested_power"].dims == ("sweep", "base_excitation_acceleration_amplitude")
    state, power = None, []
    for value in (0.02, 0.06, 0.06, 0.02):
        run = sb.simulate(shaken.replace(**{NAME: value, "initial_state": state}), STEPS, sample_times=[0.0])
        state = run.final_state
        power.append(run.summary.harvested_power_last_quarter)
    late = found["harvested_power_last_quarter"].values
    np.testing.assert_array_equal(np.append(late[0], late[1, ::-1]), power)
    assert late[0, 1] != late[1, 1], "the second run at one value begins with another state"
    ax = sb.plot.plot_statistic(found, "harvested_power_last_quarter")
    assert [line.get_label() for line in ax.lines] == ["swept up", "swept down"]
    plt.close("all")


@pytest.mark.slow
def test_the_runs_after_a_failed_one_are_marked(shaken, monkeypatch):
    """A run without a last state ends the sweeps; the runs that follow are not computed."""
    done = sb.simulate(shaken, STEPS, sample_times=[0.0])
    failed = done.summary.__class__(
        dict(done.summary) | {"status": sb.RunStatus.DIVERGED, "response_class": -1, "harvested_power": np.nan}
    )
    of_failed = dataclasses.replace(done, summary=failed, final_state=None)
    monkeypatch.setattr("snapbeam.dynamics.swept.simulate", lambda *_, **__: of_failed)
    found = sb.dynamics.hysteresis(shaken, NAME, [0.02, 0.06], STEPS)
    status = found["status"].values
    assert status[0, 0] == sb.RunStatus.DIVERGED
    assert (np.append(status[0, 1], status[1]) == sb.RunStatus.NOT_RUN).all()
    assert (found["response_class"] == sb.ResponseClass.UNKNOWN).all()
    assert np.isnan(found["harvested_power"]).all()


@pytest.mark.slow
def test_a_softening_beam_has_two_answers():
    """Within a well the resonance bends to low frequencies: the two sweeps differ where both responses exist."""
    motion = sb.AccelerationSine(frequency_ratio=0.9, acceleration_amplitude=0.006)
    model = sb.ReducedModel.from_beam(BEAM, modes=1, damping_ratio=0.01)
    system = sb.System(model, base_excitation=sb.BaseExcitation(motion=motion))
    found = sb.dynamics.hysteresis(
        system, "base_excitation.frequency_ratio", np.linspace(0.7, 1.1, 21), sb.Integration(cycles=150)
    )
    up, down = found["rms_midspan_velocity"].values
    apart = np.abs(up - down) > 0.1 * np.maximum(up, down)
    assert 4 <= apart.sum() <= 8 and not apart[0] and not apart[-1]
    assert (down[apart] > up[apart]).all(), "the strong response is found from above"


def test_bad_input_is_refused(shaken):
    with pytest.raises(sb.InputError, match="must contain 'up', 'down' or both, each once"):
        sb.dynamics.hysteresis(shaken, NAME, [0.02], sweeps=())
    with pytest.raises(sb.InputError, match="early_termination = False"):
        sb.dynamics.hysteresis(shaken, NAME, [0.02], sb.Integration(early_termination=True))


@pytest.mark.slow
def test_the_command(shaken, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shaken.save("harvester.toml")
    command = [
        "dynamics", "hysteresis", "--config", "harvester.toml", "--parameter", NAME, "--values", "0.02,0.06",
        "--cycles", "12", "--statistic", "harvested_power_last_quarter", "--plot", "power.png",
    ]  # fmt: skip
    answer = CliRunner().invoke(app, command, catch_exceptions=False)
    assert answer.exit_code == 0, answer.output
    assert "2 values up and down" in answer.stdout
    assert xr.load_dataset("hysteresis.nc", engine="h5netcdf")["peak_voltage"].shape == (2, 2)
    assert (tmp_path / "power.png").stat().st_size > 5_000


def recorded(system, duration):
    """Replace the motion of the base by a record of sine bursts, 2000 samples per second."""
    time = np.arange(int(duration * 2000.0) + 1) / 2000.0
    record = 4.0 * np.sin(2.0 * np.pi * 120.0 * time) * np.sin(np.pi * time / duration) ** 2
    motion = sb.RecordedAcceleration(record=record, sampling_frequency=2000.0)
    return system.replace(base_excitation=sb.BaseExcitation(motion=motion))


@pytest.mark.slow
def test_a_record_restarts_at_every_value(shaken):
    """The record holds one run but not two; each value sees it from its first sample and goes on from the last state."""
    lasts = 12 / shaken.model.reference_frequency
    system = recorded(shaken, 1.2 * lasts)
    found = sb.dynamics.hysteresis(system, "harvester.resistance", [1e4, 1e5], STEPS)
    assert (found["status"] == sb.RunStatus.OK).all()
    state, power = None, []
    for value in (1e4, 1e5, 1e5, 1e4):
        run = sb.simulate(
            system.replace(**{"harvester.resistance": value, "initial_state": state}), STEPS, sample_times=[0.0]
        )
        end = run.final_state
        state = sb.State(amplitude=end.amplitude, velocity=end.velocity, circuit=end.circuit)
        power.append(run.summary.harvested_power)
    up, down = found["harvested_power"].values
    np.testing.assert_array_equal([up[0], up[1], down[1], down[0]], power)


def test_a_record_that_is_too_short_is_refused_before_the_first_run(shaken, monkeypatch):
    """Also where only a later value makes the run longer than the record."""
    monkeypatch.setattr("snapbeam.dynamics.swept.simulate", lambda *_, **__: pytest.fail("computed"))
    lasts = 12 / shaken.model.reference_frequency
    with pytest.raises(sb.InputError, match=r"cycles: the run ends after .* but the recorded acceleration"):
        sb.dynamics.hysteresis(recorded(shaken, 0.9 * lasts), "harvester.resistance", [1e4, 1e5], STEPS)
    length = shaken.model.beam.length
    with pytest.raises(sb.InputError, match=r"cycles: the run ends after"):
        sb.dynamics.hysteresis(recorded(shaken, 1.2 * lasts), "beam.length", [length, 1.3 * length], STEPS)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["record", "noise", "tip in space"])
def test_a_tip_that_moves_once_is_refused(shaken, kind):
    """A restart of the record would move the tip by a jump; a sweep from rest is accepted."""
    from snapbeam.model.default_values import CONTACT

    angle = 2.0 * np.pi * 100.0 * np.arange(4000) / 2e4
    motion = {
        "record": sb.RecordedMotion(
            displacement=5e-5 * np.sin(angle),
            velocity=5e-5 * 200.0 * np.pi * np.cos(angle),
            sampling_frequency=2e4,
            frequency=100.0,
        ),
        "noise": sb.BandLimitedNoise(low_ratio=0.8, high_ratio=1.4, velocity_rms=0.1, seed=1),
        "tip in space": sb.FixedStop(),
    }[kind]
    system = sb.System(shaken.model, contacts=[sb.Contact(CONTACT, sb.Striker(drive=motion))])
    if kind == "tip in space":
        base = dataclasses.replace(recorded(shaken, 1.0).base_excitation, striker_on_base=False)
        system = system.replace(base_excitation=base)
    location = [0.45, 0.5]
    with pytest.raises(sb.InputError, match=r"does not repeat.*use sb\.sweep"):
        sb.dynamics.hysteresis(system, "contact.location", location, sb.Integration(cycles=2))
    sb.sweep(system, {"contact.location": location}, sb.Integration(cycles=2))
