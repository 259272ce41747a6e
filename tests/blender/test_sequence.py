"""Importing a mesh sequence, and the object that shows its frames."""

from __future__ import annotations

import logging
import os

import bpy
import numpy as np
import pytest
from mathutils import Vector

from refmesh_addon.bridge.meshes import read_positions, read_triangles
from refmesh_addon.bridge.sequence import FrameStore
from refmesh_addon.io.meshes import read_mesh

from .conftest import NUMBERS


def shown(owner) -> np.ndarray:
    """Positions of the evaluated object, as a render would see them."""
    return read_positions(owner.evaluated_get(bpy.context.evaluated_depsgraph_get()).data)


def test_every_scene_frame_shows_the_file_of_its_number(ball, frames):
    for scene_frame, number in [(11, 11), (6, 6), (9, 8), (8, 8), (7, 7), (10, 10), (1, 6), (99, 11)]:
        bpy.context.scene.frame_set(scene_frame)
        expected = read_mesh(frames / f"ball_{number:04d}.obj")
        np.testing.assert_array_equal(shown(ball), expected.vertices.astype(np.float32))
        np.testing.assert_array_equal(read_triangles(ball.data), expected.triangles)


def test_objects_are_named_plainly_in_one_collection(ball):
    root = ball.refmesh.root
    assert (root.name, ball.name, ball.parent) == ("ball", "ball source", root)
    assert {member.name for member in bpy.data.collections["ball"].objects} == {"ball", "ball source"}
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


def test_any_file_a_pattern_or_the_file_browser_find_the_same(blender, frames):
    found = []
    for arguments in (
        {"filepath": str(frames)},
        {"filepath": str(frames / "ball_0010.obj")},
        {"filepath": str(frames / "ball_*.obj")},
        {"directory": str(frames), "files": [{"name": "ball_0007.obj"}]},
    ):
        blender.ops.refmesh.import_sequence(**arguments)
        found.append([frame.path for frame in blender.context.active_object.refmesh.frames])
    assert found[0] and all(paths == found[0] for paths in found)


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


@pytest.mark.parametrize("words", ["ball_0006.obj", "no such file or folder"])
def test_what_cannot_be_read_is_named_and_leaves_the_scene_alone(blender, ball, frames, words):
    source = frames / "nothing"
    if words.startswith("ball"):
        source = frames
        (frames / "ball_0006.obj").write_text("this is no mesh")
    before = set(bpy.data.objects), set(bpy.data.meshes), set(bpy.data.collections)
    with pytest.raises(RuntimeError, match=words):
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


def test_store_keeps_what_was_used_last_within_its_budget(frames):
    meshes = [read_mesh(frames / f"ball_{number:04d}.obj") for number in (7, 8)]
    store = FrameStore(sum(mesh.vertices.nbytes + mesh.triangles.nbytes for mesh in meshes))
    paths = [str(frames / f"ball_{number:04d}.obj") for number in (7, 8, 7, 10)]
    seven, eight, again, _ = [store.read(path) for path in paths]
    assert again is seven
    assert store.read(paths[0]) is seven and store.read(paths[1]) is not eight


def test_store_notices_that_a_file_was_written_again(frames):
    store = FrameStore(2**30)
    path = frames / "ball_0006.obj"
    before = store.read(str(path))
    path.write_bytes((frames / "ball_0007.obj").read_bytes())
    os.utime(path, ns=(0, 0))
    assert len(store.read(str(path)).vertices) != len(before.vertices)
