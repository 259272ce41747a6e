"""A real ball that lands on a box, becomes one surface with it, and parts from it again."""

import numpy as np
from scipy.spatial import cKDTree

from refmesh_addon.core.geometry.mesh import vertex_components
from refmesh_addon.io.meshes import read_mesh

from ..running import finish

APART = range(28, 33)


def bodies_of(mesh, centers):
    """Label (C,) of the body whose surface is nearest to each center, 0 for the lower one."""
    count, labels = vertex_components(mesh)
    assert count == 2
    lower = np.argmin([mesh.vertices[labels == body, 1].mean() for body in range(2)])
    return (labels[cKDTree(mesh.vertices).query(centers)[1]] != lower).astype(int)


def test_no_center_crosses_a_contact(shared_data, tmp_path):
    source = shared_data("collision")
    finish(source, tmp_path, until="tracking", frames="0-32", centers=300, resolution=96)
    with np.load(tmp_path / "centers.npz") as centers:
        positions = centers["positions"]
    own = bodies_of(read_mesh(source / "mesh_0000.obj"), positions[0])
    assert 0.1 < own.mean() < 0.9
    for frame in APART:
        np.testing.assert_array_equal(bodies_of(read_mesh(source / f"mesh_{frame:04d}.obj"), positions[frame]), own)
