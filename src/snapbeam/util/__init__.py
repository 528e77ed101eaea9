"""Validation, diagnostics, files and provenance."""
