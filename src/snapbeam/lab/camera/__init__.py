"""Recordings of a high-speed camera: read, checked, written."""
