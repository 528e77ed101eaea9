"""Eight runs in a register, one mode a variable: the layout for few modes."""
