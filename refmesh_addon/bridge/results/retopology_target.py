"""What a mesh of the user's own was retopologized from: the source or the result in the current frame, or the reference mesh."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Matrix

from ...core.errors import RefMeshError
from ..scene.far_origin import results_shift
from ..scene.meshes import read_positions

COMPARED = 2000  # vertices of the mesh whose distance decides


@dataclass(frozen=True)
class RetopologyTarget:
    """to_source : from the object's own coordinates to those of the source object.  reference : whether it lies over the reference mesh."""

    to_source: Matrix
    reference: bool


def retopology_target(owner: bpy.types.Object, target: bpy.types.Object) -> RetopologyTarget:
    """What an object was retopologized from: itself if it is one of the results; otherwise what it lies nearest to in the scene now.

    Raises RefMeshError for a reference mesh of a take that has several.
    """
    references = [group.reference for group in owner.refmesh.groups if group.reference is not None]
    results = target.refmesh.sequence == owner
    nearest = target if results else _nearest(owner, target, references)
    if nearest in references and len(references) > 1:
        over = f"'{target.name}' lies over one of {len(references)} reference meshes"
        raise RefMeshError(f"{over}; make it over a frame, or give the whole take one mesh (One Mesh for)")
    to_source = results_to_source(owner) if results else _to_source(owner, nearest) @ target.matrix_world
    return RetopologyTarget(to_source, nearest in references)


def results_to_source(owner: bpy.types.Object) -> Matrix:
    """From the own coordinates of a result, a reference mesh for one, to those of the source object."""
    return Matrix.Translation(results_shift(owner.refmesh.root))


def _nearest(owner: bpy.types.Object, target: bpy.types.Object, references: list[bpy.types.Object]) -> bpy.types.Object:
    from scipy.spatial import cKDTree

    points = _world(target)
    if not len(points):
        return owner
    points = points[:: max(1, len(points) // COMPARED)]
    deformed = [group.deformed for group in owner.refmesh.groups if group.deformed is not None and group.deformed.visible_get()]
    candidates = [(item, places) for item in (owner, *references, *deformed) if len(places := _world(item))]
    distances = [cKDTree(places).query(points)[0].mean() for _, places in candidates]
    return candidates[int(np.argmin(distances))][0] if candidates else owner


def _world(item: bpy.types.Object) -> np.ndarray:
    """(V, 3) vertices as they are shown in the current frame, in world coordinates."""
    evaluated = item.evaluated_get(bpy.context.evaluated_depsgraph_get())
    matrix = np.array(item.matrix_world)
    return read_positions(evaluated.data) @ matrix[:3, :3].T + matrix[:3, 3]


def _to_source(owner: bpy.types.Object, item: bpy.types.Object) -> Matrix:
    """From world coordinates to those of the source object, for what lies over `item`, which may stand beside it."""
    inverted = item.matrix_world.inverted()
    return inverted if item == owner else results_to_source(owner) @ inverted
