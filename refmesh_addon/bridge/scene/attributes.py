"""What a person adds to a mesh, read before its geometry is replaced: attributes, vertex groups, shape keys."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

from ...core.types import TriangleMesh

# Data type -> property of an item, type and width of its value.
READABLE = {
    "FLOAT": ("value", np.float32, 1),
    "INT": ("value", np.int32, 1),
    "INT8": ("value", np.int32, 1),
    "BOOLEAN": ("value", bool, 1),
    "FLOAT2": ("vector", np.float32, 2),
    "FLOAT_VECTOR": ("vector", np.float32, 3),
    "INT32_2D": ("value", np.int32, 2),
    "FLOAT_COLOR": ("color", np.float32, 4),
    "BYTE_COLOR": ("color", np.float32, 4),
    "QUATERNION": ("value", np.float32, 4),
}
GEOMETRY = "position"  # written with the mesh itself


@dataclass(frozen=True)
class Attribute:
    """One attribute of a mesh.  values : (N, K), one row for each element of `domain`."""

    name: str
    domain: str
    data_type: str
    values: np.ndarray

    @property
    def is_continuous(self) -> bool:
        """Whether a mean of two values is a value: not for numbers that are labels."""
        return self.values.dtype == np.float32

    @property
    def is_uv(self) -> bool:
        """Whether Blender lists it as a UV map."""
        return (self.domain, self.data_type) == ("CORNER", "FLOAT2")

    @property
    def is_color(self) -> bool:
        """Whether Blender lists it as a color attribute."""
        return self.data_type in ("FLOAT_COLOR", "BYTE_COLOR")


@dataclass(frozen=True)
class Layers:
    """The names that Blender marks as active and as rendered among UV maps and color attributes."""

    active_uv: str
    render_uv: str
    active_color: str
    render_color: str


def read_attributes(mesh: bpy.types.Mesh) -> list[Attribute]:
    """All attributes but the geometry itself, what Blender keeps for its own use (names with a dot), and those of edges."""
    return [
        read_attribute(layer)
        for layer in mesh.attributes
        if layer.domain != "EDGE" and layer.data_type in READABLE and layer.name != GEOMETRY and not layer.name.startswith(".")
    ]


def read_attribute(layer: bpy.types.Attribute) -> Attribute:
    """Name, kind and values of one attribute."""
    member, kind, width = READABLE[layer.data_type]
    flat = np.empty(len(layer.data) * width, dtype=kind)
    layer.data.foreach_get(member, flat)
    return Attribute(layer.name, layer.domain, layer.data_type, flat.reshape(-1, width))


def write_attribute(mesh: bpy.types.Mesh, attribute: Attribute) -> None:
    """Sets the values of an attribute, which is added where the mesh does not have it."""
    layer = mesh.attributes.get(attribute.name)
    if layer is not None and (layer.domain, layer.data_type) != (attribute.domain, attribute.data_type):
        mesh.attributes.remove(layer)
        layer = None
    layer = layer or mesh.attributes.new(attribute.name, attribute.data_type, attribute.domain)
    member, kind, _ = READABLE[attribute.data_type]
    layer.data.foreach_set(member, np.ascontiguousarray(attribute.values, dtype=kind).ravel())


def read_layers(mesh: bpy.types.Mesh) -> Layers:
    """Which UV map and which color attribute are active and rendered."""
    uv, colors = mesh.uv_layers, mesh.color_attributes
    rendered = [layer.name for layer in uv if layer.active_render]
    return Layers(uv.active.name if uv.active else "", rendered[0] if rendered else "", colors.active_color_name, _render_color(mesh))


def write_layers(mesh: bpy.types.Mesh, layers: Layers) -> None:
    """Marks them again, where they are still there."""
    for layer in mesh.uv_layers:
        layer.active_render = layer.active_render or layer.name == layers.render_uv
    if layers.active_uv in mesh.uv_layers:
        mesh.uv_layers.active = mesh.uv_layers[layers.active_uv]
    names = [layer.name for layer in mesh.color_attributes]
    if layers.active_color in names:
        mesh.color_attributes.active_color_index = names.index(layers.active_color)
    if layers.render_color in names:
        mesh.color_attributes.render_color_index = names.index(layers.render_color)


def _render_color(mesh: bpy.types.Mesh) -> str:
    index, colors = mesh.color_attributes.render_color_index, mesh.color_attributes
    return colors[index].name if 0 <= index < len(colors) else ""


def read_weights(member: bpy.types.Object) -> np.ndarray:
    """(V, G) weights of all vertex groups, in their order; NaN where a vertex does not belong to a group."""
    weights = np.full((len(member.data.vertices), len(member.vertex_groups)), np.nan, dtype=np.float32)
    if len(member.vertex_groups):
        for vertex in member.data.vertices:
            for element in vertex.groups:
                weights[vertex.index, element.group] = element.weight
    return weights


def write_weights(member: bpy.types.Object, names: list[str], weights: np.ndarray) -> None:
    """Vertex groups of these names, in this order, with (V, G) weights; NaN leaves a vertex out."""
    member.vertex_groups.clear()
    for name, column in zip(names, weights.T, strict=True):
        group = member.vertex_groups.new(name=name)
        inside = np.flatnonzero(~np.isnan(column))
        for weight in np.unique(column[inside]):
            group.add(inside[column[inside] == weight].tolist(), float(weight), "REPLACE")


def surface_of(mesh: bpy.types.Mesh) -> tuple[TriangleMesh, np.ndarray, np.ndarray]:
    """The mesh as triangles, (3 T,) the corner of the mesh at each corner of them, and (T,) the face that each comes from."""
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    vertices, corners, faces = np.empty(3 * count, np.int32), np.empty(3 * count, np.int32), np.empty(count, np.int32)
    for name, target in (("vertices", vertices), ("loops", corners), ("polygon_index", faces)):
        mesh.loop_triangles.foreach_get(name, target)
    flat = np.empty(3 * len(mesh.vertices), dtype=np.float32)
    mesh.attributes[GEOMETRY].data.foreach_get("vector", flat)
    return TriangleMesh(flat.reshape(-1, 3), vertices.reshape(-1, 3)), corners, faces
