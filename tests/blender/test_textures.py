"""Textures on the results: UVs, a material that plays them, and what exports carry."""

import json
from pathlib import Path

import bpy
import numpy as np
import pytest

from refmesh_addon.bridge.results.textures import show_textures
from refmesh_addon.bridge.scene.timeline import save_scene
from refmesh_addon.core.color.projected_layout import projected_layout
from refmesh_addon.io.files import write_npz
from refmesh_addon.io.images import write_image
from refmesh_addon.io.ply import read_surface

NUMBERS = (6, 7, 8, 9, 10, 11)  # a picture for each scene frame


@pytest.fixture
def colored(ball, results):
    """The sequence object with results that have textures: frame n is gray n, the steady texture of group k is 100 + k."""
    report = json.loads((results / "report.json").read_text())
    (results / "texture").mkdir()
    for number in NUMBERS:
        write_image(results / "texture" / f"frame_{number:04d}.png", np.full((8, 8, 3), number, np.uint8))
    for frame in report["frames"]:
        frame["texture"] = f"texture/frame_{frame['number']:04d}.png"
    for index, group in enumerate(report["groups"]):
        layout = projected_layout(read_surface(results / group["reference"]))
        group["layout"], group["texture"] = f"texture/group_{index:03d}_layout.npz", f"texture/group_{index:03d}_steady.png"
        write_npz(results / group["layout"], {"uvs": layout.uvs, "triangles": layout.triangles})
        write_image(results / group["texture"], np.full((8, 8, 3), 100 + index, np.uint8))
    report["seconds"]["color"] = 1.0
    (results / "report.json").write_text(json.dumps(report))
    bpy.ops.refmesh.load_results(output=str(results))
    return ball


def image_node(group) -> bpy.types.ShaderNode:
    (material,) = group.deformed.data.materials
    return next(node for node in material.node_tree.nodes if node.type == "TEX_IMAGE")


def test_groups_have_the_layout_as_uvs(colored):
    for group in colored.refmesh.groups:
        mesh = group.deformed.data
        uvs = np.empty(2 * len(mesh.loops), np.float32)
        mesh.uv_layers.active.uv.foreach_get("vector", uvs)
        assert 0.0 <= uvs.min() < uvs.max() <= 1.0
        assert len(group.reference.data.uv_layers) == 1
    assert "color" in colored.refmesh.done


def test_captured_colors_play_frame_by_frame(colored):
    """By Blender's rule: file number = scene frame - start + 1 + offset."""
    user = image_node(colored.refmesh.groups[0]).image_user
    assert image_node(colored.refmesh.groups[0]).image.source == "SEQUENCE"
    for number in NUMBERS:
        assert number - user.frame_start + 1 + user.frame_offset == number
    assert (user.frame_start, user.frame_duration) == (6, 6)
    assert user.use_auto_refresh


def test_rendered_frames_show_their_own_pictures(colored, tmp_path):
    """Through Cycles: what the material plays is what the file of that frame holds."""
    scene = bpy.context.scene
    group = colored.refmesh.groups[0]
    material = group.deformed.data.materials[0]
    node = image_node(group)
    emission = material.node_tree.nodes.new("ShaderNodeEmission")
    output = next(item for item in material.node_tree.nodes if item.type == "OUTPUT_MATERIAL")
    material.node_tree.links.new(node.outputs["Color"], emission.inputs["Color"])
    material.node_tree.links.new(emission.outputs[0], output.inputs["Surface"])
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.type, camera.data.ortho_scale = "ORTHO", 0.1
    scene.collection.objects.link(camera)
    scene.camera = camera
    for member in bpy.data.objects:
        member.hide_render = member not in (group.deformed, camera)
    group.deformed.animation_data_clear()
    group.deformed.hide_render = False
    scene.render.engine, scene.cycles.samples, scene.cycles.device = "CYCLES", 1, "CPU"
    scene.view_settings.view_transform = "Standard"
    scene.render.resolution_x = scene.render.resolution_y = 8
    scene.render.image_settings.file_format = "PNG"
    for number in (6, 8):
        scene.frame_set(number)
        bounds = np.array([group.deformed.matrix_world @ vertex.co for vertex in group.deformed.data.vertices])
        camera.location = (*bounds.mean(axis=0)[:2], bounds[:, 2].max() + 10.0)
        scene.render.filepath = str(tmp_path / f"shot_{number}.png")
        bpy.ops.render.render(write_still=True)
        shot = bpy.data.images.load(scene.render.filepath)
        assert round(255 * shot.pixels[0]) == pytest.approx(number, abs=1)


def test_switch_shows_steady_plain_and_captured_colors(colored):
    state = colored.refmesh
    state.surface_color = "STEADY"
    paths = [bpy.path.abspath(image_node(group).image.filepath) for group in state.groups]
    assert [path.endswith(f"group_{index:03d}_steady.png") for index, path in enumerate(paths)] == [True] * len(paths)
    state.surface_color = "PLAIN"
    assert state.groups[0].deformed.data.materials[0].name == "RefMesh Deformed"
    state.surface_color = "CAPTURED"
    assert image_node(state.groups[0]).image.source == "SEQUENCE"


def exported(colored, kind):
    bpy.ops.refmesh.export(format=kind)
    return next(path for path in (Path(bpy.path.abspath(colored.refmesh.output)) / "export").rglob(f"*.{kind}"))


def test_glb_embeds_the_steady_textures(colored):
    path = exported(colored, "glb")
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.import_scene.gltf(filepath=str(path))
    shades = sorted(round(255 * image.pixels[0]) for image in bpy.data.images if image.size[0] == 8)
    assert shades == [100, 101]
    meshes = [item for item in bpy.data.objects if item.type == "MESH" and item.material_slots]
    assert all(len(item.data.uv_layers) == 1 and item.material_slots[0].material for item in meshes) and len(meshes) == 2


def test_usd_carries_uvs_materials_and_pictures(colored):
    path = exported(colored, "usd")
    steady, frames = ({picture.name for picture in (path.parent / name).iterdir()} for name in ("textures", "ball_textures"))
    assert steady == {"group_000_steady.png", "group_001_steady.png"}
    assert frames == {f"frame_{number:04d}.png" for number in (6, 7, 8, 10, 11)}
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.wm.usd_import(filepath=str(path))
    assert all(item.data.uv_layers and item.data.materials for item in bpy.data.objects if item.type == "MESH")
    shown = [image for image in bpy.data.images if image.size[0] == 8]
    assert sorted(round(255 * image.pixels[0]) for image in shown) == [100, 101]


def test_alembic_carries_uvs_and_pictures_beside_it(colored):
    path = exported(colored, "abc")
    assert len(list((path.parent / "ball_textures").glob("frame_*.png"))) == 5
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.wm.alembic_import(filepath=str(path), as_background_job=False)
    assert all(item.data.uv_layers for item in bpy.data.objects if item.type == "MESH")


def test_a_material_of_the_user_stays(colored, results):
    group = colored.refmesh.groups[0]
    group.deformed.data.materials[0] = mine = bpy.data.materials.new("mine")
    colored.refmesh.surface_color = "STEADY"
    bpy.ops.refmesh.load_results(output=str(results))
    assert colored.refmesh.groups[0].deformed.data.materials[0] == mine


def test_saved_scene_names_textures_relative_to_it(colored, results):
    save_scene(results / "scene.blend")
    paths = {image.filepath.replace("\\", "/") for image in bpy.data.images if image.source in ("FILE", "SEQUENCE") and image.filepath}
    assert paths == {"//texture/frame_0006.png", "//texture/group_000_steady.png", "//texture/group_001_steady.png"}


def test_a_mesh_of_the_user_shows_the_textures_by_its_own_uv_map(colored, results):
    """Only where they were baked for that map."""
    mesh = colored.refmesh.groups[0].deformed.data
    mesh.uv_layers.remove(mesh.uv_layers["RefMesh Layout"])
    mesh.uv_layers.new(name="Mine")
    mesh["refmesh_own_mesh"] = "own_mesh.ply"
    for source, shown in (("own", "TEX_IMAGE"), ("xatlas", None)):
        report = json.loads((results / "report.json").read_text())
        report["groups"][0]["layout_source"] = source
        (results / "report.json").write_text(json.dumps(report))
        show_textures(colored, results, report)
        kinds = {node.type for node in mesh.materials[0].node_tree.nodes}
        assert ("TEX_IMAGE" in kinds) == (shown is not None)
        assert [layer.name for layer in mesh.uv_layers] == ["Mine"]


def test_painted_textures_are_shown_the_latest_one_and_steady_ones_without(colored, results):
    for number in (2, 10):
        write_image(results / "texture" / f"group_001_steady_painted_{number}.png", np.full((8, 8, 3), 200 + number, np.uint8))
    bpy.ops.refmesh.load_results(output=str(results))
    colored.refmesh.surface_color = "PAINTED"
    names = [Path(image_node(group).image.filepath).name for group in colored.refmesh.groups]
    assert names == ["group_000_steady.png", "group_001_steady_painted_10.png"]
    path = exported(colored, "glb")
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.import_scene.gltf(filepath=str(path))
    assert sorted(round(255 * image.pixels[0]) for image in bpy.data.images if image.size[0] == 8) == [100, 210]
