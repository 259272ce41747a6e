"""Small sequences that we generate ourselves, and the generators."""
