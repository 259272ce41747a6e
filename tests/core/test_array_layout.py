"""Declared shapes and types: what fits passes, and everything else is refused by name."""

import numpy as np
import pytest

from refmesh_addon.core.array_layout import check_layouts

DECLARED = {"vertices": "(V, 3) float64", "triangles": "(T, 3) int32 < V", "kept": "(V) bool", "offset": "(3) number"}
ARRAYS = {
    "vertices": np.zeros((4, 3)),
    "triangles": np.array([[0, 1, 3]], np.int32),
    "kept": np.ones(4, bool),
    "offset": np.zeros(3, np.float32),
}


def test_arrays_as_declared_pass():
    check_layouts(ARRAYS, DECLARED)
    check_layouts({**ARRAYS, "triangles": np.empty((0, 3), np.int32)}, DECLARED)


@pytest.mark.parametrize(
    "name, array",
    [
        ("vertices", np.zeros((4, 2))),
        ("vertices", np.zeros(12)),
        ("vertices", np.zeros((4, 3), np.float32)),
        ("vertices", np.zeros((4, 3), "U1")),
        ("kept", np.ones(3, bool)),
        ("triangles", np.array([[0, 1, 4]], np.int32)),
        ("triangles", np.array([[0, 1, -1]], np.int32)),
        ("offset", np.zeros((), np.float64)),
    ],
)
def test_another_shape_type_or_index_is_refused_by_name(name, array):
    with pytest.raises(ValueError, match=f"'{name}'"):
        check_layouts({**ARRAYS, name: array}, DECLARED)


def test_a_missing_or_a_foreign_array_is_refused_and_an_optional_one_is_checked():
    with pytest.raises(ValueError, match="'kept' is missing"):
        check_layouts({name: array for name, array in ARRAYS.items() if name != "kept"}, DECLARED)
    with pytest.raises(ValueError, match="'more' is not known"):
        check_layouts({**ARRAYS, "more": np.zeros(2)}, DECLARED)
    check_layouts({**ARRAYS, "more": np.zeros((2, 4))}, DECLARED, {"more": "(N, V) float64", "absent": "(N) bool"})
    with pytest.raises(ValueError, match="'more'"):
        check_layouts({**ARRAYS, "more": np.zeros((2, 5))}, DECLARED, {"more": "(N, V) float64"})
