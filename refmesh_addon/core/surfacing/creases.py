"""Creases and corners that a smooth implicit function has rounded, recovered from the tangent planes of the points.

Ju et al., "Dual contouring of Hermite data", SIGGRAPH 2002: each vertex moves to where the planes around it meet. Here only where they
meet in a crease or a corner; where the surface is round, vertices stay.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..geometry.self_intersection import still_crossing
from ..geometry.vectors import TINY
from ..types import TriangleMesh
from .sparse_grid import SparseGrid
from .untangling import untangled

REACH = 0.75  # cells: distance from the center of a vertex's cell, along each axis, within which points count
INNER = 0.48  # cells: the same for where a vertex may move, so that vertices of neighboring cells stay apart
MOST_POINTS = 32  # the nearest ones, that count for one vertex
SPREAD = 0.06  # eigenvalue of the normals' scatter along its second axis above which planes meet; two planes at 30 degrees have 0.067
LEAST_SHARE = 0.05  # of the largest eigenvalue; along axes with less, vertices do not move
ROUND = 0.1  # cells; planes whose root mean square distance from their common point is larger belong to a round surface
MOST_REPAIRS = 4  # rounds in which vertices of crossing triangles go back; one or two are enough


def sharpened(mesh: TriangleMesh, grid: SparseGrid, points: np.ndarray, normals: np.ndarray) -> TriangleMesh:
    """The mesh with vertices moved within their cells to where the tangent planes of the points around them meet.

    mesh : from `zero_surface`, with its vertices inside cells of the grid.  points : (P, 3) scene units.  normals : (P, 3) unit length.
    Vertices of triangles that come to cross each other go back; what crosses even so is untangled.
    """
    scaled = (mesh.vertices - grid.origin) / grid.cell
    low = np.floor(scaled)  # corner of the vertex's cell
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


def _steps_to_planes(vertices: np.ndarray, centers: np.ndarray, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(V, 3) steps to where planes meet; zero where they do not. Lengths are in cells.

    vertices, centers : (V, 3), also of their cells.  points, normals : (P, 3).
    """
    distance, near = cKDTree(points).query(centers, k=np.arange(1, min(MOST_POINTS, len(points)) + 1), p=np.inf, distance_upper_bound=REACH)
    weight = np.isfinite(distance).astype(float)
    near = np.where(np.isfinite(distance), near, 0)
    planes, total = normals[near], np.maximum(weight.sum(axis=1), 1.0)
    scatter = np.einsum("vk,vki,vkj->vij", weight, planes, planes) / total[:, None, None]
    offsets = np.einsum("vki,vki->vk", planes, points[near] - vertices[:, None])  # distance of each plane from the vertex, along its normal
    values, axes = np.linalg.eigh(scatter)
    pull = np.einsum("vk,vk,vki->vi", weight, offsets, planes) / total[:, None]
    along = np.einsum("vij,vi->vj", axes, pull)
    step = np.where(values > LEAST_SHARE * values[:, 2:], along / np.maximum(values, TINY), 0.0)
    step = np.einsum("vij,vj->vi", axes, step)
    meet = (values[:, 1] > SPREAD) & (_rms_distance(offsets, planes, step, weight) < ROUND)
    within = np.clip(vertices + step, centers - INNER, centers + INNER) - vertices
    better = _rms_distance(offsets, planes, within, weight) < _rms_distance(offsets, planes, np.zeros_like(step), weight)
    return np.where((meet & better)[:, None], within, 0.0)


def _rms_distance(offsets: np.ndarray, planes: np.ndarray, step: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """(V,) root mean square distance from the planes after a step, in cells."""
    left = offsets - np.einsum("vki,vi->vk", planes, step)
    return np.sqrt(np.einsum("vk,vk->v", weight, left**2) / np.maximum(weight.sum(axis=1), 1.0))
