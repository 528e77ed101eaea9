"""The CUDA engine: a block of threads a trajectory."""
