"""Samples of a surface: where they are, what they stand for, and seams."""

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal

from refmesh_addon.core.deformation.surface_samples import SurfaceSampler
from refmesh_addon.core.geometry.mesh import triangle_areas, triangle_normals, vertex_areas, vertex_normals
from refmesh_addon.core.types import TriangleMesh
from tests.core.bending_bar import bar, bent

MESH = bar(20, 12, uneven=0.2)
MOVED = MESH.moved(bent(MESH.vertices))


def with_seam(mesh):
    """Each triangle with three vertices of its own."""
    return TriangleMesh(mesh.vertices[mesh.triangles].reshape(-1, 3), np.arange(3 * len(mesh.triangles)).reshape(-1, 3))


def test_samples_are_vertices_and_centroids_wherever_the_mesh_goes():
    samples, count = SurfaceSampler(MESH).of(MOVED), len(MESH.vertices)
    assert_allclose(samples.points, np.concatenate([MOVED.vertices, MOVED.vertices[MOVED.triangles].mean(axis=1)]))
    assert_allclose(samples.normals, np.concatenate([vertex_normals(MOVED), triangle_normals(MOVED)]), atol=1e-12)
    areas = np.concatenate([vertex_areas(MOVED), triangle_areas(MOVED)])
    assert_allclose(samples.weights, areas / areas.mean())
    assert_allclose(np.einsum("nk,nki->ni", samples.shares, MOVED.vertices[samples.corners]), samples.points)
    holders = MOVED.triangles[samples.triangles]
    assert (holders[:count] == np.arange(count)[:, None]).any(axis=1).all()
    assert_array_equal(samples.triangles[count:], np.arange(len(MESH.triangles)))


def test_a_seam_and_what_nothing_uses_change_nothing():
    loose = TriangleMesh(np.vstack([with_seam(MESH).vertices, [[9.0, 9.0, 9.0]]]), with_seam(MESH).triangles)
    plain, seamed = SurfaceSampler(MESH).of(MESH), SurfaceSampler(loose).of(loose)
    assert len(plain.points) == len(seamed.points)
    places = [np.lexsort(np.round(samples.points, 9).T) for samples in (plain, seamed)]
    for name in ("points", "normals", "weights"):
        assert_allclose(getattr(plain, name)[places[0]], getattr(seamed, name)[places[1]], atol=1e-9)


def test_every_third():
    samples = SurfaceSampler(MESH).of(MESH)
    assert_array_equal(samples.every(3).points, samples.points[::3])
    assert samples.every(1) is samples
