"""A hand grasps a ball, in color."""
