"""Coarse copies of dense meshes: near them, closed where they are, and of one side each."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from refmesh_addon.core.geometry.borders import boundary_edges
from refmesh_addon.core.geometry.closest_point import SurfaceIndex
from refmesh_addon.core.geometry.clustering import clustered
from refmesh_addon.core.geometry.mesh import signed_volume, triangle_normals, vertex_components
from refmesh_addon.core.types import TriangleMesh

from ..shapes import ball, box, joined, torus, without

BODIES = {"ball": ball(5), "box": box(subdivisions=5), "torus": torus()}


@pytest.mark.parametrize("name", BODIES)
@pytest.mark.parametrize("vertices", [60, 400])
def test_a_copy_is_closed_and_faces_and_encloses_what_the_mesh_does(name, vertices):
    mesh = BODIES[name]
    coarse, kept = clustered(mesh, vertices)
    assert not len(boundary_edges(coarse))
    assert signed_volume(coarse) == pytest.approx(signed_volume(mesh), rel=40 / vertices)
    facing = (triangle_normals(coarse) * triangle_normals(mesh)[kept]).sum(axis=1)
    assert np.mean(facing > 0) > 0.95


def test_a_copy_has_about_as_many_vertices_as_requested_and_lies_within_a_cell():
    mesh = BODIES["ball"]
    coarse, _ = clustered(mesh, 1000)
    assert 500 < len(coarse.vertices) < 2000
    assert SurfaceIndex(mesh).query(coarse.vertices, 1.0).distances.max() < np.sqrt(4 * np.pi / 1000)


def test_sheets_nearer_than_a_cell_stay_apart():
    plate = box((2.0, 2.0, 0.001), subdivisions=5)
    coarse, _ = clustered(plate, 100)
    assert signed_volume(coarse) == pytest.approx(0.004, rel=0.2)


def test_a_hole_stays_a_hole():
    mesh = BODIES["ball"]
    open_ball = without(mesh, mesh.vertices[mesh.triangles][:, :, 2].min(axis=1) > 0.7)
    coarse, _ = clustered(open_ball, 400)
    assert len(boundary_edges(coarse)) and vertex_components(coarse)[0] == 1


def test_of_triangles_that_fall_onto_each_other_one_is_left():
    cell = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    twice = joined(*[TriangleMesh(cell, [[0, 1, 2]])] * 2, TriangleMesh(cell + [3.0, 0, 0], [[0, 1, 2]]))
    coarse, kept = clustered(twice, 1000)
    assert_array_equal(kept, [0, 2])
    assert_allclose(coarse.vertices[coarse.triangles[1]], cell + [3.0, 0, 0])


def test_scale_and_place_change_nothing():
    mesh = BODIES["torus"]
    plain, kept = clustered(mesh, 100)
    moved, again = clustered(mesh.moved(1024 * mesh.vertices), 100)
    assert_array_equal(kept, again)
    assert_array_equal(plain.triangles, moved.triangles)
