"""The stages of a job in the order of the method, each cached and resumable."""
