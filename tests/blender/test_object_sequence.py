"""Animated objects of the scene as input: what is written is what a render would see."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
import pytest

from refmesh_addon.bridge.scene.materials import image_material
from refmesh_addon.bridge.scene.meshes import read_positions
from refmesh_addon.bridge.sequence.bake import evaluated_mesh
from refmesh_addon.core.geometry.mesh import signed_volume
from refmesh_addon.io.appearance import parse_appearance
from refmesh_addon.io.files import PARTIAL_SUFFIX
from refmesh_addon.io.images import write_image
from refmesh_addon.io.meshes import read_mesh
from refmesh_addon.io.sequence import BAKED_FOLDER

from .conftest import place, reference


@pytest.fixture
def cube(blender) -> bpy.types.Object:
    """A mirrored cube that moves along x and has a modifier."""
    blender.ops.mesh.primitive_cube_add()
    cube = blender.context.active_object
    cube.name = "My [cube].001"
    cube.scale = (-1.0, 2.0, 1.0)
    cube.modifiers.new("Finer", "SUBSURF")
    for frame in (1, 11):
        cube.location.x = frame
        cube.keyframe_insert("location", frame=frame)
    cube.animation_data.action.name = "move"
    return cube


def test_modifiers_motion_and_mirroring_are_taken(blender, cube, tmp_path):
    blender.context.scene.frame_set(4)
    blender.ops.refmesh.import_object(output=str(tmp_path / "out"), first=1, last=11, step=5)
    owner = blender.context.active_object
    assert [frame.name for frame in owner.refmesh.frames] == ["1", "6", "11"]
    assert blender.context.scene.frame_current == 4 and cube.hide_get()
    middles = [read_mesh(bpy.path.abspath(frame.path)) for frame in owner.refmesh.frames]
    assert [mesh.vertices[:, 0].mean() for mesh in middles] == pytest.approx([1, 6, 11], abs=0.5)
    assert all(len(mesh.vertices) > 8 and signed_volume(mesh) > 0 for mesh in middles)


def test_another_cache_in_the_scene_comes_out_as_it_plays(blender, solved, tmp_path):
    playing = solved.refmesh.groups[0].deformed.copy()  # no longer one of ours
    playing.refmesh.sequence = None
    blender.context.collection.objects.link(playing)
    playing.animation_data_clear()
    playing.hide_viewport = False
    playing.location, playing.parent = (0, 0, 0), None
    blender.context.view_layer.objects.active = playing
    blender.ops.refmesh.import_object(output=str(tmp_path / "again"), first=6, last=8)
    for frame in blender.context.active_object.refmesh.frames:
        expected = place(reference(0).vertices, int(frame.name)).astype(np.float32)
        np.testing.assert_array_equal(read_mesh(bpy.path.abspath(frame.path)).vertices, expected)


def test_a_second_time_replaces_the_first(blender, cube, tmp_path):
    blender.ops.refmesh.import_object(output=str(tmp_path / "out"), first=1, last=5)
    cube.hide_set(False)
    blender.context.view_layer.objects.active = cube
    blender.ops.refmesh.import_object(output=str(tmp_path / "out"), first=2, last=3)
    assert len(list((tmp_path / "out" / "source").iterdir())) == 2
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["source"]


def test_frames_without_faces_are_gaps_and_none_is_refused(blender, cube, tmp_path):
    count = cube.modifiers.new("Some", "MASK")
    count.vertex_group = cube.vertex_groups.new(name="none").name
    for frame, shown in ((1, False), (2, True), (3, False)):
        count.show_viewport = shown
        count.keyframe_insert("show_viewport", frame=frame)
    blender.ops.refmesh.import_object(output=str(tmp_path / "out"), first=1, last=3)
    assert [frame.name for frame in blender.context.active_object.refmesh.frames] == ["1", "3"]
    cube.hide_set(False)
    blender.context.view_layer.objects.active = cube
    before = set(bpy.data.objects)
    with pytest.raises(RuntimeError, match="has no faces in frames 2 to 2"):
        blender.ops.refmesh.import_object(output=str(tmp_path / "none"), first=2, last=2)
    assert set(bpy.data.objects) == before and not (tmp_path / "none" / "source").exists()


def test_nothing_selected_unsaved_scene_and_our_own_objects_are_refused(blender, ball, tmp_path):
    with pytest.raises(RuntimeError, match="belongs to a mesh sequence already"):
        blender.ops.refmesh.import_object()
    blender.ops.object.light_add()
    with pytest.raises(RuntimeError, match="select the animated mesh object"):
        blender.ops.refmesh.import_object()
    blender.ops.mesh.primitive_cube_add()
    with pytest.raises(RuntimeError, match="save the scene first"):
        blender.ops.refmesh.import_object()
    with pytest.raises(RuntimeError, match="the last frame, 3, is before the first, 5"):
        blender.ops.refmesh.import_object(output=str(tmp_path), first=5, last=3)


def test_curves_count_as_what_they_render(blender):
    blender.ops.curve.primitive_bezier_circle_add()
    target = blender.context.active_object
    target.data.bevel_depth = 0.1
    mesh = evaluated_mesh(target, blender.context.evaluated_depsgraph_get())
    assert len(mesh.triangles) > 100 and np.isfinite(mesh.vertices).all()


def test_the_new_sequence_shows_its_frames(blender, cube, tmp_path):
    blender.ops.refmesh.import_object(output=str(tmp_path / "out"), first=1, last=3)
    owner = blender.context.active_object
    for number in (3, 1, 2):
        blender.context.scene.frame_set(number)
        expected = read_mesh(bpy.path.abspath(owner.refmesh.frames[str(number)].path)).vertices
        np.testing.assert_array_equal(read_positions(owner.data), expected.astype(np.float32))


def test_frames_that_a_killed_bake_left_are_not_taken(blender, cube, tmp_path):
    left = tmp_path / "out" / f"{BAKED_FOLDER}{PARTIAL_SUFFIX}"
    left.mkdir(parents=True)
    (left / "My__cube__001_0099.ply").write_bytes(b"of another bake")
    blender.ops.refmesh.import_object(output=str(tmp_path / "out"), first=2, last=3)
    assert [frame.name for frame in blender.context.active_object.refmesh.frames] == ["2", "3"] and not left.exists()


def test_uv_map_and_image_sequence_of_an_object_become_the_colors_of_the_frames(blender, cube, tmp_path):
    """The picture of each frame, at the places of the corners."""
    for number in (1, 2, 3):
        write_image(tmp_path / f"skin_{number}.png", np.full((8, 8, 3), 50 * number, np.uint8))
    image = bpy.data.images.load(str(tmp_path / "skin_1.png"))
    image.source = "SEQUENCE"
    cube.data.materials.append(image_material("skin", image, 1, 3))
    blender.ops.refmesh.import_object(output=str(tmp_path / "out"), first=1, last=3)
    owner = blender.context.active_object
    for number, frame in zip((1, 2, 3), owner.refmesh.frames):
        path = Path(bpy.path.abspath(frame.path))
        appearance, notes, _ = parse_appearance(path.read_bytes(), path)
        assert notes == () and (appearance.images[0] == 50 * number).all() and (appearance.materials == 0).all()
        np.testing.assert_array_equal(appearance.mesh.triangles, read_mesh(path).triangles)
        assert -1e-6 <= appearance.uvs.min() < appearance.uvs.max() <= 1 + 1e-6
    assert owner.refmesh.source_colors


@pytest.mark.parametrize("kind", ["usdc", "usdz", "abc"])
def test_colors_of_an_object_that_a_file_brings(blender, tmp_path, kind):
    """A USDZ file has its pictures inside; an Alembic file has UV maps only, and the material is given to the object afterward."""
    blender.ops.mesh.primitive_cube_add()
    box, path = blender.context.active_object, tmp_path / "from" / f"take.{kind}"
    grow = box.modifiers.new("Grow", "DISPLACE")
    for frame in (1, 2):
        grow.strength = float(frame)
        grow.keyframe_insert("strength", frame=frame)
    write_image(tmp_path / "skin.png", np.full((8, 8, 3), (200, 100, 50), np.uint8))
    box.data.materials.append(image_material("skin", bpy.data.images.load(str(tmp_path / "skin.png"))))
    blender.context.scene.frame_start, blender.context.scene.frame_end = 1, 2
    path.parent.mkdir()
    if kind == "abc":
        blender.ops.wm.alembic_export(filepath=str(path), as_background_job=False)
    else:
        blender.ops.wm.usd_export(filepath=str(path), export_animation=True)
    blender.ops.refmesh.import_scene(filepath=str(path), empty_scene=True)
    if kind == "abc":
        skin = image_material("skin", bpy.data.images.load(str(tmp_path / "skin.png")))
        blender.context.active_object.data.materials.append(skin)
    blender.ops.refmesh.import_object(output=str(tmp_path / "out"), first=1, last=2)
    files = [Path(bpy.path.abspath(frame.path)) for frame in blender.context.active_object.refmesh.frames]
    shown = [parse_appearance(file.read_bytes(), file)[0] for file in files]
    assert [appearance.images[0][0, 0].tolist() for appearance in shown] == [[200, 100, 50]] * 2
    assert all(0.0 <= appearance.uvs.min() < appearance.uvs.max() <= 1.0 for appearance in shown)
    assert np.ptp(shown[1].mesh.vertices) > 1.1 * np.ptp(shown[0].mesh.vertices)


def test_a_color_attribute_of_an_object_becomes_vertex_colors(blender, cube, tmp_path):
    attribute = cube.data.color_attributes.new("Paint", "BYTE_COLOR", "CORNER")
    attribute.data.foreach_set("color_srgb", np.tile([0.2, 0.4, 0.6, 1.0], len(attribute.data)))
    blender.ops.refmesh.import_object(output=str(tmp_path / "out"), first=1, last=1)
    path = Path(bpy.path.abspath(blender.context.active_object.refmesh.frames[0].path))
    colors = parse_appearance(path.read_bytes(), path)[0].colors
    assert np.unique(colors.reshape(-1, 3), axis=0).tolist() == [[51, 102, 153]]


@pytest.mark.parametrize("mirror", [1.0, -1.0])
def test_corners_keep_their_places_in_the_picture(blender, tmp_path, mirror):
    """A plane whose u grows with its own x and v with its y."""
    blender.ops.mesh.primitive_grid_add(x_subdivisions=3, y_subdivisions=2)
    plane = blender.context.active_object
    plane.scale.x = mirror
    write_image(tmp_path / "skin.png", np.zeros((8, 8, 3), np.uint8))
    plane.data.materials.append(image_material("skin", bpy.data.images.load(str(tmp_path / "skin.png"))))
    blender.ops.refmesh.import_object(output=str(tmp_path / "out"), first=1, last=1)
    path = Path(bpy.path.abspath(blender.context.active_object.refmesh.frames[0].path))
    appearance = parse_appearance(path.read_bytes(), path)[0]
    x, y, _ = appearance.mesh.vertices[appearance.mesh.triangles].transpose(2, 0, 1)
    np.testing.assert_allclose(appearance.uvs, np.stack([(1 + mirror * x) / 2, (1 + y) / 2], axis=2), atol=1e-6)
