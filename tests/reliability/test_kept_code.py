"""Compiled code on disks that are read-only, full or damaged: checked, rewritten, done without, never fatal."""

from __future__ import annotations

import errno
import importlib.util
import os
import random
import subprocess
import sys

import pytest
from filelock import FileLock

from snapbeam.solver.compilation import is_private, private_folder, ready

RUN = """
import snapbeam as sb
from snapbeam.model import default_values
system = sb.System(
    sb.ReducedModel.from_beam(default_values.BEAM, modes=1),
    contacts=[sb.Contact(default_values.CONTACT, sb.Shaker(frequency_ratio=1.0, velocity_amplitude=0.3))],
)
run = sb.simulate(system, sb.Integration(cycles=1))
print(run.summary.status.name, float(run.dataset.displacement_at_striker[-1]).hex())
"""
"""A run, whose kernel is compiled."""
SMALL = """
from numba import njit
from snapbeam.solver.compilation import keep_code

@njit
def twice(x):
    return 2.0 * x

keep_code(twice, "mark")
print(twice(21.0), "loaded" if twice.stats.cache_hits else "compiled")
"""
"""A function that compiles in no time, kept as kernels are."""


@pytest.fixture(autouse=True)
def no_folder_given(monkeypatch):
    """Keep the code beside its source, also where the environment names a folder."""
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setattr("numba.config.CACHE_DIR", "")


@pytest.fixture
def small(python):
    """Run the small function from a folder of its own, in a fresh process."""

    def run(folder, **environment):
        file = folder / "small.py"
        if not file.exists():
            file.write_text(SMALL, encoding="utf-8")
        path = f"{folder}{os.pathsep}{python.package}"
        done = python("import small", path, timeout=60, **environment)
        assert done.returncode == 0, done.stderr
        assert "Traceback" not in done.stderr
        return done.stdout.strip(), done.stderr

    return run


def started(folder):
    """The same in this process, in a module made anew."""
    file = folder / "small.py"
    if not file.exists():
        file.write_text(SMALL.replace("print", "answer = "), encoding="utf-8")
    return loaded(folder).answer


def loaded(folder):
    """Module of a folder, made anew."""
    spec = importlib.util.spec_from_file_location("small", folder / "small.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def kept_files(folder):
    return sorted(folder.rglob("*.nb?"))


def test_kept_and_loaded(tmp_path):
    assert started(tmp_path) == (42.0, "compiled")
    assert len(kept_files(tmp_path)) == 2
    assert started(tmp_path) == (42.0, "loaded")


@pytest.mark.slow
@pytest.mark.parametrize(
    "harm",
    [
        "cut",
        *(pytest.param(harm, marks=pytest.mark.slow) for harm in ("flipped", "emptied", "foreign", "folder")),
    ],
)
def test_damaged_code_is_compiled_again(tmp_path, tried, harm):
    """Any damage: the function is compiled again, and the file is good from then on."""
    started(tmp_path)
    draw = random.Random(harm)
    for which in (0, 1):
        for _ in range(20 if harm in ("flipped", "cut") else 1):
            file = kept_files(tmp_path)[which]
            data = bytearray(file.read_bytes())
            if harm == "flipped":
                data[draw.randrange(len(data))] ^= 1 << draw.randrange(8)
            file.unlink()
            if harm == "folder":
                file.mkdir()
            else:
                kept = {"cut": data[: draw.randrange(1, len(data))], "emptied": b"", "foreign": b"MZ" * 400}
                file.write_bytes(kept.get(harm, data))
            assert started(tmp_path) == (42.0, "compiled")
            if harm == "folder":
                file.rmdir()
                started(tmp_path)
            assert started(tmp_path) == (42.0, "loaded")
            tried("damaged files of compiled code")


@pytest.mark.slow
def test_a_full_disk_keeps_no_code(small, mounted, tried):
    """Said once; the answer is the same."""
    disk = mounted("disk", "size=16k")
    (disk / "small.py").write_text(SMALL, encoding="utf-8")
    (disk / "filler").write_bytes(b"0" * 4096)
    answer, said = small(disk, TMPDIR=str(disk), HOME=str(disk))
    assert answer == "42.0 compiled"
    assert said.count("compiled code is not kept") == 1
    tried("starts with a full disk for compiled code")


@pytest.mark.slow
def test_read_only_package_and_home(small, mounted, read_only, tmp_path, tried):
    """Kept in a private folder of the temporary ones; with none to write to, not at all."""
    disk, other = mounted("disk", "size=64k"), tmp_path / "temporary"
    other.mkdir()
    (disk / "small.py").write_text(SMALL, encoding="utf-8")
    read_only(disk)
    places = {"HOME": str(disk), "XDG_CACHE_HOME": str(disk)}
    answer, said = small(disk, TMPDIR=str(other), **places)
    assert answer == "42.0 compiled" and said.count("compiled code is kept in") == 1
    assert kept_files(other) and all(f.parent.stat().st_mode & 0o077 == 0 for f in kept_files(other))
    assert small(disk, TMPDIR=str(other), **places)[0] == "42.0 loaded"
    tried("starts with package and HOME read-only", 2)


def test_a_private_folder_that_is_somebody_elses_is_not_used(tmp_path, monkeypatch):
    """Code is loaded from no folder that others may write."""
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    folder = private_folder()
    assert os.stat(folder).st_mode & 0o777 == 0o700
    os.chmod(folder, 0o777)
    with pytest.raises(PermissionError):
        private_folder()
    os.rmdir(folder)
    os.symlink(tmp_path, folder)
    with pytest.raises(PermissionError):
        private_folder()


PLANTED = """
import os, sys
from snapbeam.solver.compilation import _CheckedFiles

class Planted:
    def __reduce__(self):
        return os.mkdir, (sys.argv[1],)

for folder, _, names in os.walk(os.environ["NUMBA_CACHE_DIR"]):
    for name in names:
        path = os.path.join(folder, name)
        file = _CheckedFiles(folder, "x", None)
        file._write(path, file._dump(Planted()))
        assert file._read(path)
"""
"""Files with a right check sum that make a folder when they are loaded."""


@pytest.mark.skipif(os.name == "nt", reason="Windows has no access bits")
@pytest.mark.parametrize(
    "fault",
    [
        "foreign",
        *(pytest.param(each, marks=pytest.mark.slow) for each in ("writable", "writable above", "group")),
    ],
)
def test_code_that_others_planted_is_not_executed(tmp_path, tried, fault):
    """In a folder that NUMBA_CACHE_DIR names, whoever named it."""
    place, temporary, proof = tmp_path / "cache", tmp_path / "temporary", tmp_path / "executed"
    place.mkdir()
    temporary.mkdir()
    given = {"NUMBA_CACHE_DIR": str(place), "TMPDIR": str(temporary)}
    code = tmp_path / "code"
    code.mkdir()
    (code / "small.py").write_text(SMALL, encoding="utf-8")
    run = "import sys; sys.path.insert(0, sys.argv[1]); import small"
    command = [sys.executable, "-c", run, str(code)]
    environment = os.environ | given

    def started():
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
        return done.stdout.split()[-1], done.stderr

    assert started() == ("compiled", "") and started() == ("loaded", "")
    subprocess.run([sys.executable, "-c", PLANTED, str(proof)], env=environment, check=True)
    (kept,) = place.iterdir()
    if fault == "writable above":
        place.chmod(0o777)
    elif fault == "writable":
        kept.chmod(0o777)
    elif os.getuid() != 0:
        pytest.skip("only the administrator gives files to others")
    elif fault == "foreign":
        os.chown(kept, 12345, 12345)
    else:
        os.chown(kept, 0, 12345)
        kept.chmod(0o775)
    result, said = started()
    assert result == "compiled" and f"others can write to {kept}" in said and not proof.exists()
    assert started()[0] == "loaded" and not proof.exists()
    assert len(list(temporary.iterdir())) == 1
    tried("planted files of compiled code")


PLANT = """
import os, stat, sys
from snapbeam.solver.compilation import _CheckedFiles

class Planted:
    def __reduce__(self):
        return os.mkdir, (sys.argv[1],)

path, fault, file = sys.argv[2], sys.argv[3], _CheckedFiles(os.path.dirname(sys.argv[2]), "x", None)
file._write(path, file._dump(Planted()))
assert file._read(path)
if fault == "owner":
    os.chown(path, 12345, -1)
elif fault == "group":
    os.chown(path, -1, 12345)
    os.chmod(path, 0o664)
elif fault == "link":
    os.rename(path, path + ".kept")
    os.symlink(path + ".kept", path)
elif fault == "pipe":
    os.unlink(path)
    os.mkfifo(path)
else:
    os.chmod(path, 0o646)
"""
"""A file with a right check sum that makes a folder when it is loaded, in a private folder."""


@pytest.mark.skipif(os.name == "nt", reason="Windows has no access bits")
@pytest.mark.parametrize("which", [0, 1], ids=["code", "index"])
@pytest.mark.parametrize("fault", ["others", "owner", "group", "link", "pipe"])
def test_files_that_others_can_write_are_not_executed(tmp_path, caplog, monkeypatch, fault, which):
    """In a folder of this user alone: compiled again, which is said, and kept for this user."""
    if os.getuid() != 0 and fault in ("owner", "group"):
        pytest.skip("only the administrator gives files to others")
    monkeypatch.setattr("snapbeam.solver.compilation._warned", set())
    assert started(tmp_path) == (42.0, "compiled")
    (path,) = (each for each in kept_files(tmp_path) if each.suffix == (".nbc", ".nbi")[which])
    proof = tmp_path / "executed"
    subprocess.run([sys.executable, "-c", PLANT, str(proof), str(path), fault], check=True, timeout=60)
    assert started(tmp_path) == (42.0, "compiled") and not proof.exists()
    assert fault == "link" or f"others can write {path}" in caplog.text
    assert started(tmp_path) == (42.0, "loaded") and not path.is_symlink()


@pytest.mark.skipif(os.name == "nt", reason="Windows has no access bits")
def test_code_is_kept_for_this_user_whatever_the_umask(tmp_path):
    before = os.umask(0)
    try:
        started(tmp_path)
    finally:
        os.umask(before)
    assert all(file.stat().st_mode & 0o022 == 0 for file in kept_files(tmp_path))


@pytest.mark.skipif(os.name == "nt", reason="Windows has no access bits")
def test_folders_of_this_user(tmp_path):
    own = tmp_path / "a" / "b"
    own.mkdir(parents=True)
    assert is_private(own)
    own.chmod(0o775)
    assert is_private(own)  # of this user's own group
    own.chmod(0o777)
    assert not is_private(own)
    own.chmod(0o1777)
    assert not is_private(own)
    own.chmod(0o755)
    own.parent.chmod(0o777)
    assert not is_private(own)
    own.parent.chmod(0o1777)
    assert is_private(own)
    if os.getuid() == 0:
        os.chown(own, 12345, 0)
        assert not is_private(own)
        source = tmp_path / "source.py"
        source.touch()
        os.chown(source, 12345, 0)
        assert is_private(own, source)


@pytest.mark.slow
def test_a_run_from_read_only_package_and_home(python, copied, mounted, read_only, tried):
    """The whole package where nothing can be written: the same numbers, nothing but a line on the log."""
    site = copied(mounted("site", "size=64m"))
    nowhere = mounted("nowhere", "size=64k")
    free = python(RUN, site, HOME=str(nowhere), NUMBA_NUM_THREADS="1")
    assert free.returncode == 0, free.stderr
    for cache in site.rglob("*.nb?"):
        cache.unlink()
    for place in (site, nowhere):
        read_only(place)
    places = {name: str(nowhere) for name in ("HOME", "TMPDIR", "XDG_CACHE_HOME", "MPLCONFIGDIR")}
    done = python(RUN, site, **places)
    assert done.returncode == 0, done.stderr
    assert done.stdout == free.stdout and done.stdout.startswith("OK")
    assert "Traceback" not in done.stderr
    tried("starts with package and HOME read-only")


ARRAYS = """
import numpy as np
from numba import njit
from snapbeam.solver.compilation import keep_code

@njit
def total(values):
    twice = 2.0 * values
    return twice.sum()

keep_code(total, "mark")
print(total(np.arange(4.0)), "loaded" if total.stats.cache_hits else "compiled")
"""
"""A function that needs memory, for which Numba's runtime must stand before its kept code is loaded."""


@pytest.mark.slow
def test_code_that_needs_numbas_runtime_is_loaded_in_a_fresh_process(python, tmp_path):
    (tmp_path / "arrays.py").write_text(ARRAYS, encoding="utf-8")
    for how in ("compiled", "loaded"):
        done = python("import arrays", f"{tmp_path}{os.pathsep}{python.package}", timeout=120)
        assert done.returncode == 0, done.stderr
        assert done.stdout.split() == ["12.0", how]


READY = """
import logging
from small import twice
from snapbeam.solver.compilation import ready

logging.basicConfig(level=logging.INFO)
ready(twice, 21.0)
print("loaded" if twice.stats.cache_hits else "compiled")
"""


def test_one_process_compiles_and_the_others_wait(tmp_path, python, tried):
    """The test holds the lock of the code until it is on the disk again."""
    (tmp_path / "small.py").write_text(SMALL.partition("print")[0], encoding="utf-8")
    path = f"{tmp_path}{os.pathsep}{python.package}"
    assert python(READY, path).stdout == "compiled\n"
    kept = {file: file.read_bytes() for file in kept_files(tmp_path)}
    for file in kept:
        file.unlink()
    with FileLock(next(tmp_path.rglob("*.nbi.lock"))):
        waiting = subprocess.Popen(
            [sys.executable, "-c", READY], env=os.environ | {"PYTHONPATH": path}, stdout=subprocess.PIPE,
            stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        assert "compiling twice in another process" in waiting.stderr.readline()
        for file, content in kept.items():
            file.write_bytes(content)
    assert waiting.communicate(timeout=60)[0] == "loaded\n"
    tried("processes that waited for compiled code", 1)


@pytest.mark.parametrize("error", [TimeoutError(), OSError(errno.ENOLCK, "no locks")])
def test_a_process_that_cannot_wait_compiles(tmp_path, monkeypatch, error):
    (tmp_path / "small.py").write_text(SMALL.partition("print")[0], encoding="utf-8")
    module, asked = loaded(tmp_path), []

    def acquire(lock, **_):
        asked.append(lock)
        raise error

    monkeypatch.setattr("filelock.FileLock.acquire", acquire)
    ready(module.twice, 21.0)
    assert asked and kept_files(tmp_path) and module.twice.stats.cache_misses
