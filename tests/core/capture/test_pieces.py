"""Which pieces of a frame continue in which of the next."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from refmesh_addon.core.capture.pieces import continuing, pieces_of
from refmesh_addon.core.types import TriangleMesh
from tests.core.shapes import ball, box, joined

BODY = box((2.0, 1.2, 0.8), 4)


def prop(x, radius=0.25):
    return ball(2, radius, (x, 0.0, 0.0))


def links(before, after):
    return continuing(pieces_of(before), pieces_of(after)).tolist()


def test_pieces_that_hardly_move_continue_in_themselves():
    assert links(joined(BODY, prop(2.0)), joined(BODY, prop(2.05))) == [[0, 0], [1, 1]]


def test_a_piece_that_appears_or_leaves_continues_in_nothing():
    assert links(BODY, joined(BODY, prop(2.0))) == [[0, 0]]
    assert links(joined(BODY, prop(2.0)), BODY) == [[0, 0]]


def test_a_piece_that_leaps_continues_where_one_like_it_has_come_from_nowhere():
    assert links(joined(BODY, prop(2.0)), joined(prop(-3.0), BODY)) == [[0, 1], [1, 0]]
    assert links(joined(BODY, prop(2.0)), joined(prop(-3.0, 0.5), BODY)) == [[0, 1]], "not one of another size"


def test_a_split_and_a_merger_connect_all_that_take_part():
    halves = joined(box((1.0, 1.2, 0.8), 4, (-0.51, 0, 0)), box((1.0, 1.2, 0.8), 4, (0.51, 0, 0)))
    assert links(BODY, halves) == [[0, 0], [0, 1]]
    assert links(halves, BODY) == [[0, 0], [1, 0]]


def test_a_fast_piece_that_merges_has_not_left_as_the_volume_of_the_frame_stays():
    before, longer = joined(BODY, ball(3, 0.5, (4.0, 0, 0))), box((2.55, 1.2, 0.8), 4, (0.27, 0, 0))
    assert links(before, longer) == [[0, 0], [1, 0]]


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_scale_changes_nothing(scale):
    scaled = lambda mesh: mesh.moved(scale * mesh.vertices)
    before, after = joined(BODY, prop(2.0), prop(-2.0)), joined(prop(2.1), BODY, prop(9.0, 0.4))
    assert links(scaled(before), scaled(after)) == links(before, after)


def test_a_piece_without_area_has_points_too():
    flat = TriangleMesh(np.zeros((3, 3)) + [[2.0, 0, 0]], [[0, 1, 2]])
    pieces = pieces_of(joined(BODY, flat))
    assert_array_equal(pieces.queries[1], np.broadcast_to([2.0, 0, 0], pieces.queries[1].shape))
