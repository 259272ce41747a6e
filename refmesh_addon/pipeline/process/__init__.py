"""The worker process and the side that starts it."""
