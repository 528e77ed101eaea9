"""Claims of the source paper by topic."""
