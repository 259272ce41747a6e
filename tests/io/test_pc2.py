import struct

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.io.pc2 import pc2_shape, read_pc2, write_pc2

SAMPLES = np.random.default_rng(0).normal(size=(4, 7, 3))


@pytest.fixture
def cache(tmp_path):
    write_pc2(tmp_path / "a.pc2", iter(SAMPLES), points=7, count=4)
    return tmp_path / "a.pc2"


def test_samples_come_back_as_float32(cache):
    assert pc2_shape(cache) == (4, 7)
    assert_array_equal(np.stack(list(read_pc2(cache))), SAMPLES.astype(np.float32))


def test_bytes_are_those_of_the_format(cache):
    data = cache.read_bytes()
    assert struct.unpack("<12siiffi", data[:32]) == (b"POINTCACHE2\0", 1, 7, 0.0, 1.0, 4)
    assert_array_equal(np.frombuffer(data[32:], "<f4"), SAMPLES.astype("<f4").ravel())


def test_samples_are_taken_one_at_a_time(tmp_path):
    partial = tmp_path / "a.pc2.refmesh-partial"

    def samples():
        for index in range(50):
            yield np.zeros((10_000, 3))
            assert partial.stat().st_size >= 120_000 * index, "the sample before is on its way to the disk"

    write_pc2(tmp_path / "a.pc2", samples(), points=10_000, count=50)
    assert pc2_shape(tmp_path / "a.pc2") == (50, 10_000)


@pytest.mark.parametrize(
    ("points", "count", "message"), [(6, 4, r"sample 0 must be \(6, 3\)"), (7, 5, "count is 5, but 4"), (7, 3, "count is 3, but 4")]
)
def test_samples_that_are_not_as_declared_are_refused(tmp_path, points, count, message):
    with pytest.raises(ValueError, match=message):
        write_pc2(tmp_path / "a.pc2", iter(SAMPLES), points, count)
    assert not list(tmp_path.iterdir())


def test_a_broken_cache_is_refused_by_name(cache):
    data = cache.read_bytes()
    truncated, foreign = "is truncated", "is not a PC2"
    for broken, message in ((data[:-1], truncated), (data[:20], foreign), (b"PNG" + data[3:], foreign), (data + b"\0", truncated)):
        cache.write_bytes(broken)
        with pytest.raises(RefMeshError, match=rf"a\.pc2: .*{message}"):
            pc2_shape(cache)
    cache.unlink()
    with pytest.raises(RefMeshError, match="cannot be read"):
        list(read_pc2(cache))
