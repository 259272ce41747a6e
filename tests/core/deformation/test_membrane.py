"""Membranes between the vertices around small patches."""

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal

from refmesh_addon.core.deformation.membrane import connected_patches, spanned
from refmesh_addon.core.geometry.cotangent import triangle_adjacency
from tests.core.bending_bar import bar

MESH = bar(30, 16, uneven=0.1)
ADJACENCY = triangle_adjacency(MESH)


def test_patches_are_numbered_and_those_without_a_common_edge_are_apart():
    chosen = np.zeros(len(MESH.vertices), dtype=bool)
    chosen[[100, 101, 300]] = True
    vertices, patches = connected_patches(ADJACENCY, chosen)
    assert_array_equal(vertices, [100, 101, 300])
    assert_array_equal(patches, [0, 0, 1])
    assert not len(connected_patches(ADJACENCY, ~chosen & chosen)[0])


def test_each_vertex_is_the_mean_of_its_neighbors_wherever_it_was():
    chosen, astray = np.array([100, 101, 117, 300]), MESH.vertices.copy()
    places = spanned(ADJACENCY, MESH.vertices, chosen)
    astray[chosen] += np.random.default_rng(0).normal(size=(len(chosen), 3))
    assert_allclose(spanned(ADJACENCY, astray, chosen), places, atol=1e-12)
    whole = MESH.vertices.copy()
    whole[chosen] = places
    for vertex in chosen:
        assert_allclose(whole[ADJACENCY[[vertex]].indices].mean(axis=0), whole[vertex], atol=1e-12)
