"""Tasks and who computes them: this process, or the workers of a cluster."""
