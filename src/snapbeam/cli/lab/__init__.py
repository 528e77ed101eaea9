"""Commands of the laboratory, a file a verb."""
