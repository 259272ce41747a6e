import json
import os
import zipfile

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.io.files import PARTIAL_SUFFIX, atomic_file, output_folder, read_npz, write_json, write_npz


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_a_file_appears_whole_at_the_end(tmp_path):
    path = tmp_path / "a.bin"
    path.write_bytes(b"old")
    with atomic_file(path) as file:
        file.write(b"new" * 100_000)
        file.flush()
        assert path.read_bytes() == b"old"
    assert path.read_bytes() == b"new" * 100_000
    assert names(tmp_path) == ["a.bin"]


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path, error):
    path = tmp_path / "a.bin"
    path.write_bytes(b"old")
    with pytest.raises(error), atomic_file(path) as file:
        file.write(b"half")
        raise error
    assert path.read_bytes() == b"old"
    assert names(tmp_path) == ["a.bin"]


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="there is no /dev/full here to stand for a full disk")
def test_a_full_disk_is_told_by_name(tmp_path):
    with open("/dev/full", "wb", buffering=0) as full, pytest.raises(RefMeshError, match=r"a\.bin: cannot be written \(No space left"):
        with atomic_file(tmp_path / "a.bin"):
            full.write(b"x")
    assert names(tmp_path) == []


def test_a_folder_that_cannot_be_made_is_refused_by_name(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(RefMeshError, match=r"file/out: the output folder cannot be written to"):
        output_folder(tmp_path / "file" / "out")
    with pytest.raises(RefMeshError, match=r"cannot be written"), atomic_file(tmp_path / "gone" / "a.bin"):
        pass


def test_an_output_folder_loses_only_partial_files(tmp_path):
    folder = output_folder(tmp_path / "a" / "b")
    (folder / ("x.npz" + PARTIAL_SUFFIX)).touch()
    (folder / "x.npz").touch()
    assert names(output_folder(folder)) == ["x.npz"]


def test_npz_gives_back_what_it_took_in_the_same_bytes(tmp_path):
    arrays = {
        "positions": np.random.default_rng(0).random((4, 5, 3)),
        "frames": np.arange(4),
        "share": np.float64(0.25),
        "none": np.empty((0, 3)),
    }
    write_npz(tmp_path / "a.npz", arrays)
    back = read_npz(tmp_path / "a.npz")
    assert back.keys() == arrays.keys()
    for name, array in arrays.items():
        assert_array_equal(back[name], array)
        assert back[name].dtype == np.asarray(array).dtype
    write_npz(tmp_path / "b.npz", back)
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()
    with zipfile.ZipFile(tmp_path / "a.npz") as archive:
        assert {entry.date_time[0] for entry in archive.infolist()} == {1980}, "no clock in the bytes"


def test_json_keeps_order_and_takes_numpy(tmp_path):
    data = {"z": np.float32(0.5), "a": np.arange(3), "path": tmp_path, "message": "Füße"}
    write_json(tmp_path / "a.json", data)
    text = (tmp_path / "a.json").read_text(encoding="utf-8")
    assert list(json.loads(text).items()) == [("z", 0.5), ("a", [0, 1, 2]), ("path", str(tmp_path)), ("message", "Füße")]
    assert "Füße" in text


@pytest.mark.parametrize("value", [float("nan"), np.float64("inf"), object()])
def test_json_refuses_what_it_cannot_hold(tmp_path, value):
    with pytest.raises((ValueError, TypeError)):
        write_json(tmp_path / "a.json", {"x": value})
    assert names(tmp_path) == []


def test_what_a_killed_exporter_left_is_removed_and_links_are_not_followed(tmp_path):
    mine = tmp_path / "mine.abc"
    mine.write_bytes(b"mine")
    folder = output_folder(tmp_path / "out")
    (folder / f"ball{PARTIAL_SUFFIX}.abc").symlink_to(mine)
    (folder / f"write-test-{os.getpid()}{PARTIAL_SUFFIX}").symlink_to(mine)
    assert names(output_folder(folder)) == [] and mine.read_bytes() == b"mine"


def test_a_folder_in_the_place_of_a_partial_file_is_an_error_that_names_the_file(tmp_path):
    (tmp_path / f"a.json{PARTIAL_SUFFIX}").mkdir()
    with pytest.raises(RefMeshError, match="a.json: cannot be written"):
        write_json(tmp_path / "a.json", {})
