"""Pieces that are there for a few frames only."""

import pytest

from refmesh_addon.core.capture.pieces import pieces_of
from refmesh_addon.core.capture.transients import LASTING, visits
from tests.core.shapes import ball, box, joined

BODY, PROP = box((2.0, 1.2, 0.8), 4), ball(1, 0.25, (2.0, 0.0, 0.0))
ALONE, WITH = pieces_of(BODY), pieces_of(joined(BODY, PROP))


def transients(frames):
    return [own.tolist() for own in visits(frames).transient]


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


def test_a_lasting_piece_comes_in_its_first_frame_and_leaves_in_its_last():
    result = visits([ALONE] * 3 + [WITH] * LASTING + [ALONE] * 3)
    assert {frame: own.tolist() for frame, own in enumerate(result.coming) if len(own)} == {3: [1]}
    assert {frame: own.tolist() for frame, own in enumerate(result.leaving) if len(own)} == {2 + LASTING: [1]}


def test_what_is_there_in_all_frames_neither_comes_nor_leaves():
    result = visits([WITH] * 4)
    assert not any(len(own) for own in result.coming + result.leaving + result.transient)
