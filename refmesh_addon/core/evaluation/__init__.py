"""How far the result lies from the capture, and where the capture shows no surface."""
