"""Where the beam and the striker are in each frame, to a few hundredths of a pixel."""
