"""Frames as captured: what is put right, what is told, and what is refused by name."""

import os
from pathlib import Path

import numpy as np
import pytest
import trimesh
from numpy.testing import assert_allclose, assert_array_equal

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.core.geometry.mesh import is_watertight, signed_volume
from refmesh_addon.core.settings import TrackingSettings
from refmesh_addon.io.discovery import find_sequence
from refmesh_addon.pipeline.session.cache import Cache
from refmesh_addon.pipeline.session.frames import FRAMES_IN_MEMORY, Frames, read_frames
from refmesh_addon.pipeline.session.part import Part
from refmesh_addon.pipeline.session.session import Session
from refmesh_addon.pipeline.session.stage_share import StageShare

from ..running import shared_workers


def ball(radius=1.0, shift=0.0):
    return trimesh.creation.icosphere(2, radius).apply_translation([shift, 0, 0])


class Take:
    """A folder of frames and what opening them says."""

    def __init__(self, folder: Path, *meshes):
        self.source, self.folder = folder / "in", folder
        self.source.mkdir()
        for number, mesh in enumerate(meshes, 1):
            mesh.export(self.path(number))
        self.warnings: list[str] = []
        self.progress: list[tuple[int, float]] = []

    def path(self, number: int) -> Path:
        return self.source / f"take_{number:03d}.obj"

    def open(self, part: Part | None = None) -> Frames:
        note = lambda stage, number, share, skipped=False: self.progress.append((number, share))
        session = Session(self.folder, Cache(self.folder / "cache"), shared_workers(), note, part=part)
        return read_frames(session, find_sequence(self.source), StageShare("tracking"), self.warnings.append, TrackingSettings())[0]

    def written(self) -> dict[str, int]:
        return {path.name: path.stat().st_mtime_ns for path in (self.folder / "cache" / "frames").glob("*.npz")}


def test_seams_are_merged_and_nothing_else_changes(tmp_path):
    seams = ball()
    seams = trimesh.Trimesh(seams.vertices[seams.faces.ravel()], np.arange(3 * len(seams.faces)).reshape(-1, 3), process=False)
    frames = Take(tmp_path, seams).open()
    assert len(frames.mesh(0).vertices) == len(ball().vertices)
    assert is_watertight(frames.mesh(0))
    assert_allclose(signed_volume(frames.mesh(0)), ball().volume, rtol=1e-5)


def test_all_unusable_frames_are_named_with_the_option_that_leaves_them_out(tmp_path):
    take = Take(tmp_path, *(ball() for _ in range(6)))
    take.path(3).write_text("v 0 0 0")
    with pytest.raises(RefMeshError, match=r"take_003.obj: holds no triangles; .* Export this frame again, .* --frames 1-2,4-6: "):
        take.open()
    take.path(5).write_bytes(b"")
    with pytest.raises(RefMeshError, match=r"^2 of 6 frames cannot be used: 3, 5; .* --frames 1-2,4,6: .*take_003.obj: holds no triangles"):
        take.open()
    with pytest.raises(RefMeshError, match=r"^2 of 6 frames cannot be used"):
        take.open(Part(StageShare("tracking"), 1, 1))
    assert len(take.written()) == 5, "the others are read already when the run is repeated"
    for number in range(1, 7):
        take.path(number).write_bytes(b"")
    with pytest.raises(RefMeshError, match=r"take_001.obj: the file is empty; none of the 6 frames can be used"):
        take.open()


def test_bodies_are_closed_and_meshes_are_as_captured(tmp_path):
    open_ball = ball()
    open_ball.update_faces(open_ball.triangles_center[:, 2] < 0.7)
    frames = Take(tmp_path, open_ball).open()
    mesh, body = frames.mesh(0), frames.body(0)
    assert not is_watertight(mesh) and is_watertight(body)
    assert_array_equal(body.triangles[: len(mesh.triangles)], mesh.triangles)


def test_specks_are_captured_but_no_part_of_the_body(tmp_path):
    speck = ball(0.02, 1.2)
    frames = Take(tmp_path, trimesh.util.concatenate([ball(), speck])).open()
    assert len(frames.mesh(0).vertices) == len(ball().vertices) + len(speck.vertices)
    assert len(frames.surface(0).vertices) == len(frames.body(0).vertices) == len(ball().vertices)


def test_seams_open_by_a_hair_are_closed(tmp_path):
    corners = ball().triangles.reshape(-1, 3)
    moved = corners + np.random.default_rng(0).uniform(-1e-5, 1e-5, corners.shape)
    frames = Take(tmp_path, trimesh.Trimesh(moved, np.arange(len(corners)).reshape(-1, 3), process=False)).open()
    assert is_watertight(frames.mesh(0))


def test_an_inside_out_frame_is_turned_round_and_named(tmp_path):
    inside_out = ball(shift=0.1)
    inside_out.invert()
    take = Take(tmp_path, ball(), inside_out, ball())
    frames = take.open()
    assert all(signed_volume(frames.mesh(index)) > 0 for index in range(3))
    assert len(take.warnings) == 1
    assert str(take.path(2)) in take.warnings[0] and "inside out" in take.warnings[0]


@pytest.mark.parametrize("factor", [0.1, 10.0, 1000.0])
def test_a_jump_of_the_scale_is_refused_by_name_with_figures(tmp_path, factor):
    take = Take(tmp_path, ball(), ball(), ball(factor), ball())
    with pytest.raises(RefMeshError, match="one unit") as caught:
        take.open()
    assert str(take.path(3)) in str(caught.value)
    assert f"{factor * np.sqrt(12):.4g} across where the others have about {np.sqrt(12):.4g}" in str(caught.value)


def test_sizes_that_bodies_reach_when_others_come_and_go_are_taken(tmp_path):
    frames = Take(tmp_path, ball(), trimesh.util.concatenate([ball(), ball(shift=6.0)]), ball(0.5)).open()
    assert_allclose(frames.diagonals, [np.sqrt(12), np.sqrt(8 * 8 + 8), np.sqrt(3)], rtol=0.02)


def test_the_diagonal_is_that_of_the_whole_take(tmp_path):
    frames = Take(tmp_path, ball(), ball(shift=3.0)).open()
    assert frames.diagonal == pytest.approx(np.sqrt(5**2 + 8), rel=0.02)


@pytest.mark.parametrize("shift", [0.0, 1e6])
def test_coordinates_keep_their_digits(tmp_path, shift):
    mesh = Take(tmp_path, ball(shift=shift)).open().mesh(0)
    assert_allclose(np.ptp(mesh.vertices, axis=0), np.ptp(ball().vertices, axis=0), atol=1e-6)


def test_frames_are_read_once_and_only_changed_files_again(tmp_path):
    take = Take(tmp_path, ball(), ball(shift=0.1), ball(shift=0.2))
    keys, written = take.open().keys, take.written()
    assert take.open().keys == keys
    assert take.written() == written
    ball(shift=0.15).export(take.path(2))
    changed, after = take.open(), take.written()
    assert [old == new for old, new in zip(keys, changed.keys)] == [True, False, True]
    assert len(set(after.items()) - set(written.items())) == 1
    assert changed.mesh(1).vertices[:, 0].mean() == pytest.approx(0.15, abs=1e-6)


def test_equal_files_have_equal_keys_wherever_they_are(tmp_path):
    keys = []
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        keys.append(Take(tmp_path / name, ball(), ball(shift=0.1)).open().keys)
    assert keys[0] == keys[1]
    assert len(set(keys[0])) == 2


def test_every_frame_is_announced(tmp_path):
    take = Take(tmp_path, ball(), ball(), ball())
    take.open()
    announced = {number: share for number, share in take.progress if number is not None}
    assert set(announced) == {1, 2, 3}
    assert sorted(announced.values()) == pytest.approx([1 / 3, 2 / 3, 1])


def test_few_meshes_are_held_in_memory(tmp_path):
    frames = Take(tmp_path, *[ball(shift=0.01 * k) for k in range(FRAMES_IN_MEMORY + 3)]).open()
    first = frames.mesh(0)
    assert frames.mesh(0) is first
    for index in range(len(frames)):
        frames.mesh(index)
    assert frames.mesh(0) is not first


def test_a_copy_that_disappears_during_the_run_is_told(tmp_path):
    take = Take(tmp_path, ball(), ball(shift=0.1))
    frames = take.open()
    for path in (tmp_path / "cache").rglob("*.npz"):
        os.unlink(path)
    with pytest.raises(RefMeshError, match="start the run again") as caught:
        frames.mesh(0)
    assert str(take.path(1)) in str(caught.value)


def test_a_frame_from_the_cache_is_named_again(tmp_path):
    inside_out = ball(shift=0.1)
    inside_out.invert()
    take = Take(tmp_path, ball(), inside_out)
    take.open()
    take.open()
    assert len(take.warnings) == 2 and take.warnings[0] == take.warnings[1]


@pytest.mark.parametrize("part", ["a patch", "a body"])
def test_what_faces_inward_is_turned_round(tmp_path, part):
    body = trimesh.util.concatenate([ball(), ball(0.5, 3.0)])
    faces = body.faces.copy()
    chosen = body.triangles_center[:, 0] > 2.0 if part == "a body" else body.triangles_center[:, 2] > 0.6
    faces[chosen] = faces[chosen][:, ::-1]
    take = Take(tmp_path, body, trimesh.Trimesh(body.vertices, faces, process=False))
    frames = take.open()
    assert_allclose(signed_volume(frames.mesh(1)), signed_volume(frames.mesh(0)), rtol=1e-6)
    assert is_watertight(frames.body(1))
    assert len(take.warnings) == (part == "a body")
