"""Diagnostic out from a sample of frames what a recording shows, before it is followed."""
