"""Edges as long as the frames show them, and everything else where it was."""

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal

from refmesh_addon.core.geometry.half_edges import HalfEdges
from refmesh_addon.core.geometry.mesh import edge_lengths
from refmesh_addon.core.geometry.self_intersection import crossing_triangles
from refmesh_addon.core.reference.frame_lengths import LONGER, with_frame_lengths
from refmesh_addon.core.reference.refinement import FittedFrame

from ..shapes import ball

BALL = ball(4)
EDGES = HalfEdges.of(BALL).edges
WIDTH = 0.2


def drawn_out(vertices, factor=2.0):
    """A strip around the ball, twice as wide."""
    x = vertices[:, 0]
    return np.column_stack([x + (factor - 1) * np.clip(x, -WIDTH, WIDTH), vertices[:, 1:]])


def shown(vertices, visible=True):
    return FittedFrame(vertices, np.full(len(vertices), visible))


def ratios(mesh, frame):
    """Lengths of the edges in a frame, against those of the mesh."""
    return edge_lengths(frame, EDGES) / edge_lengths(mesh.vertices, EDGES)


def test_edges_get_the_lengths_that_they_have_in_the_frames():
    frame = drawn_out(BALL.vertices)
    result = with_frame_lengths(BALL, [shown(frame), shown(frame)])
    assert ratios(BALL, frame).max() > 1.9
    assert ratios(result, frame).max() < LONGER + 0.15
    assert_array_equal(result.triangles, BALL.triangles)
    far = (np.abs(BALL.vertices[EDGES][:, :, 0]) > 0.6).all(axis=1)
    assert_allclose(ratios(result, BALL.vertices)[far], 1.0, atol=0.1)


def test_a_mesh_that_frames_bend_only_is_the_same_mesh():
    turned = BALL.vertices[:, [1, 2, 0]]
    assert with_frame_lengths(BALL, [shown(BALL.vertices), shown(turned + 3.0), shown(1.1 * turned)]) is BALL


def test_edges_that_frames_shorten_keep_their_lengths():
    assert with_frame_lengths(BALL, [shown(drawn_out(BALL.vertices, factor=0.5))]) is BALL


def test_what_no_frame_shows_has_its_own_lengths():
    assert with_frame_lengths(BALL, [shown(drawn_out(BALL.vertices), visible=False)]) is BALL


def test_the_scale_does_not_matter():
    frames = [shown(drawn_out(BALL.vertices)), shown(BALL.vertices)]
    large = with_frame_lengths(BALL.moved(1e4 * BALL.vertices), [shown(1e4 * frame.vertices) for frame in frames])
    assert_allclose(large.vertices, 1e4 * with_frame_lengths(BALL, frames).vertices, rtol=1e-6, atol=1e-4)


def test_nothing_crosses_that_did_not_before():
    """Cloth that is twice as large in the frames as the room it has in the reference positions."""
    folded = np.where(BALL.vertices[:, :1] > 0.3, [0.3, 0.0, 0.0] + 0.3 * (BALL.vertices - [0.3, 0.0, 0.0]), BALL.vertices)
    mesh = BALL.moved(folded)
    result = with_frame_lengths(mesh, [shown(drawn_out(3.0 * BALL.vertices))])
    assert not (crossing_triangles(result) & ~crossing_triangles(mesh)).any()
    assert not np.array_equal(result.vertices, folded)
