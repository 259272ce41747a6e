"""Triangles that face the wrong way after a deformation, and how they are turned back."""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from ..geometry.closest_point import SurfaceIndex
from ..geometry.mesh import area_vectors, mean_edge_length, triangle_areas, triangles_at
from ..types import TriangleMesh
from .arap import ArapSolver

REACH = 4  # rings about a fold that may move at the last attempt, at least; where that is not enough the fold stays, and is reported
EDGE = 0.0075  # share of the square root of the area that counts as an edge where edges are shorter: folds of a finer mesh have more rings
HOLD, LOOSER = 40.0, 0.3  # pull of a loose vertex to its place at the first attempt, where an edge weighs 0.58, and from one to the next
TURNS = 2  # local and global steps of each attempt
LEASH = 1.0  # edge lengths that a vertex may be moved: a surface that leaves its place is worse than a fold
STRIDES, STRIDE = 5, 0.5  # steps of vertices that cannot go all the way, and the share of what is left that each tries to go


class Facing:
    """Which way each triangle should face: where its vertices' rotations turn it, or as the source does where it lies.

    rest : the shape before.  rotations : (R, 3, 3) how the surroundings of each vertex turned (column vectors).
    source : cloth may curl farther than all that is near turns; without a source that counts as folded.
    """

    def __init__(self, rest: TriangleMesh, rotations: np.ndarray, source: SurfaceIndex | None = None):
        self._mesh, self._source = rest, source
        flat = rotations.reshape(-1, 9)
        mixed = sum(flat.take(corner, axis=0) for corner in rest.triangles.T).reshape(-1, 3, 3)
        self._directions = np.einsum("tij,tj->ti", mixed, area_vectors(rest))

    def folded(self, vertices: np.ndarray, among: np.ndarray | slice = slice(None)) -> np.ndarray:
        """(S,) bool, whether a triangle points away from where it should.  among : only these triangles."""
        result = self.turned_over(vertices, among)
        if self._source is not None and result.any():
            result[result] = ~facing_alike(TriangleMesh(vertices, self._mesh.triangles[among][result]), self._source)
        return result

    def turned_over(self, vertices: np.ndarray, among: np.ndarray | slice = slice(None)) -> np.ndarray:
        """The same, whatever the source does."""
        normals = area_vectors(TriangleMesh(vertices, self._mesh.triangles[among]))
        return np.einsum("ti,ti->t", self._directions[among], normals) < 0

    def corners_of_folded(self, vertices: np.ndarray, moved: np.ndarray, known: np.ndarray) -> np.ndarray:
        """Corners of triangles at (R,) bool moved vertices that are folded though they are not among the (S,) bool known ones."""
        near = np.flatnonzero(triangles_at(self._mesh, moved) & ~known)
        return np.unique(self._mesh.triangles[near[self.folded(vertices, near)]])


def facing_alike(mesh: TriangleMesh, source: SurfaceIndex) -> np.ndarray:
    """(T,) bool, whether a triangle faces as the source does at the place nearest to its centre."""
    nearest = source.query(mesh.vertices[mesh.triangles].mean(axis=1)).triangles
    there = TriangleMesh(source.mesh.vertices, source.mesh.triangles[nearest])  # often a few of many
    return np.einsum("ti,ti->t", area_vectors(mesh), area_vectors(there)) > 0


def folded_triangles(mesh: TriangleMesh, rest: TriangleMesh, rotations: np.ndarray) -> np.ndarray:
    """(S,) bool, whether a triangle of the mesh points away from where its vertices' rotations turn it; rest, rotations : as above."""
    return Facing(rest, rotations).folded(mesh.vertices)


def unfolded(
    solver: ArapSolver, vertices: np.ndarray, shape: np.ndarray, rotations: np.ndarray, source: SurfaceIndex | None = None
) -> np.ndarray:
    """(R, 3) vertices of which those around folds are placed anew, as rigidly as possible, and all others stay.

    vertices : (R, 3) the solver's mesh, deformed.  shape : (R, 3) the same without folds; what rigid refers to.
    rotations, source : as for `Facing`, from the solver's mesh. Each attempt lets go of one more ring around the folds that
    are left. Where this would take a vertex beyond the LEASH, the folds there stay. At the end all go back as far as they can.
    """
    fitted, facing = vertices, Facing(solver.mesh, rotations, source)
    kept = solver.mesh.moved(shape)
    length = mean_edge_length(kept)
    finer = max(1.0, EDGE * np.sqrt(triangle_areas(kept).sum()) / length)
    leash = LEASH * finer * length
    for attempt in range(round(finer * REACH)):
        folded = facing.folded(vertices)
        if not folded.any():
            break
        loose = _around(solver, folded, attempt + 1)
        moved = _relaxed(solver, vertices, shape, loose, HOLD * LOOSER**attempt)
        strays = loose & (np.linalg.norm(moved - vertices, axis=1) > leash)
        vertices = np.where((loose & ~_connected(solver, loose, strays))[:, None], moved, vertices)
    return approached(facing, vertices, fitted)


def _relaxed(solver: ArapSolver, vertices: np.ndarray, shape: np.ndarray, loose: np.ndarray, keep: float) -> np.ndarray:
    """(R, 3) vertices of which the (R,) bool loose ones lie as rigidly as possible between the others, which stay."""
    kept, part = solver.part(_around(solver, triangles_at(solver.mesh, loose), 0))
    fixed, result = np.flatnonzero(~loose[kept]), vertices.copy()
    system = part.system(sparse.csr_matrix((0, len(kept))), np.empty(0), fixed, keep)
    result[kept] = system.solve(np.empty((0, 3)), vertices[kept], TURNS, rest=shape[kept], fixed_targets=vertices[kept[fixed]]).vertices
    return result


def approached(facing: Facing, vertices: np.ndarray, goal: np.ndarray) -> np.ndarray:
    """(R, 3) vertices moved to (R, 3) goals, or towards them as far as that folds no triangle which is not folded."""
    if np.array_equal(vertices, goal):
        return vertices
    folded = facing.folded(vertices)
    moved, short = _moved(facing, vertices, goal, np.ones(len(vertices), dtype=bool), folded)
    for _ in range(STRIDES if short.any() else 0):
        moved, _ = _moved(facing, moved, moved + STRIDE * (goal - moved), short, folded)
    return moved if short.any() else goal


def _moved(facing: Facing, vertices: np.ndarray, goal: np.ndarray, chosen: np.ndarray, folded: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Chosen vertices at their goals but for those of new folds, which stay; and the (R,) bool that stay.

    Those that stay may fold their neighbours in turn, which then stay as well: at worst all do.
    """
    moved, changed, stay = np.where(chosen[:, None], goal, vertices), chosen, np.zeros(len(vertices), dtype=bool)
    while len(corners := facing.corners_of_folded(moved, changed, folded)):
        changed = np.zeros(len(vertices), dtype=bool)
        changed[corners] = chosen[corners] & ~stay[corners]
        stay |= changed
        moved[changed] = vertices[changed]
    return moved, stay


def _around(solver: ArapSolver, triangles: np.ndarray, rings: int) -> np.ndarray:
    """(R,) bool, vertices of (S,) bool triangles of the solver's mesh and of so many rings around them."""
    result = np.zeros(len(solver.mesh.vertices), dtype=bool)
    result[solver.mesh.triangles[triangles]] = True
    for _ in range(rings):
        result |= (solver.adjacency @ result) > 0
    return result


def _connected(solver: ArapSolver, area: np.ndarray, seeds: np.ndarray) -> np.ndarray:
    """(R,) bool, vertices of the (R,) bool area in a connected piece of it that holds a seed."""
    inside, result = np.flatnonzero(area), np.zeros(len(area), dtype=bool)
    labels = csgraph.connected_components(solver.adjacency[inside][:, inside], directed=False)[1]
    result[inside] = np.isin(labels, labels[seeds[inside]])
    return result
