"""The reduced model: buckling modes, their frequencies and matrices."""
