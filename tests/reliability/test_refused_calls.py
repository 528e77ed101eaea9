"""Calls that fuzzing found to end in an error of Python's own: each is refused."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

import snapbeam as sb
from snapbeam.cli.app import app
from snapbeam.model import default_values
from snapbeam.model.parameter_file import load_config
from snapbeam.simulation.run import Run
from snapbeam.sweeps.measured_points import MeasuredPoints
from snapbeam.util.validation import InputError

pytest.importorskip("snapbeam.lab", reason="the part lab is not installed", exc_type=ImportError)

LONG = range(10**12)
SHORT = sb.Integration(cycles=2)
FIELD = xr.Dataset(
    {"response_class": (("frequency_ratio", "velocity_amplitude"), np.zeros((2, 2), dtype=np.int8))},
    {"frequency_ratio": [0.9, 1.0], "velocity_amplitude": [0.1, 0.2]},
)
POINTS = MeasuredPoints(np.ones(2), np.full(2, 0.1), np.full(2, np.nan), np.zeros(2, dtype=np.int8))


@pytest.fixture(scope="module")
def system():
    return sb.System(
        sb.ReducedModel.from_beam(default_values.BEAM, modes=1),
        contacts=[sb.Contact(default_values.CONTACT, sb.Shaker(frequency_ratio=1.0, velocity_amplitude=0.3))],
    )


@pytest.fixture(scope="module")
def run(system) -> Run:
    return sb.simulate(system, SHORT)


@pytest.mark.parametrize(
    "section", ["drive", "contact", "base_excitation", "axial_load", "harvester", "force", "drive.2"]
)
@pytest.mark.parametrize("value", ["[1, 2]", "{a = 1}", "3"])
def test_a_type_that_is_no_word(tmp_path, section, value):
    (tmp_path / "x.toml").write_text(f"[{section}]\ntype = {value}\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"must be one of|striker|section"):
        load_config(tmp_path / "x.toml")


def test_a_type_that_is_no_word_in_a_mapping(system):
    sections = system.to_mapping()
    with pytest.raises(InputError, match=r"\[drive\] type"):
        sb.System.from_mapping(sections | {"drive": {"type": [1, 2]}})


def test_a_range_that_fills_the_memory(system):
    axes = {"drive.frequency_ratio": [0.9, 1.0]}
    for call in (
        lambda: sb.sweep(system, {"drive.frequency_ratio": LONG}, SHORT),
        lambda: sb.sweep(system, {"model.modes": LONG}, SHORT),
        lambda: sb.threshold(system, "drive.velocity_amplitude", LONG, axes, SHORT),
        lambda: sb.simulate(system, SHORT, sample_times=LONG),
        lambda: sb.plot.class_handles(LONG),
        lambda: sb.lab.Measurements(straight_frequencies=LONG, straight_frequencies_se=[1.0]),
    ):
        with pytest.raises(InputError):
            call()
    assert sb.sweep(system, {"model.modes": range(1, 3)}, SHORT).sizes["modes"] == 2


@pytest.mark.parametrize("window", [(), 3, "ab", (1, 2, 3), (5, 2), (0, np.inf), {}, np.datetime64(1, "s"), SHORT])
def test_windows_of_figures(run, window):
    with pytest.raises(InputError, match="window"):
        sb.plot.plot_spectrum(run, window=window)
    with pytest.raises(InputError, match="window"):
        sb.plot.plot_run(run, window)


@pytest.mark.parametrize(
    "field",
    [
        FIELD.isel(frequency_ratio=slice(0, 0)),
        FIELD.assign_coords(frequency_ratio=["a", "b"]),
        FIELD.assign_coords(location="a"),
        FIELD + np.int8(100),
        FIELD.to_dataframe(),
    ],
    ids=["empty", "text", "location", "classes", "data frame"],
)
def test_maps_that_cannot_be_compared(field):
    with pytest.raises(InputError):
        sb.lab.compare_measured_points(POINTS, field)
    with pytest.raises(InputError, match="measurements"):
        sb.lab.compare_measured_points(3.0, FIELD)
    assert sb.lab.compare_measured_points(POINTS, FIELD).used == 1


@pytest.mark.parametrize("columns", [((2,), (3,), (2,), (2,)), ((2, 2),) * 4])
def test_measured_points_of_unequal_length(columns):
    with pytest.raises(InputError, match="one-dimensional"):
        MeasuredPoints(*map(np.zeros, columns))


def test_measured_points_that_are_no_numbers_or_classes():
    with pytest.raises(InputError, match="numbers"):
        MeasuredPoints(np.array(["a"]), np.zeros(1), np.zeros(1), np.zeros(1))
    with pytest.raises(InputError, match="response_class"):
        MeasuredPoints(np.zeros(1), np.zeros(1), np.zeros(1), np.array([99]))


@pytest.mark.parametrize("columns", [(LONG,) * 4, ([1, [2, 3]],) * 4, ({"a": 1},) * 4])
def test_measured_points_that_are_no_arrays(columns):
    with pytest.raises(InputError):
        MeasuredPoints(*columns)


def test_statistics_that_are_none(run):
    """One of them entered the table, and every later call failed."""
    before = list(sb.STATISTICS)
    for value in ([2], 3.0, "a", sb.RunStatus.OK, run):
        with pytest.raises(InputError, match="statistic"):
            sb.register_statistic(value)
        with pytest.raises(InputError, match="statistic"):
            sb.unregister_statistic(value)
    with pytest.raises(InputError, match="was not registered"):
        sb.unregister_statistic(np.zeros((2, 3)))
    assert list(sb.STATISTICS) == before


def test_data_frames_where_settings_belong(system, run, tmp_path):
    for name in ("integration", "sample_times", "progress", "path"):
        named = {"integration": SHORT, "path": tmp_path / "x.nc"} | {name: run.dataset.to_dataframe()}
        with pytest.raises(InputError, match=name):
            sb.simulate_to_file(system, **named)


def test_results_of_another_kind(system, run, tmp_path):
    signal = sb.lab.make_signal(np.sin(np.arange(500.0)), "m/s", 1e3)
    for call in (
        lambda: sb.RunSummary.from_statistics({"a": 1}),
        lambda: sb.uncertainty.ParameterUncertainty.from_calibration("x.nc"),
        lambda: sb.plot.plot_diagram(run.dataset),
        lambda: sb.plot.plot_diagram(None, branches=[run.dataset]),
        lambda: sb.write_netcdf(run.dataset, tmp_path / "x.nc", {None: 3}),
        lambda: sb.lab.measure_drive(signal, frequency=SHORT),
        lambda: sb.lab.measure_response(run.dataset, start="a"),
        lambda: sb.lab.identify_decay(signal, frequencies="abc"),
        lambda: sb.lab.identify_decay(signal, frequencies=[]),
        lambda: sb.lab.identify_decay(signal, buckling_level=1e200),
        lambda: sb.lab.identify_decay(signal, buckling_level=1e-200),
        lambda: sb.lab.make_signal([0.1, 0.3], "m", time=range(10**12)),
        lambda: sb.force_displacement(system, displacement_range=[1.0, 2.0, 3.0]),
    ):
        with pytest.raises(InputError):
            call()


def test_values_out_of_their_kind_or_range(system):
    for call in (
        lambda: system.poles(-1),
        lambda: system.model.tangent_magnitude("1/0"),
        lambda: system.model.tangent_magnitude(np.float32(0.1)),
        lambda: system.model.side_of(np.ones((2, 1))),
        lambda: sb.model.converged_modes(system, [0.1, 0.2]),
        lambda: sb.model.converged_modes(system, "a"),
        lambda: sb.model.modal_error(system, lambda each: each),
        lambda: sb.plot.new_figure(height=1e308),
    ):
        with pytest.raises(InputError, match=r"equilibrium|alpha|amplitude|error|quantity|height"):
            call()
    for well in (np.array([0.1, 0.2]), FIELD):
        with pytest.raises(InputError, match="initial_well"):
            sb.System(system.model, contacts=system.contacts, initial_well=well)
    for statistics in ([1, [2, 3]], [{}], [["peak_force"]]):
        with pytest.raises(InputError, match="statistics"):
            sb.uncertainty.probability_map(system, {"drive.frequency_ratio": [1.0]}, statistics=statistics)


@pytest.mark.parametrize("text", ["9" * 5000, "\u00b2", "contact.\u00b2.stiffness", f"contact.{'9' * 5000}.stiffness"])
def test_numbers_of_parts_that_int_does_not_take(text, tmp_path):
    """Digits of other scripts are digits to ``str.isdigit``, and of thousands of them ``int`` makes no number."""
    said = CliRunner().invoke(app, ["dynamics", "bifurcation-curve", "--parameter", text])
    assert said.exit_code == 2 and isinstance(said.exception, SystemExit)
    sb.lab.write_signal(tmp_path / "x.csv", sb.lab.make_signal(np.sin(np.arange(50.0)), "m/s", 1e3))
    said = CliRunner().invoke(app, ["fit-decay", str(tmp_path / "x.csv"), "--channel", text])
    assert said.exit_code == 2 and isinstance(said.exception, SystemExit) and "channel" in said.output
