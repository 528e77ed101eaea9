"""What a measurement says against itself: diagnostics as data, one module an instrument."""
