"""What the program says of a map, against maps whose answers are known."""

from __future__ import annotations

import io
import shlex
import time

import numpy as np
import pytest
import xarray as xr
from rich.console import Console

from snapbeam.cli.summary import class_table, deepest_notch, lowest_interwell, map_summary, status_lines
from snapbeam.util.status_codes import ResponseClass, RunStatus


def text(*renderables):
    console = Console(width=200, file=io.StringIO(), soft_wrap=True)
    console.print(*renderables, sep="\n")
    return console.file.getvalue()


def test_shares(synthetic_map):
    kinds = synthetic_map["response_class"].values
    rows = text(class_table(synthetic_map)).splitlines()
    assert rows[1].split() == ["intrawell", str((kinds == 0).sum()), f"{100 * (kinds == 0).mean():.1f}", "%"]
    assert rows[-1].split() == ["unknown", "1", "0.1", "%"]
    assert sum(int(row.rsplit(maxsplit=3)[1]) for row in rows[1:]) == kinds.size


def test_lowest_interwell_and_notch(synthetic_map):
    kinds, velocity = synthetic_map["response_class"].values, synthetic_map["velocity_amplitude"].values
    low = lowest_interwell(synthetic_map)
    assert low["velocity_amplitude"] == velocity[(kinds >= 1).any(axis=0)].min()
    assert low["location"] == pytest.approx(1.0 / 2.1)
    notch = deepest_notch(synthetic_map)
    assert notch["frequency_ratio"] == pytest.approx(1.2, abs=0.15)
    assert notch["velocity_amplitude"] == low["velocity_amplitude"]
    quiet = xr.zeros_like(synthetic_map)
    assert lowest_interwell(quiet) is None and deepest_notch(quiet) is None
    assert deepest_notch(synthetic_map.isel(frequency_ratio=0)) is None


def test_points_of_unknown_class_are_not_taken_for_intrawell(synthetic_map):
    said = text(map_summary(synthetic_map, []))
    assert "unknown response class may be" not in said, "the unknown point lies above the lowest interwell run"
    low = lowest_interwell(synthetic_map)
    failed = synthetic_map.copy(deep=True)
    failed.response_class.loc[{"frequency_ratio": low["frequency_ratio"]}][:2] = ResponseClass.UNKNOWN
    assert "2 points of unknown response class may be interwell below it." in text(map_summary(failed, []))
    assert deepest_notch(failed)["frequency_ratio"] != low["frequency_ratio"]
    nothing = xr.full_like(synthetic_map, ResponseClass.UNKNOWN)
    assert "1000 points of unknown response class may be interwell." in text(map_summary(nothing, []))


def test_what_is_said(synthetic_map, tmp_path):
    path = tmp_path / "map.nc"
    path.write_bytes(bytes(200_000))
    said = text(map_summary(synthetic_map, [path], 50.0))
    assert said.startswith("1000 runs of 32 modes over 200 cycles in 50 s (20 runs/s)")
    assert "Deepest notch of the threshold: V = " in said and "mm/s at" in said
    assert "map.nc (0.20 MB)" in said
    low = deepest_notch(synthetic_map)
    point = f"frequency_ratio={low['frequency_ratio']!r},velocity_amplitude={low['velocity_amplitude']!r}"
    file = shlex.quote(str(path))
    assert f"snapbeam simulate --from {file} --point {point} --plot run.png" in said
    assert f"snapbeam map --from {file} --point {point} --frequency-ratio " in said
    assert f"snapbeam plot {file} --quasi-static-line" in said
    quiet = text(map_summary(xr.zeros_like(synthetic_map).assign_attrs(synthetic_map.attrs), []))
    assert "No run snapped through: raise the velocity amplitude." in quiet


def test_failed_runs_come_with_advice(synthetic_map):
    status = np.zeros(synthetic_map["response_class"].shape, dtype=np.int8)
    status[0, :3] = RunStatus.DIVERGED
    status[1] = RunStatus.EARLY_STOP
    lines = status_lines(synthetic_map.assign(status=(synthetic_map["response_class"].dims, status)))
    assert lines[0].startswith("[bold red]3 failed[/] (DIVERGED): ") and "smaller step" in lines[0]
    assert lines[1] == "25 of 1000 runs ended early because their response class was certain."
    assert ResponseClass.UNKNOWN.label in text(class_table(synthetic_map))


def test_what_was_there_before_is_no_part_of_the_rate(monkeypatch) -> None:
    """Points that a store held, or that came from earlier rounds, do not make the others faster."""
    import io

    from rich.console import Console

    from snapbeam.cli import console

    clock = iter([0.0, 10.0, 10.0, 50.0])
    monkeypatch.setattr(time, "monotonic", lambda: next(clock))
    written = io.StringIO()
    lines = console._Lines(Console(file=written, width=100), None, "runs")
    for done, total in ((900, 1000), (1000, 1000), (1000, 2000), (1400, 2000)):
        lines(done, total)
    assert written.getvalue().splitlines() == [
        "1000 runs to compute",
        "900 of 1000 runs",
        "1000 of 1000 runs, 10 runs/s",
        "2000 runs to compute",
        "1400 of 2000 runs, 10 runs/s, 1 min 0 s left",
    ]


@pytest.mark.parametrize(("name", "following"), [("map", "closer"), ("closer", "closer_2"), ("closer_2", "closer_3")])
def test_a_suggested_map_does_not_replace_the_map_it_starts_from(synthetic_map, tmp_path, name, following):
    file = tmp_path / f"{name}.nc"
    synthetic_map.to_netcdf(file, engine="h5netcdf")
    said = text(map_summary(synthetic_map, [file], 1.0))
    assert f"--from {shlex.quote(str(file))}" in said
    assert f"-o {following}.nc --plot {following}.png" in said


def harvester_map(kinds, **more):
    """A map over load resistance and the acceleration of a base, with the power of a harvester."""
    labels = {"units": "ohm", "long_name": "load resistance", "parameter": "harvester.resistance"}
    level = {
        "units": "1",
        "long_name": "acceleration amplitude over b omega_1^2, of the base",
        "parameter": "base_excitation.acceleration_amplitude",
    }
    power = {"units": "W", "long_name": "power in the harvester's load, last quarter of the run"}
    dims, values = ("harvester_resistance", "base_excitation_acceleration_amplitude"), [1e3, 1e4, 1e5]
    table = np.array([[1e-6, 8e-4], [9e-6, 1.42e-3], [2e-6, np.nan]])
    attrs = {"modes": 2, "cycles": 4, "reference_frequency": 80.0, "length_scale": 1e-3, "harvester_type": "piezo"}
    data = {"response_class": (dims, np.array(kinds, dtype=np.int8))}
    data["harvested_power_last_quarter"] = (dims, table, power)
    data["status"] = (dims, np.zeros((3, 2), dtype=np.int8))
    coords = {dims[0]: (dims[0], values, labels), dims[1]: (dims[1], [0.02, 0.4], level)}
    return xr.Dataset(data, coords, attrs | more)


def test_the_summary_of_a_map_of_a_harvester():
    """The amplitude of the base in g, the resistance in ohm, the power in W; nothing of the paper's plane."""
    said = text(map_summary(harvester_map([[0, 3]] * 3), []))
    # 0.4 b omega_1^2 = 0.4 * 1 mm * (2 pi 80 Hz)^2 / 9.80665 m/s^2 = 10.31 g
    assert "Lowest interwell acceleration amplitude of the base: 10.31 g at load resistance = 1 kohm" in said
    assert "load, last quarter of the run: 1.42 mW at load resistance = 10 kohm, " in said
    assert "acceleration amplitude of the base = 10.31 g; not known at 1 of 6 points" in said
    assert "velocity" not in said
    quiet = text(map_summary(harvester_map([[0, 0]] * 3), []))
    assert "No run snapped through: raise the acceleration amplitude of the base." in quiet
    without = harvester_map([[0, 3]] * 3)
    del without.attrs["reference_frequency"]
    said = text(map_summary(without, []))
    assert "Lowest interwell acceleration amplitude of the base: 0.4 b omega_1^2 at" in said


def test_a_map_without_an_amplitude_has_no_lowest_amplitude(tmp_path):
    """A resistance is nothing that snapping through needs more of: the power is what matters, and its point."""
    path = tmp_path / "map.nc"
    path.write_bytes(bytes(1000))
    one = harvester_map([[0, 3]] * 3).isel(base_excitation_acceleration_amplitude=1, drop=True)
    said = text(map_summary(one, [path]))
    assert "Lowest" not in said and "Highest power" in said
    assert f"--from {shlex.quote(str(path))} --point harvester_resistance=10000.0 " in said
    assert lowest_interwell(one) is None
    struck = xr.zeros_like(one)
    struck.attrs = {"modes": 2, "cycles": 4}
    struck["response_class"][2] = ResponseClass.TRANSIENT_2
    said = text(map_summary(struck, [path]))
    assert "--point harvester_resistance=100000.0 " in said, "without a power the first interwell point"
    fixed = {"base_excitation_acceleration_amplitude": 0.4}
    for attrs, advice in (({}, "through."), (fixed, "through: raise the acceleration amplitude of the base.")):
        quiet = one.assign(response_class=xr.zeros_like(one["response_class"])).assign_attrs(attrs)
        assert f"No run snapped {advice}" in text(map_summary(quiet, [])).splitlines()


def test_a_named_statistic_is_in_the_summary(synthetic_map):
    force = np.zeros(synthetic_map["response_class"].shape)
    force[12, 7] = 3.25
    labels = {"units": "N", "long_name": "maximum contact force"}
    found = synthetic_map.assign(peak_force=(synthetic_map["response_class"].dims, force, labels))
    place = found.isel(frequency_ratio=12, velocity_amplitude=7)
    omega, velocity = float(place["frequency_ratio"]), float(place["velocity_amplitude"])
    said = text(map_summary(found, [], variable="peak_force"))
    assert f"Highest maximum contact force: 3.25 N at Omega = {omega:.4g}, V = {velocity:.4g}" in said
    assert "Highest" not in text(map_summary(found, [], variable="response_class"))


def test_the_power_of_a_harvester_with_one_well():
    dataset = harvester_map([[0, 1]] * 3).assign_attrs(wells=1)
    for name in ("min_midspan_displacement", "max_midspan_displacement"):
        dataset[name] = dataset["harvested_power_last_quarter"].fillna(0.0).assign_attrs(units="1")
    said = text(map_summary(dataset, []))
    assert "1.42 mW at load resistance = 10 kohm" in said
    assert "snapped and returned" in said and "interwell" not in said


def test_a_threshold_over_the_acceleration_of_a_base_has_units():
    """Amplitude, band and steps in g; the paper's own plane keeps its symbols."""
    from snapbeam.cli.summary import coordinate_text, value_text
    from snapbeam.plot.units import in_units

    curve = in_units(harvester_map([[0, 3]] * 3))
    name = "base_excitation_amplitude_g"
    assert coordinate_text(curve, name, 10.31) == "acceleration amplitude of the base = 10.31 g"
    assert value_text(curve, name, 1.03, 2) == "1 g"
    unit = curve[name].values / curve["base_excitation_acceleration_amplitude"].values
    np.testing.assert_allclose(0.4 * unit, 10.31, rtol=1e-3)
    assert coordinate_text(curve, "modes", 2) == "N = 2"
    assert value_text(curve, "harvester_resistance", 2.5e6) == "2.5 Mohm"
