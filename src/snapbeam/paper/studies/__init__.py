"""What the claims of the paper need measured beside its figures; each module a recipe."""
