"""Ordinary mistakes of scene, signal and sign, each drawn or written as a laboratory would have made it."""
