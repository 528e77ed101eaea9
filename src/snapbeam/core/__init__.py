"""What every room shares: codes, checks of input, files that are whole or not there, and what made a file."""
