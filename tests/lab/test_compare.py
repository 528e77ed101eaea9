"""Measured points on a map, and a measured run beside a simulated one."""

from __future__ import annotations

import json

import numpy as np
import pytest
import typer
import xarray as xr
from typer.testing import CliRunner

from snapbeam.lab.cli.calibrate import calibrate
from snapbeam.lab.cli.compare import compare
from snapbeam.lab.cli.fit_decay import fit_decay
from snapbeam.lab.cli.vibrometer import vibrometer
from snapbeam.lab.map_comparison import compare_measured_points
from snapbeam.lab.plot.comparison import plot_map_comparison, plot_waveform_comparison, plot_waveform_overlay
from snapbeam.lab.signal_files import write_signal
from snapbeam.lab.signals import make_signal
from snapbeam.lab.waveform_comparison import compare_waveforms
from snapbeam.simulation.dataset import trajectory_dataset
from snapbeam.sweeps.measured_points import MeasuredPoints, read_measured_points
from snapbeam.util.status_codes import ResponseClass
from snapbeam.util.validation import InputError


def points_of(dataset, count: int = 200, seed: int = 0):
    """Points that agree with a map, a little off its points."""
    rng = np.random.default_rng(seed)
    ratio, velocity = dataset["frequency_ratio"].values, dataset["velocity_amplitude"].values
    i, j = rng.integers(0, ratio.size, count), rng.integers(0, velocity.size, count)
    off = rng.uniform(-0.3, 0.3, (2, count))
    return MeasuredPoints(
        ratio[i] + off[0] * (ratio[1] - ratio[0]),
        velocity[j] + off[1] * (velocity[1] - velocity[0]),
        np.full(count, 1.0 / 2.1),
        dataset["response_class"].values[i, j].astype(np.int8),
    )


def test_points_from_the_map_agree_with_it(synthetic_map):
    found = compare_measured_points(points_of(synthetic_map), synthetic_map)
    assert found.agreement == 1.0 and found.snap_agreement == 1.0
    assert found.used == 200 - int((found.table["measured"] == -1).sum())
    assert np.trace(found.confusion) == found.used
    low, high = found.agreement_interval
    assert 0.97 < low < 1.0 and high == pytest.approx(1.0)
    assert (found.table["distance"].values[found.table["used"] == 1] == 0.0).all()


def test_the_confusion_table_counts_every_swap(synthetic_map):
    points = points_of(synthetic_map)
    swapped = points.response_class.copy()
    at = np.flatnonzero(swapped == ResponseClass.TRANSIENT_2)[:7]
    swapped[at] = ResponseClass.INTRAWELL
    found = compare_measured_points(
        MeasuredPoints(points.frequency_ratio, points.velocity_amplitude, points.location, swapped), synthetic_map
    )
    assert found.confusion[ResponseClass.INTRAWELL, ResponseClass.TRANSIENT_2] == 7
    assert found.agreement == pytest.approx(1.0 - 7.0 / found.used)
    assert found.snap_agreement == pytest.approx(1.0 - 7.0 / found.used)
    assert (found.table["distance"].values[at] >= 1.0).all()


FIRST, LEVEL = 80.0, 0.33e-3
UNITS = {
    "rad/s": ("frequency_hz,velocity_m_s", lambda f, v: (2.0 * np.pi * f, v), "rad/s"),
    "mm/s": ("frequency_hz,velocity_m_s", lambda f, v: (f, 1e3 * v), "mm/s"),
    "exchanged": ("frequency_hz,velocity_m_s", lambda f, v: (v, f), "exchanged"),
    "ratios exchanged": (
        "frequency_ratio,velocity_amplitude",
        lambda f, v: (v / (2.0 * np.pi * LEVEL * FIRST), f / FIRST),
        "exchanged",
    ),
    "Hz as ratio": ("frequency_ratio,velocity_m_s", lambda f, v: (f, v), "in Hz"),
}


def written(path, heads, points, change):
    frequency = points.frequency_ratio * FIRST
    velocity = points.velocity_amplitude * 2.0 * np.pi * LEVEL * FIRST
    columns = zip(*change(frequency, velocity), points.response_class, strict=True)
    rows = "".join(f"{one:.9g},{other:.9g},{kind}\n" for one, other, kind in columns)
    path.write_text(f"{heads},response_class\n{rows}", encoding="utf-8")
    return read_measured_points(path, reference_frequency=FIRST, buckling_level=LEVEL)


@pytest.mark.parametrize("kind", UNITS)
def test_a_table_in_other_units_is_told(synthetic_map, tmp_path, kind):
    known = synthetic_map.assign_attrs(reference_frequency=FIRST, beam_buckling_level=LEVEL)
    points = points_of(known, 30, seed=4)
    good = compare_measured_points(
        written(tmp_path / "good.csv", "frequency_hz,velocity_m_s", points, lambda f, v: (f, v)), known
    )
    assert good.agreement == 1.0 and not good.diagnostics
    heads, change, words = UNITS[kind]
    found = compare_measured_points(written(tmp_path / "bad.csv", heads, points, change), known)
    (told,) = found.diagnostics
    assert told.code == "comparison.units" and told.severity == "error"
    assert words in told.message and found.summary()["diagnostics"]


def test_points_that_stand_twice_count_once_and_not_if_they_contradict(synthetic_map):
    points = points_of(synthetic_map, 30, seed=5)
    kinds = points.response_class
    at = np.flatnonzero(kinds >= 0)[:3]
    again = np.concatenate([np.arange(30), at])
    changed = kinds[again].copy()
    changed[-1] = 0 if kinds[at[2]] else 1
    columns = (points.frequency_ratio, points.velocity_amplitude, points.location)
    found = compare_measured_points(MeasuredPoints(*(one[again] for one in columns), changed), synthetic_map)
    assert found.used == compare_measured_points(points, synthetic_map).used - 1
    assert any("2 of 33 measured points do not count: repeated" in note for note in found.notes)
    (told,) = found.diagnostics
    assert (told.code, told.numbers["points"]) == ("comparison.contradicting", 2.0)
    assert len(plot_map_comparison(synthetic_map, points, found).texts) > 0


def test_points_that_do_not_belong_are_left_out_and_said(synthetic_map):
    points = MeasuredPoints(
        np.array([1.0, 9.0, 1.0, 1.0, 1.0]),
        np.array([0.05, 0.05, 0.9, 0.05, 0.05]),
        np.array([0.476, 0.476, 0.476, 0.3, np.nan]),
        np.array([0, 0, 0, 0, -1], dtype=np.int8),
    )
    found = compare_measured_points(points, synthetic_map)
    assert found.table["used"].values.tolist() == [1, 0, 0, 0, 0]
    assert len(found.notes) == 3 and "2 of 5" in found.notes[0]
    empty = compare_measured_points(MeasuredPoints(*(np.empty(0),) * 3, np.empty(0, dtype=np.int8)), synthetic_map)
    assert empty.used == 0 and np.isnan(empty.agreement)
    with pytest.raises(InputError, match="map"):
        compare_measured_points(points, synthetic_map.drop_vars("response_class"))


def measured_of(run, freq: float = 100.0, start: float = 0.0123, noise: float = 0.01, rate: float = 1e4):
    """What a camera would have kept of a run that began at *start*."""
    time = np.arange(int((start + float(run["time"][-1])) * rate)) / rate
    rng = np.random.default_rng(0)
    rest = np.clip(time - start, 0.0, None)
    values = {
        name: np.interp(rest, run["time"], run[name]) + noise * rng.standard_normal(time.size)
        for name in ("displacement_at_striker", "striker_displacement")
    }
    return trajectory_dataset(time, **values)


def test_a_run_is_put_beside_itself(synthetic_run):
    seen = measured_of(synthetic_run)
    found = compare_waveforms(
        seen, synthetic_run, 100.0, start=0.0121,
        measured_onsets=[0.0123 + 0.031], simulated_onsets=[0.031],
    )  # fmt: skip
    assert found.shift == pytest.approx(-0.02, abs=0.002)  # the start was said 0.02 cycles early
    assert found.measured_impacts[0] == pytest.approx(found.simulated_impacts[0], abs=0.01)
    assert found.rms_difference < 0.02 and found.correlation > 0.98
    assert found.shaker_rms_difference == pytest.approx(0.01, rel=0.3)
    assert found.amplitude_ratio == pytest.approx(1.0, abs=0.01)
    peak = int(np.argmax(found.spectra["measured_displacement"].values))
    assert found.spectra["frequency_ratio"].values[peak] == pytest.approx(1.0, abs=0.1)


def test_dropouts_stay_dropouts(synthetic_run):
    seen = measured_of(synthetic_run)
    valid = np.ones(seen.sizes["time"], dtype=np.int8)
    valid[300:320] = 0
    seen["valid"] = ("time", valid, {"units": "1"})
    seen["displacement_at_striker"].values[300:320] = np.nan
    found = compare_waveforms(seen, synthetic_run, 100.0, start=0.0123)
    hidden = np.isnan(found.waveforms["measured_displacement"].values)
    assert 15 <= hidden.sum() <= 25 and np.isfinite(found.rms_difference)
    assert np.isfinite(found.spectra["measured_displacement"].values).all()


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"frequency": None}, "frequency"),
        ({"cycles": (3.0, 4.0)}, "at least 2"),
        ({"start": 5.0}, "64 samples"),
        ({"frequency": -1.0}, "frequency"),
    ],
)
def test_runs_that_cannot_be_compared(synthetic_run, change, word):
    with pytest.raises(InputError, match=word):
        compare_waveforms(measured_of(synthetic_run), synthetic_run, **{"frequency": 100.0, **change})
    alone = synthetic_run.drop_vars(["striker_displacement", "cycle"])
    with pytest.raises(InputError, match=r"start \(--start\): must be given"):
        compare_waveforms(alone, synthetic_run, 100.0)


def test_a_displacement_sensor_without_the_shaker(synthetic_run, program, tmp_path):
    """A record of 2 kHz at midspan, zero midway between the wells: aligned by the start of the excitation alone."""
    length, start = 0.335e-3, 0.05
    run = synthetic_run.assign_attrs(length_scale=length)
    time = np.arange(0.0, 0.12, 1.0 / 2000.0)
    exact = np.interp(time, run["time"].values + start, run["midspan_displacement"].values)
    noise = 0.01 * np.random.default_rng(1).standard_normal(time.size)
    signal = make_signal(length * (exact + noise), "m", time=time, name="laser")
    found = compare_waveforms(signal, run, 100.0, at="midspan_displacement", start=start)
    assert found.rms_difference == pytest.approx(0.01, rel=0.2) and found.correlation > 0.98
    assert [one.code for one in found.diagnostics] == ["comparison.no_shaker"] and np.isnan(found.amplitude_ratio)
    with pytest.raises(InputError, match="must be in m"):
        compare_waveforms(make_signal(exact, "m/s", time=time), run, 100.0, start=start)
    write_signal(tmp_path / "laser.csv", signal)
    run.to_netcdf(tmp_path / "run.nc", engine="h5netcdf")
    told = program(
        "compare", tmp_path / "laser.csv", tmp_path / "run.nc", "--at", "midspan", "--frequency", "100",
        "--start", str(start), "--cycles", "7", "--plot", tmp_path / "waves.png", "--overlay", "--json", "-",
    )  # fmt: skip
    assert told.exit_code == 0, told.output
    assert json.loads(told.stdout)["rms_difference_b"] == pytest.approx(found.rms_difference, rel=1e-6)


def test_a_coarse_record_of_the_shaker_has_its_amplitude(synthetic_run):
    """Eight samples a cycle: the amplitude is that of the samples, not of straight lines between them."""
    seen = measured_of(synthetic_run, noise=0.0)
    every = seen.sizes["time"] // 85
    found = compare_waveforms(seen.isel(time=slice(None, None, every)), synthetic_run, 100.0, start=0.0123)
    assert found.amplitude_ratio == pytest.approx(1.0, abs=0.002)


def test_pictures(synthetic_map, synthetic_run):
    import matplotlib.pyplot as plt

    points = points_of(synthetic_map, 40)
    figure = plot_map_comparison(synthetic_map, points, compare_measured_points(points, synthetic_map))
    assert "agree" in figure.axes[1].get_title(loc="left")
    runs = plot_waveform_comparison(
        compare_waveforms(measured_of(synthetic_run), synthetic_run, 100.0, start=0.0123), (0.0, 5.0)
    )
    assert [ax.get_title(loc="left") for ax in runs.axes[:2]] == ["measured", "simulated"]
    plt.close("all")


def parting(run, cycle: float, freq: float = 100.0):
    """The run as it is seen if its beam goes another way from a cycle on."""
    seen = run.copy(deep=True)
    late = run["time"].values * freq > cycle
    seen["displacement_at_striker"].values[late] += 0.5
    return seen


@pytest.mark.slow
def test_an_overlay_shows_where_runs_part(synthetic_run):
    """Both beams on one axis, the difference below, a line where they part: the data of the picture, not its looks."""
    import matplotlib.pyplot as plt

    found = compare_waveforms(parting(synthetic_run, 6.0), synthetic_run, 100.0)
    assert found.parted == pytest.approx(6.0, abs=0.5)
    figure = plot_waveform_overlay(found)
    top, shakers, bottom = figure.axes
    lines = {line.get_label(): line for line in top.lines}
    for name in ("measured", "simulated"):
        drawn = lines[name]
        np.testing.assert_array_equal(drawn.get_xdata(), found.waveforms["cycle"])
        np.testing.assert_array_equal(drawn.get_ydata(), found.waveforms[f"{name}_displacement"])
    difference = bottom.lines[0].get_ydata()
    late = found.waveforms["cycle"].values > 6.2
    np.testing.assert_allclose(difference[late], 0.5, atol=0.02)
    np.testing.assert_allclose(difference[found.waveforms["cycle"].values < 5.8], 0.0, atol=0.02)
    for ax in (top, shakers, bottom):
        assert [found.parted] * 2 in [list(line.get_xdata()) for line in ax.lines], "the parting is marked"
    assert f"part at cycle {found.parted:.1f}" in top.get_title(loc="left")
    same = plot_waveform_overlay(compare_waveforms(synthetic_run, synthetic_run, 100.0), (0.0, 5.0))
    assert "never part" in same.axes[0].get_title(loc="left")
    assert same.axes[0].get_xlim()[1] <= 5.0
    with pytest.raises(InputError, match="window"):
        plot_waveform_overlay(found, (50.0, 60.0))
    plt.close("all")


def scaled(run, length):
    """A run as of another buckling level, at the same displacement in m."""
    share = run.attrs["length_scale"] / length
    changed = run.assign({name: share * run[name] for name in ("displacement_at_striker",)})
    return changed.assign_attrs(length_scale=length)


def test_the_band_of_a_model_is_that_of_its_runs(synthetic_run):
    """A fifth of the runs is off by more: 5 and 95 % of 41 equal distances, in b of the run that is compared."""
    import matplotlib.pyplot as plt

    off = np.linspace(-0.4, 0.4, 41)
    runs = [
        synthetic_run.assign(displacement_at_striker=synthetic_run["displacement_at_striker"] + each) for each in off
    ]
    runs = [run.assign_attrs(length_scale=1e-3) for run in runs]
    runs[3] = scaled(runs[3], 2e-3)
    model = synthetic_run.assign_attrs(length_scale=1e-3)
    found = compare_waveforms(synthetic_run, model, ensemble=runs)
    waves = found.waveforms
    np.testing.assert_allclose(waves.simulated_high - waves.simulated_displacement, 0.36, atol=1e-9)
    np.testing.assert_allclose(waves.simulated_low - waves.simulated_displacement, -0.36, atol=1e-9)
    assert found.within == 1.0
    late = compare_waveforms(parting(synthetic_run, 6.0), synthetic_run, ensemble=runs)
    assert late.within == pytest.approx(6.0 / float(waves.cycle[-1]), abs=0.1)
    labels = [each.get_label() for each in plot_waveform_overlay(late).axes[0].collections]
    assert "90 % of the model's runs" in labels
    plt.close("all")
    for some, words in (
        (runs[:5], r"ensemble of 5 run\(s\): must have at least 20"),
        ([*runs, runs[0].drop_vars("displacement_at_striker")], r"ensemble\[41\]"),
        ([*runs, runs[0].isel(time=slice(0, 900))], r"ensemble\[41\]: must have the coordinate cycle up to"),
    ):
        with pytest.raises(InputError, match=words):
            compare_waveforms(synthetic_run, synthetic_run, ensemble=some)


# --- the commands -------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def program():
    app = typer.Typer()
    for command in (vibrometer, fit_decay, calibrate, compare):
        app.command(command.__name__.replace("_", "-"))(command)

    def call(*arguments):
        return CliRunner().invoke(app, [str(argument) for argument in arguments])

    return call


@pytest.mark.slow
def test_commands_of_signals(program, tmp_path):
    rng, time = np.random.default_rng(0), np.arange(8000) / 1e4
    drive = np.where(time > 0.05, 0.03 * np.cos(2.0 * np.pi * 100.0 * (time - 0.05)), 0.0)
    path = write_signal(tmp_path / "v.csv", make_signal(drive + 1e-3 * rng.standard_normal(8000), "m/s", 1e4))
    told = program("vibrometer", path, "--plot", tmp_path / "v.png", "--json", tmp_path / "v.json",
                   "--drive-output", tmp_path / "drive.nc")  # fmt: skip
    assert told.exit_code == 0, told.output
    report = json.loads((tmp_path / "v.json").read_text(encoding="utf-8"))
    assert report["accepted"] is True and report["frequency_hz"] == pytest.approx(100.0, abs=0.01)
    assert (tmp_path / "v.png").stat().st_size > 10_000 and (tmp_path / "drive.nc").exists()

    decay = 1e-4 * np.exp(-2.5 * time) * np.cos(2.0 * np.pi * 81.0 * time) + 1e-6 * rng.standard_normal(8000)
    path = write_signal(tmp_path / "d.uff", make_signal(decay, "m", 1e4))
    told = program("fit-decay", path, "--method", "all", "--json", tmp_path / "d.json")
    assert told.exit_code == 0, told.output
    report = json.loads((tmp_path / "d.json").read_text(encoding="utf-8"))
    for method in ("fit", "hilbert", "log_decrement"):
        assert report[method]["modes"][0]["natural_frequency"] == pytest.approx(81.0, rel=5e-4)
    assert program("fit-decay", tmp_path / "none.csv").exit_code == 2


@pytest.mark.slow
@pytest.mark.parametrize(("polarity", "source"), [(1, "vibrometer"), (1, "camera"), (-1, "camera")])
def test_a_drive_takes_amplitude_and_sign_from_the_camera(program, tmp_path, polarity, source):
    """A sensitivity set 8 % too low: the drive is the vibrometer's, or, if asked, as large as the camera sees it."""
    freq, speed, gain = 100.0, 0.03, 1.08
    size = speed / (2.0 * np.pi * freq)

    def shaker(time):
        since = np.maximum(time - 0.0503, 0.0)
        return size * np.sin(2.0 * np.pi * freq * since) * (1.0 + 0.3 * np.exp(-since / 0.012))

    time = np.arange(16_000) / 2e4
    rng = np.random.default_rng(3)
    noise = 1e-4 * rng.standard_normal(time.size)
    signal = make_signal(np.gradient(shaker(time), time) + noise, "m/s", 2e4, name="velocity")
    path = write_signal(tmp_path / "v.csv", signal)
    frames = np.arange(3500) / 5e3
    seen = polarity * gain * shaker(frames + 0.02) + 2e-7 * rng.standard_normal(frames.size)
    tracked = xr.Dataset(
        {"shaker_displacement_mm": ("time", 1e3 * seen, {"units": "mm"})}, {"time": ("time", frames, {"units": "s"})}
    )
    tracked.to_netcdf(tmp_path / "tracked.nc", engine="h5netcdf")
    told = program("vibrometer", path, "--frequency", freq, "--camera", tmp_path / "tracked.nc", "--drive-output",
                   tmp_path / "drive.nc", "--amplitude-from", source, "--json", tmp_path / "v.json")  # fmt: skip
    assert told.exit_code == 0, told.output
    report = json.loads((tmp_path / "v.json").read_text(encoding="utf-8"))["alignment"]
    assert report["polarity"] == polarity
    assert abs(report["gain"] - gain) < 5.0 * report["gain_se"] < 0.02
    codes = [one["code"] for one in report["diagnostics"]]
    assert "alignment.amplitude" in codes and ("alignment.polarity" in codes) == (polarity < 0)
    assert "--amplitude-from" in told.output.replace("\n", " ")
    with xr.open_dataset(tmp_path / "drive.nc", engine="h5netcdf") as drive:
        assert drive.attrs["amplitude_from"] == source
        steady = drive["displacement"].values[drive["time"].values > 0.3]
        expected = size * (gain if source == "camera" else 1.0)
        assert 0.5 * np.ptp(steady) == pytest.approx(expected, rel=5e-3)
        first = drive["displacement"].values[drive["time"].values < drive["time"].values[0] + 0.06]
        rise = first - first[0]
        assert np.sign(rise[np.argmax(np.abs(rise) > 0.5 * size)]) == polarity


def test_the_camera_s_amplitude_needs_a_camera(program, tmp_path):
    time = np.arange(8000) / 1e4
    drive = np.where(time > 0.05, 0.03 * np.cos(2.0 * np.pi * 100.0 * (time - 0.05)), 0.0)
    noisy = drive + 1e-4 * np.random.default_rng(0).standard_normal(8000)
    path = write_signal(tmp_path / "v.csv", make_signal(noisy, "m/s", 1e4))
    told = program("vibrometer", path, "--drive-output", tmp_path / "d.nc", "--amplitude-from", "camera")
    assert told.exit_code == 2 and "--camera" in told.output
    assert not (tmp_path / "d.nc").exists()


def test_command_of_calibration(program, tmp_path):
    told = program("calibrate", "--straight", "80,221", "--lower-well", "81.3", "--upper-well", "80.5",
                   "-o", tmp_path / "beam.toml", "--json", tmp_path / "c.json")  # fmt: skip
    assert told.exit_code == 0, told.output
    assert "outside the symmetric model" in told.output
    values = json.loads((tmp_path / "c.json").read_text(encoding="utf-8"))["values"]
    assert values["buckling_level"] == pytest.approx(0.331e-3, abs=0.0005e-3)
    assert program("calibrate").exit_code == 2
    assert program("calibrate", "--straight", "80,x").exit_code == 2


@pytest.mark.slow
def test_command_of_comparison(program, tmp_path, synthetic_map, synthetic_run):
    synthetic_map.to_netcdf(tmp_path / "map.nc", engine="h5netcdf")
    synthetic_run.to_netcdf(tmp_path / "run.nc", engine="h5netcdf")
    (tmp_path / "t.csv").write_text(
        "frequency_hz,velocity_m_s,location,response_class\n80,0.002,0.476,intrawell\n100,0.08,0.476,transient 2\n",
        encoding="utf-8",
    )
    told = program("compare", tmp_path / "t.csv", tmp_path / "map.nc", "--json", tmp_path / "t.json")
    assert told.exit_code == 0, told.output
    assert json.loads((tmp_path / "t.json").read_text(encoding="utf-8"))["used"] == 2
    told = program("compare", tmp_path / "run.nc", tmp_path / "run.nc", "--json", tmp_path / "r.json")
    assert told.exit_code == 0, told.output
    report = json.loads((tmp_path / "r.json").read_text(encoding="utf-8"))
    assert report["rms_difference_b"] == 0.0
    for option in ("", "--overlay"):
        picture = tmp_path / f"runs{option}.png"
        told = program("compare", tmp_path / "run.nc", tmp_path / "run.nc", "--plot", picture, *option.split())
        assert told.exit_code == 0, told.output
        assert picture.stat().st_size > 20_000
    assert (tmp_path / "runs.png").read_bytes() != (tmp_path / "runs--overlay.png").read_bytes()
    assert "too short to tell" in report["reasons"][0] and report["measured_response"] == "unknown"
    assert program("compare", tmp_path / "t.csv", tmp_path / "t.csv").exit_code == 2
