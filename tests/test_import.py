"""Importing the package costs little and brings nothing along that most runs do not need."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import snapbeam

HEAVY = ("matplotlib", "dask", "distributed", "cv2", "av", "pandas", "zarr", "typer", "rich", "pydantic", "xarray")


@pytest.mark.parametrize("module", ["snapbeam", "snapbeam.cli"])
def test_import_is_light(module):
    script = f"import sys, {module}; print(*[m for m in {HEAVY!r} if m in sys.modules])"
    loaded = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout.split()
    allowed = {"typer", "rich"} if module == "snapbeam.cli" else set()
    assert set(loaded) <= allowed


def test_xarray_is_imported_in_one_module_only():
    """Every dataset of snapbeam has ``dataset.snapbeam``, because each module takes xarray from util.datasets."""
    source = Path(snapbeam.__file__).parent
    found = set()
    for path in source.rglob("*.py"):
        block = ""
        for line in path.read_text(encoding="utf-8").splitlines():
            block = line if line[:1].strip() else block
            if line.strip().startswith("import xarray") and block != "if TYPE_CHECKING:":
                found.add(path.relative_to(source).as_posix())
    assert found == {"util/datasets.py"}


def loaded_by(*arguments):
    """What the program loads for a command."""
    script = (
        "import sys; sys.argv[1:] = " + repr(list(arguments)) + "\n"
        "from snapbeam.cli import main\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        "print('loaded', *sys.modules, file=sys.stderr)"
    )
    ended = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    return set(ended.stderr.rsplit("loaded", 1)[1].split())


def test_the_version_loads_next_to_nothing():
    assert not loaded_by("--version") & {*HEAVY, "numpy", "numba"} - {"typer", "rich"}


def test_a_run_without_files_loads_no_pictures_and_no_tables():
    loaded = loaded_by("simulate", "--modes", "1", "--cycles", "2", "--quiet")
    assert "snapbeam.solver.native" in loaded
    assert not loaded & {"matplotlib", "pandas", "xarray", "dask", "scipy"}


def test_help_loads_no_scipy():
    assert not loaded_by("--help") & {"scipy", "matplotlib", "pandas", "xarray"}


@pytest.mark.slow
def test_a_run_that_is_written_and_drawn_loads_no_arrays_of_other_libraries(tmp_path):
    files = ("-o", str(tmp_path / "run.nc"), "--plot", str(tmp_path / "run.png"), "--window", "0:2")
    loaded = loaded_by("simulate", "--modes", "2", "--cycles", "3", "--quiet", *files)
    assert {"xarray", "matplotlib"} <= loaded
    assert not loaded & {"dask.base", "dask.array", "pint", "scipy"}


def test_every_public_name_is_found_where_it_stands():
    for name in snapbeam.__all__:
        assert getattr(snapbeam, name) is not None, name
    assert set(snapbeam.__all__) <= set(dir(snapbeam))
    with pytest.raises(AttributeError, match="attribute simulat"):
        snapbeam.simulat  # noqa: B018
