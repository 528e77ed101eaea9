"""A disk that fills while a result is written: no crash, no half file, nothing that was computed is lost."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import h5netcdf
import numpy as np
import pytest
import xarray as xr

import snapbeam as sb
from snapbeam.util.files import NoRoomError, atomic_path
from snapbeam.util.netcdf import netcdf_file, write_netcdf

RUN = "import sys; from snapbeam.cli import main; main()"


def random_set(numbers):
    values = np.random.default_rng(1).random(numbers)
    return xr.Dataset({"a": ("x", values, {"units": "1"})}, attrs={"title": "a", "count": numbers})


@pytest.mark.parametrize("size", ["8k", "20k", "64k"])
@pytest.mark.parametrize("numbers", [20, 3000, 100_000])
def test_a_dataset_that_does_not_fit(mounted, tmp_path, monkeypatch, tried, size, numbers):
    """Whole, or not there and whole elsewhere, with the room that it needs."""
    disk = mounted("disk", f"size={size}")
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    dataset = random_set(numbers)
    tried("NetCDF files written to a disk that may be too small")
    try:
        write_netcdf(dataset, disk / "a.nc")
    except NoRoomError as error:
        found = re.search(r"it needs ([0-9.e+]+) MB, [0-9.e+-]+ MB are free; it was written to '(.*)' inst", str(error))
        kept = Path(found[2])
        assert float(found[1]) == pytest.approx(kept.stat().st_size / 1e6, rel=0.01)
        assert os.listdir(disk) == []
    else:
        kept = disk / "a.nc"
        assert os.listdir(disk) == ["a.nc"]
    xr.testing.assert_identical(read_back(kept), dataset)


def read_back(path):
    """What was given to be written: without the version, which every file says of its own."""
    found = xr.load_dataset(path, engine="h5netcdf")
    assert found.attrs.pop("snapbeam_version") == sb.__version__
    return found


def test_it_fits_and_is_what_xarray_writes(tmp_path):
    dataset = random_set(1000)
    write_netcdf({None: dataset, "more": dataset.isel(x=0)}, tmp_path / "a.nc")
    dataset.to_netcdf(tmp_path / "b.nc", engine="h5netcdf")
    xr.testing.assert_identical(read_back(tmp_path / "a.nc"), xr.load_dataset(tmp_path / "b.nc", engine="h5netcdf"))
    more = xr.load_dataset(tmp_path / "a.nc", engine="h5netcdf", group="more")
    xr.testing.assert_identical(more, dataset.isel(x=0))


def test_no_room_anywhere(mounted, monkeypatch):
    disk = mounted("disk", "size=8k")
    monkeypatch.setattr("tempfile.tempdir", str(disk))
    before = disk / "a.nc"
    before.write_text("a file of before", encoding="utf-8")
    with pytest.raises(NoRoomError, match=r"needs 0\.8\d+ MB, 0\.00\d+ MB are free: make room and give the same"):
        write_netcdf(random_set(100_000), before)
    assert os.listdir(disk) == ["a.nc"] and before.read_text(encoding="utf-8") == "a file of before"


def test_blocks_that_do_not_fit(mounted, tmp_path, monkeypatch, tried):
    """Written a compressed block at a time, as stores are, with the disk full at any of them."""
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    values = np.random.default_rng(2).random((16, 4096))
    for size in range(16, 440, 48):
        disk = mounted(f"disk-{size}", f"size={size}k")
        tried("NetCDF files written to a disk that may be too small")
        with pytest.raises(NoRoomError) as refused, netcdf_file(disk / "a.nc") as file:
            file.dimensions = {"y": 16, "x": 4096}
            made = file.create_variable("a", ("y", "x"), "f8", compression="gzip", shuffle=True)
            for row in range(16):
                made[row] = values[row]
        assert os.listdir(disk) == []
        kept = re.search(r"written to '(.*)' instead", str(refused.value))[1]
        with h5netcdf.File(kept) as file:
            np.testing.assert_array_equal(file["a"][...], values)


def test_a_run_that_cannot_be_saved_is_not_lost(mounted, tmp_path, monkeypatch, model, contact):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    system = sb.System(model, contacts=[sb.Contact(contact, sb.Shaker(frequency_ratio=1.0, velocity_amplitude=0.3))])
    run = sb.simulate(system, sb.Integration(cycles=5))
    with pytest.raises(NoRoomError) as refused:
        run.save(mounted("disk", "size=20k") / "run.nc")
    kept = re.search(r"written to '(.*)' instead", str(refused.value))[1]
    xr.testing.assert_identical(sb.load(kept).impacts, run.impacts)


@pytest.mark.sampled(2)
@pytest.mark.parametrize("kind", [pytest.param("pdf", marks=pytest.mark.slow), "png", "svg"])
@pytest.mark.parametrize("size", ["4k", pytest.param("12k", marks=pytest.mark.slow), "20k"])
def test_a_figure_that_does_not_fit(mounted, synthetic_run, tried, size, kind):
    """Matplotlib's writer of PDF files raises errors of other kinds when the disk is full."""
    disk = mounted("disk", f"size={size}")
    with pytest.raises(NoRoomError, match="No space left"):
        sb.plot.save_figure(sb.plot.plot_run(synthetic_run), disk / f"x.{kind}")
    assert os.listdir(disk) == []
    tried("figures written to a disk that is too small")


@pytest.mark.slow
@pytest.mark.parametrize("place", ["output", "store", "plot", "save"])
def test_commands_on_a_full_disk(mounted, tmp_path, tried, place):
    """Every place that a command writes to: a refusal before the work, no traceback, no signal."""
    disk = mounted("disk", "size=20k")
    paths = {name: tmp_path / name for name in ("output", "plot", "store", "log", "save")}
    paths[place] = disk / place
    grid = ["--frequency-ratio", "0.5:2:24", "--velocity-amplitude", "0.05:0.6:24", "--modes", "1", "--cycles", "2"]
    command = ["map", *grid, "-o", f"{paths['output']}.nc", "--plot", f"{paths['plot']}.png"]
    command += ["--checkpoint", str(paths["store"])] if place == "store" else []
    if place == "save":
        command = ["simulate", "--modes", "1", "--cycles", "20", "-o", f"{paths['save']}.nc"]
    env = os.environ | {"PYTHONFAULTHANDLER": "1"}
    done = subprocess.run([sys.executable, "-c", RUN, *command], capture_output=True, text=True, env=env, cwd=tmp_path)
    assert done.returncode == 2, (done.returncode, done.stderr)
    assert "make room" in done.stderr
    assert "Traceback" not in done.stderr
    assert not any(file.suffix in (".nc", ".png") for file in disk.iterdir())
    tried("commands with a full disk")


def test_a_full_disk_for_the_log_ends_no_map(tmp_path, mounted, capsys):
    from snapbeam.cli.parameter_options import LongReport

    disk = mounted("disk", "size=8k")
    (disk / "filler").write_bytes(b"0" * 8192)
    report = LongReport(lambda done, total: None, disk / "map.log")
    for done in range(3):
        report.progress(done, 2)
    assert capsys.readouterr().err.count("cannot be written any more, No space left") == 1


def test_orphans_of_killed_writers_are_swept(tmp_path, tried):
    """What a killed process left is removed by the next write; what a living one writes is not."""
    script = (
        "import os, signal, sys; from snapbeam.util.files import atomic_path\n"
        "with atomic_path(sys.argv[1]) as temporary:\n"
        "    temporary.write_text('half'); os.kill(os.getpid(), signal.SIGKILL)"
    )
    subprocess.run([sys.executable, "-c", script, str(tmp_path / "map.nc")])
    assert len(os.listdir(tmp_path)) == 1
    with atomic_path(tmp_path / "map.nc") as mine:
        assert os.listdir(tmp_path) == [mine.name]
        with atomic_path(tmp_path / "map.nc") as other:
            other.write_text("other", encoding="utf-8")
        assert mine.exists()
        mine.write_text("whole", encoding="utf-8")
    assert os.listdir(tmp_path) == ["map.nc"] and (tmp_path / "map.nc").read_text(encoding="utf-8") == "whole"
    tried("writers killed in the middle of a file")


def test_every_netcdf_file_is_written_that_way():
    """Nothing in the package hands a path on a disk to the HDF5 library to write to."""
    package = Path(sb.__file__).parent
    for file in package.rglob("*.py"):
        text = file.read_text(encoding="utf-8")
        assert not re.search(r"\.to_netcdf\(|h5netcdf\.File\((?!stream)|h5py\.File\((?!stream).*[\"'](w|a)", text), file


def begins_alike(path, whole):
    found = sb.load(path).dataset
    xr.testing.assert_equal(found.drop_attrs(), whole.dataset.isel(time=slice(found.sizes["time"])).drop_attrs())


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*the run will be stopped where the disk is full")
@pytest.mark.parametrize(("kind", "most"), [("map", 160), ("streamed", 2_500), ("saved", 1_000)])
def test_disks_of_random_sizes(mounted, tmp_path, monkeypatch, model, contact, tried, kind, most):
    """After each refusal, or after more room, the same bits; nothing incomplete is on the disk."""
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    monkeypatch.setattr("snapbeam.solver.native._SAMPLES", 4096)
    system = sb.System(model, contacts=[sb.Contact(contact, sb.Shaker(frequency_ratio=1.2, velocity_amplitude=0.2))])
    axes = {"drive.frequency_ratio": np.linspace(0.4, 2.0, 6), "drive.velocity_amplitude": np.linspace(0.05, 0.6, 5)}
    how = sb.Integration(cycles=3 if kind == "map" else 60)
    whole = sb.sweep(system, axes, how) if kind == "map" else sb.simulate(system, how)
    draw, full, disks = np.random.default_rng(84), 0, 0
    while full < 34:
        disks += 1
        disk = mounted(f"disk-{disks}", f"size={4 * draw.integers(1, most // 4)}k")
        kept = disk / "store" if kind == "map" else disk / "run.nc"
        try:
            if kind == "map":
                sb.sweep(system, axes, how, checkpoint=sb.CheckpointOptions(kept, points_per_task=2))
            elif kind == "streamed":
                sb.simulate_to_file(system, how, path=kept)
            else:
                whole.save(kept)
        except OSError as error:
            full += 1
            elsewhere = re.search(r"written to '(.*)' instead", str(error))
            assert str(disk) in str(error) and ("room" in str(error) or elsewhere)
            if elsewhere:
                begins_alike(Path(elsewhere[1]), whole)
                Path(elsewhere[1]).unlink()
        if kind == "map":
            subprocess.run(["mount", "-o", "remount,size=8m", str(disk)], check=True)
            again = sb.sweep(system, axes, how, checkpoint=sb.CheckpointOptions(kept, points_per_task=2))
            xr.testing.assert_equal(again.drop_attrs(), whole.drop_attrs())
            assert not list(kept.rglob("*.partial"))
            continue
        assert os.listdir(disk) == (["run.nc"] if kept.exists() else [])
        if kept.exists():
            begins_alike(kept, whole)
    tried(f"disks that {'a map' if kind == 'map' else f'a {kind} run'} fills", full)
