"""Reads and writes files: sequences, meshes, results, caches; no bpy and no algorithms."""
