"""Disks that are full or read-only, caches that are gone, objects of another scene: a clear message, nothing half-written."""

from __future__ import annotations

import shutil
import subprocess

import bpy
import pytest

from .conftest import write_results
from .test_jobs import TINY

SMALL = "64k"  # of a disk that is full before anything is done on it


def mounted(place, options: str):
    place.mkdir()
    try:
        subprocess.run(["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(place)], check=True, capture_output=True)
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("a disk of its own for the test needs the right to mount")
    yield place
    subprocess.run(["umount", "-l", str(place)], check=True)


@pytest.fixture
def full(tmp_path):
    yield from mounted(tmp_path / "full", f"size={SMALL}")


@pytest.fixture
def read_only(tmp_path):
    yield from mounted(tmp_path / "read-only", "ro")


def everything() -> dict[str, set[str]]:
    kinds = ("objects", "meshes", "collections", "actions", "node_groups", "curves", "scenes", "lights", "cameras")
    return {kind: {item.name for item in getattr(bpy.data, kind)} for kind in kinds}


def refused(operator: str, message: str, **arguments) -> None:
    """The operator fails in one line of message and leaves the scene as it was."""
    before = everything()
    with pytest.raises(RuntimeError, match=message) as failure:
        getattr(bpy.ops.refmesh, operator)(**arguments)
    assert "Traceback" not in str(failure.value) and len(str(failure.value).strip().splitlines()) == 1
    assert everything() == before


@pytest.mark.parametrize("operator", ["check_sequence", "run_all", "track", "extract_reference", "deform", "evaluate"])
@pytest.mark.parametrize("disk, message", [("full", "No space left"), ("read_only", "Read-only")])
def test_jobs_name_the_disk(ball, request, operator, disk, message):
    place = request.getfixturevalue(disk)
    refused(operator, message, output=str(place / "out"), quiet=True, **TINY)
    assert not ball.refmesh.done and not list(place.rglob("*.refmesh-partial"))


@pytest.mark.parametrize("disk, message", [("full", "No space left|cannot be written"), ("read_only", "Read-only")])
@pytest.mark.parametrize("kind", ["pc2", "ply", "glb", "abc", "usd"])
def test_exports_name_the_disk(solved, request, disk, message, kind):
    if not {"abc": bpy.app.build_options.alembic, "usd": bpy.app.build_options.usd}.get(kind, True):
        pytest.skip(f"this Blender was built without {kind}")
    place = request.getfixturevalue(disk)
    if disk == "full":
        (place / "filler").write_bytes(bytes(60 * 1024))
    refused("export", message, format=kind, directory=str(place / "export"))
    assert not list(place.rglob("*partial*"))


@pytest.mark.parametrize("disk, reason", [("full", "No space left"), ("read_only", "")])
def test_saving_and_pictures_name_the_disk(solved, request, disk, reason):
    place = request.getfixturevalue(disk)
    if disk == "full":
        (place / "filler").write_bytes(bytes(60 * 1024))
    refused("save_scene", rf"scene.blend: the scene cannot be saved \({reason}", filepath=str(place / "scene.blend"))
    refused("render_preview", "No space left|cannot be written", filepath=str(place / "preview.png"), width=640)
    assert {path.name for path in place.rglob("*") if path.is_file()} <= {"filler"}


@pytest.mark.parametrize("disk, message", [("full", "No space left"), ("read_only", "Read-only")])
def test_an_object_as_input_names_the_disk(blender, request, disk, message):
    place = request.getfixturevalue(disk)
    blender.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=64)
    refused("import_object", message, output=str(place / "out"), first=1, last=2)
    assert not list(place.rglob("*.ply")) and not list(place.rglob("*.refmesh-partial"))


def test_a_cache_that_is_gone_is_named(blender, solved, results):
    solved.refmesh.show_source = True
    shutil.rmtree(results / "playback")
    refused("export", "run the Deform step again", format="pc2")
    refused("export", "point cache|playback", format="glb")
    refused("show_trails", "playback")
    refused("load_results", "playback")
    blender.context.scene.frame_set(10)  # the timeline still moves
    assert solved.refmesh.shown == "10"


def test_two_outputs_that_are_one_folder_wait_for_each_other(ball, tmp_path):
    from refmesh_addon.pipeline.process.lock import output_lock

    with output_lock(tmp_path / "out" / "cache", tmp_path / "out"):
        refused("run_all", "another RefMesh job", output=str(tmp_path / "out"), quiet=True, **TINY)


def test_results_written_to_by_another_sequence_are_refused(blender, ball, frames, tmp_path):
    other = tmp_path / "other"
    shutil.copytree(frames, other)
    for path in other.iterdir():
        path.rename(path.with_name(path.name.replace("00", "01")))
    out = write_results(tmp_path / "results", frames)
    blender.ops.refmesh.import_sequence(filepath=str(other))
    refused("load_results", "has frames 6-11, not in this sequence", output=str(out))


def test_the_output_folder_stays_locked_until_the_exports_of_a_script_are_written(ball, tmp_path):
    from refmesh_addon.core.errors import RefMeshError
    from refmesh_addon.pipeline.process.lock import SCRIPT_LOCK_NAME, keep_lock, output_lock

    bpy.ops.refmesh.run_all(output=str(tmp_path / "out"), quiet=True, keep_lock=True, **TINY)
    with pytest.raises(RefMeshError, match="another RefMesh job"), output_lock(tmp_path / "out" / "cache", "OUT", SCRIPT_LOCK_NAME):
        pass
    keep_lock(tmp_path / "other", "OTHER")


def test_an_output_folder_that_holds_the_input_is_refused_before_anything_is_written(ball, frames):
    before = sorted(frames.rglob("*"))
    refused("run_all", "the output folder holds the input", output=str(frames), quiet=True, keep_lock=True, **TINY)
    assert sorted(frames.rglob("*")) == before


@pytest.mark.parametrize(("output", "message"), [("", "no output folder is chosen"), ("//out", "save the scene first")])
@pytest.mark.parametrize("operator", ["run_all", "load_results", "clean_cache"])
def test_an_output_folder_without_a_place_is_refused(ball, operator, output, message):
    """Neither the folder that Blender was started in nor that of the frames is meant."""
    ball.refmesh.output = output
    refused(operator, message)
