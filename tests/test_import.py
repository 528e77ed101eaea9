"""Importing the package costs little and brings nothing along that most runs do not need."""

from __future__ import annotations

import subprocess
import sys

import pytest

HEAVY = ("matplotlib", "dask", "distributed", "cv2", "av", "pandas", "zarr", "typer", "rich", "pydantic")


@pytest.mark.parametrize("module", ["snapbeam", "snapbeam.cli"])
def test_import_is_light(module):
    script = f"import sys, {module}; print(*[m for m in {HEAVY!r} if m in sys.modules])"
    loaded = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    ).stdout.split()
    allowed = {"typer", "rich"} if module == "snapbeam.cli" else set()
    assert set(loaded) <= allowed


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
    assert "snapbeam.solver.cpu.integrate" in loaded
    assert not loaded & {"matplotlib", "pandas", "xarray", "dask", "scipy.stats"}


def test_every_public_name_is_found_where_it_stands():
    import snapbeam

    for name in snapbeam.__all__:
        assert getattr(snapbeam, name) is not None, name
    assert set(snapbeam.__all__) <= set(dir(snapbeam))
    with pytest.raises(AttributeError, match="attribute simulat"):
        snapbeam.simulat  # noqa: B018
