"""The captured frames in their own colors: each with its own picture, also in renders, and plain where there are none."""

from pathlib import Path

import bpy
import numpy as np
import pytest
import trimesh
from PIL import Image

from refmesh_addon.bridge.sequence.source_colors import MARK
from refmesh_addon.core.types import TriangleMesh
from refmesh_addon.io.images import write_image
from refmesh_addon.io.ply import write_ply

NUMBERS = (1, 2, 3)
SHADES = {1: 40, 2: 120, 3: 200}
QUAD = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nv 0 0 -1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"


def write_frame(folder: Path, number: int, extension: str = ".png") -> None:
    """A pyramid whose base shows a picture that is brighter in its upper half."""
    picture = np.full((8 * number, 8, 3), SHADES[number], np.uint8)
    picture[: 4 * number] += 40
    write_image(folder / f"scan_{number}{extension}", picture)
    (folder / f"scan_{number}.mtl").write_text(f"newmtl skin\nmap_Kd scan_{number}{extension}\n")
    faces = "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\nf 2/1 1/1 5/1\nf 3/1 2/1 5/1\nf 4/1 3/1 5/1\nf 1/1 4/1 5/1\n"
    (folder / f"scan_{number}.obj").write_text(f"mtllib scan_{number}.mtl\n{QUAD}usemtl skin\n{faces}")


@pytest.fixture
def textured(blender, tmp_path):
    for number in NUMBERS:
        write_frame(tmp_path, number)
    bpy.ops.refmesh.import_sequence(filepath=str(tmp_path / "scan_1.obj"), up_axis="Z")
    return bpy.context.active_object


def shown_image(owner) -> bpy.types.Image:
    (material,) = owner.data.materials
    return next(node for node in material.node_tree.nodes if node.type == "TEX_IMAGE").image


def test_each_frame_shows_its_own_picture_and_only_one_is_kept(textured):
    for number in (2, 3, 1, 3):
        bpy.context.scene.frame_set(number)
        image = shown_image(textured)
        assert Path(image.filepath).name == f"scan_{number}.png"
        assert round(255 * image.pixels[0]) == SHADES[number] and round(255 * image.pixels[len(image.pixels) - 4]) == SHADES[number] + 40
        assert len([item for item in bpy.data.images if item.get(MARK)]) == 1
        uvs = np.empty(2 * len(textured.data.loops), np.float32)
        textured.data.uv_layers.active.uv.foreach_get("vector", uvs)
        assert uvs[:6].tolist() == [0, 0, 1, 0, 1, 1]


def test_renders_of_an_animation_show_the_picture_of_each_frame(textured, tmp_path):
    """The upper half is the brighter one: v is the right way up."""
    scene, material = bpy.context.scene, textured.data.materials[0]
    nodes, links = material.node_tree.nodes, material.node_tree.links
    emission, output = nodes.new("ShaderNodeEmission"), next(item for item in nodes if item.type == "OUTPUT_MATERIAL")
    links.new(next(node for node in nodes if node.type == "TEX_IMAGE").outputs["Color"], emission.inputs["Color"])
    links.new(emission.outputs[0], output.inputs["Surface"])
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.type, camera.data.ortho_scale, camera.location = "ORTHO", 1.6, (0.0, 0.0, 5.0)
    scene.collection.objects.link(camera)
    scene.camera, scene.render.engine, scene.cycles.samples, scene.cycles.device = camera, "CYCLES", 1, "CPU"
    scene.view_settings.view_transform, scene.render.filepath = "Standard", str(tmp_path / "shots" / "shot_")
    scene.render.resolution_x = scene.render.resolution_y = 8
    scene.render.resolution_percentage, scene.render.image_settings.file_format = 100, "PNG"
    scene.render.dither_intensity = 0.0
    scene.frame_start, scene.frame_end = 1, 3
    bpy.ops.render.render(animation=True)
    for number in NUMBERS:
        with Image.open(tmp_path / "shots" / f"shot_{number:04d}.png") as shot:
            pixels = np.asarray(shot.convert("RGB"))
        assert pixels[-1, 4, 0] == pytest.approx(SHADES[number], abs=2)
        assert pixels[0, 4, 0] == pytest.approx(SHADES[number] + 40, abs=2)


def test_colors_can_be_switched_off_and_a_material_of_the_user_stays(textured):
    textured.refmesh.source_colors = False
    assert textured.data.materials[0].name == "RefMesh Source"
    textured.refmesh.source_colors = True
    assert shown_image(textured)
    textured.data.materials[0] = mine = bpy.data.materials.new("mine")
    bpy.context.scene.frame_set(2)
    assert textured.data.materials[0] == mine


def test_a_frame_whose_picture_is_missing_or_damaged_is_plain(blender, tmp_path):
    for number in NUMBERS:
        write_frame(tmp_path, number)
    (tmp_path / "scan_2.png").write_bytes((tmp_path / "scan_2.png").read_bytes()[:40])
    (tmp_path / "scan_3.png").unlink()
    bpy.ops.refmesh.import_sequence(filepath=str(tmp_path / "scan_1.obj"), up_axis="Z")
    owner = bpy.context.active_object
    for number in (2, 3):
        bpy.context.scene.frame_set(number)
        assert len(owner.data.polygons) == 6
        assert owner.data.materials[0].name == "RefMesh Source"


def test_vertex_colors_of_ply_frames(blender, tmp_path):
    mesh = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    for number in NUMBERS:
        write_ply(tmp_path / f"scan_{number}.ply", mesh, np.full((4, 4), SHADES[number], np.uint8))
    bpy.ops.refmesh.import_sequence(filepath=str(tmp_path / "scan_1.ply"))
    owner = bpy.context.active_object
    for number in (1, 3, 2):
        bpy.context.scene.frame_set(number)
        colors = np.empty(4 * len(owner.data.loops), np.float32)
        owner.data.color_attributes["Col"].data.foreach_get("color_srgb", colors)
        assert np.unique(np.rint(255 * colors.reshape(-1, 4)[:, :3])).tolist() == [SHADES[number]]


def test_pictures_inside_of_glb_frames(blender, tmp_path):
    for number in NUMBERS:
        picture = Image.fromarray(np.full((8, 8, 3), SHADES[number], np.uint8))
        box = trimesh.creation.box()
        box.visual = trimesh.visual.TextureVisuals(
            uv=box.vertices[:, :2] + 0.5, material=trimesh.visual.material.PBRMaterial(baseColorTexture=picture)
        )
        (tmp_path / f"scan_{number}.glb").write_bytes(box.export(file_type="glb"))
    bpy.ops.refmesh.import_sequence(filepath=str(tmp_path / "scan_1.glb"))
    for number in (2, 3):
        bpy.context.scene.frame_set(number)
        assert round(255 * shown_image(bpy.context.active_object).pixels[0]) == SHADES[number]
