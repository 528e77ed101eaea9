"""Build backend: scikit-build-core, with ziglang as the C++ compiler where no other one works."""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from scikit_build_core import build as _build
from scikit_build_core.build import *  # noqa: F403

_PROGRAM = "#include <concepts>\n#include <vector>\nint main() { std::vector<int> v(1); return v[0]; }\n"


def _works(command):
    """Return whether a command compiles and links C++20."""
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder, "program.cpp")
        source.write_text(_PROGRAM, encoding="utf-8")
        words = [*command.split(), "-std=c++20", str(source), "-o", str(Path(folder, "program"))]
        return bool(shutil.which(words[0])) and subprocess.run(words, capture_output=True).returncode == 0


_HAS_COMPILER = os.name == "nt" or any(map(_works, [os.environ.get("CXX", "c++"), "g++", "clang++"]))


def _with_zig(call):
    """The call with a compiler: CMake takes one program, hence scripts."""

    def wrapped(*args, **options):
        if call.__name__.startswith("get_requires"):
            return call(*args, **options) + (
                [] if _HAS_COMPILER else ["ziglang<0.16", "cmake>=3.20", "ninja"]
            )
        if not _HAS_COMPILER:
            folder = Path(tempfile.mkdtemp(prefix="snapbeam-zig-"))
            for name in ("c++", "cc", "ar", "ranlib"):
                script = folder / name.replace("+", "x")
                script.write_text(
                    f'#!/bin/sh\nexec "{sys.executable}" -m ziglang {name} "$@"\n', encoding="utf-8"
                )
                script.chmod(0o755)
            os.environ |= {"CXX": f"{folder}/cxx", "CC": f"{folder}/cc"}
            os.environ["CMAKE_ARGS"] = (
                f"-DCMAKE_AR={folder}/ar -DCMAKE_RANLIB={folder}/ranlib " + os.environ.get("CMAKE_ARGS", "")
            )
        return call(*args, **options)

    return wrapped


for _name in (
    "get_requires_for_build_wheel",
    "get_requires_for_build_editable",
    "build_wheel",
    "build_editable",
):
    globals()[_name] = _with_zig(getattr(_build, _name))


def dynamic_metadata(field, settings, project):
    """Return the README, its links absolute if ``[project.urls]`` has the address ``Source``."""
    text, source = Path("README.md").read_text(encoding="utf-8"), project.get("urls", {}).get("Source")
    if source:
        version = re.search(
            r'__version__ = "(.+)"', Path("src/snapbeam/_version.py").read_text(encoding="utf-8")
        )[1]
        text = re.sub(r"(!\[[^\]]*\]\()(?!https?:)", rf"\g<1>{source}/raw/v{version}/", text)
        text = re.sub(r"(\]\()(?!https?:)", rf"\g<1>{source}/blob/v{version}/", text)
    return {"content-type": "text/markdown", "text": text}
