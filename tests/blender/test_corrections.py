"""Corrections by hand: they follow the surface, can be muted and removed, survive a run, and go into playback and exports."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

from refmesh_addon.bridge.scene.meshes import read_positions
from refmesh_addon.io.meshes import read_mesh
from refmesh_addon.io.pc2 import read_pc2

from .conftest import place, reference, write_results

LIFT = np.array([0.0, 0.0, 0.25])
VERTEX = 3


def shown(owner, number: int) -> np.ndarray:
    bpy.context.scene.frame_set(number)
    index = 0 if number < 10 else 1
    deformed = owner.refmesh.groups[index].deformed
    return read_positions(deformed.evaluated_get(bpy.context.evaluated_depsgraph_get()).data)


def uncorrected(number: int) -> np.ndarray:
    return place(reference(0).vertices, number)


def lift(owner, number: int = 7, **options) -> None:
    """Moves one vertex as it is seen in a frame, and applies that."""
    bpy.context.scene.frame_set(number)
    bpy.context.view_layer.objects.active = owner
    bpy.ops.refmesh.edit_shape()
    mesh = owner.refmesh.groups[0].deformed.data
    np.testing.assert_allclose(read_positions(mesh), shown(owner, number), atol=1e-6)  # what is edited is what is seen
    mesh.vertices[VERTEX].co += bpy.context.scene.cursor.location.__class__(LIFT)
    assert bpy.ops.refmesh.apply_edit(**options) == {"FINISHED"}


def moved(owner, number: int) -> np.ndarray:
    """How far each vertex is from the results in a frame of the first group."""
    return shown(owner, number) - uncorrected(number)


def test_a_change_is_what_one_drew_in_its_frame_and_follows_in_the_others(blender, solved):
    lift(solved, 7)
    for number in (6, 7, 8):
        offsets = moved(solved, number)
        assert np.abs(np.delete(offsets, VERTEX, axis=0)).max() < 1e-6
        np.testing.assert_allclose(np.linalg.norm(offsets[VERTEX]), 0.25, atol=1e-5)
    np.testing.assert_allclose(moved(solved, 7)[VERTEX], LIFT, atol=1e-5)
    np.testing.assert_allclose(read_positions(solved.refmesh.groups[0].deformed.data), reference(0).vertices.astype(np.float32), atol=0)
    assert [item.name for item in solved.refmesh.groups[0].corrections] == ["Frame 7"]


def test_a_range_with_a_fade(blender, solved):
    lift(solved, 7, whole_group=False, first=8, last=8, fade=1)
    lengths = [np.linalg.norm(moved(solved, number)[VERTEX]) for number in (6, 7, 8)]
    np.testing.assert_allclose(lengths, [0.0, 0.125, 0.25], atol=1e-5)


def test_muted_and_removed_the_results_are_as_they_were(blender, solved):
    lift(solved)
    (item,) = solved.refmesh.groups[0].corrections
    item.mute = True
    assert np.abs(moved(solved, 7)).max() < 1e-6
    item.mute = False
    assert np.abs(moved(solved, 7)).max() > 0.2
    blender.ops.refmesh.remove_correction()
    assert np.abs(moved(solved, 7)).max() < 1e-6 and not solved.refmesh.groups[0].corrections
    assert not [layer.name for layer in solved.refmesh.groups[0].deformed.data.attributes if layer.name.startswith("RefMesh Correction")]
    with pytest.raises(RuntimeError, match="has no corrections"):
        blender.ops.refmesh.remove_correction()


def test_moved_vertices_and_shape_keys_of_the_reference_shape_count_as_well(blender, solved):
    """Without Edit Shape: changes of the mesh itself, which the cache hides."""
    deformed = solved.refmesh.groups[0].deformed
    deformed.shape_key_add(name="Basis")
    key = deformed.shape_key_add(name="nose", from_mix=False)
    key.data[5].co.z += 0.5
    key.value = 0.5
    deformed.data.vertices[VERTEX].co.z += 0.25
    blender.context.view_layer.objects.active = deformed
    blender.ops.refmesh.apply_edit()
    lengths = np.linalg.norm(moved(solved, 8), axis=1)
    np.testing.assert_allclose(lengths[[VERTEX, 5]], [0.25, 0.25], atol=1e-5)
    assert key.value == 0.0 and (lengths > 1e-5).sum() == 2


def test_several_add_up_and_one_can_be_drawn_over_another(blender, solved):
    lift(solved, 7)
    lift(solved, 7)
    np.testing.assert_allclose(moved(solved, 7)[VERTEX], 2 * LIFT, atol=1e-5)


def test_a_correction_survives_the_next_results(blender, solved, results, frames, tmp_path, monkeypatch):
    from . import conftest

    lift(solved)
    blender.ops.refmesh.load_results()
    np.testing.assert_allclose(moved(solved, 7)[VERTEX], LIFT, atol=1e-5)
    finer = reference(2)
    monkeypatch.setattr(conftest, "reference", lambda index: finer)
    blender.ops.refmesh.load_results(output=str(write_results(tmp_path / "finer", frames)))
    offsets = shown(solved, 7) - place(finer.vertices, 7)
    nearest = np.linalg.norm(finer.vertices - reference(0).vertices[VERTEX], axis=1).argmin()
    assert np.linalg.norm(offsets, axis=1).argmax() == nearest
    np.testing.assert_allclose(np.linalg.norm(offsets[nearest]), 0.25, atol=0.01)


def test_exports_have_it(blender, solved, results):
    lift(solved)
    for kind in ("ply", "pc2", "glb"):
        blender.ops.refmesh.export(format=kind)
    expected = uncorrected(7)
    expected[VERTEX] += LIFT
    out = results / "export"
    np.testing.assert_allclose(read_mesh(out / "ply" / "frame_0007.ply").vertices, expected, atol=1e-5)
    np.testing.assert_allclose(list(read_pc2(out / "ball_group_000.pc2"))[1], expected, atol=1e-5)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.import_scene.gltf(filepath=str(out / "ball.glb"), merge_vertices=False)
    bpy.context.scene.frame_set(7)
    member = next(item for item in bpy.data.objects if item.type == "MESH" and "group_000" in item.name)
    world = read_positions(member.evaluated_get(bpy.context.evaluated_depsgraph_get()).data)
    x, y, z = expected[VERTEX]
    assert np.linalg.norm(world @ np.array(member.matrix_world)[:3, :3].T - [x, -z, y], axis=1).min() < 1e-4


def test_saved_and_opened_again_it_plays(blender, solved, results):
    lift(solved)
    blender.ops.refmesh.save_scene(filepath=str(results / "scene.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(results / "scene.blend"))
    owner = next(item for item in bpy.data.objects if item.refmesh.frames)
    np.testing.assert_allclose(moved(owner, 7)[VERTEX], LIFT, atol=1e-5)


def test_a_discarded_edit_leaves_no_trace(blender, solved):
    bpy.context.scene.frame_set(7)
    blender.ops.refmesh.edit_shape()
    with pytest.raises(RuntimeError, match="is being edited in frame 7"):
        blender.ops.refmesh.edit_shape()
    solved.refmesh.groups[0].deformed.data.vertices[VERTEX].co.z += 1.0
    blender.ops.refmesh.discard_edit()
    assert np.abs(moved(solved, 8)).max() < 1e-6
    with pytest.raises(RuntimeError, match="nothing was changed"):
        blender.ops.refmesh.apply_edit()
