"""Small GLB files: one mesh with a few quantized morph targets for each group of frames."""
