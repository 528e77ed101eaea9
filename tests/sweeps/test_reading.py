"""A store is read as it stands: whole, half done, and while it is written."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model.parameter_file import Config
from snapbeam.model.parameters import lookup

pytest.importorskip("zarr")


@pytest.fixture(scope="module")
def system():
    return Config().system.replace(**{"model.modes": 2})


AXES = {"velocity_amplitude": np.linspace(0.05, 0.4, 10), "frequency_ratio": np.linspace(0.5, 2.0, 12)}


@pytest.fixture(scope="module")
def whole(system, tmp_path_factory):
    path = tmp_path_factory.mktemp("store") / "map.store"
    dataset = sb.sweep(
        system, AXES, sb.Integration(cycles=5), checkpoint=sb.CheckpointOptions(path, points_per_task=16)
    )
    return path, dataset


def test_a_finished_store_is_the_map_that_was_returned(whole):
    path, dataset = whole
    read = sb.read_checkpoint(path)
    assert read.attrs["points_done"] == read.attrs["points_total"] == 120
    for name in sb.STATISTICS:
        np.testing.assert_array_equal(read[name].transpose(*dataset[name].dims).values, dataset[name].values, name)
    np.testing.assert_array_equal(read["frequency_ratio"], dataset["frequency_ratio"])
    assert json.loads(read.attrs["system"]) == json.loads(dataset.attrs["system"])


def test_what_is_not_done_is_unknown_and_says_so(whole, tmp_path):
    path, dataset = whole
    half = tmp_path / "half.store"
    shutil.copytree(path, half)
    lines = (half / "tasks.jsonl").read_text(encoding="utf-8").splitlines()
    (half / "tasks.jsonl").write_text("\n".join([*lines[:3], lines[3][:40]]), encoding="utf-8")  # the last line is torn
    read = sb.read_checkpoint(half)
    assert read.attrs["points_done"] == 48
    known = read["response_class"].transpose(*dataset["response_class"].dims).values >= 0
    assert known.sum() == 48
    assert (read["status"].values[read["response_class"].values < 0] == sb.RunStatus.NOT_RUN).all()
    np.testing.assert_array_equal(
        read["response_class"].transpose(*dataset["response_class"].dims).values[known],
        dataset["response_class"].values[known],
    )


def test_damaged_rows_are_not_read(whole, tmp_path):
    import shutil

    path, _ = whole
    spoilt = tmp_path / "spoilt.store"
    shutil.copytree(path, spoilt)
    chunk = next(item for item in (spoilt / "runs.zarr" / "base" / "numbers").rglob("c*") if item.is_file())
    chunk.write_bytes(chunk.read_bytes()[:-5] + b"12345")
    assert sb.read_checkpoint(spoilt).attrs["points_done"] == 104


def test_what_is_no_store_is_refused(tmp_path):
    with pytest.raises(sb.InputError, match="is not the folder of a sweep"):
        sb.read_checkpoint(tmp_path)
    with pytest.raises(sb.InputTypeError, match="must be a folder"):
        sb.read_checkpoint(3)


def test_the_order_of_the_axes_is_kept_before_anything_is_computed(system, tmp_path):
    """The first axis changes the structure: points are counted alike in either order, and no task is done."""
    axes = {"frequency_ratio": np.linspace(0.5, 2.0, 4), "beam.thickness": np.array([3.9e-4, 4.0e-4])}

    class Enough(Exception):
        pass

    def stop(done, total):
        raise Enough

    for name, order in (("one", list(axes)), ("other", list(axes)[::-1])):
        path = tmp_path / f"{name}.store"
        with pytest.raises(Enough):
            given = {each: axes[each] for each in order}
            sb.sweep(
                system,
                given,
                sb.Integration(cycles=2),
                checkpoint=sb.CheckpointOptions(path, points_per_task=2),
                progress=stop,
            )
        (path / "tasks.jsonl").write_text("", encoding="utf-8")
        read = sb.read_checkpoint(path)
        assert read["response_class"].dims == tuple(lookup(each).short for each in order)
        assert read.attrs["points_done"] == 0


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="limits of memory are POSIX limits here")
@pytest.mark.parametrize("where", ["map.json", "zarr.json"])
def test_a_foreign_task_size_takes_no_memory(whole, tmp_path, where):
    """The task size is outside the hash of the parameters, and Zarr allocates whole chunks: 1e9 points are 26 GiB."""
    path = tmp_path / "foreign.store"
    shutil.copytree(whole[0], path)
    for file in path.rglob(where):
        text = file.read_text(encoding="utf-8").replace('"points_per_task": 16', '"points_per_task": 1000000000')
        file.write_text(text.replace('"points_per_task":16', '"points_per_task":1000000000'), encoding="utf-8")
        if where == "zarr.json" and (found := json.loads(text)).get("node_type") == "array":
            found["chunk_grid"]["configuration"]["chunk_shape"][0] = 10**9
            file.write_text(json.dumps(found), encoding="utf-8")
    code = f"""
import resource
import snapbeam as sb
resource.setrlimit(resource.RLIMIT_AS, (12 * 2**30, 12 * 2**30))
try:
    print(int(sb.read_checkpoint({str(path)!r}).attrs["points_done"]))
except sb.InputError:
    print(0)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) in (0, 120)
