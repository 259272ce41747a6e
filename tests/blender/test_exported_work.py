"""What a person has put on the deformed meshes goes into files, and comes back by Blender's own importers."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

from refmesh_addon.bridge.scene.meshes import read_positions

from .conftest import place, reference
from .test_exports import IMPORTERS, imported, written  # noqa: F401  (a fixture)

SIZE = 4  # pixels


@pytest.fixture
def painted(solved, tmp_path):
    """UV maps, a textured material on half of the faces, colors and a vertex group on every deformed mesh."""
    image = bpy.data.images.new("skin", SIZE, SIZE)
    image.pixels.foreach_set(np.linspace(0, 1, 4 * SIZE * SIZE).astype(np.float32))
    image.filepath_raw, image.file_format = str(tmp_path / "skin.png"), "PNG"
    image.save()
    skin = bpy.data.materials.new("skin")
    if bpy.app.version < (5, 0):
        skin.use_nodes = True
    node = skin.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    surface = next(item for item in skin.node_tree.nodes if item.type == "BSDF_PRINCIPLED")
    skin.node_tree.links.new(node.outputs["Color"], surface.inputs["Base Color"])
    for group in solved.refmesh.groups:
        paint(group.deformed, skin)
    return solved


def paint(member: bpy.types.Object, material: bpy.types.Material) -> None:
    mesh = member.data
    corners, positions = np.array([loop.vertex_index for loop in mesh.loops]), read_positions(mesh)
    mesh.uv_layers.new(name="UVMap").uv.foreach_set("vector", layout(positions)[corners].astype(np.float32).ravel())
    mesh.materials.append(material)
    mesh.polygons.foreach_set("material_index", (np.arange(len(mesh.polygons)) % 2).astype(np.int32))
    colors = mesh.color_attributes.new("Paint", "FLOAT_COLOR", "POINT")
    colors.data.foreach_set(
        "color", np.column_stack([weights(positions), np.full((len(positions), 2), 0.25), np.ones(len(positions))]).ravel()
    )
    mesh.color_attributes.active_color = colors
    group = member.vertex_groups.new(name="head")
    for index, weight in enumerate(weights(positions)):
        group.add([index], float(weight), "REPLACE")


def layout(positions: np.ndarray) -> np.ndarray:
    return 0.5 + 0.4 * positions[:, :2]


def weights(positions: np.ndarray) -> np.ndarray:
    return 0.5 + 0.5 * positions[:, 1]


def imported_layout(mesh: bpy.types.Mesh) -> tuple[np.ndarray, np.ndarray]:
    """UV coordinates of all corners and the vertex of each."""
    flat = np.empty(2 * len(mesh.loops), dtype=np.float32)
    mesh.uv_layers[0].uv.foreach_get("vector", flat)
    return flat.reshape(-1, 2), np.array([loop.vertex_index for loop in mesh.loops])


def rest_of(mesh: bpy.types.Mesh, number: int) -> np.ndarray:
    """The unit sphere that the vertices were moved from in this frame."""
    return (read_positions(mesh) - [0.1 * number, 2.0, 0.0]) / [1.0, 1.5 + 0.1 * number, 0.8]


@pytest.mark.parametrize("kind", IMPORTERS)
def test_work_goes_out_and_comes_back(blender, painted, results, written):  # noqa: F811
    blender.ops.refmesh.export(format=written, first=6, last=8)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    IMPORTERS[written](str(results / "export" / f"ball.{written}"))
    bpy.context.scene.frame_set(6)
    member = next(item for item in bpy.data.objects if item.type == "MESH" and "group_000" in item.name)
    mesh = member.data if written == "glb" else imported(0).data
    if written != "glb":
        rest = reference(0).vertices
        assert len(mesh.vertices) == len(rest)
    else:
        rest = rest_of(mesh, 6)  # the importer turns glTF's axes back, and splits corners
    uv, corners = imported_layout(mesh)
    np.testing.assert_allclose(uv, layout(rest)[corners], atol=1e-4)
    if written == "abc":
        return
    names = {slot.material.name.partition(".")[0].replace("_", " ") for slot in member.material_slots}
    assert names == {"RefMesh Deformed", "skin"}
    skin = next(slot.material for slot in member.material_slots if slot.material.name.startswith("skin"))
    image = next(node.image for node in skin.node_tree.nodes if node.type == "TEX_IMAGE")
    assert tuple(image.size) == (SIZE, SIZE)
    head = mesh.attributes["_HEAD" if written == "glb" else "group_head"]
    values = np.array([item.value for item in head.data])
    np.testing.assert_allclose(values, weights(rest), atol=1e-3)
    colors = mesh.color_attributes[0]
    red = np.array([item.color[0] for item in colors.data])
    expected = weights(rest)[corners] if colors.domain == "CORNER" else weights(rest)
    np.testing.assert_allclose(red, expected, atol=0.01)


@pytest.mark.parametrize("kind", IMPORTERS)
@pytest.mark.parametrize("applied", [True, False])
def test_modifiers_above_the_cache_are_applied_where_asked(blender, painted, results, written, applied):  # noqa: F811
    modifier = painted.refmesh.groups[0].deformed.modifiers.new("lift", "DISPLACE")
    modifier.direction, modifier.strength, modifier.mid_level = "Y", 0.5, 0.0
    blender.ops.refmesh.export(format=written, first=6, last=8, apply_modifiers=applied)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    IMPORTERS[written](str(results / "export" / f"ball.{written}"))
    for number in (6, 8):
        bpy.context.scene.frame_set(number)
        member = imported(0)
        world = read_positions(member.data) @ np.array(member.matrix_world)[:3, :3].T
        x, y, z = (place(reference(0).vertices, number) + [0.0, 0.5 * applied, 0.0]).T
        np.testing.assert_allclose(
            np.sort(np.unique(world.round(4), axis=0), axis=0), np.sort(np.column_stack([x, -z, y]).round(4), axis=0), atol=2e-4
        )


def test_modifiers_that_change_the_topology_are_refused_as_morph_targets(blender, painted, results):
    modifier = painted.refmesh.groups[0].deformed.modifiers.new("fewer", "DECIMATE")
    modifier.keyframe_insert("ratio", frame=6)
    modifier.ratio = 0.3
    modifier.keyframe_insert("ratio", frame=8)
    with pytest.raises(RuntimeError, match="change the number of vertices between frames; export without Apply Modifiers"):
        blender.ops.refmesh.export(format="glb", first=6, last=8)


@pytest.mark.parametrize("apply_modifiers", [False, True])
def test_an_export_leaves_nothing_in_the_file(blender, painted, tmp_path, apply_modifiers):
    """Shape keys without a mesh would make every later save report an error."""
    deformed = painted.refmesh.groups[0].deformed
    deformed.shape_key_add(name="Basis")
    deformed.shape_key_add(name="smile").keyframe_insert("value", frame=6)
    deformed.modifiers.new("Mine", "SUBSURF")
    kinds = ("objects", "meshes", "shape_keys", "actions", "materials", "images", "node_groups", "collections")
    before = {kind: sorted(item.name for item in getattr(bpy.data, kind)) for kind in kinds}
    for kind in ("glb", "fbx", "pc2"):
        blender.ops.refmesh.export(format=kind, apply_modifiers=apply_modifiers and kind != "pc2")
        assert {kind: sorted(item.name for item in getattr(bpy.data, kind)) for kind in kinds} == before
    assert blender.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend")) == {"FINISHED"}
