"""Single runs: simulate, advance, the dataset of a run, saving and loading."""
