"""Edits between two runs: what they ask for, and that only what depends on them is computed again."""

from __future__ import annotations

import json
from pathlib import Path

import bpy
import pytest

from refmesh_addon.bridge.results.status import step_status
from refmesh_addon.core.settings import STAGES

from .test_jobs import TINY


def test_the_shown_frame_is_left_out(blender, ball):
    for scene_frame, remaining in ((7, "6,8-11"), (9, "6,10-11"), (11, "6,10")):
        blender.context.scene.frame_set(scene_frame)
        blender.ops.refmesh.exclude_frame()
        assert ball.refmesh.frame_selection == remaining
    ball.refmesh.frame_selection = "10"
    with pytest.raises(RuntimeError, match="the only one left"):
        blender.context.scene.frame_set(10)
        blender.ops.refmesh.exclude_frame()


def test_groups_begin_where_their_markers_are_dragged(blender, solved):
    markers = blender.context.scene.timeline_markers
    next(marker for marker in markers if marker.frame == 10).frame = 8
    blender.ops.refmesh.edit_groups(change="MARKERS")
    assert solved.refmesh.settings.group_starts == "6,8"
    assert [step_status(solved.refmesh, stage).kind for stage in STAGES[:4]] == ["current", "stale", "stale", "stale"]


def test_groups_are_split_and_joined_at_the_shown_frame(blender, solved):
    for change, scene_frame, starts in (("SPLIT", 7, "6,7,10"), ("JOIN", 11, "6,7"), ("JOIN", 7, "6")):
        blender.context.scene.frame_set(scene_frame)
        blender.ops.refmesh.edit_groups(change=change)
        assert solved.refmesh.settings.group_starts == starts
    with pytest.raises(RuntimeError, match="this is the first group"):
        blender.ops.refmesh.edit_groups(change="JOIN")


@pytest.mark.parametrize("change, scene_frame", [("SPLIT", 10), ("SPLIT", 6), ("MARKERS", 7)])
def test_a_change_that_changes_nothing_leaves_the_settings_alone(blender, solved, change, scene_frame):
    blender.context.scene.frame_set(scene_frame)
    blender.ops.refmesh.edit_groups(change=change)
    assert solved.refmesh.settings.group_starts == ""
    assert [step_status(solved.refmesh, stage).kind for stage in STAGES[:4]] == ["current"] * 4


def test_groups_need_a_reference_step(blender, ball):
    with pytest.raises(RuntimeError, match="run the Reference step first"):
        blender.ops.refmesh.edit_groups(change="MARKERS")


def test_only_the_groups_that_changed_are_made_again(ball, tmp_path):
    output = tmp_path / "out"
    bpy.ops.refmesh.run_all(output=str(output), quiet=True, **TINY | {"group_starts": "7,8"})
    before = _made(output)
    bpy.ops.refmesh.run_all(quiet=True, group_starts="7,10")
    report = json.loads((output / "report.json").read_text())
    assert [group["frames"] for group in report["groups"]] == [[6], [7, 8], [10, 11]]
    after = _made(output)
    assert {name for name in before if after.get(name) == before[name]} >= {"mesh_0006", "centers_0006", "frame_0006"}
    assert before["mesh_0007"] != after["mesh_0007"]


def _made(output: Path) -> dict[str, tuple[str, int]]:
    """Name of each cached result of the groups -> its key and the time when it was made."""
    cached = [path for stage in ("reference", "deformation", "tracking") for path in (output / "cache" / stage).glob("*.npz")]
    return {path.stem.rpartition("-")[0]: (path.name, path.stat().st_mtime_ns) for path in cached}


@pytest.mark.parametrize("starts, message", [("9", "'9' is not a frame of the job, which has 6-8, 10-11"), ("six", "'six' is not a frame")])
def test_groups_that_begin_nowhere_are_refused(ball, tmp_path, starts, message):
    with pytest.raises(RuntimeError, match=message):
        bpy.ops.refmesh.run_all(output=str(tmp_path / "out"), quiet=True, **TINY | {"group_starts": starts})
