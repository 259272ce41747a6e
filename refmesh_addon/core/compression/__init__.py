"""Models of the compressed export: what a decoder predicts, in which order, and with which integer tables."""
