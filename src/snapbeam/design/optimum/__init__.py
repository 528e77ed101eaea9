"""The best place, frequency and amplitude under constraints that hold with a stated probability."""
