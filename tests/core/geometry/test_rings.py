"""Rings of vertices around others."""

import numpy as np
import trimesh
from numpy.testing import assert_array_equal

from refmesh_addon.core.geometry.cotangent import triangle_adjacency
from refmesh_addon.core.geometry.rings import grown, vertices_around
from refmesh_addon.core.types import TriangleMesh

SHAPE = trimesh.creation.icosphere(subdivisions=2)
MESH = TriangleMesh(np.asarray(SHAPE.vertices), np.asarray(SHAPE.faces))
ADJACENCY = triangle_adjacency(MESH)


def test_rings_are_the_vertices_so_many_edges_away():
    chosen = np.arange(len(MESH.vertices)) == 5
    away = np.array([len(path) - 1 for _, path in sorted(_paths(5).items())])
    for rings in range(4):
        assert_array_equal(grown(ADJACENCY, chosen, rings), away <= rings)
    assert chosen.sum() == 1


def test_around_a_triangle_its_corners_come_first():
    first = np.arange(len(MESH.triangles)) == 0
    assert_array_equal(np.flatnonzero(vertices_around(MESH, ADJACENCY, first, 0)), np.sort(MESH.triangles[0]))
    corners = np.isin(np.arange(len(MESH.vertices)), MESH.triangles[0])
    assert_array_equal(vertices_around(MESH, ADJACENCY, first, 2), grown(ADJACENCY, corners, 2))


def _paths(start):
    """The shortest way to each vertex, found breadth first."""
    paths, frontier = {start: [start]}, [start]
    while frontier:
        found = {}
        for vertex in frontier:
            for other in SHAPE.vertex_neighbors[vertex]:
                if other not in paths and other not in found:
                    found[other] = [*paths[vertex], other]
        paths |= found
        frontier = list(found)
    return paths
