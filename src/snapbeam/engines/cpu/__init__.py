"""The CPU engine: rows of modes in memory, a step, a march, and the threads that share it."""
