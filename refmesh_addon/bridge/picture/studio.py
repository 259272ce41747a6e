"""A separate scene for one picture: light, background, labels and an orthographic camera that looks down -Z.

Everything is placed in the camera's coordinates: x to the right, y up, z toward the viewer.
"""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy
import numpy as np

from ...core.errors import RefMeshError
from ...core.types import TriangleMesh
from ...io.files import PARTIAL_SUFFIX
from ..scene.materials import emission_material, enable_nodes
from ..scene.meshes import COLOR_NAME, fill_mesh, set_colors
from ..scene.objects import remove_object

SAMPLES = 16  # enough for soft daylight on plain surfaces
BACKGROUND = (0.80, 0.81, 0.82, 1.0)
PNG_END = b"IEND\xaeB`\x82"
INK = (0.02, 0.02, 0.025, 1.0)
SKY_STRENGTH, SUN_STRENGTH = 0.55, 3.0
SUN_ANGLE = 0.3  # radians: the apparent size of the sun, for soft shadows
SUN_TURN = (-0.6, 0.5, 0.0)  # from the upper left, over the viewer's shoulder


@contextmanager
def studio() -> Iterator[bpy.types.Scene]:
    """An empty scene with light; the scene and its contents are removed after the block."""
    scene = bpy.data.scenes.new("RefMesh preview")
    scene.world = bpy.data.worlds.new("RefMesh preview")
    light = bpy.data.lights.new("RefMesh sun", "SUN")
    camera = bpy.data.cameras.new("RefMesh preview")
    try:
        _light(scene, light)
        scene.camera = add(scene, "RefMesh preview", camera)
        yield scene
    finally:
        for member in list(scene.objects):
            data = member.data
            remove_object(member)
            if isinstance(data, bpy.types.TextCurve):
                bpy.data.curves.remove(data)
        world = scene.world
        bpy.data.scenes.remove(scene)
        bpy.data.worlds.remove(world)
        bpy.data.lights.remove(light)
        bpy.data.cameras.remove(camera)


def add(scene: bpy.types.Scene, name: str, data: bpy.types.ID) -> bpy.types.Object:
    """An object for `data` in the scene."""
    member = bpy.data.objects.new(name, data)
    scene.collection.objects.link(member)
    return member


def write(scene: bpy.types.Scene, text: str, place: tuple[float, float], size: float) -> None:
    """Adds text, centered below `place`; `size` is the height of a line, scene units."""
    curve = bpy.data.curves.new(text, "FONT")
    curve.body, curve.size, curve.align_x, curve.align_y = text, size, "CENTER", "TOP"
    curve.materials.append(emission_material("RefMesh Ink", INK))
    add(scene, text, curve).location = (*place, 0.0)


def draw_bar(scene: bpy.types.Scene, corner: tuple[float, float], size: tuple[float, float], colors: np.ndarray) -> None:
    """Adds a horizontal color bar with its lower left at `corner`; colors (N, 4) linear, from left to right."""
    across = np.linspace(corner[0], corner[0] + size[0], len(colors))
    rows = [np.column_stack([across, np.full_like(across, height), np.zeros_like(across)]) for height in (corner[1], corner[1] + size[1])]
    first = np.arange(len(colors) - 1)
    above = first + len(colors)
    triangles = np.concatenate([np.column_stack([first, first + 1, above + 1]), np.column_stack([first, above + 1, above])])
    bar = bpy.data.meshes.new("RefMesh scale")
    fill_mesh(bar, TriangleMesh(np.concatenate(rows), triangles))
    set_colors(bar, np.concatenate([colors, colors]))
    bar.materials.append(emission_material("RefMesh Scale", attribute=COLOR_NAME))
    add(scene, "RefMesh scale", bar)


def render(scene: bpy.types.Scene, low: np.ndarray, high: np.ndarray, target: Path, pixels: int) -> None:
    """Renders the box from `low` to `high`, (3,) each, to a PNG, `pixels` wide, that is complete or absent.

    Raises RefMeshError when Cycles is not enabled or the file cannot be written.
    """
    width, height, depth = high - low
    camera = scene.camera
    camera.location = (*((low + high) / 2)[:2], high[2] + depth + width)
    camera.data.type, camera.data.ortho_scale, camera.data.sensor_fit = "ORTHO", width, "HORIZONTAL"
    camera.data.clip_start, camera.data.clip_end = 0.01 * width, 3.0 * (depth + width)
    _use_cycles(scene)
    settings = scene.render
    settings.resolution_x, settings.resolution_y, settings.resolution_percentage = pixels, max(1, round(pixels * height / width)), 100
    settings.image_settings.file_format = "PNG"
    partial = target.with_name(f"{target.stem}{PARTIAL_SUFFIX}.png")
    settings.filepath = str(partial)
    try:
        bpy.ops.render.render(write_still=True, scene=scene.name)
        if not partial.read_bytes().endswith(PNG_END):  # Blender reports no error when the disk is full
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        os.replace(partial, target)
    except (RuntimeError, OSError) as error:
        raise RefMeshError(f"{target}: the picture cannot be written ({str(error).strip()})") from error
    finally:
        partial.unlink(missing_ok=True)


def _light(scene: bpy.types.Scene, light: bpy.types.Light) -> None:
    enable_nodes(scene.world)
    sky = next(node for node in scene.world.node_tree.nodes if node.type == "BACKGROUND")
    sky.inputs["Color"].default_value = BACKGROUND
    _dim_for_lighting(scene.world.node_tree, sky)
    light.energy, light.angle = SUN_STRENGTH, SUN_ANGLE
    add(scene, "RefMesh sun", light).rotation_euler = SUN_TURN


def _dim_for_lighting(tree: bpy.types.NodeTree, sky: bpy.types.ShaderNode) -> None:
    """The camera sees the background as it is; its light is weaker, so that the sun can shade the shapes."""
    path, strength = tree.nodes.new("ShaderNodeLightPath"), tree.nodes.new("ShaderNodeMapRange")
    strength.inputs["To Min"].default_value = SKY_STRENGTH
    tree.links.new(path.outputs["Is Camera Ray"], strength.inputs["Value"])
    tree.links.new(strength.outputs["Result"], sky.inputs["Strength"])


def _use_cycles(scene: bpy.types.Scene) -> None:
    try:
        scene.render.engine = "CYCLES"  # the only engine that needs no graphics card
    except TypeError as error:
        raise RefMeshError("the preview is rendered with Cycles: enable the add-on 'Cycles Render Engine' in the preferences") from error
    scene.cycles.samples, scene.cycles.device = SAMPLES, "CPU"
    scene.cycles.use_denoising = False  # not in every build, and it would take more time than it saves
    scene.cycles.max_bounces = 2
    scene.view_settings.view_transform = "Standard"  # colors of the error scale as they are
