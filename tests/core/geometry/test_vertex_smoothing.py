"""Smoothing of values over the edges of a mesh."""

import numpy as np
from numpy.testing import assert_allclose

from refmesh_addon.core.geometry.vertex_smoothing import VertexSmoother
from refmesh_addon.core.types import TriangleMesh

from ..shapes import ball

MESH = ball(2)


def test_a_step_averages_with_the_neighbors_as_a_loop_does():
    values = np.random.default_rng(0).random(len(MESH.vertices))
    neighbors = [set() for _ in values]
    for a, b, c in MESH.triangles.tolist():
        neighbors[a] |= {b, c}
        neighbors[b] |= {a, c}
        neighbors[c] |= {a, b}
    expected = [(own + np.mean([values[one] for one in around])) / 2 for own, around in zip(values, neighbors)]
    assert_allclose(VertexSmoother(MESH).step(values), expected)


def test_constants_stay_and_vertices_without_neighbors_too():
    mesh = TriangleMesh(np.vstack([MESH.vertices, [[9, 9, 9]]]), MESH.triangles)
    values = np.append(np.ones(len(MESH.vertices)), 5.0)
    assert_allclose(VertexSmoother(mesh).step(values), values)
