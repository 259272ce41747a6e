"""Frames that come or go after the import: the sequence takes them up, and work on the results stays."""

import shutil

import pytest

from refmesh_addon.bridge.results.status import step_status
from refmesh_addon.bridge.sequence.reload import reload_frames


def names(owner) -> list[str]:
    return [frame.name for frame in owner.refmesh.frames]


def copy(frames, number: int, new: int) -> None:
    shutil.copy(frames / f"ball_{number:04d}.obj", frames / f"ball_{new:04d}.obj")


def test_added_and_deleted_frames_change_the_list_and_a_timeline_that_fitted(blender, solved, frames):
    scene, state = blender.context.scene, solved.refmesh
    deformed = state.groups[0].deformed
    deformed.modifiers.new("Mine", "SUBSURF")
    measured = state.frames["7"].distance
    copy(frames, 11, 12)
    (frames / "ball_0006.obj").unlink()
    assert blender.ops.refmesh.reload_frames() == {"FINISHED"}
    assert names(solved) == ["7", "8", "10", "11", "12"] and state.frames["7"].distance == measured > 0
    assert (scene.frame_start, scene.frame_end) == (7, 12)
    assert state.groups[0].deformed == deformed and "Mine" in deformed.modifiers
    status = step_status(state, "tracking")
    assert status.kind == "stale" and status.text == "out of date: made for frames 6-11, now all"


def test_a_frame_that_fills_a_gap_joins_before_anything_is_computed(blender, ball, frames, tmp_path):
    copy(frames, 8, 9)
    for _ in range(2):  # nothing was computed yet, so nothing can be out of date
        blender.ops.refmesh.reload_frames()
    assert names(ball) == ["6", "7", "8", "9", "10", "11"] and not ball.refmesh.checked
    blender.ops.refmesh.check_sequence(output=str(tmp_path / "out"), quiet=True)
    assert [finding.name for finding in ball.refmesh.findings if "identical" in finding.message] == ["9"]


def test_a_new_first_frame_moves_those_of_a_sequence_that_counts_in_steps(blender, frames, tmp_path):
    (tmp_path / "tens").mkdir()
    for number in (6, 7, 8):
        shutil.copy(frames / f"ball_{number:04d}.obj", tmp_path / "tens" / f"scan_{10 * number}.obj")
    blender.ops.refmesh.import_sequence(filepath=str(tmp_path / "tens"))
    owner = blender.context.active_object
    shutil.copy(frames / "ball_0010.obj", tmp_path / "tens" / "scan_90.obj")
    assert not reload_frames(owner).moved
    shutil.copy(frames / "ball_0010.obj", tmp_path / "tens" / "scan_50.obj")
    assert reload_frames(owner).moved and [frame.scene_frame for frame in owner.refmesh.frames] == [50, 51, 52, 53, 54]


def test_the_current_frame_is_shown_as_it_is_now(blender, ball, frames):
    blender.context.scene.frame_set(8)
    before = len(ball.data.vertices)
    (frames / "ball_0008.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    blender.ops.refmesh.reload_frames()
    assert len(ball.data.vertices) == 3 < before


def test_a_selection_takes_no_frames_that_it_does_not_name(blender, frames):
    blender.ops.refmesh.import_sequence(filepath=str(frames), frames="7-10")
    owner = blender.context.active_object
    copy(frames, 8, 9)
    blender.ops.refmesh.reload_frames()
    assert names(owner) == ["7", "8", "9", "10"]
    owner.refmesh.frame_selection = ""
    blender.ops.refmesh.reload_frames()
    assert names(owner) == ["6", "7", "8", "9", "10", "11"]


def test_a_picked_file_that_is_gone_does_not_matter_but_all_of_them_do(blender, frames):
    blender.ops.refmesh.import_sequence(filepath=str(frames / "ball_0006.obj"))
    owner = blender.context.active_object
    (frames / "ball_0006.obj").unlink()
    blender.ops.refmesh.reload_frames()
    assert names(owner) == ["7", "8", "10", "11"]
    shutil.rmtree(frames)
    with pytest.raises(RuntimeError, match="no such file or folder"):
        blender.ops.refmesh.reload_frames()
    assert names(owner) == ["7", "8", "10", "11"]
