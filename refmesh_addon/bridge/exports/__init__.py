"""Results written to files by Blender."""
