"""Triangles that frames stretch are divided: there and nowhere else, the surface and its feature lines staying what they are."""

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal

from refmesh_addon.core.geometry.half_edges import HalfEdges
from refmesh_addon.core.geometry.mesh import is_watertight, mean_edge_length, triangle_areas
from refmesh_addon.core.reference.group import ReferenceMesh
from refmesh_addon.core.reference.refinement import LONGEST, MOST, STRETCHED, FittedFrame, refined

from ..shapes import ball

BALL = ball(4)
WIDTH = 0.04
STRIP = np.abs(BALL.vertices[:, 0]) < WIDTH


def drawn_out(vertices, factor=4.0):
    """A narrow strip around the ball, several times as wide."""
    x = vertices[:, 0]
    return np.column_stack([x + (factor - 1) * np.clip(x, -WIDTH, WIDTH), vertices[:, 1:]])


def shown(vertices):
    return FittedFrame(vertices, np.ones(len(vertices), dtype=bool))


def edge_lengths(mesh):
    ends = mesh.vertices[HalfEdges.of(mesh).edges]
    return np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)


def test_edges_that_a_frame_stretches_are_split_until_they_are_short_there():
    frame = drawn_out(BALL.vertices)
    result = refined(ReferenceMesh(BALL, 0), [shown(BALL.vertices), shown(frame)])
    assert len(BALL.triangles) < len(result.mesh.triangles) < 1.3 * len(BALL.triangles)
    there = edge_lengths(result.mesh.moved(drawn_out(result.mesh.vertices))) / mean_edge_length(BALL.moved(frame))
    at_rest = edge_lengths(result.mesh) / mean_edge_length(BALL)
    assert edge_lengths(BALL.moved(frame)).max() > 2 * LONGEST * mean_edge_length(BALL.moved(frame)), "and they were long"
    assert not ((there > 1.3 * LONGEST) & (there > 1.3 * STRETCHED * at_rest)).any()  # new vertices are on chords of what they stand for
    assert is_watertight(result.mesh)


def test_the_surface_at_rest_stays_and_so_do_vertices_and_what_is_far_away():
    result = refined(ReferenceMesh(BALL, 0), [shown(drawn_out(BALL.vertices))]).mesh
    assert_array_equal(result.vertices[: len(BALL.vertices)], BALL.vertices)
    assert_allclose(triangle_areas(result).sum(), triangle_areas(BALL).sum(), rtol=1e-12)
    far = lambda mesh: mesh.triangles[(np.abs(mesh.vertices[mesh.triangles][:, :, 0]) > 0.3).all(axis=1)]
    assert_array_equal(far(result), far(BALL))


def test_in_any_unit_and_far_away_the_same_edges_are_split():
    plain = refined(ReferenceMesh(BALL, 0), [shown(drawn_out(BALL.vertices))]).mesh
    moved = BALL.moved(1e-3 * BALL.vertices + 5.0)
    assert_array_equal(refined(ReferenceMesh(moved, 0), [shown(1e6 * drawn_out(BALL.vertices) - 7.0)]).mesh.triangles, plain.triangles)


def test_feature_lines_stay_lines_of_edges():
    edges = HalfEdges.of(BALL).edges
    across = edges[STRIP[edges].any(axis=1)][:40].astype(np.int32)
    result = refined(ReferenceMesh(BALL, 0, across), [shown(drawn_out(BALL.vertices))])
    present = {tuple(edge) for edge in HalfEdges.of(result.mesh).edges.tolist()}
    assert {tuple(edge) for edge in np.sort(result.features, axis=1).tolist()} <= present
    length = lambda mesh, lines: np.linalg.norm(np.diff(mesh.vertices[lines], axis=1)[:, 0], axis=1).sum()
    assert len(result.features) > len(across)
    assert_allclose(length(result.mesh, result.features), length(BALL, across), rtol=1e-12)


def test_edges_that_are_long_at_rest_as_well_are_left():
    uneven = BALL.moved(drawn_out(BALL.vertices))
    reference = ReferenceMesh(uneven, 0)
    assert refined(reference, [shown(3 * uneven.vertices)]) is reference
    assert refined(reference, [shown(uneven.vertices * [1 + 0.5 * (STRETCHED - 1), 1, 1])]) is reference


def test_no_more_than_a_stated_share_is_split_however_much_is_stretched():
    x = BALL.vertices[:, 0]
    half = np.column_stack([np.where(x > 0, 9 * x, x), BALL.vertices[:, 1:]])
    result = refined(ReferenceMesh(BALL, 0), [shown(half)])
    assert len(result.mesh.vertices) - len(BALL.vertices) == int(MOST * len(HalfEdges.of(BALL).edges))


def test_what_no_surface_has_placed_is_not_divided():
    reference = ReferenceMesh(BALL, 0)
    assert refined(reference, [FittedFrame(drawn_out(BALL.vertices), np.abs(BALL.vertices[:, 0]) > 5 * WIDTH)]) is reference
