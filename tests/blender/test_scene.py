"""A saved scene plays after its folder was moved, in a Blender that does not know the add-on."""

from __future__ import annotations

import shutil
import subprocess
import sys

import bpy
import numpy as np
import pytest

from .conftest import GROUPS, NUMBERS, needs_bpy_module, place, reference

# Runs in a process of its own: prints, for each frame, the visible deformed object and its vertices.
PLAY = """
import sys, bpy, numpy
bpy.ops.wm.open_mainfile(filepath=sys.argv[1])
assert not hasattr(bpy.types.Object, "refmesh")
frames = {}
for number in map(int, sys.argv[3:]):
    bpy.context.scene.frame_set(number)
    (shown,) = [item for item in bpy.data.objects if "deformed" in item.name and not item.hide_render]
    mesh = shown.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    flat = numpy.empty(3 * len(mesh.vertices), dtype=numpy.float32)
    mesh.attributes["position"].data.foreach_get("vector", flat)
    frames[str(number)] = flat.reshape(-1, 3)
numpy.savez(sys.argv[2], **frames)
"""


@needs_bpy_module
def test_moved_scene_plays_without_the_addon(blender, solved, results, tmp_path):
    blender.ops.refmesh.save_scene(filepath=str(results / "scene.blend"))
    moved = tmp_path / "moved" / "elsewhere"
    shutil.copytree(results, moved)
    shutil.rmtree(results)
    numbers = [str(number) for number in NUMBERS]
    subprocess.run([sys.executable, "-c", PLAY, str(moved / "scene.blend"), str(tmp_path / "played.npz"), *numbers], check=True)
    with np.load(tmp_path / "played.npz") as played:
        for index, group in enumerate(GROUPS):
            for number in group:
                np.testing.assert_array_equal(played[str(number)], place(reference(index).vertices, number).astype(np.float32))


def test_moved_scene_goes_on_with_the_addon(blender, frames, results, tmp_path):
    """Source and results move together; everything is found beside the scene."""
    blender.ops.refmesh.import_sequence(filepath=str(frames))
    blender.ops.refmesh.load_results(output=str(results))
    blender.ops.refmesh.save_scene(filepath=str(tmp_path / "shot" / "scene.blend"))
    (tmp_path / "archive").mkdir()
    for folder in (frames, results, tmp_path / "shot"):
        shutil.move(folder, tmp_path / "archive" / folder.name)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "archive" / "shot" / "scene.blend"))
    owner = next(item for item in bpy.data.objects if item.refmesh.frames)
    owner.refmesh.show_source = True
    bpy.context.scene.frame_set(10)
    assert owner.refmesh.shown == "10"
    bpy.ops.refmesh.load_results()
    assert owner.refmesh.groups[1].deformed is not None


def test_saving_leaves_no_backup_and_no_changed_preference(blender, solved, results):
    before = blender.context.preferences.filepaths.save_version
    for _ in range(2):
        blender.ops.refmesh.save_scene(filepath=str(results / "scene.blend"))
    assert [path.name for path in results.glob("scene*")] == ["scene.blend"]
    assert blender.context.preferences.filepaths.save_version == before


def test_a_place_that_cannot_be_written_is_named_and_paths_stay(blender, solved, tmp_path):
    (tmp_path / "file").write_text("not a folder")
    before = [frame.path for frame in solved.refmesh.frames]
    with pytest.raises(RuntimeError, match="scene.blend: the scene cannot be saved"):
        blender.ops.refmesh.save_scene(filepath=str(tmp_path / "file" / "scene.blend"))
    assert [frame.path for frame in solved.refmesh.frames] == before


def test_a_scene_that_was_worked_on_among_the_results_is_kept(blender, solved, results):
    path = results / "scene.blend"
    path.write_bytes(b"somebody else's")
    for expected in ([b"somebody else's"], [b"somebody else's"]):  # the second time, nothing is in the way
        blender.ops.refmesh.save_scene(filepath=str(path), among_results=True)
        assert [kept.read_bytes() for kept in sorted(results.glob("scene_kept_*.blend"))] == expected
    bpy.context.scene.name = "worked on"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    mine = path.read_bytes()
    blender.ops.refmesh.save_scene(filepath=str(path), among_results=True)
    assert (results / "scene_kept_2.blend").read_bytes() == mine and path.is_file()
