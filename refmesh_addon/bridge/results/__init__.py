"""What a run made, in the scene."""
