"""Groups of frames, their reference centers, and the reference mesh in which touching bodies come apart."""
