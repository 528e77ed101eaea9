"""The linear algebra of the recorded corpus: one kernel of OpenBLAS for every processor with AVX-512.

OpenBLAS chooses its kernel by the model of the processor, and takes that of 2013 for one it does not know.  Kernels round
differently, so that matrices and states would differ in their last bits from the recorded ones.
"""

from __future__ import annotations

from pathlib import Path

KERNEL = "SkylakeX"


def blas_kernel() -> dict[str, str]:
    """Environment that chooses the kernel; of no effect after NumPy was imported."""
    processor = Path("/proc/cpuinfo")
    known = processor.exists() and "avx512vl" in processor.read_text(encoding="utf-8", errors="replace")
    return {"OPENBLAS_CORETYPE": KERNEL} if known else {}
