"""Triangles that face the wrong way after a deformation, and how they are turned back."""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from .arap import ArapSolver
from .cotangent import triangle_adjacency
from .geometry import mean_edge_length, triangle_normals
from .types import TriangleMesh

REACH = 4  # rings about a fold that may move at the last attempt; where that is not enough the fold stays, and is reported
HOLD, LOOSER = 40.0, 0.3  # pull of a loose vertex to its place at the first attempt, where an edge weighs 0.58, and from one to the next
TURNS = 2  # local and global steps of each attempt
LEASH = 1.0  # mean edge lengths that a vertex may be moved: a surface that leaves its place is worse than a fold
STRIDES, STRIDE = 5, 0.5  # steps towards a goal, and the share of the way that is left that each tries to go
MOST_REFUSALS = 8  # times that vertices stay back in one step, because others that stay may fold their neighbours


def folded_triangles(mesh: TriangleMesh, rest: TriangleMesh, rotations: np.ndarray) -> np.ndarray:
    """(S,) bool, whether a triangle points away from where its vertices' rotations turn it.

    rest : the shape before.  rotations : (R, 3, 3) how the surroundings of each vertex turned (column vectors).
    """
    turned = np.einsum("tij,tj->ti", rotations[mesh.triangles].mean(axis=1), triangle_normals(rest))
    return np.einsum("ij,ij->i", turned, triangle_normals(mesh)) < 0


def unfolded(solver: ArapSolver, vertices: np.ndarray, shape: np.ndarray, rotations: np.ndarray) -> np.ndarray:
    """(R, 3) vertices of which those around folds are placed anew, as rigidly as possible, and all others stay.

    vertices : (R, 3) the solver's mesh, deformed.  shape : (R, 3) the same without folds; what rigid refers to.
    rotations : as for `folded_triangles`, from the solver's mesh. Each attempt lets go of one more ring around the folds that
    are left. Where this would take a vertex beyond the LEASH, the folds there stay. At the end all go back as far as they can.
    """
    fitted = vertices
    mesh, leash = solver.mesh, LEASH * mean_edge_length(solver.mesh.moved(shape))
    for attempt in range(REACH):
        folded = folded_triangles(mesh.moved(vertices), mesh, rotations)
        if not folded.any():
            break
        loose = _around(mesh, folded, attempt + 1)
        fixed = np.flatnonzero(~loose)
        system = solver.system(sparse.csr_matrix((0, len(vertices))), np.empty(0), fixed, HOLD * LOOSER**attempt)
        moved = system.solve(np.empty((0, 3)), vertices, TURNS, rest=shape, fixed_targets=vertices[fixed]).vertices
        strays = loose & (np.linalg.norm(moved - vertices, axis=1) > leash)
        vertices = np.where((loose & ~_connected(mesh, loose, strays))[:, None], moved, vertices)
    return approached(mesh, vertices, fitted, rotations)


def approached(rest: TriangleMesh, vertices: np.ndarray, goal: np.ndarray, rotations: np.ndarray) -> np.ndarray:
    """(R, 3) vertices moved towards (R, 3) goals as far as that folds no triangle which is not folded; rest, rotations : as above."""
    if np.array_equal(vertices, goal):
        return vertices
    folded = folded_triangles(rest.moved(vertices), rest, rotations)
    direct = folded_triangles(rest.moved(goal), rest, rotations)
    if not (direct & ~folded).any():
        return goal
    for _ in range(STRIDES):
        moved = vertices + STRIDE * (goal - vertices)
        for _ in range(MOST_REFUSALS):
            turned = np.unique(rest.triangles[folded_triangles(rest.moved(moved), rest, rotations) & ~folded])
            if not len(turned):
                vertices = moved
                break
            moved[turned] = vertices[turned]
    return vertices


def _around(mesh: TriangleMesh, triangles: np.ndarray, rings: int) -> np.ndarray:
    """(R,) bool, vertices of (S,) bool triangles and of so many rings around them."""
    result = np.zeros(len(mesh.vertices), dtype=bool)
    result[mesh.triangles[triangles]] = True
    neighbours = triangle_adjacency(mesh)
    for _ in range(rings):
        result |= (neighbours @ result) > 0
    return result


def _connected(mesh: TriangleMesh, area: np.ndarray, seeds: np.ndarray) -> np.ndarray:
    """(R,) bool, vertices of the (R,) bool area in a connected piece of it that holds a seed."""
    inside = sparse.diags(area.astype(float))
    labels = csgraph.connected_components(inside @ triangle_adjacency(mesh) @ inside, directed=False)[1]
    return area & np.isin(labels, labels[seeds])
