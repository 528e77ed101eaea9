"""C++ programs beside the benchmarks, compiled with the machine's own compiler when they are first asked for."""

from __future__ import annotations

import ctypes
import os
import re
import shutil
import subprocess
import tempfile
from pathlib import Path

__all__ = ["library"]

_OPTIONS = ("-O3", "-march=native", "-DNDEBUG", "-shared", "-fPIC")


def library(source: Path, *options: str) -> ctypes.CDLL:
    """The compiled program; ImportError where there is no compiler or the program does not compile."""
    name = source.stem
    compiler = os.environ.get("CXX") or shutil.which("g++") or shutil.which("c++")
    if compiler is None:
        raise ImportError("no C++ compiler", name=name)
    with tempfile.TemporaryDirectory() as folder:  # this process's own
        built = Path(folder) / f"{name}.so"
        command = [compiler, *_OPTIONS, *options, str(source), "-o", str(built)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            why = (re.findall(r"error: .*", done.stderr) or ["it does not compile"])[0]
            raise ImportError(why, name=name)
        return ctypes.CDLL(str(built))
