"""Where and how to strike, how sure, and what matters most: questions to many runs of a system not known exactly."""
