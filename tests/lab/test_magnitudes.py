"""Numbers so large or small that computations with them overflow: refused, and no library is called with the result."""

from __future__ import annotations

import math
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import snapbeam
from snapbeam import lab
from snapbeam.cli.app import app
from snapbeam.util.singular_values import lstsq, pinv, polyfit, svd
from snapbeam.util.validation import InputError


def written(path, largest, step=1e-3):
    lines = [f"{k * step!r},{math.exp(-0.01 * k) * math.sin(0.7 * k) * largest!r}" for k in range(400)]
    path.write_text("time (s),velocity (m/s)\n" + "\n".join(lines) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("largest", "step"),
    [(1e155, 1e-3), (3e76, 1e-3), (1e300, 1e-3), (1e-200, 1e-3), (1e-170, 1e-3), (1.0, 1e200), (1.0, 1e-200)],
)
def test_signals_of_any_magnitude(tmp_path, capfd, largest, step):
    path = written(tmp_path / "record.csv", largest, step)
    with pytest.raises(InputError, match=r"largest value|sampling rate"):
        lab.read_signal(path)
    done = CliRunner().invoke(app, ["fit-decay", str(path)])
    assert done.exit_code == 2 and re.search(r"largest value|sampling rate", " ".join(done.stderr.split()))
    printed = capfd.readouterr()  # LAPACK prints past Python
    assert "DLASCL" not in printed.err + printed.out + done.output


def test_a_record_that_was_changed_afterwards():
    signal = lab.make_signal(np.sin(0.7 * np.arange(400.0)), "m/s", 1e3)
    for factor in (1e200, 1e-200):
        with pytest.raises(InputError, match="largest value"):
            lab.fit_sine((signal * factor).assign_attrs(signal.attrs))
    with pytest.raises(InputError, match="largest value"):
        lab.make_signal(np.full(400, 1e308), "km/s", 1e3)  # overflows in SI units


# The search of singular vectors does not end for these in a child process of its own; a refusal needs no search.
NOT_ENDING = """
import numpy as np, sys
from snapbeam.util.singular_values import *
name, bad, seed = sys.argv[1], float(sys.argv[2]), int(sys.argv[3])
rng = np.random.default_rng(seed)
for _ in range(200):
    size = int(rng.integers(2, 12))
    matrix, values = np.diag(rng.random(size)), rng.random(size)
    matrix[rng.integers(size), rng.integers(size)] = bad
    try:
        {"lstsq": lambda: lstsq(matrix, values), "pinv": lambda: pinv(matrix), "svd": lambda: svd(matrix),
         "polyfit": lambda: polyfit(np.append(values, bad), np.append(values, 1.0), 1)}[name]()
    except NotFiniteError:
        continue
    raise SystemExit(f"{matrix} was taken")
"""


@pytest.mark.parametrize("bad", ["nan", "inf"])
@pytest.mark.parametrize("name", ["lstsq", "pinv", "svd", "polyfit"])
def test_matrices_that_are_not_finite(name, bad):
    done = subprocess.run(
        [sys.executable, "-c", NOT_ENDING, name, bad, "3"], capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0 and done.stderr == "", done.stderr


def test_finite_matrices_as_numpy_does():
    rng = np.random.default_rng(4)
    matrix, values = rng.random((7, 3)), rng.random(7)
    np.testing.assert_array_equal(lstsq(matrix, values), np.linalg.lstsq(matrix, values, rcond=None)[0])
    np.testing.assert_array_equal(pinv(matrix), np.linalg.pinv(matrix))
    np.testing.assert_array_equal(svd(matrix)[2], np.linalg.svd(matrix)[2])
    np.testing.assert_array_equal(polyfit(values, matrix[:, 0], 2), np.polyfit(values, matrix[:, 0], 2))
    with pytest.raises(InputError, match="not finite"):
        polyfit([1e200, 2e200, 3e200, 5e200], [1.0, 2.0, 3.0, 4.0], 2)


def test_nothing_else_searches_singular_vectors():
    for file in Path(snapbeam.__file__).parent.rglob("*.py"):
        if file.name == "singular_values.py":
            continue
        for line in file.read_text(encoding="utf-8").splitlines():
            found = re.search(r"np\.linalg\.(lstsq|pinv|svd)\(|np\.polyfit\(|numpy\.linalg import", line)
            assert not found or "compute_uv=False" in line, (file, line)
