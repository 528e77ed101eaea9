"""Run-lane layout: eight runs in one register."""
