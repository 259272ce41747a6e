"""Archives that would fill the memory, or never end, are refused before they are read."""

import io
import os
import struct
import sys
import zipfile

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from refmesh_addon.io.files import read_npz
from refmesh_addon.io.npz_reader import loaded_arrays


def archive(**members):
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as written:
        for name, data in members.items():
            written.writestr(f"{name}.npy", data)
    return file


def npy(array):
    file = io.BytesIO()
    np.save(file, array)
    return file.getvalue()


def test_arrays_come_back_all_or_some_in_either_order_of_memory():
    arrays = {"a": np.arange(12.0).reshape(3, 4), "b": np.asfortranarray(np.arange(6).reshape(2, 3)), "c": np.array(2.5)}
    file = io.BytesIO()
    np.savez(file, **arrays)
    for names in (None, ["b"]):
        for name, array in loaded_arrays(file, names).items():
            assert_array_equal(array, arrays[name])
            assert array.flags.f_contiguous == arrays[name].flags.f_contiguous and array.dtype == arrays[name].dtype
    with pytest.raises(ValueError, match="KeyError"):
        loaded_arrays(file, ["d"])


def test_a_compressed_archive_is_refused_before_it_is_unpacked():
    file = io.BytesIO()
    np.savez_compressed(file, a=np.zeros(10_000_000))
    with pytest.raises(ValueError, match="compressed"):
        loaded_arrays(file)


def test_members_that_share_their_bytes_are_refused():
    file = archive(a=npy(np.zeros(1000)))
    data = file.getvalue()
    start, end, count = data.index(b"PK\1\2"), data.index(b"PK\5\6"), 16
    directory = b"".join(data[start:end].replace(b"a.npy", f"{index:x}.npy".encode()) for index in range(count))
    tail = data[end : end + 8] + struct.pack("<HHII", count, count, len(directory), start) + data[end + 20 :]
    with pytest.raises(ValueError, match="declares more"):
        loaded_arrays(io.BytesIO(data[:start] + directory + tail))


@pytest.mark.parametrize("shape", [(10**12,), (2,), (3, 10**9)])
def test_an_array_of_another_size_than_declared_is_refused(shape):
    head = io.BytesIO()
    np.lib.format.write_array_header_1_0(head, {"descr": "<f8", "fortran_order": False, "shape": shape})
    with pytest.raises(ValueError):
        loaded_arrays(archive(a=head.getvalue() + bytes(24)))


def test_pickled_objects_are_refused():
    with pytest.raises(ValueError):
        loaded_arrays(archive(a=npy(np.array([{}], dtype=object))))


@pytest.mark.skipif(sys.platform == "win32", reason="no named pipes in folders")
def test_a_pipe_in_the_place_of_a_file_is_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "a.npz")
    with pytest.raises(OSError, match="not a regular file"):
        read_npz(tmp_path / "a.npz")
