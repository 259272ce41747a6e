"""Pieces of an open surface face one way: the one that most of the area faces in the file."""

import numpy as np
import pytest

from refmesh_addon.core.capture.sheet_orientation import turned_pieces

from ..shapes import TILT, above, ball, flipped, joined, moved, without


def three_caps():
    """Three pieces of balls, all seen from above, the last one the largest."""
    cap = without(ball(), ~above(ball(), 0.5))
    return joined(moved(cap, scale=0.4), moved(cap, scale=0.6, shift=(2, 0, 0)), moved(cap, shift=(5, 1, -1)))


@pytest.mark.parametrize("wrong", [[], [0], [1], [0, 1], [2], [0, 1, 2]])
@pytest.mark.parametrize("turn", [np.eye(3), TILT])
def test_pieces_agree_with_the_larger_area_in_the_file(wrong, turn):
    caps = moved(three_caps(), turn)
    piece = np.repeat([0, 1, 2], len(caps.triangles) // 3)
    mixed = flipped(caps, np.isin(piece, wrong))
    turned = set(np.unique(piece[turned_pieces(mixed)]))
    assert turned == (set(wrong) if 2 not in wrong else {0, 1, 2} - set(wrong))
