"""The core under AddressSanitizer, UBSan and ThreadSanitizer, and with packs as arrays, as for compilers without vector types."""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
TESTS = [
    "tests/core/test_core_layouts.py",
    "tests/core/test_core_laws.py",
    "tests/core/test_core_fuzz.py",
    "tests/core/test_core_arguments.py",
]
RUN = """
import importlib.util, sys
spec = importlib.util.spec_from_file_location("snapbeam._core", sys.argv[1])
core = sys.modules["snapbeam._core"] = importlib.util.module_from_spec(spec)
spec.loader.exec_module(core)
import snapbeam
snapbeam._core = core
import pytest
sys.exit(pytest.main(["-s", "-q", "-x", "-n", "0", "-p", "no:cacheprovider", "-p", "no:faulthandler", "-m", "not slow", *sys.argv[2:]]))
"""
pytestmark = pytest.mark.slow


def command(name: str) -> str:
    """Path of a program, also of one in the environment of the interpreter."""
    beside = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
    found = shutil.which(name, path=beside)
    if found is None:
        pytest.skip(f"{name} was not found")
    return found


def library(compiler: str, name: str) -> str:
    """Path of a library of the compiler."""
    done = subprocess.run([compiler, f"-print-file-name={name}"], capture_output=True, text=True)
    if done.returncode or not os.path.isabs(done.stdout.strip()):
        pytest.skip(f"{compiler} has no {name}")
    return done.stdout.strip()


def built(folder: Path, compiler: str, option: str) -> Path:
    """The module, built in a folder with an option of ``CMakeLists.txt``."""
    cmake = command("cmake")
    if importlib.util.find_spec("nanobind") is None:
        pytest.skip("nanobind is not installed")
    settings = [f"-D{option}", "-DSNAPBEAM_SETS=baseline", f"-DPython_EXECUTABLE={sys.executable}"]
    for words in (
        [cmake, "-S", str(ROOT), "-B", str(folder), f"-DCMAKE_CXX_COMPILER={compiler}", *settings],
        [cmake, "--build", str(folder), "--parallel", "2"],
    ):
        done = subprocess.run(words, capture_output=True, text=True, timeout=3000)
        assert done.returncode == 0, done.stdout[-6000:] + done.stderr[-4000:]
    (module_file,) = folder.glob("_core*.so")
    return module_file


def tried(module: Path, *tests: str, before: tuple[str, ...] = (), **variables: str) -> None:
    """Run tests of the core in a process that has loaded a *module* in place of the installed one."""
    done = subprocess.run(
        [*before, sys.executable, "-c", RUN, str(module), *(tests or TESTS)], cwd=ROOT, capture_output=True, text=True, timeout=3000,
        env={**os.environ, "PYTHONPATH": str(ROOT / "src"), "PYTHONMALLOC": "malloc", **variables},
    )  # fmt: skip
    said = done.stdout[-6000:] + done.stderr[-6000:]
    assert done.returncode == 0 and " passed" in done.stdout, said
    for finding in ("AddressSanitizer", "ThreadSanitizer", "runtime error:"):
        assert finding not in done.stdout + done.stderr, said


@pytest.mark.skipif(sys.platform != "linux", reason="libraries are preloaded as on Linux")
def test_the_sanitizers_find_nothing(tmp_path: Path) -> None:
    compiler = command("g++")
    asan, standard = library(compiler, "libasan.so"), library(compiler, "libstdc++.so")
    module = built(tmp_path, compiler, "SNAPBEAM_CHECKS=address,undefined")
    tried(module, LD_PRELOAD=f"{asan} {standard}", ASAN_OPTIONS="detect_leaks=0", UBSAN_OPTIONS="print_stacktrace=1")


@pytest.mark.skipif(sys.platform != "linux", reason="libraries are preloaded as on Linux")
def test_threads_race_for_nothing(tmp_path: Path) -> None:
    compiler = command("g++")
    both = f"{library(compiler, 'libtsan.so')} {library(compiler, 'libstdc++.so')}"
    module = built(tmp_path, compiler, "SNAPBEAM_CHECKS=thread")
    # addresses at random are not those that the sanitizer expects
    fixed = (command("setarch"), "-R")
    tried(module, "tests/core/test_core_threads.py", before=fixed, LD_PRELOAD=both, OPENBLAS_NUM_THREADS="1")
