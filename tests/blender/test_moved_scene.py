"""File > Save, moved, reopened, linked: result and source play, and the next run starts."""

from __future__ import annotations

import shutil

import bpy
import numpy as np
import pytest

from refmesh_addon.bridge.results.relocation import moved_file
from refmesh_addon.bridge.scene.meshes import read_positions
from refmesh_addon.bridge.scene.playback import CACHE_NAME
from refmesh_addon.io.meshes import read_mesh

from .conftest import NUMBERS, place, reference, write_results
from .test_jobs import TINY


@pytest.fixture
def project(blender, tmp_path) -> bpy.types.Object:
    """A sequence with results, all below one folder."""
    return _project(blender, tmp_path, tmp_path / "project")


def _project(blender, tmp_path, folder):
    from .conftest import _obj

    (folder / "capture").mkdir(parents=True)
    for number in NUMBERS:
        mesh = reference(0)
        (folder / "capture" / f"ball_{number:04d}.obj").write_text(_obj(place(mesh.vertices, number), mesh.triangles))
    blender.ops.refmesh.import_sequence(filepath=str(folder / "capture"))
    blender.ops.refmesh.load_results(output=str(write_results(folder / "out", folder / "capture")))
    return blender.context.active_object.refmesh.sequence or blender.context.active_object


def owner_of_scene() -> bpy.types.Object:
    return next(item for item in bpy.data.objects if item.refmesh.frames)


def all_paths(owner) -> list[str]:
    state = owner.refmesh
    caches = [member.modifiers[CACHE_NAME].filepath for member in (state.centers, *(group.deformed for group in state.groups))]
    return [state.source, state.output, *(frame.path for frame in state.frames), *caches]


def check_plays(owner) -> None:
    """Source and result show every frame, and no path is missing."""
    state = owner.refmesh
    state.show_source = True
    assert state.missing == ""
    for number in NUMBERS:
        bpy.context.scene.frame_set(number)
        expected = read_mesh(bpy.path.abspath(state.frames[str(number)].path)).vertices
        np.testing.assert_allclose(read_positions(owner.data), expected, atol=1e-6)
    bpy.context.scene.frame_set(7)
    shown = state.groups[0].deformed.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    np.testing.assert_allclose(read_positions(shown), place(reference(0).vertices, 7), atol=1e-6)


def test_saved_by_blender_itself_and_moved_it_plays_and_runs(blender, project, tmp_path):
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "project" / "shot.blend"))
    assert all(path.startswith("//") for path in all_paths(project))
    shutil.move(tmp_path / "project", tmp_path / "elsewhere")
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "elsewhere" / "shot.blend"))
    owner = owner_of_scene()
    check_plays(owner)
    bpy.context.view_layer.objects.active = owner
    assert blender.ops.refmesh.evaluate() == {"FINISHED"}  # finds everything up to date
    assert blender.ops.refmesh.check_sequence(quiet=True) == {"FINISHED"}


def test_saved_elsewhere_and_back_all_paths_follow(blender, project, tmp_path):
    for target in (tmp_path / "one" / "a.blend", tmp_path / "project" / "deep" / "b.blend", tmp_path / "project" / "b.blend"):
        target.parent.mkdir(exist_ok=True)
        bpy.ops.wm.save_as_mainfile(filepath=str(target))
        assert all(path.startswith("//") for path in all_paths(project))
        bpy.ops.wm.open_mainfile(filepath=str(target))
        project = owner_of_scene()
        check_plays(project)


def test_a_copy_leaves_the_open_scene_as_it_was(blender, project, tmp_path):
    before = all_paths(project)
    (tmp_path / "copies").mkdir()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "copies" / "copy.blend"), copy=True)
    assert all_paths(project) == before
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "project" / "shot.blend"))
    before = all_paths(project)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "copies" / "copy.blend"), copy=True)
    assert all_paths(project) == before
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "copies" / "copy.blend"))
    check_plays(owner_of_scene())


def test_imported_into_a_saved_scene_paths_are_relative_at_once(blender, tmp_path):
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "empty.blend"))
    assert all(path.startswith("//") for path in all_paths(_project(blender, tmp_path, tmp_path / "later")))


def test_absolute_paths_of_a_moved_folder_are_repaired(blender, project, tmp_path):
    """As versions without relative paths left them in a scene."""
    target = tmp_path / "project" / "shot.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(target))
    with_absolute_paths(project, target)
    shutil.move(tmp_path / "project", tmp_path / "elsewhere")
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "elsewhere" / "shot.blend"))
    owner = owner_of_scene()
    check_plays(owner)
    assert all(path.startswith("//") for path in all_paths(owner))


def with_absolute_paths(owner, target) -> None:
    """Saves the scene once more, without the handlers."""
    from refmesh_addon.bridge.handlers import before_save

    bpy.app.handlers.save_pre.remove(before_save)
    state = owner.refmesh
    for holder in state.frames:
        holder.path = bpy.path.abspath(holder.path)
    state.source, state.output = bpy.path.abspath(state.source), bpy.path.abspath(state.output)
    for member in (state.centers, *(group.deformed for group in state.groups)):
        member.modifiers[CACHE_NAME].filepath = bpy.path.abspath(member.modifiers[CACHE_NAME].filepath)
    bpy.ops.wm.save_as_mainfile(filepath=str(target), relative_remap=False)
    bpy.app.handlers.save_pre.append(before_save)


def test_only_the_scene_moved_a_few_folders_deeper(blender, project, tmp_path):
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "project" / "shot.blend"))
    (tmp_path / "project" / "shots" / "010").mkdir(parents=True)
    shutil.move(tmp_path / "project" / "shot.blend", tmp_path / "project" / "shots" / "010" / "shot.blend")
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "project" / "shots" / "010" / "shot.blend"))
    check_plays(owner_of_scene())


@pytest.mark.parametrize("by", ["field", "operator"])
def test_frames_elsewhere_are_said_and_pointed_at_again(blender, project, tmp_path, by):
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "project" / "shot.blend"))
    shutil.move(tmp_path / "project" / "capture", tmp_path / "archive" / "take 3")
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "project" / "shot.blend"))
    owner = owner_of_scene()
    assert "the frames are not in" in owner.refmesh.missing
    bpy.context.view_layer.objects.active = owner
    if by == "field":
        owner.refmesh.source = str(tmp_path / "archive" / "take 3")
    else:
        blender.ops.refmesh.relocate_frames(filepath=str(tmp_path / "archive" / "take 3" / "ball_0008.obj"))
    check_plays(owner)
    assert blender.ops.refmesh.evaluate(**TINY) == {"FINISHED"}


def test_a_place_without_all_frames_is_refused_and_changes_nothing(blender, project, tmp_path):
    (tmp_path / "few").mkdir()
    shutil.copy(tmp_path / "project" / "capture" / "ball_0006.obj", tmp_path / "few")
    before = all_paths(project)
    with pytest.raises(RuntimeError, match="few: lacks frames 7-11 of this sequence"):
        blender.ops.refmesh.relocate_frames(filepath=str(tmp_path / "few"))
    assert all_paths(project) == before


@pytest.mark.parametrize("instanced", [True, False])
def test_linked_into_another_scene_the_result_plays_and_the_source_says_why_not(blender, project, tmp_path, instanced):
    project.refmesh.show_source = True
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "project" / "shot.blend"))
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    (tmp_path / "other").mkdir()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "other" / "layout.blend"))
    with bpy.data.libraries.load(str(tmp_path / "project" / "shot.blend"), link=True) as (source, target):
        target.collections = ["ball"]
    scene = bpy.context.scene
    if instanced:
        holder = bpy.data.objects.new("ball", None)
        holder.instance_type, holder.instance_collection = "COLLECTION", target.collections[0]
        scene.collection.objects.link(holder)
        bpy.context.view_layer.objects.active = holder
    else:
        scene.collection.children.link(target.collections[0])
    owner = owner_of_scene()
    for number in (6, 8, 10):
        scene.frame_set(number)
        shown = [item.object for item in bpy.context.evaluated_depsgraph_get().object_instances if "deformed" in item.object.name]
        assert any(np.allclose(read_positions(item.data)[:12], place(reference(0).vertices[:12], number), atol=1e-5) for item in shown)
    with pytest.raises(RuntimeError, match="linked from .*shot.blend: the result plays here, the source shows frame 6 only"):
        blender.ops.refmesh.run_all()
    np.testing.assert_allclose(read_positions(owner.data), place(reference(0).vertices, 6), atol=1e-6)


def test_the_longest_end_of_a_path_that_exists_is_taken(tmp_path):
    for path in ("a/take/x.obj", "take/x.obj", "x.obj"):
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).touch()
    from pathlib import Path

    assert moved_file(Path("/old/a/take/x.obj"), tmp_path) == tmp_path / "a" / "take" / "x.obj"
    assert moved_file(Path("/old/b/take/x.obj"), tmp_path) == tmp_path / "take" / "x.obj"
    assert moved_file(Path("/old/b/other/x.obj"), tmp_path / "a") == tmp_path / "x.obj"
    assert moved_file(Path("/old/b/other/x.obj"), tmp_path, least=2) is None
