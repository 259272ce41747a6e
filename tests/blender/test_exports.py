"""What other programs read is what the caches play: checked by reading it back with Blender's own importers."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

from refmesh_addon.bridge.formats.registry import FORMATS
from refmesh_addon.bridge.scene.meshes import read_positions
from refmesh_addon.io.meshes import read_mesh
from refmesh_addon.io.pc2 import read_pc2
from refmesh_addon.io.ply import write_ply

from .conftest import GROUPS, NUMBERS, place, reference, velocities, write_results

IMPORTERS = {
    "abc": lambda path: bpy.ops.wm.alembic_import(filepath=path, as_background_job=False),
    "usd": lambda path: bpy.ops.wm.usd_import(filepath=path),
    "glb": lambda path: bpy.ops.import_scene.gltf(filepath=path, merge_vertices=False),
}


@pytest.fixture
def written(kind) -> str:
    """The format under test; skipped where this Blender was built without it."""
    lacking = [name for name, option in (("abc", "alembic"), ("usd", "usd")) if not getattr(bpy.app.build_options, option)]
    if kind in lacking:
        pytest.skip(f"this Blender was built without {kind}")
    return kind


def names_in_blender() -> dict[str, set]:
    kinds = ("objects", "meshes", "actions", "shape_keys", "collections", "materials")
    return {kind: {item.name for item in getattr(bpy.data, kind)} for kind in kinds}


@pytest.mark.parametrize("kind", IMPORTERS)
def test_scene_formats_come_back_the_same(blender, solved, results, written):
    selected = blender.context.selected_objects
    before = names_in_blender()
    blender.ops.refmesh.export(format=written)
    assert names_in_blender() == before and blender.context.selected_objects == selected
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    IMPORTERS[written](str(results / "export" / f"ball.{written}"))
    for number in NUMBERS:
        bpy.context.scene.frame_set(number)
        check_frame(number)


def imported(index: int) -> bpy.types.Object:
    """The mesh of a group as an importer made it, evaluated at the present frame."""
    member = next(item for item in bpy.data.objects if item.type == "MESH" and f"group_{index:03d}" in item.name)
    return member.evaluated_get(bpy.context.evaluated_depsgraph_get())


def check_frame(number: int) -> None:
    """Each group lies where the input did, turned upright, in its own frames, and is scaled to nothing in the others."""
    for index, numbers in enumerate(GROUPS):
        evaluated = imported(index)
        matrix = np.array(evaluated.matrix_world)
        world = read_positions(evaluated.data) @ matrix[:3, :3].T + matrix[:3, 3]
        if number in numbers:
            x, y, z = place(reference(index).vertices, number).T
            np.testing.assert_allclose(world, np.column_stack([x, -z, y]), atol=1e-5)
        else:
            assert np.ptp(world, axis=0).max() < 1e-6


@pytest.mark.parametrize("kind", ["abc", "usd"])
def test_velocities_come_back_in_units_per_second(blender, solved, results, written):
    blender.context.scene.render.fps = 30
    handlers = list(bpy.app.handlers.frame_change_pre)
    blender.ops.refmesh.export(format=written)
    assert list(bpy.app.handlers.frame_change_pre) == handlers
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.context.scene.render.fps = 30  # Alembic knows times, not frames
    IMPORTERS[written](str(results / "export" / f"ball.{written}"))
    for number in NUMBERS:
        bpy.context.scene.frame_set(number)
        for index, numbers in enumerate(GROUPS):
            mesh = imported(index).data
            imported_velocities = np.empty(3 * len(mesh.vertices), dtype=np.float32)
            mesh.attributes["velocity"].data.foreach_get("vector", imported_velocities)
            expected = 30 * velocities(reference(index).vertices, number) if number in numbers else np.zeros((len(mesh.vertices), 3))
            np.testing.assert_allclose(imported_velocities.reshape(-1, 3), expected, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("kind", ["abc", "usd"])
def test_frames_without_velocities_are_refused_before_anything_is_written(blender, solved, results, written):
    path = results / "deformed" / f"frame_{NUMBERS[-1]:04d}.ply"
    write_ply(path, read_mesh(path))
    before, handlers = names_in_blender(), list(bpy.app.handlers.frame_change_pre)
    with pytest.raises(RuntimeError, match=f"frame_{NUMBERS[-1]:04d}.ply: holds no velocities; run the Deform step"):
        blender.ops.refmesh.export(format=written)
    assert not list((results / "export").iterdir())
    assert names_in_blender() == before and list(bpy.app.handlers.frame_change_pre) == handlers


def test_caches_come_with_the_mesh_they_move(blender, solved, results, tmp_path):
    folder = tmp_path / "elsewhere" / "deep"
    blender.ops.refmesh.export(format="pc2", directory=str(folder))
    for index, numbers in enumerate(GROUPS):
        mesh = read_mesh(folder / f"ball_group_{index:03d}.ply")
        np.testing.assert_array_equal(mesh.triangles, reference(index).triangles)
        samples = list(read_pc2(folder / f"ball_group_{index:03d}.pc2"))
        for number, sample in zip(numbers, samples, strict=True):
            np.testing.assert_array_equal(sample, place(mesh.vertices, number).astype(np.float32))


def test_frames_are_copied_with_their_colors(blender, solved, results):
    blender.ops.refmesh.export(format="ply")
    for number in NUMBERS:
        name = f"frame_{number:04d}.ply"
        assert (results / "export" / "ply" / name).read_bytes() == (results / "deformed" / name).read_bytes()


@pytest.mark.parametrize("kind", FORMATS)
def test_exports_leave_the_timeline_and_the_place_of_objects_alone(blender, solved, written):
    scene = blender.context.scene
    scene.frame_start, scene.frame_end = 2, 20
    scene.frame_set(13)
    places = [group.deformed.location.copy() for group in solved.refmesh.groups]
    blender.ops.refmesh.export(format=written)
    assert (scene.frame_start, scene.frame_end, scene.frame_current) == (2, 20, 13)
    assert [group.deformed.location for group in solved.refmesh.groups] == places


@pytest.mark.parametrize("kind", FORMATS)
def test_nothing_to_export_is_said(blender, ball, written):
    with pytest.raises(RuntimeError, match="run the Deform step first"):
        blender.ops.refmesh.export(format=written)


@pytest.mark.parametrize("kind", FORMATS)
def test_a_folder_that_cannot_be_made_is_named(blender, solved, tmp_path, written):
    (tmp_path / "file").write_text("not a folder")
    with pytest.raises(RuntimeError, match="cannot be written"):
        blender.ops.refmesh.export(format=written, directory=str(tmp_path / "file" / "export"))


def test_a_failed_export_leaves_nothing_half_written(blender, solved, results):
    (results / "export" / "ball.glb").mkdir(parents=True)  # in the way of the file
    before = names_in_blender()
    with pytest.raises(RuntimeError, match="ball.glb"):
        blender.ops.refmesh.export(format="glb")
    assert [path.name for path in (results / "export").iterdir()] == ["ball.glb"]
    assert names_in_blender() == before


@pytest.mark.parametrize("kind", FORMATS)
def test_formats_this_blender_lacks_are_refused_before_any_work(blender, ball, kind):
    lacks = {"abc": not bpy.app.build_options.alembic, "usd": not bpy.app.build_options.usd}
    if lacks.get(kind):
        with pytest.raises(RuntimeError, match=f"--export {kind}: this Blender was built without .*; choose pc2"):
            blender.ops.refmesh.export(format=kind, only_check=True)
    else:
        assert blender.ops.refmesh.export(format=kind, only_check=True) == {"FINISHED"}


@pytest.mark.parametrize("kind", ["abc", "usd", "glb"])
def test_a_range_and_one_object_go_out_alone(blender, solved, results, written):
    blender.context.view_layer.objects.active = solved.refmesh.groups[0].deformed
    blender.ops.refmesh.export(format=written, scope="OBJECT", first=7, last=8)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    IMPORTERS[written](str(results / "export" / f"ball.{written}"))
    assert not [item for item in bpy.data.objects if "group_001" in item.name]
    for scene_frame, number in ((7, 7), (8, 8), (6, 7), (11, 8)):  # beyond the range its ends are held
        bpy.context.scene.frame_set(scene_frame)
        world = read_positions(imported(0).data) @ np.array(imported(0).matrix_world)[:3, :3].T
        x, y, z = place(reference(0).vertices, number).T
        np.testing.assert_allclose(world, np.column_stack([x, -z, y]), atol=1e-5)


def test_a_step_takes_every_second_frame(blender, solved, results):
    blender.ops.refmesh.export(format="ply", first=7, step=2)
    assert sorted(path.name for path in (results / "export" / "ply").iterdir()) == ["frame_0007.ply", "frame_0011.ply"]  # 9 is missing
    blender.ops.refmesh.export(format="pc2", first=6, last=10, step=2)
    for index, numbers in enumerate(((6, 8), (10,))):
        mesh = read_mesh(results / "export" / f"ball_group_{index:03d}.ply")
        samples = list(read_pc2(results / "export" / f"ball_group_{index:03d}.pc2"))
        for number, sample in zip(numbers, samples, strict=True):
            np.testing.assert_array_equal(sample, place(mesh.vertices, number).astype(np.float32))
    blender.ops.refmesh.export(format="glb", step=2)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    IMPORTERS["glb"](str(results / "export" / "ball.glb"))
    for number in (6, 8, 10):
        bpy.context.scene.frame_set(number)
        check_frame(number)


@pytest.mark.parametrize("kind", ["abc", "usd"])
def test_a_step_is_refused_where_every_frame_is_written(blender, solved, results, written):
    with pytest.raises(RuntimeError, match="leave out the step, or choose pc2, glb, fbx, .*vat, ply or refmesh"):
        blender.ops.refmesh.export(format=written, step=2)
    assert not (results / "export").exists()


def test_a_collection_holds_several_sequences(blender, frames, tmp_path):
    for name in ("one", "two"):
        blender.ops.refmesh.import_sequence(filepath=str(frames), name=name)
        blender.ops.refmesh.load_results(output=str(write_results(tmp_path / name, frames)))
    blender.context.view_layer.active_layer_collection = blender.context.view_layer.layer_collection
    blender.ops.refmesh.export(format="glb", scope="COLLECTION", directory=str(tmp_path / "both"))
    assert sorted(path.name for path in (tmp_path / "both").iterdir()) == ["one.glb", "two.glb"]
    other = bpy.data.collections.new("other")
    blender.context.scene.collection.children.link(other)
    blender.context.view_layer.active_layer_collection = blender.context.view_layer.layer_collection.children["other"]
    with pytest.raises(RuntimeError, match="the collection 'other' holds no mesh sequence"):
        blender.ops.refmesh.export(format="glb", scope="COLLECTION")


@pytest.mark.parametrize(
    "arguments, message",
    [
        ({"first": 50}, "no frames to export from 50 to 11: the sequence has 6 to 11; choose frames within that"),
        ({"first": 8, "last": 7}, "no frames to export"),
        ({"scope": "OBJECT"}, "select the deformed mesh of one"),
    ],
)
def test_nothing_chosen_is_said(blender, solved, results, arguments, message):
    with pytest.raises(RuntimeError, match=message):
        blender.ops.refmesh.export(format="pc2", **arguments)
    assert not (results / "export").exists()


def test_files_of_others_in_the_folder_are_kept(blender, solved, tmp_path, capfd):
    folder = tmp_path / "assets"
    folder.mkdir()
    for name in ("ball.glb", "ball.fbx"):
        (folder / name).write_text("mine")
    for _ in range(2):
        for kind in ("glb", "fbx"):
            assert blender.ops.refmesh.export(format=kind, directory=str(folder)) == {"FINISHED"}
    assert sorted(path.name for path in folder.iterdir()) == ["ball.fbx", "ball.glb", "ball_kept_1.fbx", "ball_kept_1.glb"]
    assert (folder / "ball_kept_1.glb").read_text() == "mine" and "is kept as ball_kept_1.glb" in capfd.readouterr().out
