"""What the page shows, a view a file; they draw what they are given and say what was asked for."""
