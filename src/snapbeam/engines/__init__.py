"""Time: the engines by name, what they are asked for and what they answer."""
