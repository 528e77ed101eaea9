"""Inputs at the edge of what is allowed: an error of input that names them, and no other error."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest
from matplotlib.figure import Figure

import snapbeam as sb
from snapbeam.model.imperfection import perfect_equilibria
from snapbeam.sweeps.points import points_of
from snapbeam.util.si_prefixes import prefixed
from snapbeam.util.status_codes import wells_of


@pytest.mark.parametrize("wells", [np.zeros(0), [1, 2], "two", 3, np.nan, 1.5, np.array(["1"])])
def test_an_attribute_that_counts_no_wells(wells):
    with pytest.raises(sb.InputError, match=r"attribute wells = .*must be 1 or 2"):
        wells_of({"wells": wells})


def test_attributes_that_count_wells():
    assert [wells_of({}), wells_of({"wells": np.int64(1)}), wells_of({"wells": np.array([2])})] == [2, 1, 2]


@pytest.mark.parametrize(("kappa", "gamma"), [(-1e200, 1e-200), (-1e180, 1.0), (-1.0, 5e-324)])
def test_equilibria_beyond_the_range_of_numbers(kappa, gamma):
    with pytest.raises(sb.InputError, match="the equilibria are no finite numbers"):
        perfect_equilibria(np.array([kappa]), gamma)


def test_equilibria_inside_the_range_of_numbers():
    lowest = perfect_equilibria(np.array([-4.0]), 2.0)[0]
    assert lowest.energy == -2.0 and abs(lowest.amplitude[0]) == np.sqrt(2.0)


def test_a_video_whose_codec_is_not_known(tmp_path):
    pytest.importorskip("av")
    lab = pytest.importorskip("snapbeam.lab")

    path = lab.write_video(tmp_path / "a.avi", np.zeros((3, 32, 32), np.uint8))
    data = path.read_bytes()
    assert data.count(b"FFV1")
    path.write_bytes(data.replace(b"FFV1", b"ZZZ9"))
    with pytest.raises(sb.InputError, match="codec that is not known here"):
        lab.open_recording(path, frame_rate=1e4, pixel_size=1e-5)


@pytest.mark.slow
def test_output_in_ascii(tmp_path):
    environment = os.environ | {"PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0"}
    done = subprocess.run(
        [sys.executable, "-m", "snapbeam", "equilibria"],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        timeout=120,
    )
    assert done.returncode == 0 and b"Traceback" not in done.stderr, done.stderr
    assert rb"\xb5" in done.stdout


@pytest.mark.parametrize(
    "name", ["contact.side", "base_excitation.striker_on_base", "drive.velocity_amplitude", "modes"]
)
@pytest.mark.parametrize("values", [[], np.zeros(0)])
def test_an_axis_without_values(name, values):
    with pytest.raises(sb.InputError, match=rf"{name} = \[\]: must hold at least one point"):
        points_of({name: values})


@pytest.mark.parametrize("value", [1e-308, 5e-324, 1.797e308, -1.797e308])
def test_a_number_at_the_ends_of_the_range_has_a_prefix(value):
    assert prefixed(value, "m").endswith(" ym" if abs(value) < 1.0 else " Ym")


@pytest.mark.filterwarnings("ignore:overflow", "ignore:invalid value")
@pytest.mark.parametrize("kind", ["png", "pdf", "svg"])
def test_a_figure_whose_axes_are_beyond_the_range_of_numbers(tmp_path, kind):
    ax = Figure().add_subplot()
    ax.plot([-1.5e308, 1.5e308], [0.0, 1e-308])
    with pytest.raises(sb.InputError, match="cannot draw the figure"):
        sb.plot.save_figure(ax, tmp_path / f"a.{kind}")
    assert os.listdir(tmp_path) == []


def run_python(code, *words, **options):
    command = [sys.executable, "-c", code, *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, **options)


PROGRAM = "import sys; from snapbeam.__main__ import main; sys.argv[:1] = ['snapbeam']; main()"
NO_THREADS = """
import threading
def start(self): raise RuntimeError("can't start new thread")
threading.Thread.start = start
"""


@pytest.mark.slow
def test_threads_that_cannot_start(tmp_path):
    """A command that needs none goes on, and one that does says so."""
    assert run_python(NO_THREADS + PROGRAM, "equilibria", cwd=tmp_path).returncode == 0
    grid = ["--frequency-ratio", "0.9:1:2", "--velocity-amplitude", "0.1:0.2:2", "--threads", "2"]
    done = run_python(NO_THREADS + PROGRAM, "map", "--modes", "1", "--cycles", "2", *grid, cwd=tmp_path)
    assert "Traceback" not in done.stderr and done.returncode in (0, 1), done.stderr
    assert done.returncode == 0 or "starts no further threads" in done.stderr


NO_DESCRIPTORS = """
import os, sys, numpy as np, xarray as xr, snapbeam as sb
data = xr.Dataset({"a": ("x", np.arange(9.0))})
sb.write_netcdf(data, "a.nc")  # modules are loaded
held = []
try:
    import resource
    resource.setrlimit(resource.RLIMIT_NOFILE, (64, 64))
    while True:
        held.append(os.open(os.devnull, os.O_RDONLY))
except OSError:
    pass
for free in range(4):
    try:
        sb.write_netcdf(data, f"b{free}.nc")
    except OSError as error:
        assert "Too many open files" in str(error), error
    except sb.InputError as error:
        assert "Too many open files" in str(error), error
    os.close(held.pop())
sb.write_netcdf(data, "c.nc")
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="limits of a process")
def test_no_descriptors(tmp_path):
    done = run_python(NO_DESCRIPTORS, cwd=tmp_path)
    assert done.returncode == 0 and done.stderr == "", done.stderr
    left = set(os.listdir(tmp_path))
    assert {"a.nc", "c.nc"} <= left and all(name.endswith(".nc") and name[0] != "." for name in left)


NO_MEMORY = """
import numpy as np, xarray as xr, snapbeam as sb, snapbeam.util.netcdf as netcdf
begin, part = netcdf.DiskStream.__init__, netcdf.DiskStream._page
def full(self, path):
    begin(self, path)
    self.trouble = OSError(28, "No space left on device")
def scarce(self, number):
    if number >= PAGES:
        raise MemoryError
    return part(self, number)
netcdf.DiskStream.__init__, netcdf.DiskStream._page = full, scarce
try:
    sb.write_netcdf(xr.Dataset({"a": ("x", np.random.rand(100_000))}), "a.nc")
except OSError as error:
    print(error)
"""


@pytest.mark.slow
@pytest.mark.parametrize("pages", [0, 1, 5])
def test_a_file_for_which_there_is_no_memory(tmp_path, pages):
    """An error inside a callback of HDF5 would end the process with a segmentation fault."""
    done = run_python(NO_MEMORY.replace("PAGES", str(pages)), cwd=tmp_path)
    assert done.returncode == 0 and "a.nc" in done.stdout and "the memory is not sufficient" in done.stdout, done
    assert os.listdir(tmp_path) == []


@pytest.mark.skipif(sys.platform != "linux", reason="a folder in use can be deleted")
@pytest.mark.parametrize("words", [["simulate", "--modes", "1", "--cycles", "2", "-o", "a.nc"], ["info", "a.nc"]])
def test_a_working_folder_that_was_deleted(tmp_path, words):
    gone = tmp_path / "gone"
    gone.mkdir()
    code = f"import os; os.chdir({str(gone)!r}); os.environ['PWD'] = os.getcwd(); os.rmdir(os.getcwd()); {PROGRAM}"
    done = run_python(code, *words)
    assert done.returncode == 1 and "Traceback" not in done.stderr, done.stderr
    assert f"working folder = {str(gone)!r}: does not exist any more" in done.stderr
