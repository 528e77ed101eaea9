"""A file with several results: each is opened by ``FILE.nc:GROUP``."""

from __future__ import annotations

import pytest
import xarray as xr

import snapbeam as sb
from snapbeam.util.netcdf import read_result, split_group
from snapbeam.util.validation import InputError


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "two.nc"
    one, other = (xr.Dataset({"gap": ("time", [value])}) for value in (1.0, 2.0))
    sb.write_netcdf({None: xr.Dataset(), "first": one, "second": other}, path)
    return path


def test_a_result_is_named(file) -> None:
    assert read_result(f"{file}:second").gap.values.tolist() == [2.0]
    assert split_group(f"{file}:second") == (file, "second")
    with pytest.raises(InputError, match=r"has the results first, second; give one as two\.nc:first"):
        read_result(file)
    with pytest.raises(InputError, match=r"has no result 'third'; it has first, second"):
        read_result(f"{file}:third")
    with pytest.raises(InputError, match="no such file"):
        read_result(file.with_name("none.nc:first"))


def test_a_plain_file_stays_plain(tmp_path) -> None:
    path = tmp_path / "one.nc"
    sb.write_netcdf(xr.Dataset({"gap": ("time", [1.0])}), path)
    assert read_result(path).gap.values.tolist() == [1.0]
    assert split_group(path) == (path, None)
    with pytest.raises(InputError, match=r"has no result 'group'; it is one result; give one\.nc alone"):
        read_result(f"{path}:group")


def test_arrays_of_dask_are_written(tmp_path):
    pytest.importorskip("dask.array")
    lazy = xr.Dataset({"gap": ("time", [1.0, 2.0, 3.0]), "name": ("time", ["a", "b", "c"])}).chunk(time=2)
    sb.write_netcdf(lazy, tmp_path / "lazy.nc")
    written = read_result(tmp_path / "lazy.nc")
    assert written["gap"].values.tolist() == [1.0, 2.0, 3.0]
    assert written["name"].values.tolist() == ["a", "b", "c"]
