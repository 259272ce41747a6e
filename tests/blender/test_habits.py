"""What people do to objects: two sequences side by side, renamed, hidden, parented, scaled, linked, undone."""

from __future__ import annotations

import shutil
import subprocess
import sys

import bpy
import numpy as np
import pytest

import refmesh_addon
from refmesh_addon.bridge.scene.meshes import read_positions
from refmesh_addon.io.meshes import read_mesh

from .conftest import GROUPS, NUMBERS, needs_bpy_module, place, reference, write_results


def evaluated(member) -> np.ndarray:
    return read_positions(member.evaluated_get(bpy.context.evaluated_depsgraph_get()).data)


def test_two_sequences_keep_apart(blender, frames, tmp_path):
    owners = []
    for name in ("one", "two"):
        blender.ops.refmesh.import_sequence(filepath=str(frames), name=name)
        owners.append(blender.context.active_object)
        blender.ops.refmesh.load_results(output=str(write_results(tmp_path / name, frames)))
    one, two = owners
    members = [{member for member in bpy.data.objects if member.refmesh.sequence == owner} for owner in owners]
    assert not members[0] & members[1] and len(members[0]) == len(members[1])
    two.refmesh.heat_map, two.refmesh.arrangement, two.refmesh.center_color = True, "SIDE", "SPEED"
    assert "RefMesh Errors" not in one.refmesh.groups[0].deformed.modifiers
    assert one.refmesh.groups[0].deformed.location.x == 0 < two.refmesh.groups[0].deformed.location.x
    assert one.refmesh.center_color == "PLACE"
    assert len(blender.context.scene.timeline_markers) == 2 * len(GROUPS)
    blender.context.view_layer.objects.active = one
    blender.ops.refmesh.load_results()
    assert len(blender.context.scene.timeline_markers) == 2 * len(GROUPS) and two.refmesh.heat_map


def test_renamed_hidden_parented_and_scaled_it_still_plays_and_refreshes(blender, solved):
    state = solved.refmesh
    for number, member in enumerate((solved, state.root, state.centers, state.groups[0].deformed)):
        member.name = f"mine {number}"
    state.show_source = True
    solved.hide_set(True)
    state.groups[0].deformed.hide_set(True)
    state.root.parent = bpy.data.objects.new("rig", None)
    state.root.scale = (3.0, 3.0, 3.0)
    blender.context.view_layer.objects.active = state.root
    blender.ops.refmesh.load_results()
    assert {"mine 0", "mine 1", "mine 2", "mine 3"} <= {member.name for member in bpy.data.objects}
    assert tuple(state.root.scale) == (3.0, 3.0, 3.0)
    for number in NUMBERS:
        blender.context.scene.frame_set(number)
        index = next(index for index, numbers in enumerate(GROUPS) if number in numbers)
        expected = place(reference(index).vertices, number).astype(np.float32)
        np.testing.assert_array_equal(evaluated(state.groups[index].deformed), expected)
        assert solved.refmesh.shown == str(number)


def test_deleted_objects_come_back_with_the_results(blender, solved):
    bpy.data.objects.remove(solved.refmesh.centers)
    bpy.data.objects.remove(solved.refmesh.groups[0].deformed)
    assert solved.refmesh.centers is None
    blender.ops.refmesh.load_results()
    assert solved.refmesh.centers and solved.refmesh.groups[0].deformed


def test_taken_out_and_put_back_the_addon_goes_on(blender, solved):
    refmesh_addon.unregister()
    refmesh_addon.register()
    owner = next(member for member in bpy.data.objects if member.refmesh.frames)
    blender.context.view_layer.objects.active = owner
    blender.ops.refmesh.load_results()
    owner.refmesh.show_source = True
    blender.context.scene.frame_set(10)
    assert owner.refmesh.shown == "10"


@pytest.mark.parametrize("operator", ["apply_preset", "load_results", "exclude_frame", "show_trails", "set_timeline", "edit_groups"])
def test_what_changes_the_scene_can_be_undone(blender, operator):
    assert "UNDO" in getattr(bpy.types, f"REFMESH_OT_{operator}").bl_options


LINKED = """
import sys, bpy, numpy
sys.path.insert(0, sys.argv[1])
import refmesh_addon
refmesh_addon.register()
bpy.ops.wm.read_factory_settings(use_empty=True)
with bpy.data.libraries.load(sys.argv[2], link=True) as (there, here):
    here.collections = ["ball"]
bpy.context.scene.collection.children.link(here.collections[0])
for number in map(int, sys.argv[4:]):
    bpy.context.scene.frame_set(number)
shown = [item for item in bpy.context.scene.objects if "deformed" in item.name and not item.hide_render]
mesh = shown[0].evaluated_get(bpy.context.evaluated_depsgraph_get()).data
flat = numpy.empty(3 * len(mesh.vertices), dtype=numpy.float32)
mesh.attributes["position"].data.foreach_get("vector", flat)
numpy.save(sys.argv[3], flat.reshape(-1, 3))
refmesh_addon.unregister()
"""


@needs_bpy_module
def test_a_linked_sequence_plays_with_the_addon_there(blender, solved, results, tmp_path):
    blender.ops.refmesh.save_scene(filepath=str(results / "scene.blend"))
    root = str(refmesh_addon.__path__[0].removesuffix("/refmesh_addon"))
    command = [sys.executable, "-c", LINKED, root, str(results / "scene.blend"), str(tmp_path / "played.npy"), *map(str, NUMBERS)]
    subprocess.run(command, check=True)
    expected = place(reference(1).vertices, NUMBERS[-1]).astype(np.float32)
    np.testing.assert_array_equal(np.load(tmp_path / "played.npy"), expected)


def test_saved_before_the_first_run_it_goes_on_where_it_was_moved(blender, frames, tmp_path):
    """Nothing but the sequence is there yet; source and scene move together."""
    blender.ops.refmesh.import_sequence(filepath=str(frames))
    blender.ops.refmesh.save_scene(filepath=str(tmp_path / "shot" / "scene.blend"))
    (tmp_path / "moved").mkdir()
    for folder in (frames, tmp_path / "shot"):
        shutil.move(folder, tmp_path / "moved" / folder.name)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "moved" / "shot" / "scene.blend"))
    owner = next(member for member in bpy.data.objects if member.refmesh.frames)
    for number in (8, 11):
        bpy.context.scene.frame_set(number)
        expected = read_mesh(tmp_path / "moved" / frames.name / f"ball_{number:04d}.obj").vertices
        np.testing.assert_array_equal(read_positions(owner.data), expected.astype(np.float32))
    assert owner.refmesh.output.startswith("//")


@pytest.mark.parametrize(
    "lose, message",
    [
        (lambda frames, results: None, ""),
        (lambda frames, results: shutil.rmtree(frames), "the frames are not in"),
        (lambda frames, results: (results / "report.json").unlink(), "report.json is missing: choose its folder"),
        (lambda frames, results: shutil.rmtree(results / "playback"), ".pc2 is missing: choose its folder"),
    ],
)
def test_what_is_missing_is_said_when_a_scene_is_opened(blender, solved, frames, results, tmp_path, lose, message):
    blender.ops.refmesh.save_scene(filepath=str(tmp_path / "scene.blend"))
    lose(frames, results)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "scene.blend"))
    owner = next(member for member in bpy.data.objects if member.refmesh.frames)
    assert (message in owner.refmesh.missing) if message else owner.refmesh.missing == ""
