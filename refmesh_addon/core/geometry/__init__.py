"""The toolbox: triangle meshes, their edges and borders, closest points, winding numbers, voxels, rotations."""
