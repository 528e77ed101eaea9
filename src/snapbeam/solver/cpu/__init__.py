"""Mode-lane and run-lane layouts for the processor."""
