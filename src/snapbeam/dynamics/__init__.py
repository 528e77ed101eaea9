"""Questions put to many runs: how long, how likely, which attractors, how rough their borders, how orbits go on."""
