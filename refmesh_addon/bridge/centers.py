"""Tracked centers as an animated cloud of points that plays and renders without the add-on.

A vertex-only mesh takes the PC2 cache and Geometry Nodes turn its vertices into points: real point clouds cannot be
filled from Python before Blender 5.1.
"""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
from mathutils.kdtree import KDTree

from .materials import attribute_material
from .meshes import COLOR_NAME, fill_points, set_colors
from .objects import new_member
from .playback import play_cache

NODES_NAME = "RefMesh Points"
RADIUS_SHARE = 0.25  # of the center spacing: points stay apart, and what lies behind them can be seen
DARKEST, BRIGHTEST = 0.05, 0.9  # linear; no point is black or glares


def show_centers(owner: bpy.types.Object, positions: np.ndarray, cache: Path, first_scene_frame: int, apart: float | None = None) -> None:
    """Makes or refreshes the centers of the sequence object `owner`.

    positions : (C, 3), the centers in the first frame.  cache : PC2 file with one sample per scene frame.
    apart : usual distance of neighbours, where it is known.
    """
    state = owner.refmesh
    material = attribute_material("RefMesh Centers", COLOR_NAME)
    if state.centers is None:
        state.centers = new_member(state.root, f"{state.root.name} centers", material)
        state.centers.refmesh.sequence = owner
    centers = state.centers
    fill_points(centers.data, positions)
    set_colors(centers.data, colors_by_place(positions))
    play_cache(centers, cache, first_scene_frame)
    _draw_as_points(centers, RADIUS_SHARE * (apart or spacing(positions)), material)


def spacing(positions: np.ndarray) -> float:
    """Median distance from a center to its nearest neighbour, scene units."""
    tree = KDTree(len(positions))
    for index, position in enumerate(positions):
        tree.insert(position, index)
    tree.balance()
    nearest = [tree.find_n(position, 2)[-1][2] for position in positions]
    return float(np.median(nearest))


def colors_by_place(positions: np.ndarray) -> np.ndarray:
    """(C, 4) linear colours: x, y and z in the first frame as red, green and blue, so that one can see what went where."""
    low, extent = positions.min(axis=0), np.ptp(positions, axis=0)
    shares = (positions - low) / np.where(extent > 0, extent, 1.0)
    return np.column_stack([DARKEST + (BRIGHTEST - DARKEST) * shares, np.ones(len(positions))])


def _draw_as_points(centers: bpy.types.Object, radius: float, material: bpy.types.Material) -> None:
    modifier = centers.modifiers.get(NODES_NAME)
    if modifier is None:
        modifier = centers.modifiers.new(NODES_NAME, "NODES")
        modifier.node_group = _points_nodes(centers.name, material)
    for node in modifier.node_group.nodes:
        if node.bl_idname == "GeometryNodeMeshToPoints":
            node.inputs["Radius"].default_value = radius


def _points_nodes(name: str, material: bpy.types.Material) -> bpy.types.GeometryNodeTree:
    tree = bpy.data.node_groups.new(f"{name} points", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    chain = [tree.nodes.new(kind) for kind in ("NodeGroupInput", "GeometryNodeMeshToPoints", "GeometryNodeSetMaterial", "NodeGroupOutput")]
    for column, (before, after) in enumerate(zip(chain, chain[1:], strict=False), start=1):
        after.location.x = 200.0 * column
        tree.links.new(before.outputs[0], after.inputs[0])
    chain[2].inputs["Material"].default_value = material
    return tree
