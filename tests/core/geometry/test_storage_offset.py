import numpy as np
from numpy.testing import assert_array_equal

from refmesh_addon.core.geometry.storage_offset import storage_offset


def test_near_the_origin_nothing_is_moved():
    assert_array_equal(storage_offset(np.array([-1.0, 0, 0]), np.array([1.0, 2, 1])), 0)
    assert_array_equal(storage_offset(np.array([8.0, 0, 0]), np.array([10.0, 2, 1])), 0)
    assert_array_equal(storage_offset(np.full(3, 5.0), np.full(3, 5.0)), 0)


def test_about_the_offset_single_precision_resolves_a_millionth_of_the_body():
    rng = np.random.default_rng(0)
    for scale in 10.0 ** np.arange(-6, 7):
        for distance in 10.0 ** np.arange(0, 7):
            low = scale * distance * rng.normal(size=3)
            points = low + scale * rng.random((50, 3))
            offset = storage_offset(points.min(axis=0), points.max(axis=0))
            assert_array_equal(offset.astype(np.float32), offset, err_msg="what Blender stores exactly")
            stored = (points - offset).astype(np.float32).astype(np.float64) + offset
            assert np.abs(stored - points).max() <= 1e-6 * np.linalg.norm(np.ptp(points, axis=0)) + 4e-16 * np.abs(points).max()


def test_offsets_are_round_numbers():
    assert storage_offset(np.array([2_682_999.0, 1_246_999.0, 449.0]), np.array([2_683_001.2, 1_247_001.1, 451.3])).tolist() == [
        2_683_000.0,
        1_247_000.0,
        450.0,
    ]
