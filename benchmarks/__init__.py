"""Benchmarks: snapbeam beside general-purpose integrators, in one process and one environment.

Run them with ``make bench`` or ``python -m benchmarks``; README.md says what is measured and what was tried.
Libraries are held to one thread each before any of them is imported.
"""

import os

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
