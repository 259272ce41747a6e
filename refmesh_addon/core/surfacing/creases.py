"""Sharp edges and corners that a smooth implicit function has rounded, found again from the points' own planes.

Ju et al., "Dual contouring of Hermite data", SIGGRAPH 2002: a vertex goes where the planes around it meet. Here only where they
do meet, in an edge or a corner: a round place keeps its vertex.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..geometry.self_intersection import still_crossing
from ..types import TriangleMesh
from .sparse_grid import SparseGrid
from .untangling import untangled

REACH = 0.75  # cells from the middle of a vertex's cell, along each axis, within which points count
INNER = 0.48  # cells from there, along each axis, to which a vertex may move: two do not meet in one place
MOST_POINTS = 32  # that count for one vertex, the nearest ones
SPREAD = 0.06  # share of the normals' scatter along their second axis above which planes meet: two planes 30 degrees apart have 0.067
LEAST_SHARE = 0.05  # of the scatter's largest axis; along weaker ones the vertex stays
ROUND = 0.1  # cells; planes that miss their common point by more, in the mean square, are those of a round place
MOST_REPAIRS = 4  # times that vertices go back to where they were because triangles cross; one or two do


def sharpened(mesh: TriangleMesh, grid: SparseGrid, points: np.ndarray, normals: np.ndarray) -> TriangleMesh:
    """The mesh with vertices moved within their cells to where the planes of the points around them meet.

    mesh : one vertex or a few in each cell of the grid, none on the side of one.  points, normals : (P, 3), scene units, unit.
    Vertices of triangles that come to cross go back; what crosses even so is untangled.
    """
    scaled = (mesh.vertices - grid.origin) / grid.cell
    low = np.floor(scaled)
    moved = mesh.vertices + grid.cell * _steps_to_planes(scaled, low + 0.5, (points - grid.origin) / grid.cell, normals)
    changed = np.ones(len(mesh.triangles), dtype=bool)
    for _ in range(MOST_REPAIRS):
        sharp = mesh.moved(moved)
        crossing = still_crossing(sharp, changed)
        back = np.unique(mesh.triangles[crossing])
        back = back[(moved[back] != mesh.vertices[back]).any(axis=1)]
        if not len(back):
            return untangled(sharp, crossing)
        moved[back] = mesh.vertices[back]
        changed = crossing | np.isin(mesh.triangles, back).any(axis=1)
    return untangled(mesh)


def _steps_to_planes(vertices: np.ndarray, middles: np.ndarray, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(V, 3) steps, in cells, to where planes meet; zero where they do not.

    vertices, middles of their cells : (V, 3).  points, normals : (P, 3).
    """
    distance, near = cKDTree(points).query(middles, k=np.arange(1, min(MOST_POINTS, len(points)) + 1), p=np.inf, distance_upper_bound=REACH)
    weight = np.isfinite(distance).astype(float)
    near = np.where(np.isfinite(distance), near, 0)
    planes, total = normals[near], np.maximum(weight.sum(axis=1), 1.0)
    scatter = np.einsum("vk,vki,vkj->vij", weight, planes, planes) / total[:, None, None]
    offsets = np.einsum("vki,vki->vk", planes, points[near] - vertices[:, None])  # from the vertex to each plane
    values, axes = np.linalg.eigh(scatter)
    pull = np.einsum("vk,vk,vki->vi", weight, offsets, planes) / total[:, None]
    along = np.einsum("vij,vi->vj", axes, pull)
    step = np.where(values > LEAST_SHARE * values[:, 2:], along / np.maximum(values, np.finfo(float).tiny), 0.0)
    step = np.einsum("vij,vj->vi", axes, step)
    meet = (values[:, 1] > SPREAD) & (_missed(offsets, planes, step, weight) < ROUND)
    within = np.clip(vertices + step, middles - INNER, middles + INNER) - vertices
    better = _missed(offsets, planes, within, weight) < _missed(offsets, planes, np.zeros_like(step), weight)
    return np.where((meet & better)[:, None], within, 0.0)


def _missed(offsets: np.ndarray, planes: np.ndarray, step: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """(V,) root mean square distance from the planes after a step."""
    left = offsets - np.einsum("vki,vi->vk", planes, step)
    return np.sqrt(np.einsum("vk,vk->v", weight, left**2) / np.maximum(weight.sum(axis=1), 1.0))
