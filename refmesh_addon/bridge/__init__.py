"""The only place where numpy arrays become Blender data and back."""
