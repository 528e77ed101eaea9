"""What a measurement says against itself: findings as data, one module an instrument."""
