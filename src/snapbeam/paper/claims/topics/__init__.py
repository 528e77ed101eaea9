"""The claims by topic: a module of measurements and a file of words (TOML) each, under one name."""
