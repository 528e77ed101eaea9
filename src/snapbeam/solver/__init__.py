"""The solver: step, events, statistics and the layouts that compile them."""
