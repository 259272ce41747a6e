"""Arrays into Blender meshes and back."""

from __future__ import annotations

import hashlib

import bpy
import numpy as np

from ...core.types import TriangleMesh
from ...io.preview import PreviewMesh

UV_NAME = "RefMesh Layout"  # not "UVMap", which is what Blender calls the first one of a person
OWN_LAYOUT = "refmesh_own_layout"  # custom property of a mesh whose own UV map the textures were baked for
WRITTEN_LAYOUT = "refmesh_written_layout"  # custom property: digests of the topology and of the UV map that RefMesh gave the mesh
COLOR_NAME = "Col"  # as Blender's PLY importer calls vertex colors; Cycles does not find one called "color"


def fill_mesh(target: bpy.types.Mesh, mesh: TriangleMesh | PreviewMesh) -> None:
    """Replaces the geometry of `target` by that of `mesh`; materials stay, attributes go.

    Vertices and triangles keep their order; Blender stores positions as float32 and shades the surface smooth.
    """
    target.clear_geometry()
    _add_vertices(target, mesh.vertices)
    known = isinstance(mesh, PreviewMesh) and len(mesh.edges) > 0
    if known:
        target.edges.add(len(mesh.edges))
        _set(target, ".edge_verts", mesh.edges)
    corners = len(mesh.triangles) * 3
    target.loops.add(corners)
    _set(target, ".corner_vert", mesh.triangles)
    if known:
        _set(target, ".corner_edge", mesh.triangle_edges)
    target.polygons.add(len(mesh.triangles))
    target.polygons.foreach_set("loop_start", np.arange(0, corners, 3, dtype=np.int32))
    target.update(calc_edges=not known)


def _set(target: bpy.types.Mesh, attribute: str, indices: np.ndarray) -> None:
    # Some ten times faster than through the items of mesh.edges and mesh.loops.
    target.attributes[attribute].data.foreach_set("value", np.ascontiguousarray(indices, dtype=np.int32).ravel())


def fill_points(target: bpy.types.Mesh, positions: np.ndarray) -> None:
    """Loose vertices at (C, 3) positions as the geometry of `target`; as many as before are moved and keep their attributes."""
    if len(target.vertices) == len(positions):
        if np.array_equal(read_positions(target), positions.astype(np.float32)):
            return
        set_positions(target, positions)
    else:
        target.clear_geometry()
        _add_vertices(target, positions)
    target.update()


def _add_vertices(target: bpy.types.Mesh, positions: np.ndarray) -> None:
    target.vertices.add(len(positions))
    set_positions(target, positions)


def set_positions(target: bpy.types.Mesh, positions: np.ndarray) -> None:
    """Moves the vertices to (V, 3) positions."""
    # Through the attribute: some hundred times faster than through vertices.co.
    target.attributes["position"].data.foreach_set("vector", np.ascontiguousarray(positions, dtype=np.float32).ravel())


def read_positions(source: bpy.types.Mesh) -> np.ndarray:
    """(V, 3) float32 vertex positions of a Blender mesh, in the coordinates of its object."""
    flat = np.empty(3 * len(source.vertices), dtype=np.float32)
    source.attributes["position"].data.foreach_get("vector", flat)
    return flat.reshape(-1, 3)


def set_uvs(target: bpy.types.Mesh, corners: np.ndarray) -> None:
    """Gives a mesh the UV map of RefMesh beside those of a person: (T, 3, 2) places of the corners of its triangles, v up."""
    layer, target_uvs = target.uv_layers.get(UV_NAME), np.ascontiguousarray(corners, dtype=np.float32).ravel()
    if layer is None:
        layer = target.uv_layers.new(name=UV_NAME)
        target.uv_layers.active = layer
    present = np.empty(2 * len(target.loops), dtype=np.float32)
    layer.uv.foreach_get("vector", present)
    if not np.array_equal(present, target_uvs):
        layer.uv.foreach_set("vector", target_uvs)
    target[WRITTEN_LAYOUT] = [_digest(corner_vertices(target)), _digest(target_uvs)]


def added_uvs(mesh: bpy.types.Mesh) -> np.ndarray | None:
    """(T, 3, 2) float32 places of the corners of the triangles in the UV map that renders use, where a person has added or edited it."""
    layer = next((layer for layer in mesh.uv_layers if layer.active_render), None)
    if layer is None or len(mesh.loops) != 3 * len(mesh.polygons):
        return None
    places = np.empty(2 * len(mesh.loops), dtype=np.float32)
    layer.uv.foreach_get("vector", places)
    if layer.name == UV_NAME:
        topology, written = mesh.get(WRITTEN_LAYOUT, ("", ""))
        if topology != _digest(corner_vertices(mesh)) or written == _digest(places):
            return None
    return places.reshape(-1, 3, 2)


def corner_vertices(mesh: bpy.types.Mesh) -> np.ndarray:
    """(L,) int32 vertex of each corner."""
    corners = np.empty(len(mesh.loops), dtype=np.int32)
    mesh.attributes[".corner_vert"].data.foreach_get("value", corners)
    return corners


def _digest(values: np.ndarray) -> str:
    return hashlib.blake2b(values.tobytes(), digest_size=16).hexdigest()


def has_layout(mesh: bpy.types.Mesh) -> bool:
    """Whether the textures of RefMesh fit a UV map of this mesh: that of RefMesh, or the user's own that they were baked for."""
    return UV_NAME in mesh.uv_layers or bool(mesh.get(OWN_LAYOUT))


def set_colors(target: bpy.types.Mesh, colors: np.ndarray, name: str = COLOR_NAME) -> None:
    """Writes (V, 4) colors, linear, 0 to 1, as vertex colors called `name`."""
    attribute = target.attributes.get(name) or target.attributes.new(name, "FLOAT_COLOR", "POINT")
    attribute.data.foreach_set("color", colors.astype(np.float32).ravel())
