"""The solver: from a system to the arrays of the native core, the core, and the equations in Python."""
