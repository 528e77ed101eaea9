"""Packed numbers, sampling rates and time axes of binary files: used, or refused with the reason."""

from __future__ import annotations

import h5py
import numpy as np
import pytest
import xarray as xr
from scipy.io import netcdf_file, savemat

from snapbeam.lab import matlab_file, signal_formats
from snapbeam.lab.signal_files import read_channels, read_signal
from snapbeam.lab.signals import check_signal
from snapbeam.util.netcdf import read_netcdf
from snapbeam.util.validation import InputError

COUNT = 40
TIME = np.arange(COUNT) / 2000.0
COUNTS = np.round(5000.0 * np.sin(2.0 * np.pi * 97.0 * TIME)).astype(np.int16)
PACKED = {"scale_factor": 1e-6, "add_offset": 2e-3, "units": "m/s"}
VALUES = 1e-6 * COUNTS + 2e-3


def hdf5(path, data=COUNTS, time=TIME, **attributes):
    with h5py.File(path, "w") as file:
        if time is not None:
            file["time"] = time
            file["time"].attrs["units"] = "s"
        file["velocity"] = data
        file["velocity"].attrs.update(attributes)
    return path


def netcdf(path, data=COUNTS, **attributes):
    with netcdf_file(path, "w") as file:
        file.createDimension("time", COUNT)
        for name, numbers, units in (("time", TIME, "s"), ("velocity", data, "m/s")):
            made = file.createVariable(name, numbers.dtype, ("time",))
            made[:] = numbers
            made.units = units
        for key, value in attributes.items():
            setattr(made, key, value)
    return path


def same(path, values=VALUES, **options):
    signal = read_signal(path, **options)
    np.testing.assert_allclose(signal.values, values, atol=1e-9)
    assert check_signal(signal).sampling_frequency == pytest.approx(2000.0, rel=1e-6)
    assert signal.attrs["units"] == "m/s"


def test_packed_numbers_are_unpacked_by_one_rule(tmp_path):
    """5000 counts with a scale of 1e-6 are .005 m/s, also as ``compare`` reads them."""
    same(hdf5(tmp_path / "a.nc", **PACKED))
    same(hdf5(tmp_path / "a.h5", **PACKED))
    same(netcdf(tmp_path / "three.nc", scale_factor=1e-6, add_offset=2e-3))
    np.testing.assert_allclose(read_netcdf(tmp_path / "three.nc").velocity, VALUES, atol=1e-9)
    data = xr.Dataset({"velocity": ("time", VALUES, {"units": "m/s"})}, {"time": ("time", TIME, {"units": "s"})})
    packing = {"dtype": "int16", "scale_factor": 1e-6, "add_offset": 2e-3, "_FillValue": np.int16(-32768)}
    data.to_netcdf(tmp_path / "xarray.nc", engine="h5netcdf", encoding={"velocity": packing})
    same(tmp_path / "xarray.nc")
    np.testing.assert_array_equal(
        read_signal(tmp_path / "xarray.nc").values, read_netcdf(tmp_path / "xarray.nc").velocity
    )
    small = COUNTS // 50
    same(
        hdf5(tmp_path / "u.nc", small.astype(np.int8).view(np.uint8), **PACKED, _Unsigned="false"), 1e-6 * small + 2e-3
    )


@pytest.mark.parametrize("key", ["_FillValue", "missing_value", "valid_min", "valid_range", "fillvalue"])
@pytest.mark.parametrize("kind", ["nc", "h5", "nc3"])
def test_fill_values_are_no_data(tmp_path, key, kind):
    counts = COUNTS.copy()
    counts[7:9] = -32768
    value = {"valid_min": np.int16(-6000), "valid_range": np.array([-6000, 6000], np.int16)}.get(key, np.int16(-32768))
    if key == "fillvalue":
        with h5py.File(tmp_path / "a.h5", "w") as file:
            file["time"] = TIME
            made = file.create_dataset("velocity", (COUNT,), "i2", fillvalue=-32768)
            made[:7], made[9:] = COUNTS[:7], COUNTS[9:]
            made.attrs.update(PACKED)
        path = tmp_path / "a.h5"
    elif kind == "nc3":
        path = netcdf(tmp_path / "a.nc", counts, **{key: value})
    else:
        path = hdf5(tmp_path / f"a.{kind}", counts, **PACKED, **{key: value})
    with pytest.raises(InputError, match=r"velocity, sample 7: nan is not a finite number \(2 such"):
        read_signal(path)


@pytest.mark.parametrize(
    ("attributes", "said"),
    [
        ({"scale_factor": 0.0}, "'scale_factor' = 0.0: must be"),
        ({"scale_factor": "big"}, "'scale_factor' = big: must be"),
        ({"add_offset": np.inf}, "'add_offset' = inf: must be"),
        ({"scale_factor": [1.0, 2.0]}, "'scale_factor' = .*must be"),
        ({"gain": 0.01}, "gain = 0.01 may scale its numbers"),
        ({"Conversion": np.array([2.5])}, "Conversion = 2.5 may scale"),
        ({"offset": 3}, "offset = 3 may scale"),
    ],
)
def test_scales_that_are_not_clear_are_refused(tmp_path, attributes, said):
    with pytest.raises(InputError, match=said):
        read_signal(hdf5(tmp_path / "a.h5", units="m/s", **attributes))


def test_counts_beside_a_scale_in_matlab_and_numpy(tmp_path):
    arrays = {"velocity": COUNTS, "velocity_units": "m/s", "fs": 2000.0, "scale_factor": 1e-6}
    savemat(tmp_path / "a.mat", arrays)
    np.savez(tmp_path / "a.npz", **arrays)
    for path in (tmp_path / "a.mat", tmp_path / "a.npz"):
        with pytest.raises(InputError, match="scale_factor = 1e-06 may scale its numbers: store the scaled numbers"):
            read_signal(path)
    arrays["velocity"] = 1e-6 * arrays["velocity"]
    del arrays["scale_factor"]
    np.savez(tmp_path / "a.npz", **arrays)
    same(tmp_path / "a.npz", 1e-6 * COUNTS)


RATES = {
    "dt": 5e-4, "fs": 2000.0, "Fs": 2000, "sampling_rate": 2000.0, "SamplingFrequency": "2 kHz", "Time_Sample_Rate": 2000.0,
    "dt_ms": 0.5, "fs_Hz": 2000.0, "sampleRate": [[2000.0]], "Tinterval": 5e-4, "sample_interval": "0.5 ms",
}  # fmt: skip
AXES = ("time", "t", "Time", "Time_domain", "time_s", "time_axis", "Zeit", "X-Axis")


def stored(path, arrays):
    """Write named arrays to a file of the kind that its name says."""
    if path.suffix == ".npz":
        np.savez(path, **arrays)
    elif path.suffix == ".mat":
        savemat(path, {name.replace("-", "_"): value for name, value in arrays.items()})
    else:
        with h5py.File(path, "w") as file:
            for name, value in arrays.items():
                file[name] = value
    return path


@pytest.mark.parametrize("suffix", [".mat", ".h5", ".npz"])
def test_sampling_rates_under_their_usual_names(tmp_path, suffix, monkeypatch):
    # without a process for each of the eighty files
    monkeypatch.setattr(signal_formats, "read_version_5", matlab_file._load)
    base = {"velocity": VALUES, "velocity_units": "m/s"}
    for name, value in RATES.items():
        path = stored(tmp_path / f"a{suffix}", {**base, name: value})
        same(path)
        assert len(read_channels(path)) == 1
        with pytest.raises(InputError, match="the header says"):
            read_signal(stored(path, {**base, name: value, "time": 2.0 * TIME}))
        with pytest.raises(InputError, match="contradicts itself about the sampling rate"):
            read_signal(stored(path, {**base, name: value, "sample_frequency": 1000.0}))
    for name in AXES:
        path = stored(tmp_path / f"a{suffix}", {**base, name: TIME})
        same(path)
        same(path, sampling_frequency=2000.0)
        with pytest.raises(InputError, match="the header says 1000 Hz; leave out sampling_frequency"):
            read_signal(path, sampling_frequency=1000.0)
    for axis, name in ((1e3 * TIME, "time_ms"), (1e6 * TIME, "t_us")):
        same(stored(tmp_path / f"a{suffix}", {**base, name: axis, "fs": 2000.0}))
    with pytest.raises(InputError, match=r"time axes .* differ: remove the wrong one"):
        read_signal(stored(tmp_path / f"a{suffix}", {**base, "time": TIME, "Time_domain": 2.0 * TIME}))
    with pytest.raises(InputError, match="timestamp has no unit"):
        read_signal(stored(tmp_path / f"a{suffix}", {**base, "timestamp": TIME}))
    with pytest.raises(InputError, match="has no sampling rate; state sampling_frequency"):
        read_signal(stored(tmp_path / f"a{suffix}", {**base, "dt": 0.0}))
    same(stored(tmp_path / f"a{suffix}", {**base, "dt": 0.0}), sampling_frequency=2000.0)
    with pytest.raises(InputError, match=r"sampling rate = -2000.0: must be"):
        read_signal(stored(tmp_path / f"a{suffix}", {**base, "fs": -2000.0}))


def test_rates_in_attributes_and_axes_of_dimensions(tmp_path):
    for where in ("", "run", "run/velocity"):
        with h5py.File(tmp_path / "a.h5", "w") as file:
            file["run/velocity"] = VALUES
            file["run/velocity"].attrs["units"] = "m/s"
            (file[where] if where else file).attrs["SamplingFrequency"] = 2000.0
        same(tmp_path / "a.h5")
        with h5py.File(tmp_path / "a.h5", "a") as file:
            file.attrs["dt"] = 1e-3
        with pytest.raises(InputError, match="contradicts itself"):
            read_signal(tmp_path / "a.h5")
    for units, scale in (("s", 1.0), ("milliseconds since 2024-01-01", 1e3), ("days since 2024-01-01", 1.0 / 86400.0)):
        data = xr.Dataset({"velocity": ("x", VALUES, {"units": "m/s"})}, {"x": ("x", scale * TIME, {"units": units})})
        data.to_netcdf(tmp_path / "axis.nc", engine="h5netcdf")
        same(tmp_path / "axis.nc")
    data = xr.Dataset({"velocity": ("sample", VALUES, {"units": "m/s"})}, {"sample": np.arange(COUNT)}, {"fs": 2000.0})
    data.to_netcdf(tmp_path / "number.nc", engine="h5netcdf")
    assert [each["name"] for each in read_channels(tmp_path / "number.nc")] == ["velocity"]
    same(tmp_path / "number.nc")


def test_netcdf_of_64_bit_data_says_how_to_convert_it(tmp_path):
    path = netcdf(tmp_path / "a.nc")
    path.write_bytes(b"CDF\x05" + path.read_bytes()[4:])
    with pytest.raises(InputError, match=r"CDF-5.*nccopy -k nc4"):
        read_signal(path)
