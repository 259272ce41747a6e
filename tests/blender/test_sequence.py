"""Importing a mesh sequence, and the object that shows its frames."""

from __future__ import annotations

import logging

import bpy
import numpy as np
import pytest
import trimesh
from mathutils import Vector

from refmesh_addon.bridge.scene.focus import longest_side
from refmesh_addon.bridge.scene.meshes import read_positions
from refmesh_addon.bridge.scene.timeline import widen_clipping
from refmesh_addon.core.capture.scale import scale_note
from refmesh_addon.io.meshes import read_mesh
from refmesh_addon.operators.sequence_preview import first_frame_size, format_bytes, format_meters, summarize

from .conftest import NUMBERS, read_triangles


def shown(owner) -> np.ndarray:
    """Positions of the evaluated object, as a render would see them."""
    return read_positions(owner.evaluated_get(bpy.context.evaluated_depsgraph_get()).data)


def test_every_scene_frame_shows_the_file_of_its_number(ball, frames):
    for scene_frame, number in [(11, 11), (6, 6), (9, 8), (8, 8), (7, 7), (10, 10), (1, 6), (99, 11)]:
        bpy.context.scene.frame_set(scene_frame)
        expected = read_mesh(frames / f"ball_{number:04d}.obj")
        np.testing.assert_array_equal(shown(ball), expected.vertices.astype(np.float32))
        np.testing.assert_array_equal(read_triangles(ball.data), expected.triangles)


def test_objects_are_named_plainly_in_a_collection_for_each_kind(ball):
    root = ball.refmesh.root
    assert (root.name, ball.name, ball.parent) == ("ball", "ball source", root)
    assert [member.name for member in bpy.data.collections["ball"].objects] == ["ball"]
    assert {member.name for member in bpy.data.collections["ball"].all_objects} == {"ball", "ball source"}
    assert [frame.name for frame in ball.refmesh.frames] == [str(number) for number in NUMBERS]


def test_only_the_root_turns_the_up_axis(blender, frames):
    for axis, up in (("Y", (0, 1, 0)), ("Z", (0, 0, 1))):
        blender.ops.refmesh.import_sequence(filepath=str(frames), up_axis=axis)
        owner = blender.context.active_object
        blender.context.view_layer.update()
        np.testing.assert_allclose(owner.matrix_world.to_3x3() @ Vector(up), (0, 0, 1), atol=1e-6)
        np.testing.assert_array_equal(read_positions(owner.data), read_mesh(frames / "ball_0006.obj").vertices.astype(np.float32))


def test_timeline_is_set_only_when_asked(blender, frames):
    scene = blender.context.scene
    scene.frame_start, scene.frame_end = 1, 250
    blender.ops.refmesh.import_sequence(filepath=str(frames), set_timeline=False)
    assert (scene.frame_start, scene.frame_end) == (1, 250)
    blender.ops.refmesh.import_sequence(filepath=str(frames), fps=29.97)
    assert (scene.frame_start, scene.frame_end, scene.frame_current) == (6, 11, 6)
    assert scene.render.fps / scene.render.fps_base == pytest.approx(29.97)


@pytest.mark.parametrize("lowest, kind", [(-2.0, "closed bodies"), (0.0, "open surfaces")])
def test_import_says_what_kind_of_capture_the_first_frame_shows(blender, tmp_path, capfd, lowest, kind):
    sphere = trimesh.creation.icosphere(3)
    sphere.update_faces(sphere.triangles_center[:, 2] > lowest)
    for number in (1, 2):
        sphere.export(tmp_path / f"scan_{number}.ply")
    capfd.readouterr()
    blender.ops.refmesh.import_sequence(filepath=str(tmp_path))
    assert f"2 frames, 1-2; its first frame shows {kind}" in capfd.readouterr().out


def test_any_file_a_pattern_or_the_file_browser_find_the_same(blender, frames):
    imported_paths = []
    for arguments in (
        {"filepath": str(frames)},
        {"filepath": str(frames / "ball_0010.obj")},
        {"filepath": str(frames / "ball_*.obj")},
        {"directory": str(frames), "files": [{"name": "ball_0007.obj"}]},
    ):
        blender.ops.refmesh.import_sequence(**arguments)
        imported_paths.append([frame.path for frame in blender.context.active_object.refmesh.frames])
    assert imported_paths[0] and all(paths == imported_paths[0] for paths in imported_paths)


def test_frames_and_name_can_be_chosen(blender, frames):
    blender.ops.refmesh.import_sequence(filepath=str(frames), frames="7-8,11", name="take two")
    state = blender.context.active_object.refmesh
    assert [frame.name for frame in state.frames] == ["7", "8", "11"] and state.root.name == "take two"


def test_two_sequences_do_not_touch_each_other(blender, ball, frames):
    blender.ops.refmesh.import_sequence(filepath=str(frames), frames="10-11")
    other = blender.context.active_object
    blender.context.scene.frame_set(7)
    assert (ball.refmesh.shown, other.refmesh.shown) == ("7", "10")


def test_empty_scene_removes_what_was_there(blender, ball, frames):
    blender.ops.mesh.primitive_cube_add()
    blender.ops.refmesh.import_sequence(filepath=str(frames), empty_scene=True)
    assert {member.name for member in bpy.data.objects} == {"ball", "ball source"} and len(bpy.data.meshes) == 1


@pytest.mark.parametrize("message", ["ball_0006.obj", "no such file or folder"])
def test_what_cannot_be_read_is_named_and_leaves_the_scene_alone(blender, ball, frames, message):
    source = frames / "nothing"
    if message.startswith("ball"):
        source = frames
        (frames / "ball_0006.obj").write_text("this is no mesh")
    before = set(bpy.data.objects), set(bpy.data.meshes), set(bpy.data.collections)
    with pytest.raises(RuntimeError, match=message):
        blender.ops.refmesh.import_sequence(filepath=str(source), empty_scene=True)
    assert (set(bpy.data.objects), set(bpy.data.meshes), set(bpy.data.collections)) == before


def test_a_frame_that_is_gone_holds_the_last_one_and_warns_once(ball, frames, caplog):
    (frames / "ball_0010.obj").unlink()
    with caplog.at_level(logging.WARNING):
        for scene_frame in (8, 10, 8, 10, 8, 10):
            bpy.context.scene.frame_set(scene_frame)
    assert ball.refmesh.shown == "8"
    assert [record.getMessage() for record in caplog.records if "ball_0010.obj" in record.getMessage()] != []
    assert len([record for record in caplog.records if "ball_0010.obj" in record.getMessage()]) == 1


@pytest.mark.parametrize("axis, up", [("X", (1, 0, 0)), ("-X", (-1, 0, 0)), ("-Y", (0, -1, 0)), ("-Z", (0, 0, -1))])
@pytest.mark.parametrize("unit, meters", [("MM", 0.001), ("FT", 0.3048)])
def test_axis_and_unit_are_turned_once_by_the_root(blender, frames, axis, up, unit, meters):
    blender.ops.refmesh.import_sequence(filepath=str(frames), up_axis=axis, unit=unit)
    owner = blender.context.active_object
    blender.context.view_layer.update()
    np.testing.assert_allclose(owner.matrix_world.to_3x3() @ Vector(up), (0, 0, meters), atol=1e-7)
    assert owner.matrix_world.to_3x3().determinant() > 0
    np.testing.assert_array_equal(read_positions(owner.data), read_mesh(frames / "ball_0006.obj").vertices.astype(np.float32))


def test_timeline_can_be_set_later(blender, ball):
    scene = blender.context.scene
    scene.frame_start, scene.frame_end = 1, 250
    blender.ops.refmesh.set_timeline(fps=60)
    assert (scene.frame_start, scene.frame_end, scene.frame_current, scene.render.fps) == (6, 11, 6, 60)


def test_what_would_be_imported_is_shown_first(frames):
    size = sum(path.stat().st_size for path in frames.iterdir())
    assert summarize(str(frames / "ball_0010.obj"), "") == ("ball", "5 frames: 6-8, 10-11", "missing: 9", format_bytes(size))
    assert summarize(str(frames), "6-7")[1:3] == ("2 frames: 6-7", "no gaps")
    assert "no such file" in summarize(str(frames / "nothing"), "")[0]
    assert [format_bytes(size) for size in (1_234_567, 1_640_000_000)] == ["1.2 MB", "1.64 GB"]


def test_the_size_is_shown_in_the_unit_that_is_chosen(frames):
    sides = np.ptp(read_mesh(frames / "ball_0007.obj").vertices, axis=0)
    np.testing.assert_allclose(first_frame_size(str(frames), "7-8"), sides)
    assert format_meters((170.0, 60.0, 25.04), 0.01) == "1.7 x 0.6 x 0.25 m"
    (frames / "ball_0007.obj").write_text("this is no mesh")
    assert first_frame_size(str(frames), "7") == () == first_frame_size(str(frames / "nothing"), "")


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_3d_views_reach_as_far_as_the_sequence(blender, scale):
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    space = next(space for screen in bpy.data.screens for area in screen.areas for space in area.spaces if space.type == "VIEW_3D")
    widen_clipping(scale)
    assert space.clip_start <= 0.01 * scale and space.clip_end >= max(20 * scale, 1000) and space.clip_end / space.clip_start < 2e8
    assert scale != 1.0 or (space.clip_start, space.clip_end) == (pytest.approx(0.01), 1000.0)


def test_going_to_a_frame_by_its_number(blender, ball):
    blender.ops.refmesh.go_to_frame(frame="10")
    assert blender.context.scene.frame_current == 10
    with pytest.raises(RuntimeError, match="frame 9 is not part of this sequence"):
        blender.ops.refmesh.go_to_frame(frame="9")


def test_looking_at_a_sequence_writes_nothing(ball, frames):
    for scene_frame in range(6, 12):
        bpy.context.scene.frame_set(scene_frame)
    assert all(path.suffix == ".obj" for path in frames.iterdir())


def test_imported_it_is_the_only_selected_object_and_the_startup_cube_is_out_of_the_way(blender, frames):
    bpy.ops.wm.read_homefile(use_empty=False, use_factory_startup=True)
    bpy.ops.mesh.primitive_cone_add(location=(5, 0, 0))
    bpy.ops.refmesh.import_sequence(filepath=str(frames))
    owner = next(item for item in bpy.data.objects if item.refmesh.frames)
    assert blender.context.selected_objects == [owner] and blender.context.active_object == owner
    assert bpy.data.objects["Cube"].hide_get() and not bpy.data.objects["Cone"].hide_get()


@pytest.mark.parametrize(
    "arguments, length, scale",
    [({}, 1.0, 1.0), ({"unit": "M"}, 0.01, 100.0), ({"unit": "MM"}, 1.0, 0.001), ({"unit": "FACTOR", "unit_factor": 0.25}, 0.01, 0.25)],
)
def test_units_are_those_of_the_scene(blender, frames, arguments, length, scale):
    blender.context.scene.unit_settings.scale_length = length
    blender.ops.refmesh.import_sequence(filepath=str(frames), **arguments)
    root = blender.context.active_object.refmesh.root
    assert tuple(root.scale) == pytest.approx((scale, scale, scale))


def test_a_person_of_18_meters_is_said_and_scaled(blender, frames):
    blender.ops.refmesh.import_sequence(filepath=str(frames))
    owner = blender.context.active_object
    owner.refmesh.root.scale *= 18.7 / longest_side(owner, blender.context.scene)
    blender.context.view_layer.update()
    note, findings = scale_note(longest_side(owner, blender.context.scene)), owner.refmesh.findings
    assert note.startswith("18.7 m long: if this is a person, scale by 0.1")
    findings.add().message, findings.add().message = "identical to frame 6", note
    blender.ops.refmesh.scale_sequence()
    assert [finding.message for finding in findings] == ["identical to frame 6"]
    assert longest_side(owner, blender.context.scene) == pytest.approx(1.87)
    with pytest.raises(RuntimeError, match="a usual size"):
        blender.ops.refmesh.scale_sequence()


def test_another_reading_of_the_names_can_be_chosen(blender, tmp_path):
    for number in range(3):
        for level in range(2):
            trimesh.creation.box().export(tmp_path / f"scan_{number:04d}_lod{level}.ply")
    blender.ops.refmesh.import_sequence(filepath=str(tmp_path / "scan_0001_lod0.ply"))
    assert [frame.name for frame in blender.context.active_object.refmesh.frames] == ["0", "1", "2"]
    other = str(tmp_path / "scan_0001_lod#.ply")
    blender.ops.refmesh.import_sequence(filepath=str(tmp_path / "scan_0001_lod0.ply"), reading=other)
    state = blender.context.active_object.refmesh
    assert [frame.name for frame in state.frames] == ["0", "1"]
    assert state.source == other
