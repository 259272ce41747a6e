"""Marks of bodies as text."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.core.reference.marks import EXAMPLE, Marks, marks_as_text, parse_marks


def test_the_example_is_read_as_it_says():
    marks = parse_marks(EXAMPLE)
    assert marks.frame == 48 and [body.tolist() for body in marks.bodies] == [[[0.1, 0.2, 0.3], [0.1, 0.3, 0.3]], [[0.4, 0.5, 0.6]]]
    assert marks_as_text(marks) == EXAMPLE
    assert parse_marks("") is parse_marks("  ") is None


def test_single_precision_survives():
    points = np.random.default_rng(0).normal(size=(50, 3)).astype(np.float32) * np.float32(10.0) ** np.arange(-12, 13, 12, dtype=np.float32)
    marks = parse_marks(marks_as_text(Marks(110, (points[:20], points[20:]))))
    for body, expected in zip(marks.bodies, (points[:20], points[20:]), strict=True):
        assert_array_equal(body.astype(np.float32), expected)


@pytest.mark.parametrize(
    "text, words",
    [
        ("0 0 0 | 1 1 1", "'0 0 0 | 1 1 1' is not a frame"),
        ("six: 0 0 0 | 1 1 1", "'six' is not a frame"),
        ("6: 0 0 | 1 1 1", "'0 0' is not a point"),
        ("6: 0 0 0 |", "'' is not a point"),
        ("6: 0 0 zero | 1 1 1", "'0 0 zero' is not a point"),
        ("6: 0 0 nan | 1 1 1", "'0 0 nan' is not a point"),
    ],
)
def test_what_is_not_understood_is_quoted(text, words):
    with pytest.raises(RefMeshError) as failure:
        parse_marks(text)
    assert words in str(failure.value) and EXAMPLE in str(failure.value)
