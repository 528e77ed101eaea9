"""What every engine compiles: the physics, signals, decisions and compositions, as functions of numbers."""
