"""Random changes of a small file of each format: what comes of it is the file's own number, or a refusal.

A flipped bit inside a number is a number, too: no reader can tell.  Everything else of the signal must stay: a change
touches one sample, or the rate, the unit or the length, and never shifts what lies behind it.
"""

from __future__ import annotations

import logging
import warnings

import numpy as np
import pytest
import pyuff
import xarray as xr
from nptdms import ChannelObject, TdmsWriter
from scipy.io import savemat, wavfile
from test_packed_signals import hdf5, netcdf
from test_signal_formats import COUNT, TIME, VALUES, lvm, rows

from snapbeam.lab.signal_files import read_signal
from snapbeam.lab.signals import check_signal
from snapbeam.util.diagnostics import diagnostics_of
from snapbeam.util.validation import InputError

RATE = 1.0 / TIME[1]


def tdms(path):
    properties = {"wf_increment": TIME[1], "wf_samples": COUNT, "unit_string": "m/s"}
    with TdmsWriter(path) as writer:
        writer.write_segment([ChannelObject("g", "velocity", VALUES, properties=properties)])


def uff(path):
    pyuff.UFF(str(path)).write_sets(
        {
            "type": 58, "binary": 0, "func_type": 1, "rsp_node": 1, "rsp_dir": 1, "ref_node": 1, "ref_dir": 1,
            "data": VALUES, "x": TIME, "id1": "velocity", "rsp_ent_name": "a", "ref_ent_name": "b",
            "abscissa_spacing": 1, "abscissa_inc": TIME[1], "abscissa_min": 0.0, "abscissa_spec_data_type": 17,
            "ordinate_spec_data_type": 11, "orddenom_spec_data_type": 0,
        },
        mode="overwrite",
    )  # fmt: skip


def netcdf4(path):
    units = {"units": "m/s"}, {"units": "s"}
    data = xr.Dataset({"velocity": ("time", VALUES, units[0])}, {"time": ("time", TIME, units[1])})
    data.to_netcdf(path, engine="h5netcdf")


WRITERS = {
    "a.csv": lambda path: path.write_text("time [s],velocity [m/s]\n" + rows("{t:.6f},{v:.9f}")),
    "a.lvm": lambda path: path.write_text(lvm()),
    "a.uff": uff,
    "a.mat": lambda path: savemat(path, {"velocity": VALUES, "fs": RATE}),
    "a.npz": lambda path: np.savez(path, velocity=VALUES, time=TIME),
    "a.h5": lambda path: hdf5(path, VALUES, units="m/s"),
    "a.nc": netcdf4,
    "three.nc": lambda path: netcdf(path, VALUES),
    "a.tdms": tdms,
    "a.wav": lambda path: wavfile.write(path, int(RATE), VALUES.astype(np.float32)),
}
OF_FIXED_PLACES = {"three.nc", "a.mat", "a.wav"}
"""Formats whose headers state no length of the file: changes there keep the number of bytes."""
SEPARATE = "a.mat"
"""Read by a process of its own for each change."""
KEPT_HEAP = 2
"""HDF5 itself never returns from a string whose heap states a length of 0: no bytes of it are changed in place."""
TEXTS = {"a.csv", "a.lvm", "a.uff"}


def read(path):
    options = {
        ".lvm": {"channel": "Velocity"}, ".mat": {"units": "m/s"}, ".npz": {"units": "m/s"}, ".uff": {"units": "m/s"},
        ".wav": {"sensitivity": "1 m/s/FS"},
    }  # fmt: skip
    signal = read_signal(path, **options.get(path.suffix, {}))
    return signal, check_signal(signal).sampling_frequency


def changed(whole, rng, name):
    """*whole* with a bit or a byte changed, some bytes missing or added, or the end cut off."""
    content, kind = (
        bytearray(whole),
        rng.integers(KEPT_HEAP if name == "a.nc" else 0, 2 if name in OF_FIXED_PLACES else 5),
    )
    at, more = int(rng.integers(len(content))), int(rng.integers(1, 9))
    if kind == 0:
        content[at] ^= 1 << int(rng.integers(8))
    elif kind == 1:
        content[at] = int(rng.integers(256))
    elif kind == 2:
        del content[at : at + more]
    elif kind == 3:
        content[at:at] = rng.integers(0, 256, more, dtype=np.uint8).tobytes()
    else:
        del content[at:]
    return bytes(content)


@pytest.mark.sampled(3)
@pytest.mark.parametrize(
    ("name", "changes"),
    [*((name, 200) for name in WRITERS if name != SEPARATE), pytest.param(SEPARATE, 60, marks=pytest.mark.slow)],
)
def test_a_change_is_seen_or_stays_where_it_is(name, changes, tmp_path):
    logging.getLogger("nptdms").setLevel(logging.CRITICAL)
    path, rng, refused = tmp_path / name, np.random.default_rng(52), 0
    WRITERS[name](path)
    whole = path.read_bytes()
    good, rate = read(path)
    assert rate == pytest.approx(RATE, rel=1e-6)
    for number in range(changes):
        path.write_bytes(changed(whole, rng, name))
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                signal, found = read(path)
        except InputError:
            refused += 1
            continue
        if diagnostics_of(signal):
            continue
        common = min(signal.size, good.size)
        differs = int((signal.values[:common] != good.values[:common]).sum())
        if name in TEXTS:
            # a text that ends between two lines is whole, and two of its numbers may have become one
            assert signal.size <= good.size
            assert differs <= 2 or signal.size == good.size - 1, (number, differs)
            continue
        others = [signal.attrs["units"] != good.attrs["units"], abs(found / rate - 1.0) > 1e-9]
        others.append(signal.size != good.size)
        assert differs + sum(others) <= 1, (number, differs, others)
    assert refused > changes // (40 if name in OF_FIXED_PLACES else 4)
