"""Measurements of the tracker: `python -m benchmarks.NAME --help`. Each ends with one line of JSON."""
