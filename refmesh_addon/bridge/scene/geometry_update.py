"""New geometry for an object whose attributes, vertex groups, shape keys, materials and modifiers a person may have added.

While the topology stays, vertices are moved and nothing else is touched. Where it changes, everything is carried over by nearest surface.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ...core.types import TriangleMesh
from ...io.preview import PreviewMesh
from .attributes import (
    Attribute,
    read_attribute,
    read_attributes,
    read_layers,
    read_weights,
    surface_of,
    write_attribute,
    write_layers,
    write_weights,
)
from .meshes import corner_vertices, fill_mesh, read_positions, set_positions
from .shape_keys import ShapeKey, read_shape_keys, shift_shape_keys, write_shape_keys

if TYPE_CHECKING:
    from ...core.geometry.surface_transfer import SurfacePoints, SurfaceTransfer

REST = ".refmesh_rest"  # positions as they were written last: what differs from them is an edit
POSE = ".refmesh_pose"  # positions in the first frame of the group, in which another topology is compared
OWN_LAYERS = (REST, POSE)
OWN_MESH = "refmesh_own_mesh"  # property of meshes with polygons of the user's own: vertices alone tell whether results are theirs
MEMBERSHIP = 1e-6  # share of a vertex that must come from members of a vertex group, for it to become a member


@dataclass(frozen=True)
class Shape:
    """Geometry that results hold.  rest : the mesh.  pose : (V, 3) its vertices in the first frame of its group; None without playback."""

    rest: PreviewMesh
    pose: np.ndarray | None = None


def update_geometry(member: bpy.types.Object, shape: Shape) -> str:
    """Gives the object this geometry; edits of it stay as offsets.

    Returns what had to be carried to another topology, such as "UV maps, vertex groups"; "" for nothing.
    """
    if len(member.data.polygons) == 0:
        fill_mesh(member.data, shape.rest)
        _remember(member.data, shape)
    elif has_topology(member.data, shape.rest):
        _move(member.data, shape)
    else:
        return _replace(member, shape)
    return ""


def has_topology(mesh: bpy.types.Mesh, target: TriangleMesh | PreviewMesh) -> bool:
    """Whether the mesh has these vertices and triangles, in this order; for one of the user's own, as many vertices."""
    if OWN_MESH in mesh:
        return len(mesh.vertices) == len(target.vertices)
    if (len(mesh.vertices), len(mesh.polygons), len(mesh.loops)) != (len(target.vertices), len(target.triangles), target.triangles.size):
        return False
    return np.array_equal(corner_vertices(mesh), target.triangles.ravel())


def rest_positions(mesh: bpy.types.Mesh) -> np.ndarray:
    """(V, 3) float32 positions that the results gave the mesh, without edits of them."""
    stored = _stored(mesh, REST)
    return read_positions(mesh) if stored is None else stored


def _move(mesh: bpy.types.Mesh, shape: Shape) -> None:
    rest = np.asarray(shape.rest.vertices, dtype=np.float32)
    before = rest_positions(mesh)
    if not np.array_equal(before, rest):
        offset = rest.astype(np.float64) - before
        shift_shape_keys(mesh, offset)
        # Exact where nothing was edited, which a sum of offsets would not be.
        positions = read_positions(mesh)
        set_positions(mesh, np.where(positions == before, rest, positions + offset))
        mesh.update()
    _remember(mesh, shape)


def _remember(mesh: bpy.types.Mesh, shape: Shape) -> None:
    for name, values in ((REST, shape.rest.vertices), (POSE, shape.pose)):
        if values is not None and not np.array_equal(_stored(mesh, name), values := np.asarray(values, np.float32)):
            write_attribute(mesh, Attribute(name, "POINT", "FLOAT_VECTOR", values))


def _stored(mesh: bpy.types.Mesh, name: str) -> np.ndarray | None:
    layer = mesh.attributes.get(name)
    return None if layer is None else read_attribute(layer).values


def _replace(member: bpy.types.Object, shape: Shape) -> str:
    mesh = member.data
    source, corners, faces = surface_of(mesh)
    carried, layers, keys = read_attributes(mesh), read_layers(mesh), read_shape_keys(member)
    names, weights = [group.name for group in member.vertex_groups], read_weights(member)
    active_group = member.vertex_groups.active_index
    edits = read_positions(mesh).astype(np.float64) - rest_positions(mesh)
    transfer = _Carrier(_transfer(mesh, source, shape), source.triangles, corners, faces)
    fill_mesh(mesh, shape.rest)
    mesh.pop(OWN_MESH, None)
    _remember(mesh, shape)
    edited = shape.rest.vertices + (transfer.at_vertices(edits) if edits.any() else 0.0)
    set_positions(mesh, edited)
    for attribute in carried:
        write_attribute(mesh, transfer.carried(attribute))
    write_layers(mesh, layers)
    write_weights(member, names, transfer.weights(weights))
    member.vertex_groups.active_index = active_group
    write_shape_keys(member, [replace(key, offsets=transfer.at_vertices(key.offsets)) for key in keys], edited)
    mesh.update()
    return _description(carried, names, keys, edits)


def _description(carried: list[Attribute], groups: list[str], keys: list[ShapeKey], edits: np.ndarray) -> str:
    kinds = {
        "UV maps": any(layer.is_uv for layer in carried),
        "color attributes": any(layer.is_color for layer in carried),
        "other attributes": any(not (layer.is_uv or layer.is_color or layer.name == "material_index") for layer in carried),
        "material assignment": any(layer.name == "material_index" for layer in carried),
        "vertex groups": bool(groups),
        "shape keys": bool(keys),
        "edited vertices": bool(edits.any()),
    }
    return ", ".join(kind for kind, is_there in kinds.items() if is_there)


def _transfer(mesh: bpy.types.Mesh, source: TriangleMesh, shape: Shape) -> SurfaceTransfer:
    """Compared in the first frame of the group where both are known there: two reference meshes may differ in their pose."""
    from ...core.geometry.surface_transfer import SurfaceTransfer

    pose = _stored(mesh, POSE)
    if pose is not None and shape.pose is not None:
        return SurfaceTransfer(source.moved(pose.astype(np.float64)), TriangleMesh(shape.pose, shape.rest.triangles))
    return SurfaceTransfer(source.moved(rest_positions(mesh).astype(np.float64)), TriangleMesh(shape.rest.vertices, shape.rest.triangles))


@dataclass(frozen=True)
class _Carrier:
    """Takes values from one mesh to the other.  triangles, corners, faces : of the earlier mesh, as `surface_of` gives them."""

    transfer: SurfaceTransfer
    triangles: np.ndarray
    corners: np.ndarray
    faces: np.ndarray

    def carried(self, attribute: Attribute) -> Attribute:
        """The attribute with one value for each element of the new mesh."""
        if attribute.domain == "FACE":
            return replace(attribute, values=attribute.values[self.faces[self.transfer.triangles.triangles]])
        if attribute.domain == "POINT":
            return replace(attribute, values=_read(self.transfer.vertices, attribute, attribute.values[self.triangles]))
        at_corners = attribute.values[self.corners].reshape(len(self.triangles), 3, -1)
        return replace(attribute, values=_read(self.transfer.corners(at_corners), attribute, at_corners))

    def at_vertices(self, values: np.ndarray) -> np.ndarray:
        """(V, K) values at the vertices of the new mesh."""
        return self.transfer.vertices.interpolated(values[self.triangles])

    def weights(self, weights: np.ndarray) -> np.ndarray:
        """(V, G) weights of vertex groups; NaN where a vertex comes from none of the members."""
        inside = ~np.isnan(weights)
        share = self.at_vertices(inside.astype(np.float64))
        return np.where(share > MEMBERSHIP, self.at_vertices(np.where(inside, weights, 0.0)), np.nan)


def _read(points: SurfacePoints, attribute: Attribute, at_corners: np.ndarray) -> np.ndarray:
    return points.interpolated(at_corners) if attribute.is_continuous else points.nearest(at_corners)
