"""Build backend: scikit-build-core, with the compiler of the package ziglang where no C++20 compiler works."""

import contextlib
import os
import re
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

import scikit_build_core.build as backend
from scikit_build_core.build import *  # noqa: F403  (the other entries of a backend)

_PROGRAM = "#include <concepts>\n#include <thread>\nint main() { std::thread([](std::integral auto) {}, 1).join(); }\n"


def dynamic_metadata(settings, project):
    """README.md, with links that also work outside the repository if [project.urls] has its address."""
    text = Path("README.md").read_text(encoding="utf-8")
    if source := project.get("urls", {}).get("Source"):
        text = re.sub(r"(!\[[^\]]*\]\()(?!https?:)", rf"\g<1>{source}/raw/v{project['version']}/", text)
        text = re.sub(r"(\]\()(?!https?:)", rf"\g<1>{source}/blob/v{project['version']}/", text)
    return {"readme": {"content-type": "text/markdown", "text": text}}


def _compiler_works():
    """Tell if a compiler makes a C++20 program that runs, and name it; on Windows CMake looks for one itself."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "try.cpp").write_text(_PROGRAM, encoding="utf-8")
        for compiler in [os.environ["CXX"]] if "CXX" in os.environ else ["c++", "g++", "clang++"]:
            words = [*shlex.split(compiler), "-std=c++20", "-pthread", "try.cpp", "-o", "try"]
            with contextlib.suppress(OSError, subprocess.CalledProcessError):
                for command in (words, [os.path.join(folder, "try")]):
                    subprocess.run(command, cwd=folder, check=True, capture_output=True)
                os.environ["CXX"] = compiler
                return True
    return os.name == "nt"


def get_requires_for_build_wheel(config_settings=None):
    return [
        *backend.get_requires_for_build_wheel(config_settings),
        *([] if _compiler_works() else ["ziglang"]),
    ]


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    """Build a wheel; CMake wants single programs, so scripts in the build folder call the compiler of ziglang."""
    if not _compiler_works():
        os.makedirs("build/ziglang", exist_ok=True)
        for tool, words in {"c++": "c++ -mcpu=baseline", "ar": "ar", "ranlib": "ranlib"}.items():
            script = Path("build/ziglang", tool).absolute()
            script.write_text(
                f'#!/bin/sh\nexec "{sys.executable}" -m ziglang {words} "$@"\n', encoding="utf-8"
            )
            script.chmod(0o755)
        os.environ["CXX"] = str(script.with_name("c++"))
    return backend.build_wheel(wheel_directory, config_settings, metadata_directory)


def build_editable(wheel_directory, config_settings=None, metadata_directory=None):
    """Build a wheel that holds a path to src, where the module lies: an import hook would go before PYTHONPATH."""
    own = {"wheel.packages": [], "build-dir": "build/{wheel_tag}", "cmake.define.SNAPBEAM_EDITABLE": "ON"}
    return build_wheel(wheel_directory, {**(config_settings or {}), **own}, metadata_directory)


get_requires_for_build_editable = get_requires_for_build_wheel
