"""Records of sensors: read from the formats that laboratories have, and their sines fitted."""
