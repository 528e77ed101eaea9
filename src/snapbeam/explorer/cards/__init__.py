"""The cards of the page: what can be set, asked for and taken away."""
