"""Single vertices off the source come back to it; surface that is off as a whole, over holes or covered does not move."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from refmesh_addon.core.deformation.facing import Facing
from refmesh_addon.core.deformation.outliers import COVER_RINGS, LARGEST, OFF, Surroundings, VisibleSource, without_outliers
from refmesh_addon.core.geometry.closest_point import SurfaceIndex
from refmesh_addon.core.geometry.cotangent import triangle_adjacency
from refmesh_addon.core.geometry.mesh import mean_edge_length, submesh, vertex_normals
from refmesh_addon.core.geometry.winding import enclosed_by
from tests.core.shapes import TILT, ball

MESH, SOURCE = ball(4), ball(5)  # an icosphere's vertices are those of the next finer one as well
LENGTH, NORMALS = mean_edge_length(MESH), vertex_normals(MESH)
UNROTATED = np.tile(np.eye(3), (len(MESH.vertices), 1, 1))


def repaired(mesh, source=SOURCE, covered=()):
    around = Surroundings.of(triangle_adjacency(MESH), LENGTH, np.isin(np.arange(len(MESH.vertices)), covered))
    return without_outliers(mesh, Facing(MESH, UNROTATED), around, VisibleSource(SurfaceIndex(source), enclosed_by(source)))


def pushed(chosen, edges):
    """The ball with chosen vertices moved out by so many edge lengths."""
    vertices = MESH.vertices.copy()
    vertices[chosen] += edges * LENGTH * NORMALS[chosen]
    return MESH.moved(vertices)


@pytest.mark.parametrize("edges", [-0.8, 0.8, 1.2, 3.0])
def test_spikes_come_back_and_all_else_stays(edges):
    spikes = np.array([100, 700, 701, 1500])
    spiky = pushed(spikes, edges)
    result = repaired(spiky)
    assert_array_equal(np.delete(result.vertices, spikes, axis=0), np.delete(spiky.vertices, spikes, axis=0))
    heights = np.linalg.norm(result.vertices[spikes], axis=1) - 1.0
    assert np.abs(heights).max() < OFF * LENGTH
    assert np.linalg.norm(result.vertices - MESH.vertices, axis=1).max() < 0.5 * LENGTH


def test_what_the_fit_leaves_everywhere_stays():
    for mesh in (MESH, pushed([100, 700], 0.5 * OFF)):
        assert_array_equal(repaired(mesh).vertices, mesh.vertices)


def test_what_is_covered_may_lie_inside_and_lead_there_but_not_stick_out():
    adjacency, near = triangle_adjacency(MESH), np.arange(len(MESH.vertices)) == 100
    for _ in range(COVER_RINGS):
        near = near | ((adjacency @ near) > 0)
    for chosen in np.flatnonzero(near):
        dented = pushed([chosen], -0.8)
        assert_array_equal(repaired(dented, covered=[100]).vertices, dented.vertices)
    assert np.linalg.norm(repaired(pushed([100], 0.8), covered=[100]).vertices - MESH.vertices, axis=1).max() < OFF * LENGTH


def test_surface_that_is_off_as_a_whole_stays():
    near = np.flatnonzero(np.linalg.norm(MESH.vertices - MESH.vertices[100], axis=1) < 6 * LENGTH)
    assert len(near) > LARGEST
    for mesh in (pushed(near, 1.0), pushed(slice(None), 1.0)):
        assert_array_equal(repaired(mesh).vertices, mesh.vertices)


def test_surface_over_a_hole_stays():
    hole = np.linalg.norm(SOURCE.vertices[SOURCE.triangles].mean(axis=1) - MESH.vertices[100], axis=1) < 2.0 * LENGTH
    spiky = pushed([100], 1.0)
    assert_array_equal(repaired(spiky, submesh(SOURCE, ~hole)[0]).vertices, spiky.vertices)


def test_turning_and_scaling_the_problem_does_so_to_the_answer():
    spiky, change = pushed([100, 700], 1.2), lambda mesh: mesh.moved(50.0 * mesh.vertices @ TILT.T + [3.0, -7.0, 11.0])
    plain, rest, source = repaired(spiky), change(MESH), change(SOURCE)
    facing = Facing(rest, UNROTATED)
    around = Surroundings.of(triangle_adjacency(MESH), mean_edge_length(rest), np.zeros(len(rest.vertices), dtype=bool))
    turned = without_outliers(change(spiky), facing, around, VisibleSource(SurfaceIndex(source), enclosed_by(source)))
    assert_allclose(turned.vertices, change(plain).vertices, atol=1e-9)
