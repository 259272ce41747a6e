"""The materials of the add-on. One that exists already under its name may have been edited and stays as it is."""

from __future__ import annotations

import bpy

SOURCE_COLOR = (0.35, 0.36, 0.38, 1.0)
REFERENCE_COLOR = (0.80, 0.42, 0.12, 1.0)
DEFORMED_COLOR = (0.16, 0.38, 0.70, 1.0)
ROUGHNESS = 0.7  # without highlights, which would hide the shape of a capture


def plain_material(name: str, color: tuple[float, float, float, float]) -> bpy.types.Material:
    """A material of one linear color, also in solid shading."""
    return bpy.data.materials.get(name) or _new_material(name, color)


def attribute_material(name: str, attribute: str) -> bpy.types.Material:
    """A material that takes its color from a color attribute."""
    existing = bpy.data.materials.get(name)
    if existing:
        return existing
    material = _new_material(name, (1.0, 1.0, 1.0, 1.0))
    attribute_node = material.node_tree.nodes.new("ShaderNodeAttribute")
    attribute_node.attribute_name = attribute
    attribute_node.location = (-250.0, 250.0)
    material.node_tree.links.new(attribute_node.outputs["Color"], _surface(material).inputs["Base Color"])
    return material


def emission_material(
    name: str, color: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0), attribute: str = ""
) -> bpy.types.Material:
    """A material that shows one linear color, or a color attribute, independent of lighting."""
    material = attribute_material(name, attribute) if attribute else plain_material(name, (0.0, 0.0, 0.0, 1.0))
    surface = _surface(material)
    emission, base = surface.inputs["Emission Color"], surface.inputs["Base Color"]
    emission.default_value, base.default_value = color, (0.0, 0.0, 0.0, 1.0)
    surface.inputs["Emission Strength"].default_value, surface.inputs["Specular IOR Level"].default_value = 1.0, 0.0
    if base.links:
        material.node_tree.links.new(base.links[0].from_socket, emission)
        material.node_tree.links.remove(base.links[0])
    return material


def image_material(name: str, image: bpy.types.Image, first: int = 0, count: int = 0) -> bpy.types.Material:
    """A material of an image, or of an image sequence whose file numbers are the scene's frames.

    first, count : first file of a sequence and number of its files; before and after it, first and last are held. Plays without
    the add-on, in Cycles, EEVEE and solid shading by texture.
    """
    material = bpy.data.materials.get(name) or _new_material(name, (1.0, 1.0, 1.0, 1.0))
    nodes = material.node_tree.nodes
    node = next((node for node in nodes if node.type == "TEX_IMAGE"), None) or nodes.new("ShaderNodeTexImage")
    node.image, node.location = image, (-350.0, 250.0)
    if count:
        user = node.image_user
        user.frame_start, user.frame_offset, user.frame_duration = first, first - 1, count
        user.use_auto_refresh = True
    nodes.active = node  # what solid shading shows
    material.node_tree.links.new(node.outputs["Color"], _surface(material).inputs["Base Color"])
    return material


def fade_by(material: bpy.types.Material, attribute: str) -> None:
    """Makes a material as transparent as an attribute of the points says, 0 to 1; opaque where there is none.

    A transparency that the material has already stays.
    """
    alpha = _surface(material).inputs["Alpha"]
    if alpha.links or alpha.default_value < 1.0:
        return
    nodes, links = material.node_tree.nodes, material.node_tree.links
    value, rest = nodes.new("ShaderNodeAttribute"), nodes.new("ShaderNodeMath")
    value.attribute_name, value.location = attribute, (-550.0, -50.0)
    rest.operation, rest.location = "SUBTRACT", (-300.0, -50.0)
    rest.inputs[0].default_value = 1.0
    links.new(value.outputs["Fac"], rest.inputs[1])
    links.new(rest.outputs[0], alpha)


def enable_nodes(owner: bpy.types.Material | bpy.types.World) -> None:
    """Gives it a node tree; from Blender 5.0 it always has one."""
    if bpy.app.version < (5, 0):
        owner.use_nodes = True


def _new_material(name: str, color: tuple[float, float, float, float]) -> bpy.types.Material:
    material = bpy.data.materials.new(name)
    enable_nodes(material)
    surface = _surface(material)
    surface.inputs["Base Color"].default_value = color
    surface.inputs["Roughness"].default_value = ROUGHNESS
    material.diffuse_color = color
    return material


def _surface(material: bpy.types.Material) -> bpy.types.ShaderNode:
    return next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
