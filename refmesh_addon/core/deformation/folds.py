"""Turns back triangles that folded over in a deformation."""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from ..geometry.mesh import mean_edge_length, triangle_areas, triangles_at
from ..geometry.rings import vertices_around
from .arap import ArapSolver
from .arap_system import Constraints, Start, Targets
from .facing import Facing
from .fold_free_moves import moved_without_folds

RINGS = 4  # least number of rings around a fold that may move at the last attempt; what is still folded then stays, and is reported
# Share of the square root of the area that counts as an edge where edges are shorter: folds of a finer mesh are more rings across.
EDGE = 0.0075
START_WEIGHT, WEIGHT_RATIO = 40.0, 0.3  # of a free vertex at the first attempt, where an edge weighs 0.58, and from one to the next
ITERATIONS = 2  # of ARAP in each attempt
FARTHEST = 1.0  # edge lengths that a vertex may be moved: a surface that leaves its place is worse than a fold


def unfolded(
    solver: ArapSolver, vertices: np.ndarray, shape: np.ndarray, facing: Facing, hidden: np.ndarray | None = None
) -> np.ndarray:
    """(R, 3) vertices of which those around folds are moved, as rigidly as possible, and all others stay.

    vertices : (R, 3) the solver's mesh, deformed.  shape : (R, 3) the same without folds, the rest shape.
    facing : of the solver's mesh.  hidden : (R,) bool, vertices in a contact, where no camera saw the surface; None for none.
    Each attempt frees one more ring around the folds that are left. Where this would move a vertex that is not hidden by more than
    FARTHEST, the folds there stay. At the end all return as far as that folds nothing.
    """
    fitted, rest = vertices, solver.mesh.moved(shape)
    length, limited = mean_edge_length(rest), np.ones(len(vertices), dtype=bool) if hidden is None else ~hidden
    finer = max(1.0, EDGE * np.sqrt(triangle_areas(rest).sum()) / length)
    for attempt in range(round(finer * RINGS)):
        folded = facing.folded(vertices)
        if not folded.any():
            break
        free = vertices_around(solver.mesh, solver.energy.adjacency, folded, attempt + 1)
        moved = _relaxed(solver, vertices, shape, free, START_WEIGHT * WEIGHT_RATIO**attempt)
        too_far = free & limited & (np.linalg.norm(moved - vertices, axis=1) > FARTHEST * finer * length)
        vertices = np.where((free & ~_connected(solver, free, too_far))[:, None], moved, vertices)
    return moved_without_folds(facing, vertices, fitted)


def _relaxed(solver: ArapSolver, vertices: np.ndarray, shape: np.ndarray, free: np.ndarray, start_weight: float) -> np.ndarray:
    """(R, 3) vertices of which the (R,) bool free ones lie as rigidly as possible between the others, which stay."""
    kept, part = solver.part(vertices_around(solver.mesh, solver.energy.adjacency, triangles_at(solver.mesh, free), 0))
    fixed, result = np.flatnonzero(~free[kept]), vertices.copy()
    system = part.system(Constraints(sparse.csr_matrix((0, len(kept))), np.empty(0), fixed, start_weight))
    targets, rest = Targets(np.empty((0, 3)), vertices[kept[fixed]]), part.energy.rest_shape(shape[kept])
    result[kept] = system.solve(targets, Start(vertices[kept]), ITERATIONS, rest=rest).vertices
    return result


def _connected(solver: ArapSolver, area: np.ndarray, seeds: np.ndarray) -> np.ndarray:
    """(R,) bool, vertices of the (R,) bool area in a connected piece of it that holds a seed."""
    inside, result = np.flatnonzero(area), np.zeros(len(area), dtype=bool)
    labels = csgraph.connected_components(solver.energy.adjacency[inside][:, inside], directed=False)[1]
    result[inside] = np.isin(labels, labels[seeds[inside]])
    return result
