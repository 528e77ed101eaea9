"""C++ programs beside the benchmarks, compiled with the machine's own compiler when they are first asked for."""

from __future__ import annotations

import ctypes
import hashlib
import os
import re
import shutil
import subprocess
from pathlib import Path

from snapbeam.solver.compilation import private_folder

__all__ = ["library"]

_OPTIONS = ("-O3", "-march=native", "-DNDEBUG", "-shared", "-fPIC")


def library(source: Path, *options: str) -> ctypes.CDLL:
    """The compiled program; ImportError where there is no compiler or the program does not compile."""
    name = source.stem
    compiler = os.environ.get("CXX") or shutil.which("g++") or shutil.which("c++")
    if compiler is None:
        raise ImportError("no C++ compiler", name=name)
    command = [compiler, *_OPTIONS, *options]
    text = source.read_bytes() + " ".join(command).encode()
    folder = Path(private_folder())  # code is loaded from here: nobody else may write there
    built = folder / f"{name}-{hashlib.sha256(text).hexdigest()[:12]}.so"
    if not built.exists():
        made = built.with_suffix(f".{os.getpid()}.so")
        done = subprocess.run(
            [*command, str(source), "-o", str(made)], capture_output=True, text=True, check=False
        )
        if done.returncode != 0:
            why = (re.findall(r"error: .*", done.stderr) or ["it does not compile"])[0]
            raise ImportError(why, name=name)
        made.replace(built)
    return ctypes.CDLL(str(built))
