"""Results of a run in the scene."""
