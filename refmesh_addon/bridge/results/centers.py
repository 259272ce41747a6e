"""Tracked centers as small spheres that play and render without the add-on.

A vertex-only mesh takes the PC2 cache and Geometry Nodes put a sphere on each of its vertices. Spheres of triangles rather than a point
cloud: solid views color only meshes by an attribute.
"""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
from mathutils.kdtree import KDTree

from ..scene.materials import attribute_material
from ..scene.meshes import COLOR_NAME, fill_points, read_positions
from ..scene.objects import new_member
from ..scene.playback import CACHE_NAME, play_cache
from .center_colors import color_centers, set_attributes

NODES_NAME = "RefMesh Points"
SPHERE, SUBDIVISIONS = "GeometryNodeMeshIcoSphere", 2  # 80 triangles: round at the size that centers have
RADIUS_SHARE = 0.25  # of the center spacing: points do not touch, and what lies behind them stays visible


def show_centers(
    owner: bpy.types.Object,
    positions: np.ndarray,
    cache: Path,
    first_scene_frame: int,
    center_spacing: float,
    attributes: dict[str, np.ndarray],
) -> None:
    """Creates or updates the centers of the sequence object `owner`.

    positions : (C, 3), the centers in the first frame.  cache : PC2 file with one sample per scene frame.
    center_spacing : usual distance of neighbors.  attributes : name -> (C,) values that the centers can be colored by.
    """
    state = owner.refmesh
    if state.centers is None:
        state.centers = new_member(state.root, f"{state.root.name} centers", _material(), "centers")
        state.centers.refmesh.sequence = owner
        state.centers.show_in_front = True  # else hidden inside the source where all is in one place
    centers = state.centers
    fill_points(centers.data, positions)
    set_attributes(centers, attributes)
    play_cache(centers, cache, first_scene_frame)
    playing = centers.modifiers[CACHE_NAME]
    playing.show_in_editmode = playing.show_on_cage = True  # centers can be selected at their positions in the current frame
    state.center_spacing = center_spacing
    restyle_centers(owner)


def restyle_centers(owner: bpy.types.Object) -> None:
    """Draws the centers in the size and the colors that are set in the panel."""
    state = owner.refmesh
    if state.centers is not None:
        state.center_range = color_centers(state.centers, state.center_color, read_positions(state.centers.data))
        _draw_as_spheres(state.centers, center_radius(owner), _material())


def center_radius(owner: bpy.types.Object) -> float:
    """Radius at which the centers are drawn, in the units of the files."""
    return RADIUS_SHARE * owner.refmesh.center_size * owner.refmesh.center_spacing


def selected_centers(centers: bpy.types.Object) -> np.ndarray:
    """Indices of the centers that were selected when edit mode was left."""
    selected = np.zeros(len(centers.data.vertices), dtype=bool)
    centers.data.vertices.foreach_get("select", selected)
    return np.flatnonzero(selected)


def deselect_centers(centers: bpy.types.Object) -> None:
    """Deselects all centers, so that the next selection starts empty."""
    centers.data.vertices.foreach_set("select", np.zeros(len(centers.data.vertices), dtype=bool))
    centers.data.update()


def _material() -> bpy.types.Material:
    return attribute_material("RefMesh Centers", COLOR_NAME)


def spacing(positions: np.ndarray) -> float:
    """Median distance from a center to its nearest neighbor, scene units."""
    tree = KDTree(len(positions))
    for index, position in enumerate(positions):
        tree.insert(position, index)
    tree.balance()
    nearest = [tree.find_n(position, 2)[-1][2] for position in positions]
    return float(np.median(nearest))


def _draw_as_spheres(centers: bpy.types.Object, radius: float, material: bpy.types.Material) -> None:
    modifier = centers.modifiers.get(NODES_NAME) or centers.modifiers.new(NODES_NAME, "NODES")
    if modifier.node_group is None or SPHERE not in {node.bl_idname for node in modifier.node_group.nodes}:
        modifier.node_group = _sphere_nodes(centers.name, material)
    for node in modifier.node_group.nodes:
        if node.bl_idname == SPHERE:
            node.inputs["Radius"].default_value = radius


def _sphere_nodes(name: str, material: bpy.types.Material) -> bpy.types.GeometryNodeTree:
    tree = bpy.data.node_groups.new(f"{name} spheres", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    kinds = ("NodeGroupInput", "GeometryNodeInstanceOnPoints", "GeometryNodeRealizeInstances", "GeometryNodeJoinGeometry")
    chain = [tree.nodes.new(kind) for kind in (*kinds, "GeometryNodeSetMaterial", "NodeGroupOutput")]
    sphere = tree.nodes.new(SPHERE)
    for column, node in enumerate(chain):
        node.location.x = 200.0 * column
    sphere.location = (0.0, -200.0)
    sphere.inputs["Subdivisions"].default_value = SUBDIVISIONS
    tree.links.new(sphere.outputs[0], chain[1].inputs["Instance"])
    for before, after in zip(chain, chain[1:], strict=False):
        tree.links.new(before.outputs[0], after.inputs[0])
    # The vertices themselves come first: they say which color attribute is the active one. Blender puts the latest link in front.
    tree.links.new(chain[0].outputs[0], chain[3].inputs[0])
    chain[4].inputs["Material"].default_value = material
    return tree
