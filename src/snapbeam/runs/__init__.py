"""One run: asked for, integrated, recorded, classed, kept."""
