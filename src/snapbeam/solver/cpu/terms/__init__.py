"""Forces and couplings beside tension and the first contact."""
