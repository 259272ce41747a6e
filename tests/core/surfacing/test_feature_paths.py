"""Edges laid along feature lines: straight, from corner to corner, on a mesh that otherwise stays what it was."""

import itertools

import numpy as np
import pytest
import trimesh
from numpy.testing import assert_array_equal

from refmesh_addon.core.geometry.feature_lines import feature_edges
from refmesh_addon.core.geometry.half_edges import HalfEdges
from refmesh_addon.core.geometry.mesh import is_watertight
from refmesh_addon.core.geometry.self_intersection import crossing_triangles
from refmesh_addon.core.surfacing.feature_paths import with_feature_edges
from refmesh_addon.core.surfacing.reconstruction import screened_poisson
from refmesh_addon.core.surfacing.remeshing import remeshed
from refmesh_addon.core.types import TriangleMesh

from ..bodies import oriented_points
from ..shapes import TILT, ball, box, moved

SIDES = np.array([2.0, 1.2, 0.8])
BOX = moved(box(SIDES), TILT)


def reconstructed(body, triangles=3000):
    return remeshed(screened_poisson(*oriented_points(body, 20_000), 6), triangles)


def chamfered(width):
    """BOX with its edges cut off: each becomes two lines, width * sqrt(2) apart."""
    cuts = width * (1 - np.eye(3))
    points = [np.array(signs) * (SIDES / 2 - cut) for signs in itertools.product((-1, 1), repeat=3) for cut in cuts]
    hull = trimesh.convex.convex_hull(np.array(points))
    return moved(TriangleMesh(hull.vertices, hull.faces), TILT)


def total_length(mesh, edges):
    return np.linalg.norm(np.diff(mesh.vertices[edges], axis=1)[:, 0], axis=1).sum()


def off_the_edges(points):
    """Distance of points from the nearest of the twelve edges of BOX."""
    beyond = np.abs(np.abs(points @ TILT) - SIDES / 2)
    return np.sqrt((np.sort(beyond, axis=1)[:, :2] ** 2).sum(axis=1))


def test_the_edges_of_a_reconstructed_box_become_straight():
    mesh = reconstructed(BOX)
    result = with_feature_edges(mesh, BOX, feature_edges(BOX).edges)
    ends = result.mesh.vertices[result.features]
    assert np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum() > 0.99 * 4 * SIDES.sum(), "all twelve, whole"
    assert off_the_edges(ends.reshape(-1, 3)).max() < 1e-9 * BOX.diagonal
    corners = BOX.vertices[:, None] - result.mesh.vertices
    assert np.linalg.norm(corners, axis=2).min(axis=1).max() < 1e-9, "and all eight corners"


def test_the_mesh_stays_closed_and_does_not_cross_itself():
    mesh = reconstructed(BOX)
    result = with_feature_edges(mesh, BOX, feature_edges(BOX).edges)
    assert is_watertight(result.mesh)
    assert not crossing_triangles(result.mesh).any()
    assert len(result.mesh.triangles) == len(mesh.triangles)
    present = {tuple(edge) for edge in HalfEdges.of(result.mesh).edges.tolist()}
    assert all(tuple(edge) in present for edge in result.features.tolist())
    inner = (SIDES / 2 - np.abs(mesh.vertices @ TILT) > 0.35).sum(axis=1) >= 2  # in the middle of a face
    assert_array_equal(result.mesh.vertices[inner], mesh.vertices[inner])


@pytest.mark.parametrize("width", [0.04, 0.08, 0.1])
def test_where_lines_would_make_the_mesh_cross_itself_only_their_ends_are_given_up(width):
    body = chamfered(width)  # its mesh crosses itself at a corner when both lines of each chamfer are laid whole
    edges = feature_edges(body).edges
    result = with_feature_edges(reconstructed(body), body, edges)
    assert result.crossing == crossing_triangles(result.mesh).sum() == 0
    assert is_watertight(result.mesh)
    assert total_length(result.mesh, result.features) > 0.9 * total_length(body, edges)


def test_without_lines_nothing_changes():
    mesh = ball(3)
    result = with_feature_edges(mesh, mesh, feature_edges(mesh).edges)
    assert result.mesh is mesh
    assert not len(result.features)
