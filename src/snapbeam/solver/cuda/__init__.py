"""CUDA layout: one block of threads per run."""
