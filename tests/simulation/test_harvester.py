"""Power and voltage of a harvester: last quarter of a run, text of the command, figures."""

from __future__ import annotations

import re

import matplotlib.pyplot as plt
import numpy as np
import pytest
from typer.testing import CliRunner

import snapbeam as sb
from snapbeam.cli.app import app
from snapbeam.model.default_values import BEAM

FILE = """
[model]
modes = 2
damping_ratio = 0.02

[base_excitation]
type = "acceleration_sine"
frequency_ratio = 0.9
acceleration_amplitude = 0.0548

[harvester]
type = "piezo"
moment_per_volt = -1.245e-4
capacitance = 3.085e-7
resistance = 1e4

[integration]
cycles = 40
"""


@pytest.fixture(scope="module")
def shaken():
    layers = sb.PiezoelectricHarvester(moment_per_volt=-1.245e-4, capacitance=3.085e-7, resistance=1e4)
    motion = sb.AccelerationSine(frequency_ratio=0.9, acceleration_amplitude=0.0548)
    model = sb.ReducedModel.from_beam(BEAM, modes=2, damping_ratio=0.02)
    return sb.System(model, harvesters=[layers], base_excitation=sb.BaseExcitation(motion=motion))


@pytest.fixture(scope="module")
def run(shaken):
    return sb.simulate(shaken, sb.Integration(cycles=40))


def late_means(run):
    """Means of power and squared voltage over the last quarter, from the time series."""
    time = run.dataset.time.values
    late = time >= 0.75 * time[-1]
    time = time[late]
    return [
        np.trapezoid(values[late], time) / (time[-1] - time[0])
        for values in (run.dataset.power_load.values, run.dataset.voltage.values**2)
    ]


def test_the_last_quarter_leaves_out_the_transient(run):
    """The statistics are the means of the time series over the last quarter."""
    power, square = late_means(run)
    assert run.summary.harvested_power_last_quarter == pytest.approx(power, rel=2e-3)
    assert run.summary.rms_voltage_last_quarter**2 == pytest.approx(square, rel=2e-3)
    assert run.summary.rms_voltage_last_quarter**2 / 1e4 == pytest.approx(
        run.summary.harvested_power_last_quarter, rel=1e-12
    )


@pytest.mark.slow
@pytest.mark.parametrize("inductance", [0.0, 0.01])
def test_voltage_of_a_coil(shaken, inductance):
    """A coil with a resistance of its own, with and without an inductance."""
    coil = sb.ElectromagneticHarvester(
        force_factor=1.5, resistance=30.0, coil_resistance=10.0, inductance=inductance, location=0.4
    )
    run = sb.simulate(shaken.replace(harvesters=[coil]), sb.Integration(cycles=20))
    power, square = late_means(run)
    assert run.summary.harvested_power_last_quarter == pytest.approx(power, rel=2e-3)
    assert run.summary.rms_voltage_last_quarter**2 == pytest.approx(square, rel=2e-3)


def test_the_command_reports_the_harvester_and_no_striker(tmp_path, monkeypatch, run):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "harvester.toml").write_text('extends = "paper"\n' + FILE)
    answer = CliRunner().invoke(app, ["simulate", "--config", "harvester.toml"], catch_exceptions=False)
    assert answer.exit_code == 0
    assert f"last quarter          {1e6 * run.summary.harvested_power_last_quarter:.4g} µW" in answer.stdout
    assert "work of the base" in answer.stdout and "harvested" in answer.stdout
    assert "impacts" not in answer.stdout and "striker" not in answer.stdout


def test_a_large_file_is_announced(tmp_path, monkeypatch, run):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("snapbeam.cli.simulate._LARGE_FILE", 1e4)
    (tmp_path / "harvester.toml").write_text('extends = "paper"\n' + FILE)
    answer = CliRunner().invoke(app, ["simulate", "--config", "harvester.toml", "-o", "run.nc"])
    assert re.search(r"run.nc: about \d\S* MB; .*--save statistics", answer.stderr)


def test_the_figure_shows_voltage_and_power(run):
    figure = run.plot().figure
    assert [ax.get_ylabel() for ax in figure.axes] == [
        "Displacement $w/b$\n($b$ = 335 µm)",
        "Voltage\n$v$ (V)",
        "Power in\nthe load (µW)",
    ]
    legend = figure.legends[0]
    assert [text.get_text() for text in legend.get_texts()] == ["beam, centre"]
    for words in ("base 75.5 Hz", "0.521 $g$", "$R$ = 10 kΩ"):
        assert words in figure.axes[0].get_title().replace("\n", " ").replace("\xa0", " ")
    mean = figure.axes[2].lines[-1]
    assert mean.get_ydata()[0] == pytest.approx(1e6 * late_means(run)[0], rel=1e-9)
    assert mean.get_xdata()[0] == pytest.approx(30.0, abs=0.02)
    plt.close(figure)


def test_a_statistic_from_the_command_line(tmp_path, monkeypatch, synthetic_map):
    monkeypatch.chdir(tmp_path)
    synthetic_map["harvested_power_last_quarter"] = (
        synthetic_map["response_class"].dims,
        np.full(synthetic_map["response_class"].shape, 2e-5),
        {"units": "W"},
    )
    synthetic_map.to_netcdf("map.nc", engine="h5netcdf")
    command = ["plot", "map.nc", "-o", "power.png", "--variable"]
    answer = CliRunner().invoke(app, [*command, "harvested_power_last_quarter"], catch_exceptions=False)
    assert answer.exit_code == 0, answer.output
    assert (tmp_path / "power.png").stat().st_size > 5_000
    refused = CliRunner().invoke(app, [*command, "nosuch"], catch_exceptions=False)
    assert refused.exit_code == 2 and "nosuch" in refused.output


# ---------------------------------------------------------------------- structures given by matrices


@pytest.mark.slow
def test_bistable_piezoelectric_oscillator_of_the_literature() -> None:
    """x'' + .02 x' - .5 x + .5 x^3 - chi v = .115 cos .8 t, v' + lambda v + kappa x' = 0; chi = .05, kappa = .5, lambda = .05.

    With theta = chi the capacitance is chi/kappa and the resistance 1/(lambda C).  The mean of lambda v^2 over the last
    quarter is .017855962 on the orbit between the wells; SciPy (DOP853, rtol = 1e-11) gives .0178559580 after 400 periods
    from any of the states below.
    """
    model = sb.ReducedModel.from_matrices(
        [[1.0]], [-0.5], contact_shape=[1.0], patch_shape=[1.0], nonlinear_stiffness=0.5, well_amplitude=[-1.0],
        damping_ratio=0.01,
    )  # fmt: skip
    layers = sb.PiezoelectricHarvester(moment_per_volt=0.05, capacitance=0.1, resistance=200.0)
    force = sb.HarmonicForce(frequency_ratio=0.8, amplitude=0.115, phase=0.5 * np.pi)
    for start in (sb.State(amplitude=[-1.0]), sb.State(amplitude=[1.0], velocity=[1.3])):
        system = sb.System(model, forces=[sb.ExternalForce(history=force)], harvesters=[layers], initial_state=start)
        power = sb.simulate(system, sb.Integration(cycles=400)).summary.harvested_power_last_quarter
        assert power / 0.1 == pytest.approx(0.017855962, rel=3e-6)


@pytest.mark.slow
def test_layers_on_the_matrices_of_a_beam(shaken: sb.System) -> None:
    """The coupling row of the beam's own layers, given with the beam's matrices, gives the beam's run."""
    beam, layers = shaken.model, shaken.harvester
    assert isinstance(layers, sb.PiezoelectricHarvester)
    given = sb.ReducedModel.from_matrices(
        beam.mass, beam.stiffness, contact_shape=beam.midspan_shape, nonlinear_stiffness=beam.nonlinear_stiffness,
        well_amplitude=beam.well_amplitude, length_scale=beam.length_scale, damping_ratio=0.02,
        patch_shape=layers.row(beam) / layers.moment_per_volt,
    )  # fmt: skip
    force = sb.HarmonicForce(frequency_ratio=0.9, amplitude=0.02)
    powers = [
        sb.simulate(
            sb.System(model, forces=[sb.ExternalForce(history=force, **more)], harvesters=[layers]),
            sb.Integration(cycles=20),
        ).summary.harvested_power
        for model, more in ((beam, {"location": 0.5}), (given, {}))
    ]
    assert powers[0] > 0.0
    assert powers[1] == pytest.approx(powers[0], rel=1e-6)
    assert given.patch_shape is not None
    again = sb.System(given, forces=[sb.ExternalForce(history=force)], harvesters=[layers])
    changed = again.replace(**{"model.damping_ratio": 0.03})
    assert changed.model.patch_shape.tolist() == given.patch_shape.tolist()


def test_layers_need_their_row() -> None:
    model = sb.ReducedModel.from_matrices([[1.0]], [1.0], contact_shape=[1.0])
    layers = sb.PiezoelectricHarvester(moment_per_volt=0.05, capacitance=0.1, resistance=200.0)
    with pytest.raises(sb.InputError, match=r"give patch_shape to ReducedModel\.from_matrices"):
        sb.System(
            model,
            forces=[sb.ExternalForce(history=sb.HarmonicForce(frequency_ratio=1.0, amplitude=0.1))],
            harvesters=[layers],
        )
    with pytest.raises(sb.InputError, match=r"patch_shape of shape \(2,\)"):
        sb.ReducedModel.from_matrices([[1.0]], [1.0], contact_shape=[1.0], patch_shape=[1.0, 2.0])
