"""Floating bits go; whatever could be a body, or all there is, stays."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from refmesh_addon.core.capture.floaters import without_floaters
from refmesh_addon.core.types import TriangleMesh

from ..shapes import above, ball, box, inside_out, joined, moved, without

BODY = box(subdivisions=3)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("first", [False, True])
def test_a_floating_bit_goes(scale, first):
    bit = ball(1, 0.03, (1.3, 0.0, 0.0))
    open_bit = moved(without(bit, above(bit, 0.01)), shift=(0.0, 0.5, 0.0))
    pieces = (bit, inside_out(open_bit))
    result = without_floaters(moved(joined(*pieces, BODY) if first else joined(BODY, *pieces), scale=scale))
    assert_array_equal(result.vertices, scale * BODY.vertices)
    assert_array_equal(result.triangles, BODY.triangles)


@pytest.mark.parametrize(
    "piece",
    [
        pytest.param(ball(2, 0.1, (1.5, 0.0, 0.0)), id="a small body"),
        pytest.param(TriangleMesh(np.array([[1.2, 0, 0], [1.7, 0, 0], [1.2, 0.5, 0]]), [[0, 1, 2]]), id="a sheet"),
    ],
)
def test_what_may_be_a_body_stays(piece):
    mesh = joined(BODY, piece)
    assert without_floaters(mesh) is mesh


def test_what_makes_up_the_capture_stays():
    drops = joined(*(ball(0, 0.05, (x, y, z)) for x in range(10) for y in range(10) for z in range(45)))
    assert without_floaters(drops) is drops


def test_one_piece_comes_back_as_it_is():
    assert without_floaters(BODY) is BODY
