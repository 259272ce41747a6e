"""The captured frames in the scene."""
