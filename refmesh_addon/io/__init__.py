"""Files in and out: sequences, meshes, results, caches; no bpy and no algorithm."""
