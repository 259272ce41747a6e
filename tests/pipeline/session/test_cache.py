import os

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from refmesh_addon.core.arrays import to_arrays
from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.core.types import TriangleMesh
from refmesh_addon.pipeline.session.cache import Cache, digest

KEY, OTHER = digest("a"), digest("b")


class Maker:
    """Counts how often it is asked."""

    def __init__(self, value=1.0):
        self.calls, self.value = 0, value

    def __call__(self):
        self.calls += 1
        return {"x": np.full((3, 2), self.value)}


def names(folder):
    return sorted(path.name for path in folder.rglob("*") if path.is_file())


def test_an_entry_is_made_once_and_found_by_the_next_run(tmp_path):
    make = Maker()
    for _ in range(2):
        assert_array_equal(Cache(tmp_path).load_or_make("centers", KEY, make)["x"], np.full((3, 2), 1.0))
    assert make.calls == 1
    assert names(tmp_path) == [f"centers-{KEY[:12]}.npz"]


def test_another_key_is_made_again_and_replaces_its_siblings_only(tmp_path):
    cache = Cache(tmp_path)
    for name in ("group_1", "group_10", "group_1-fit", "a/group_1"):
        cache.load_or_make(name, KEY, Maker())
    make = Maker(2.0)
    assert cache.load_or_make("group_1", OTHER, make)["x"][0, 0] == 2.0
    assert make.calls == 1
    assert cache.load("group_1", KEY) is None
    for name in ("group_10", "group_1-fit", "a/group_1"):
        assert cache.load(name, KEY) is not None


def test_stale_siblings_go_only_when_the_new_entry_is_whole(tmp_path):
    cache = Cache(tmp_path)
    cache.save("centers", KEY, Maker()())

    def fail():
        raise RuntimeError

    with pytest.raises(RuntimeError):
        cache.load_or_make("centers", OTHER, fail)
    assert cache.load("centers", KEY) is not None


@pytest.mark.parametrize("length", [0, 1, 100, -1, -30])
def test_a_cut_off_entry_is_made_again(tmp_path, length):
    cache = Cache(tmp_path)
    cache.save("centers", KEY, Maker()())
    whole = cache.path("centers", KEY).read_bytes()
    cache.path("centers", KEY).write_bytes(whole[:length])
    make = Maker()
    cache.load_or_make("centers", KEY, make)
    assert make.calls == 1
    assert cache.path("centers", KEY).read_bytes() == whole, "the same bytes as before"


def test_an_entry_with_changed_bytes_is_made_again(tmp_path):
    cache = Cache(tmp_path)
    cache.save("centers", KEY, {"x": np.arange(1000.0)})
    data = bytearray(cache.path("centers", KEY).read_bytes())
    data[4000] ^= 1
    cache.path("centers", KEY).write_bytes(data)
    assert cache.load("centers", KEY) is None


def test_without_resume_only_what_this_run_made_is_used(tmp_path):
    Cache(tmp_path).save("centers", KEY, Maker(1.0)())
    cache, make = Cache(tmp_path, resume=False), Maker(2.0)
    for _ in range(2):
        assert cache.load_or_make("centers", KEY, make)["x"][0, 0] == 2.0
    assert make.calls == 1


def test_frames_are_kept_one_by_one_in_a_folder_of_their_own(tmp_path):
    cache = Cache(tmp_path)
    for number in (6, 7, 8):
        cache.save(f"tracking/frame_{number:04d}", digest("tracking", number), {"centers": np.full((4, 3), number)})
    again = Cache(tmp_path)
    assert again.load("tracking/frame_0007", digest("tracking", 7))["centers"][0, 0] == 7
    assert again.load("tracking/frame_0009", digest("tracking", 9)) is None


def test_made_and_loaded_arrays_have_the_same_layout(tmp_path):
    cache = Cache(tmp_path)
    square = np.arange(12.0).reshape(3, 4)
    made = cache.load_or_make("a", KEY, lambda: {"turned": square.T, "part": square[:, ::2], "scalar": 3.5})
    loaded = cache.load("a", KEY)
    for name, array in made.items():
        assert_array_equal(array, loaded[name])
        assert (array.strides, array.dtype) == (loaded[name].strides, loaded[name].dtype)


def test_leftovers_of_a_killed_run_are_cleared(tmp_path):
    cache = Cache(tmp_path)
    cache.save("tracking/frame_0001", KEY, Maker()())
    for folder in (tmp_path, tmp_path / "tracking"):
        (folder / "x.npz.refmesh-partial").touch()
    again = Cache(tmp_path)
    again.save("tracking/frame_0002", KEY, Maker()())
    assert not [name for name in names(tmp_path) if name.endswith("partial")]


def test_keys_depend_on_every_part_and_its_place_but_not_on_the_order_of_names():
    parts = [
        digest("ab", "c"),
        digest("a", "bc"),
        digest("abc"),
        digest("c", "ab"),
        digest(b"abc"),
        digest(["ab", "c"]),
        digest(1),
        digest(1.5),
        digest("1"),
    ]
    assert len(set(parts)) == len(parts)
    assert digest({"a": 1, "b": [2, 3]}) == digest({"b": [2, 3], "a": 1})


def test_a_damaged_entry_is_made_again_with_one_warning(tmp_path):
    Cache(tmp_path).save("centers", KEY, Maker()())
    path = Cache(tmp_path).path("centers", KEY)
    whole = path.read_bytes()
    path.write_bytes(whole.replace(b"(3, 2)", b"(1, 2)"))
    said, make = [], Maker()
    cache = Cache(tmp_path, warn=said.append)
    assert cache.load("centers", KEY) is None
    for _ in range(2):
        assert_array_equal(cache.load_or_make("centers", KEY, make)["x"], np.full((3, 2), 1.0))
    assert make.calls == 1 and len(said) == 1 and str(path) in said[0]
    assert path.read_bytes() == whole


def test_an_entry_renamed_to_another_is_made_again(tmp_path):
    cache = Cache(tmp_path)
    cache.save("tracking/frame_0001", KEY, Maker(1.0)())
    cache.path("tracking/frame_0001", KEY).rename(cache.path("tracking/frame_0002", KEY))
    assert cache.load("tracking/frame_0002", KEY) is None


def test_a_missing_entry_is_no_reason_for_a_warning(tmp_path):
    said = []
    Cache(tmp_path, warn=said.append).load_or_make("centers", KEY, Maker())
    assert not said


@pytest.mark.parametrize(
    "wrong",
    [
        {"vertices": np.zeros((3, 3), np.float32)},
        {"triangles": np.array([[0, 1, 3]], np.int32)},
        {"triangles": np.array([0, 1, 2], np.int32)},
        {"more": np.zeros(2)},
    ],
)
def test_an_entry_of_other_names_shapes_or_types_is_made_again_with_a_warning(tmp_path, wrong):
    mesh = TriangleMesh(np.eye(3), [[0, 1, 2]])
    Cache(tmp_path).save("mesh", KEY, {**to_arrays(mesh), **wrong})  # with the right checksum
    said = []
    cache = Cache(tmp_path, warn=said.append)
    assert cache.load_result("mesh", KEY, TriangleMesh) is None
    assert_array_equal(cache.load_or_make_result("mesh", KEY, TriangleMesh, lambda: mesh).vertices, mesh.vertices)
    assert len(said) == 1 and next(iter(wrong)) in said[0]
    assert Cache(tmp_path).load_result("mesh", KEY, TriangleMesh) is not None


def test_a_table_of_other_shapes_is_made_again_with_a_warning(tmp_path):
    Cache(tmp_path).save("centers", KEY, {"x": np.zeros((3, 3))})
    said, make = [], Maker()
    assert Cache(tmp_path, warn=said.append).load_or_make("centers", KEY, make, {"x": "(N, 2) float64"})["x"].shape == (3, 2)
    assert make.calls == 1 and len(said) == 1


def test_a_folder_in_the_place_of_an_old_entry_stays_and_one_in_the_place_of_an_entry_is_named(tmp_path):
    cache = Cache(tmp_path)
    for key in (KEY, OTHER):
        cache.path("centers", key).mkdir()
    assert cache.load("centers", KEY) is None
    with pytest.raises(RefMeshError, match="centers-.*cannot be written"):
        cache.save("centers", KEY, Maker()())
    cache.path("centers", KEY).rmdir()
    cache.save("centers", KEY, Maker()())
    assert cache.load("centers", KEY) is not None and cache.path("centers", OTHER).is_dir()


def test_stale_entries_of_earlier_runs_go_wherever_this_run_writes_and_nowhere_else(tmp_path):
    earlier = Cache(tmp_path)
    for name in ("tracking/frame_0001", "tracking/frame_0002", "reference/mesh_0001"):
        earlier.save(name, OTHER, Maker()())
    cache = Cache(tmp_path)
    for key in (KEY, digest("c"), KEY):  # the last one has been there before
        cache.save("tracking/frame_0001", key, Maker()())
    kept = [cache.path("tracking/frame_0001", KEY), *(earlier.path(name, OTHER) for name in ("tracking/frame_0002", "reference/mesh_0001"))]
    assert sorted(path for path in tmp_path.rglob("*.npz")) == sorted(kept)


def test_a_folder_is_listed_once_however_many_entries_are_saved(tmp_path, monkeypatch):
    listed = []
    real = os.listdir
    monkeypatch.setattr(os, "listdir", lambda folder: listed.append(folder) or real(folder))
    cache = Cache(tmp_path)
    for number in range(20):
        cache.save(f"tracking/frame_{number:04d}", KEY, Maker()())
    assert listed == [tmp_path / "tracking"]


def test_an_entry_is_read_once_to_see_that_it_is_whole(tmp_path, monkeypatch):
    mesh = TriangleMesh(np.eye(3), [[0, 1, 2]])
    Cache(tmp_path).save_result("mesh", KEY, mesh)
    cache, read = Cache(tmp_path), []
    monkeypatch.setattr(cache, "load", lambda *arguments: read.append(arguments) or Cache.load(cache, *arguments))
    assert [cache.holds_result("mesh", key, TriangleMesh) for key in (KEY, KEY, OTHER)] == [True, True, False]
    assert len(read) == 2
    cache.save_result("mesh", OTHER, mesh)
    assert cache.holds_result("mesh", OTHER, TriangleMesh) and not cache.holds_result("mesh", KEY, TriangleMesh)
