"""Exports for game engines: FBX read back by Blender's own importer, textures read by Blender's own image reader."""

from __future__ import annotations

import json

import bpy
import numpy as np
import pytest

from refmesh_addon.bridge.scene.meshes import read_positions

from .conftest import GROUPS, NUMBERS, place, reference

TOLERANCE = 1e-3  # scene units; the ball is some 2 across, and FBX stores centimeters in single precision


def world_positions(member: bpy.types.Object) -> np.ndarray:
    evaluated = member.evaluated_get(bpy.context.evaluated_depsgraph_get())
    matrix = np.array(evaluated.matrix_world)
    return read_positions(evaluated.data) @ matrix[:3, :3].T + matrix[:3, 3]


def expected(index: int, number: float) -> np.ndarray:
    """The ball upright, as Blender shows it."""
    x, y, z = place(reference(index).vertices, number).T
    return np.column_stack([x, -z, y])


def imported_fbx(path) -> list[bpy.types.Object]:
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.import_scene.fbx(filepath=str(path), anim_offset=0.0)
    return sorted((item for item in bpy.data.objects if item.type == "MESH"), key=lambda item: item.name)


needs_fbx = pytest.mark.skipif(not hasattr(bpy.types, "IMPORT_SCENE_OT_fbx"), reason="this Blender has no importer of FBX in Python")


@needs_fbx
def test_fbx_plays_frame_by_frame(blender, solved, results):
    blender.ops.refmesh.export(format="fbx")
    bodies = imported_fbx(results / "export" / "ball.fbx")
    for number in NUMBERS:
        bpy.context.scene.frame_set(number)
        for index, numbers in enumerate(GROUPS):
            positions = world_positions(bodies[index])
            if number in numbers:
                np.testing.assert_allclose(positions, expected(index, number), atol=TOLERANCE)
            else:
                assert np.ptp(positions, axis=0).max() < TOLERANCE


@needs_fbx
def test_fbx_with_a_step_has_key_frames_that_turn_into_each_other(blender, solved, results):
    blender.ops.refmesh.export(format="fbx", step=2)
    body = imported_fbx(results / "export" / "ball.fbx")[0]
    assert len(body.data.shape_keys.key_blocks) == 2  # frames 6 and 8
    for number in GROUPS[0]:
        bpy.context.scene.frame_set(number)
        np.testing.assert_allclose(world_positions(body), expected(0, number), atol=TOLERANCE)  # the ball moves in a straight line


def pixels(path) -> np.ndarray:
    """(H, W, 3) of a picture, first row at the top, values 0 to 1."""
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name = "Non-Color"
    values = np.empty(image.size[0] * image.size[1] * 4, np.float32)
    image.pixels.foreach_get(values)
    return values.reshape(image.size[1], image.size[0], 4)[::-1, :, :3]


@pytest.mark.parametrize("arrangement", ["square", "row"])
def test_vertex_animation_textures_move_the_mesh_as_the_results_do(blender, solved, results, arrangement):
    blender.ops.refmesh.export(format="vat", vat_arrangement=arrangement)
    for index, numbers in enumerate(GROUPS):
        name = f"ball_group_{index:03d}"
        folder = results / "export" / f"{name}_vat"
        remap = json.loads((folder / f"{name}-remap_info.json").read_text())["os-remap"]
        texture = pixels(folder / f"{name}_vat.png")
        bpy.ops.import_scene.gltf(filepath=str(folder / f"{name}.glb"))
        mesh = bpy.context.selected_objects[0].data
        corners = np.empty(2 * len(mesh.loops), np.float32)
        mesh.uv_layers[1].uv.foreach_get("vector", corners)
        owners = np.empty(len(mesh.loops), np.int32)
        mesh.loops.foreach_get("vertex_index", owners)
        texels = np.empty((len(mesh.vertices), 2))
        texels[owners] = corners.reshape(-1, 2) * [1, -1] + [0, 1]
        height, width = texture.shape[:2]
        columns, rows = (np.floor(texels[:, axis] * size).astype(int) for axis, size in ((0, width), (1, height)))
        for frame, number in enumerate(numbers):
            low, high = np.array(remap["Min"]), np.array(remap["Max"])
            shown = read_positions(mesh) + low + texture[rows + frame, columns] * (high - low)
            distances = np.linalg.norm(shown[:, None] - expected(index, number), axis=2)
            assert distances.min(axis=1).max() < 1e-4
            assert remap["Frames"] == len(numbers)
