"""Many tests at once: recordings and vibrometer files of a folder, to a table of responses."""
