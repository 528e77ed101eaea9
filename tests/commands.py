"""Commands run one by one in processes of their own, forked from one that has imported the packages: imports take longest."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from typing import NamedTuple

SCRIPT = """
import json, os, sys
from importlib import import_module
from snapbeam.__main__ import main
for name in sys.argv[3:]:
    import_module(name)
results = []
for number, words in enumerate(json.loads(sys.argv[1])):
    if not (child := os.fork()):
        for stream, name in ((1, "stdout"), (2, "stderr")):
            os.dup2(os.open(f"{sys.argv[2]}/{number}.{name}", os.O_WRONLY | os.O_CREAT, 0o600), stream)
        sys.argv[:] = ["snapbeam", *words]
        main()
        sys.exit(0)
    results.append(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
print(json.dumps(results))
"""


class Done(NamedTuple):
    """Answer of a command."""

    returncode: int
    stdout: bytes
    stderr: bytes


def run_commands(folder, outputs, lines, first="", modules=("snapbeam.cli.simulate", "snapbeam.cli.map")):
    """Run commands, whose words may be bytes, in *folder*; *outputs* is an empty folder, *first* begins the program.

    *modules* are imported once for all.
    """
    words = json.dumps([[os.fsdecode(word) for word in line] for line in lines])
    program = [sys.executable, "-c", first + SCRIPT, words, str(outputs), *modules]
    done = subprocess.run(program, cwd=folder, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    return [
        Done(code, *((outputs / f"{number}.{name}").read_bytes() for name in ("stdout", "stderr")))
        for number, code in enumerate(json.loads(done.stdout))
    ]
