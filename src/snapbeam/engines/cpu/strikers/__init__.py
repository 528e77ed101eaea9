"""The strikers beside the first one, in a march: their forces, when they meet the beam, and what they did."""
