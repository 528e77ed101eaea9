"""What is explored: maps from files, stores and nothing, cut, drawn and computed anew."""
