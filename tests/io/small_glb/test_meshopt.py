import numpy as np
import pytest

from refmesh_addon.io.small_glb.meshopt import encoded_attributes, encoded_triangles
from refmesh_addon.io.small_glb.triangle_order import packing_order
from tests.core import shapes
from tests.io.small_glb.unpacking import unpacked_attributes, unpacked_triangles


def turned(triangles):
    """Each triangle with its lowest corner first."""
    rows = np.asarray(triangles)
    return rows[np.arange(len(rows))[:, None], (rows.argmin(axis=1)[:, None] + np.arange(3)) % 3]


@pytest.mark.parametrize("count", [1, 15, 16, 17, 255, 256, 257, 1000])
@pytest.mark.parametrize("stride", [4, 8, 12, 64, 256])
@pytest.mark.parametrize("spread", [0, 1, 5, 90])
def test_attributes_come_back(count, stride, spread):
    rng = np.random.default_rng(count + stride)
    steps = np.rint(spread * rng.standard_normal((count, stride))).astype(int)
    elements = (np.cumsum(steps, axis=0) & 0xFF).astype(np.uint8)
    np.testing.assert_array_equal(unpacked_attributes(encoded_attributes(elements), count, stride), elements)


@pytest.mark.parametrize("shape", [(3, 6), (0, 4), (2, 260)])
def test_attributes_of_other_sizes_are_refused(shape):
    with pytest.raises(ValueError, match="elements must be"):
        encoded_attributes(np.zeros(shape, dtype=np.uint8))


@pytest.mark.parametrize("name", ["ball", "torus", "two bodies", "any order"])
def test_triangles_come_back_in_their_order(name):
    mesh = {"torus": shapes.torus(), "two bodies": shapes.joined(shapes.ball(1), shapes.torus())}.get(name, shapes.ball(3))
    triangles, _ = packing_order(mesh.triangles, len(mesh.vertices))
    if name == "any order":
        triangles = np.random.default_rng(3).permutation(triangles)
    unpacked = unpacked_triangles(encoded_triangles(triangles), 3 * len(triangles))
    np.testing.assert_array_equal(turned(unpacked), turned(triangles))


def test_packing_order_keeps_the_triangles_and_packs_them_in_a_byte_each():
    mesh = shapes.ball(4)
    triangles, order = packing_order(mesh.triangles, len(mesh.vertices))
    assert sorted(map(tuple, turned(order[triangles]).tolist())) == sorted(map(tuple, turned(mesh.triangles).tolist()))
    assert len(encoded_triangles(triangles)) < 1.3 * len(triangles)


def test_vertices_appear_in_their_order_and_those_without_a_triangle_come_last():
    triangles, order = packing_order(np.array([[5, 3, 1], [1, 3, 4]]), 7)
    seen = np.maximum.accumulate(triangles.ravel())
    assert (np.diff(seen, prepend=-1) <= 1).all()
    assert sorted(order) == list(range(7)) and set(order[4:]) == {0, 2, 6}
