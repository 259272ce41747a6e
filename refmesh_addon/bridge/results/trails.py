"""Paths of chosen centers as curves."""

from __future__ import annotations

import bpy
import numpy as np

from ...io.pc2 import read_pc2
from ..scene.materials import plain_material
from ..scene.objects import kind_collection, remove_object
from ..scene.playback import cache_path
from .centers import selected_centers

TRAIL_COLOR = (0.95, 0.62, 0.10, 1.0)
BEVEL_SHARE = 0.2  # of the radius at which centers are drawn
MAX_TRAILS = 60  # where no centers are selected


def show_trails(owner: bpy.types.Object, radius: float) -> int:
    """Replaces the trails by those of the selected centers, or of evenly many of all centers; returns their number.

    radius : at which the centers are drawn, in their own units.
    """
    state = owner.refmesh
    remove_trails(owner)
    chosen = _chosen(state.centers)
    paths = np.stack([sample[chosen] for sample in read_pc2(cache_path(state.centers))], axis=1)
    curve = bpy.data.curves.new(f"{state.root.name} trails", "CURVE")
    curve.dimensions, curve.bevel_depth = "3D", BEVEL_SHARE * radius
    curve.materials.append(plain_material("RefMesh Trails", TRAIL_COLOR))
    for path in paths:
        spline = curve.splines.new("POLY")
        spline.points.add(len(path) - 1)
        spline.points.foreach_set("co", np.column_stack([path, np.ones(len(path))]).astype(np.float32).ravel())
    state.trails = bpy.data.objects.new(curve.name, curve)
    kind_collection(state.root, "centers").objects.link(state.trails)
    state.trails.parent, state.trails.refmesh.sequence = state.root, owner
    state.trails.location, state.trails.show_in_front = state.centers.location, True
    return len(chosen)


def remove_trails(owner: bpy.types.Object) -> None:
    """Removes the trails, if there are any."""
    curve = owner.refmesh.trails and owner.refmesh.trails.data
    remove_object(owner.refmesh.trails)
    if curve is not None and not curve.users:
        bpy.data.curves.remove(curve)


def _chosen(centers: bpy.types.Object) -> np.ndarray:
    """Indices of the selected centers; evenly many of all where none is, or all are."""
    chosen, count = selected_centers(centers), len(centers.data.vertices)
    return chosen if 0 < len(chosen) < count else np.unique(np.linspace(0, count - 1, min(MAX_TRAILS, count)).astype(int))
