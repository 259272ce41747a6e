"""One run: its job, its frames, its cache, its processes."""
