"""Any changed byte of a sealed file is noticed, and it stays an ordinary .npz."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from refmesh_addon.io.files import write_npz
from refmesh_addon.io.sealed_npz import read_sealed, write_sealed

ARRAYS = {"vertices": np.arange(12.0).reshape(4, 3), "triangles": np.array([[0, 1, 2]], np.int32), "empty": np.empty((0, 3))}


def test_arrays_come_back_and_numpy_reads_them_too(tmp_path):
    write_sealed(tmp_path / "a.npz", "a", ARRAYS)
    with np.load(tmp_path / "a.npz") as plain:
        for back in (read_sealed(tmp_path / "a.npz", "a"), plain):
            assert set(back) == set(ARRAYS)
            for name, array in ARRAYS.items():
                assert_array_equal(back[name], array)


def test_the_same_arrays_give_the_same_bytes(tmp_path):
    for name in ("a.npz", "b.npz"):
        write_sealed(tmp_path / name, "same", ARRAYS)
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


def test_every_flipped_bit_is_noticed(tmp_path):
    path = tmp_path / "a.npz"
    write_sealed(path, "a", ARRAYS)
    whole = path.read_bytes()
    for position in range(len(whole)):
        damaged = bytearray(whole)
        damaged[position] ^= 1 << position % 8
        path.write_bytes(damaged)
        with pytest.raises(ValueError, match="damaged"):
            read_sealed(path, "a")


@pytest.mark.parametrize("length", [0, 1, 21, 22, 40, 100, -1, -2, -40])
def test_a_cut_off_file_is_noticed(tmp_path, length):
    path = tmp_path / "a.npz"
    write_sealed(path, "a", ARRAYS)
    path.write_bytes(path.read_bytes()[:length])
    with pytest.raises(ValueError, match="damaged"):
        read_sealed(path, "a")


def test_a_file_in_the_place_of_another_is_noticed(tmp_path):
    write_sealed(tmp_path / "a.npz", "frames/frame_0001", ARRAYS)
    with pytest.raises(ValueError, match="checksum"):
        read_sealed(tmp_path / "a.npz", "frames/frame_0002")


def test_files_of_earlier_versions_are_read_unless_an_array_or_its_shape_is_damaged(tmp_path):
    path = tmp_path / "a.npz"
    write_npz(path, ARRAYS)
    assert_array_equal(read_sealed(path, "a")["vertices"], ARRAYS["vertices"])
    damaged = bytearray(path.read_bytes())
    damaged[damaged.index(b"(4, 3)") + 1] ^= 1  # 5 in place of 4
    path.write_bytes(damaged)
    with pytest.raises(ValueError, match="checksum"):
        read_sealed(path, "a")


def test_a_missing_file_is_no_damage(tmp_path):
    with pytest.raises(FileNotFoundError):
        read_sealed(tmp_path / "a.npz", "a")
