"""What surrounds a beam, in a march: forces on every mode that change in time, and circuits."""
