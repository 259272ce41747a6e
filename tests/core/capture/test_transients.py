"""Pieces that are there for a few frames only."""

import pytest

from refmesh_addon.core.capture.pieces import pieces_of
from refmesh_addon.core.capture.transients import LASTING, transient_pieces
from tests.core.shapes import ball, box, joined

BODY, PROP = box((2.0, 1.2, 0.8), 4), ball(1, 0.25, (2.0, 0.0, 0.0))
ALONE, WITH = pieces_of(BODY), pieces_of(joined(BODY, PROP))


def transients(frames):
    return [own.tolist() for own in transient_pieces(frames)]


def test_a_piece_in_one_frame_alone_is_transient():
    assert transients([ALONE, ALONE, WITH, ALONE, ALONE]) == [[], [], [1], [], []]


@pytest.mark.parametrize("shown, transient", [(LASTING - 1, True), (LASTING, False)])
def test_how_long_a_piece_may_last(shown, transient):
    frames = [ALONE] * 8 + [WITH] * shown + [ALONE] * 8
    assert any(transients(frames)) == transient


def test_most_of_a_short_take_is_not_transient():
    assert not any(transients([ALONE, WITH, WITH]))


def test_a_piece_that_splits_off_is_not_transient():
    halves = pieces_of(joined(box((1.0, 1.2, 0.8), 4, (-0.51, 0, 0)), box((1.0, 1.2, 0.8), 4, (0.51, 0, 0))))
    assert not any(transients([ALONE, ALONE, halves, ALONE, ALONE]))


def test_no_frame_loses_everything():
    other = pieces_of(ball(2, 3.0, (30.0, 0, 0)))
    assert transients([ALONE, ALONE, other, ALONE, ALONE])[2] == []


def test_a_single_frame_has_none():
    assert transients([WITH]) == [[]]
