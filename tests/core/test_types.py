"""Meshes cannot change behind a reader's back, and wrong shapes are refused."""

import numpy as np
import pytest

from refmesh_addon.core.types import TriangleMesh


def test_arrays_have_their_types_and_are_read_only():
    mesh = TriangleMesh([[0, 0, 0], [3, 0, 0], [0, 4, 0]], [[0, 1, 2]])
    assert (mesh.vertices.dtype, mesh.triangles.dtype) == (np.float64, np.int32)
    assert mesh.vertices.flags.c_contiguous
    with pytest.raises(ValueError, match="read-only"):
        mesh.vertices[0, 0] = 1.0
    with pytest.raises(ValueError, match="read-only"):
        mesh.triangles[0, 0] = 1
    with pytest.raises(AttributeError):
        mesh.vertices = np.zeros((3, 3))


def test_an_array_given_to_a_mesh_stays_writable_for_its_owner():
    vertices = np.zeros((3, 3))
    TriangleMesh(vertices, [[0, 1, 2]])
    vertices[0] = 1.0


@pytest.mark.parametrize(
    ("vertices", "triangles", "name"),
    [(np.zeros((4, 2)), [[0, 1, 2]], "vertices"), (np.zeros((4, 3)), [[0, 1, 2, 3]], "triangles"), (np.zeros(3), [[0, 1, 2]], "vertices")],
)
def test_wrong_shapes_are_named(vertices, triangles, name):
    with pytest.raises(ValueError, match=name):
        TriangleMesh(vertices, triangles)


def test_diagonal():
    assert TriangleMesh([[1, 1, 1], [4, 1, 1], [1, 5, 1]], [[0, 1, 2]]).diagonal == 5.0
    assert TriangleMesh(np.empty((0, 3)), np.empty((0, 3))).diagonal == 0.0


def test_moving_keeps_the_triangles_and_the_number_of_vertices():
    mesh = TriangleMesh([[0, 0, 0], [3, 0, 0], [0, 4, 0]], [[0, 1, 2]])
    moved = mesh.moved(mesh.vertices + 1)
    assert np.array_equal(moved.triangles, mesh.triangles)
    assert np.array_equal(moved.vertices, mesh.vertices + 1)
    with pytest.raises(ValueError, match="topology"):
        mesh.moved(np.zeros((4, 3)))
