"""Objects, meshes, materials and timeline of a scene: whole arrays in and out."""
