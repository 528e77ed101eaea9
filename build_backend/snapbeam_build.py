"""Build backend: scikit-build-core, with the compiler of the package ziglang where no C++20 compiler works."""

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import scikit_build_core.build as backend
from scikit_build_core.build import *  # noqa: F403  (the other entries of a backend)


def dynamic_metadata(settings, project):
    """README.md, with links that also work outside the repository if [project.urls] has its address."""
    text = Path("README.md").read_text(encoding="utf-8")
    if source := project.get("urls", {}).get("Source"):
        for kind, link in (("raw", r"(!\[[^\]]*\]\()(?!https?:)"), ("blob", r"(\]\()(?!https?:)")):
            text = re.sub(link, rf"\g<1>{source}/{kind}/v{project['version']}/", text)
    return {"readme": {"content-type": "text/markdown", "text": text}}


def _compiler_works():
    """Tell if a compiler makes a C++20 program that runs; CMake judges one that CXX names, and looks itself on Windows."""
    if "CXX" in os.environ or os.name == "nt":
        return True
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "try.cpp").write_text("#include <concepts>\nint main() { return !std::integral<int>; }")
        for compiler in ("c++", "g++", "clang++"):
            trial = f"{compiler} -std=c++20 try.cpp -o try && ./try"
            if subprocess.run(trial, shell=True, cwd=folder, capture_output=True).returncode == 0:
                os.environ["CXX"] = compiler
                return True
    return False


def get_requires_for_build_wheel(config_settings=None):
    """Add the compiler; cmake and ninja are named by scikit-build-core where they are missing."""
    return backend.get_requires_for_build_wheel(config_settings) + ([] if _compiler_works() else ["ziglang"])


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    """Build a wheel; CMake wants single programs, so scripts in the build folder call the compiler of ziglang."""
    if not _compiler_works():
        os.makedirs("build/ziglang", exist_ok=True)
        for tool, words in {"c++": "c++ -mcpu=baseline", "ar": "ar", "ranlib": "ranlib"}.items():
            script = Path("build/ziglang", tool).absolute()
            script.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m ziglang {words} "$@"\n')
            script.chmod(0o755)
        os.environ["CXX"] = os.path.abspath("build/ziglang/c++")
    return backend.build_wheel(wheel_directory, config_settings, metadata_directory)


def build_editable(wheel_directory, config_settings=None, metadata_directory=None):
    """Build a wheel that holds a path to src, where the module lies: an import hook would go before PYTHONPATH."""
    own = {"wheel.packages": [], "build-dir": "build/{wheel_tag}", "cmake.define.SNAPBEAM_EDITABLE": "ON"}
    return build_wheel(wheel_directory, (config_settings or {}) | own, metadata_directory)


get_requires_for_build_editable = get_requires_for_build_wheel
