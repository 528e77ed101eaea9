"""Results on disk while they are computed: whole, checked, resumable."""
