"""Every operator in every state in which it cannot do its work: refused in one line of message, and the scene is as before."""

from __future__ import annotations

import shutil

import bpy
import pytest

from .test_bad_places import refused

JOBS = ("run_all", "track", "extract_reference", "deform", "evaluate", "check_sequence")
# Operators that work on a sequence -> arguments with which they would do something.
ON_SEQUENCES = dict.fromkeys(JOBS, {}) | {
    "load_results": {},
    "export": {"format": "pc2"},
    "render_preview": {},
    "show_trails": {},
    "remove_trails": {},
    "mark_body": {},
    "forget_body": {"body": 1},
    "exclude_frame": {},
    "edit_groups": {"change": "SPLIT"},
    "apply_preset": {"preset": "draft"},
    "set_timeline": {},
}
ON_SCENES = ON_SEQUENCES | {"import_sequence": {"filepath": "nothing"}, "import_object": {}, "save_scene": {"filepath": "nothing.blend"}}
SELECT = "import one with File > Import"
on_sequences = pytest.mark.parametrize("operator", ON_SEQUENCES)


def no_object(solved) -> None:
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)


def wrong_object(solved) -> None:
    """A lamp is active beside two sequences: which of them is meant?"""
    bpy.ops.refmesh.import_sequence(filepath=bpy.path.abspath(solved.refmesh.source))
    bpy.ops.object.light_add()


def object_of_another_scene(solved) -> None:
    bpy.context.window.scene = bpy.data.scenes.new("other")


@on_sequences
@pytest.mark.parametrize("state", [no_object, wrong_object, object_of_another_scene])
def test_without_a_sequence_that_is_meant(blender, solved, operator, state):
    state(solved)
    refused(operator, SELECT, **ON_SEQUENCES[operator])


@pytest.mark.parametrize("state", [no_object, object_of_another_scene])
def test_without_an_object_that_could_become_a_sequence(blender, solved, state):
    state(solved)
    refused("import_object", "select the animated mesh object")


@pytest.mark.parametrize("kind", ["light_add", "camera_add", "empty_add"])
def test_an_object_without_a_mesh_becomes_no_sequence(blender, kind):
    getattr(bpy.ops.object, kind)()
    refused("import_object", "select the animated mesh object")


def test_a_member_of_a_sequence_becomes_no_other_one(blender, solved):
    refused("import_object", "belongs to a mesh sequence already")


@pytest.mark.parametrize("operator", ["go_to_frame", "cancel"])
def test_small_ones_say_why_too(blender, operator):
    refused(operator, {"go_to_frame": SELECT, "cancel": "no RefMesh job is running"}[operator])


@pytest.mark.parametrize("operator", ON_SCENES)
def test_in_edit_mode(blender, solved, operator):
    bpy.ops.object.mode_set(mode="EDIT")
    message = "belongs to a mesh sequence already" if operator == "import_object" else "switch to Object Mode first"
    refused(operator, message, **ON_SCENES[operator])
    bpy.ops.object.mode_set(mode="OBJECT")


# What is gone -> the operators that need it, with what they say.
GONE = {
    "report.json": {"load_results": "report.json", "export": "report.json", "render_preview": "report.json"},
    "centers.npz": {"load_results": "centers.npz", "mark_body": "centers.npz"},
    "playback": {"load_results": "playback", "export": "run the Deform step again", "show_trails": "playback"},
    "reference": {"load_results": "group_000.ply", "export": "group_000.ply", "render_preview": "group_000.ply"},
    "deformed": {"render_preview": "frame_0006.ply"},
}


@pytest.mark.parametrize("gone, operator, message", [(gone, *item) for gone, table in GONE.items() for item in table.items()])
def test_without_a_cache(blender, solved, results, gone, operator, message):
    target = results / gone
    shutil.rmtree(target) if target.is_dir() else target.unlink()
    vertices = solved.refmesh.centers.data.vertices
    vertices.foreach_set("select", [True, *[False] * (len(vertices) - 1)])
    refused(operator, message, **ON_SEQUENCES[operator])
    assert solved.refmesh.settings.apart == ""


@pytest.mark.parametrize("kind", ["pc2", "abc", "usd", "glb", "ply"])
def test_exports_without_what_they_write(blender, solved, results, kind):
    if not {"abc": bpy.app.build_options.alembic, "usd": bpy.app.build_options.usd}.get(kind, True):
        pytest.skip(f"this Blender was built without {kind}")
    for folder in ("playback", "deformed"):
        shutil.rmtree(results / folder)
    refused("export", r"\.pc2|\.ply", format=kind)
    assert not [path for path in (results / "export").rglob("*") if path.is_file()]


@pytest.mark.parametrize("operator", JOBS)
def test_without_the_frames(blender, ball, frames, tmp_path, operator):
    shutil.rmtree(frames)
    refused(operator, "no such file or folder", output=str(tmp_path / "out"), quiet=True)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("operator", ["remove_trails", "edit_groups", "show_trails", "mark_body", "export", "render_preview"])
def test_before_the_step_that_they_need(blender, ball, operator):
    message = "there are no trails|run the Reference step first|run the Track step first|run the Deform step first|report.json"
    refused(operator, message, **ON_SEQUENCES[operator])
