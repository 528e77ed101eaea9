"""Identification of free decays."""
