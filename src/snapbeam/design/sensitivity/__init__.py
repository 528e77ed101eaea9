"""Which parameter moves an answer most: local, variance-based and given-data sensitivity, with intervals."""
