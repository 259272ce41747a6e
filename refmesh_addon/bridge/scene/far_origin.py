"""Sequences far from the origin, where Blender's single precision is too coarse: their data is about an offset that the root carries.

The root's own location is the true place of the data. So that Blender can draw and render it there, the root is the child of an Empty
that moves everything back to the origin of the scene; at its location (0, 0, 0) the sequence is where it is in the world.
"""

from __future__ import annotations

import bpy
import numpy as np
from mathutils import Matrix

OFFSET = "refmesh_offset"  # custom property of the root, in double precision, in the coordinates of the files
RESULTS_OFFSET = "refmesh_results_offset"  # the same of the results that are shown
ORIGIN = "refmesh_origin"  # custom property of the Empty that moves a sequence to the origin


def carry_offset(root: bpy.types.Object, offset: np.ndarray) -> None:
    """Puts a new root at the true place of data that is stored about `offset`, and everything back to the origin of the scene."""
    root[OFFSET] = [float(value) for value in offset]
    if not offset.any():
        return
    axes = np.rint(np.array(root.rotation_euler.to_matrix(), dtype=float))  # quarter turns, without the rounding of their cosines
    root.location = root.scale[0] * (axes @ offset)
    origin = bpy.data.objects.new(f"{root.name} origin", None)
    origin[ORIGIN] = True
    origin.location = -root.location
    root.users_collection[0].objects.link(origin)
    root.parent = origin


def scale_root(root: bpy.types.Object, factor: float) -> None:
    """Scales everything below a root; data far from the origin stays where the scene shows it."""
    root.scale *= factor
    if root.parent is not None and ORIGIN in root.parent:
        root.location *= factor
        root.parent.location *= factor


def offset_of(root: bpy.types.Object | None) -> np.ndarray:
    """(3,) what is missing in the positions of the objects below a root, in the coordinates of the files."""
    return np.array(root[OFFSET], dtype=np.float64) if root is not None and OFFSET in root else np.zeros(3)


def results_shift(root: bpy.types.Object | None) -> np.ndarray:
    """(3,) from the source to results that are stored about another offset, as those of other frames may be."""
    if root is None or RESULTS_OFFSET not in root:
        return np.zeros(3)
    return np.array(root[RESULTS_OFFSET], dtype=np.float64) - offset_of(root)


def place_in_world(root: bpy.types.Object) -> Matrix:
    """The root's matrix at its true place, wherever the scene shows it."""
    origin = root.parent if root.parent is not None and ORIGIN in root.parent else None
    return root.matrix_world.copy() if origin is None else Matrix.Translation(-origin.location) @ root.matrix_world


def results_in_world(root: bpy.types.Object) -> Matrix:
    """The matrix of objects that show results, at their true place."""
    return place_in_world(root) @ Matrix.Translation(results_shift(root))
