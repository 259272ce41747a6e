"""Triangles as fine as those of the capture: where it is fine and nowhere else, the surface staying what it is."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from refmesh_addon.core.geometry.half_edges import HalfEdges
from refmesh_addon.core.geometry.mesh import edge_lengths, is_watertight, triangle_areas
from refmesh_addon.core.geometry.subdivision import split_edges
from refmesh_addon.core.reference.capture_density import COARSE, MOST, CaptureDensity, as_fine_as
from refmesh_addon.core.reference.group import ReferenceMesh
from refmesh_addon.core.types import TriangleMesh

from ..shapes import ball

BALL = ball(4)
CENTERS = np.random.default_rng(0).normal(size=(2000, 3))
CENTERS *= 0.9 / np.linalg.norm(CENTERS, axis=1, keepdims=True)


def finer(mesh: TriangleMesh, above: float, times: int) -> TriangleMesh:
    """The mesh with the edges above a height along z halved so often."""
    for _ in range(times):
        table = HalfEdges.of(mesh)
        mesh = split_edges(mesh, table, (mesh.vertices[table.edges][:, :, 2] > above).all(axis=1))
    return mesh


def density(capture: TriangleMesh) -> CaptureDensity:
    return CaptureDensity.of(capture, CENTERS, CENTERS)


def test_edges_are_split_where_the_capture_is_fine_and_nowhere_else():
    result = as_fine_as(density(finer(BALL, 0.85, 2)), ReferenceMesh(BALL, 0)).mesh
    assert_array_equal(result.vertices[: len(BALL.vertices)], BALL.vertices)
    assert_allclose(triangle_areas(result).sum(), triangle_areas(BALL).sum(), rtol=1e-12)
    assert is_watertight(result)
    lengths = lambda mesh: edge_lengths(mesh.vertices, HalfEdges.of(mesh).edges)
    heights = lambda mesh: mesh.vertices[HalfEdges.of(mesh).edges][:, :, 2].mean(axis=1)
    assert lengths(result)[heights(result) > 0.95].max() < COARSE * lengths(BALL).mean() / 3
    assert_array_equal(np.sort(lengths(result)[heights(result) < 0.7]), np.sort(lengths(BALL)[heights(BALL) < 0.7]))


@pytest.mark.parametrize("capture", [BALL, ball(3)], ids=["as fine", "coarser"])
def test_a_mesh_that_is_fine_enough_is_itself(capture):
    reference = ReferenceMesh(BALL, 0)
    assert as_fine_as(density(capture), reference) is reference


def test_in_any_unit_and_far_away_the_same_edges_are_split():
    capture = finer(BALL, 0.85, 2)
    plain = as_fine_as(density(capture), ReferenceMesh(BALL, 0)).mesh
    moved = lambda points: 1e3 * points + 700.0
    far = CaptureDensity.of(capture.moved(moved(capture.vertices)), moved(CENTERS), moved(CENTERS))
    assert_array_equal(as_fine_as(far, ReferenceMesh(BALL.moved(moved(BALL.vertices)), 0)).mesh.triangles, plain.triangles)


def test_no_more_than_a_stated_share_is_split_however_fine_the_capture_is():
    result = as_fine_as(density(finer(BALL, -2.0, 2)), ReferenceMesh(BALL, 0)).mesh
    assert len(result.vertices) - len(BALL.vertices) == int(MOST * len(HalfEdges.of(BALL).edges))
