"""Frames in memory and in the binary cache: bounded, current, and the same as the files."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.core.types import TriangleMesh
from refmesh_addon.io.files import read_npz, write_npz
from refmesh_addon.io.frame_store import FrameStore
from refmesh_addon.io.meshes import read_mesh
from refmesh_addon.io.ply import write_ply
from refmesh_addon.io.preview import PREVIEW_FOLDER, PreviewMesh, preview_path, read_preview, remove_other_previews
from refmesh_addon.io.source_colors import SourceColors

from ..core.shapes import ball

PLENTY = 2**30


@pytest.fixture
def frames(tmp_path) -> list[Path]:
    paths = [tmp_path / f"scan_{number}.ply" for number in range(3)]
    for number, path in enumerate(paths):
        sphere = ball(1)
        write_ply(path, TriangleMesh(sphere.vertices + number, sphere.triangles))
    return paths


@pytest.fixture
def output(tmp_path) -> Path:
    """An output folder that a job has made."""
    (tmp_path / "out" / PREVIEW_FOLDER).mkdir(parents=True)
    return tmp_path / "out"


def written(frame: Path, output: Path) -> Path:
    """The entry of a frame, as a job writes it."""
    entry = preview_path(output, frame)
    write_npz(entry, vars(PreviewMesh.of(read_mesh(frame))))
    return entry


def make_indices_wrong(entry: Path) -> None:
    arrays = read_npz(entry)
    write_npz(entry, {**arrays, "triangles": arrays["triangles"] + 1})


def test_least_recently_used_goes_first(frames, output):
    size = PreviewMesh.of(read_mesh(frames[0])).nbytes
    store = FrameStore(2 * size)
    first, second = store.read(frames[0], output), store.read(frames[1], output)
    assert store.read(frames[0], output) is first
    store.read(frames[2], output)
    assert store.read(frames[0], output) is first and store.read(frames[1], output) is not second


def test_a_smaller_budget_holds_at_once_and_the_last_frame_stays(frames, output):
    store = FrameStore(PLENTY)
    held = [store.read(path, output) for path in frames]
    store.set_budget(0)
    assert store.read(frames[2], output) is held[2] and store.read(frames[0], output) is not held[0]


def test_a_file_that_was_written_again_is_read_again(frames, output):
    store = FrameStore(PLENTY)
    before = store.read(frames[0], output)
    frames[0].write_bytes(frames[1].read_bytes())
    os.utime(frames[0], ns=(0, 0))
    assert not np.array_equal(store.read(frames[0], output).vertices, before.vertices)


def test_cache_gives_what_the_file_holds_and_the_file_is_not_parsed_again(frames, output):
    before = FrameStore(PLENTY).read(frames[0], output)
    written(frames[0], output)
    again = FrameStore(PLENTY, parse=None).read(frames[0], output)
    for name in ("vertices", "triangles", "edges", "triangle_edges"):
        np.testing.assert_array_equal(getattr(again, name), getattr(before, name))


@pytest.mark.parametrize("damage", [lambda path: path.write_bytes(b"PK"), lambda path: path.unlink(), make_indices_wrong])
def test_a_broken_entry_is_passed_over(frames, output, damage):
    entry = written(frames[0], output)
    damage(entry)
    assert read_preview(entry) is None
    assert len(FrameStore(PLENTY).read(frames[0], output).vertices) == len(read_mesh(frames[0]).vertices)


def test_a_file_of_the_same_size_and_time_in_the_place_of_another_is_read_again(frames, output):
    written(frames[0], output)
    store, times = FrameStore(PLENTY), frames[0].stat()
    before = store.read(frames[0], output)
    other = frames[1].read_bytes()
    assert len(other) == times.st_size
    frames[0].write_bytes(other)
    os.utime(frames[0], ns=(times.st_atime_ns, times.st_mtime_ns))
    assert not np.array_equal(store.read(frames[0], output).vertices, before.vertices)
    assert not np.array_equal(FrameStore(PLENTY).read(frames[0], output).vertices, before.vertices)


def test_viewing_writes_nothing(frames, output):
    before = sorted(output.rglob("*"))
    FrameStore(PLENTY).read(frames[0], output)
    assert sorted(output.rglob("*")) == before


def test_without_an_output_folder_nothing_is_written(frames, tmp_path):
    FrameStore(PLENTY).read(frames[0], tmp_path / "none")
    assert not (tmp_path / "none").exists()


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(RefMeshError, match="gone.ply: cannot be read"):
        FrameStore(PLENTY).read(tmp_path / "gone.ply", tmp_path)


def test_edges_are_those_of_the_triangles():
    sphere = ball(2)
    mesh = PreviewMesh.of(sphere)
    assert len(mesh.edges) == len(np.unique(np.sort(mesh.edges, axis=1), axis=0)) == len(sphere.vertices) + len(sphere.triangles) - 2
    for corner in range(3):
        expected = np.sort(mesh.triangles[:, [corner, (corner + 1) % 3]], axis=1)
        np.testing.assert_array_equal(np.sort(mesh.edges[mesh.triangle_edges[:, corner]], axis=1), expected)


def test_collapsed_triangles_leave_the_edges_to_blender():
    mesh = PreviewMesh.of(TriangleMesh(np.eye(3), np.array([[0, 1, 2], [0, 0, 1]])))
    assert len(mesh.triangles) == 2 and not len(mesh.edges)


def test_only_wanted_entries_stay(frames, output):
    entries = [preview_path(output, path) for path in frames]
    for path in frames:
        written(path, output)
    remove_other_previews(output, entries[:1])
    assert list((output / PREVIEW_FOLDER).iterdir()) == entries[:1]


def test_colors_count_toward_the_budget_and_are_read_anew_after_a_change(frames, output):
    read = []

    def colors(path: Path) -> SourceColors:
        read.append(path.name)
        return SourceColors(np.zeros((1000, 3, 2), np.float32), np.zeros(1000, np.int32), np.zeros((1000, 3, 3), np.uint8), ())

    size = colors(frames[0]).nbytes
    read.clear()
    store = FrameStore(2 * size)
    for path in (frames[0], frames[1], frames[0], frames[2], frames[0], frames[1]):
        store.read_colors(path, colors)
    assert read == ["scan_0.ply", "scan_1.ply", "scan_2.ply", "scan_1.ply"]
    os.utime(frames[1], ns=(1, 1))
    store.read_colors(frames[1], colors)
    assert read[4:] == ["scan_1.ply"]
    store.set_budget(1)
    assert len(store._colors) == 1
