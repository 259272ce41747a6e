"""Fewer triangles for a whole group: collapsed in one frame, then fitted to the surface in every frame.

A collapse looks at one frame only. So what it leaves is fitted: points all over the original surface, each held to the place
that it has on the reduced one, must lie on it in every frame with the least squared error. That is one linear system,
factored once for all frames.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from ..geometry.borders import barycentric
from ..geometry.closest_point import SurfaceIndex
from ..geometry.factor import factored
from ..geometry.mesh import triangle_areas, triangle_normals
from ..surfacing.edge_collapse import collapsed
from ..types import FrozenArrays, TriangleMesh
from .hierarchy import neighbors

POINTS = np.vstack([np.full((1, 3), 1 / 3), np.full((3, 3), 1 / 6) + np.eye(3) / 2])  # where the points lie in a triangle
STIFFNESS = 1e-3  # of the reduced mesh against being moved unevenly, in mean weights of its vertices
FLOOR = 1e-6  # of the stiffness, for vertices that neither a point nor a neighbor holds in place


@dataclass(frozen=True)
class Reduction(FrozenArrays):
    """frames : (F, R, 3).  triangles : (T', 3).  error : RMS distance of the original surface from it along normals, scene units."""

    frames: np.ndarray
    triangles: np.ndarray
    error: float


def reduced(frames: np.ndarray, triangles: np.ndarray, count: int) -> Reduction:
    """At most `count` triangles in all frames, or as few as the topology allows.

    frames : (F, V, 3) float64, scene units.  triangles : (T, 3), each edge with one or two triangles.
    A mesh that has no more triangles comes back as it is.
    """
    if len(triangles) <= count:
        return Reduction(frames, triangles, 0.0)
    middle = TriangleMesh(frames[len(frames) // 2], triangles)
    coarse, _ = collapsed(middle, count, np.zeros(len(middle.vertices), dtype=bool))
    start = _carried(coarse.vertices, middle, frames)
    held, weights = _held_points(coarse, middle)
    fitted = _fitted(start, held, (_spread(middle.triangles, frame) for frame in frames), weights, coarse.triangles)
    squares = [_square_error(held @ moved, middle.moved(frame), weights) for moved, frame in zip(fitted, frames)]
    return Reduction(fitted, coarse.triangles, float(np.sqrt(np.mean(squares))))


def _carried(points: np.ndarray, mesh: TriangleMesh, frames: np.ndarray) -> np.ndarray:
    """(F, R, 3) points near the mesh, moved with its nearest triangles."""
    closest = SurfaceIndex(mesh).query(points)
    corners = mesh.triangles[closest.triangles]
    shares = barycentric(closest.points, mesh.vertices[corners])
    height = np.einsum("ij,ij->i", points - closest.points, triangle_normals(mesh)[closest.triangles])
    moved = [
        np.einsum("ij,ijk->ik", shares, frame[corners]) + height[:, None] * triangle_normals(mesh.moved(frame))[closest.triangles]
        for frame in frames
    ]
    return np.stack(moved)


def _held_points(coarse: TriangleMesh, middle: TriangleMesh) -> tuple[sparse.csr_matrix, np.ndarray]:
    """(P, R) shares of the reduced vertices in points of the original surface, and the (P,) areas of these."""
    closest = SurfaceIndex(coarse).query(_spread(middle.triangles, middle.vertices))
    corners = coarse.triangles[closest.triangles]
    shares = barycentric(closest.points, coarse.vertices[corners])
    rows = np.repeat(np.arange(len(corners)), 3)
    held = sparse.csr_matrix((shares.ravel(), (rows, corners.ravel())), shape=(len(corners), len(coarse.vertices)))
    return held, np.repeat(triangle_areas(middle), len(POINTS))


def _spread(triangles: np.ndarray, vertices: np.ndarray) -> np.ndarray:
    """(P, 3) points in the triangles, one after another."""
    return np.einsum("pc,tck->tpk", POINTS, vertices[triangles]).reshape(-1, 3)


def _fitted(
    start: np.ndarray, held: sparse.csr_matrix, points: Iterable[np.ndarray], weights: np.ndarray, triangles: np.ndarray
) -> np.ndarray:
    """(F, R, 3) near `start`, with the points of every frame as close to their places as they can be."""
    weighted = held.T @ sparse.diags(weights)
    adjacency = neighbors(triangles.astype(np.int64), held.shape[1])
    laplacian = sparse.diags(np.asarray(adjacency.sum(axis=1)).ravel()) - adjacency
    system = weighted @ held
    stiffness = STIFFNESS * system.diagonal().mean() * (laplacian + FLOOR * sparse.identity(held.shape[1]))
    solver = factored(system + stiffness)
    return np.stack([origin + solver.solve(weighted @ (goal - held @ origin)) for origin, goal in zip(start, points)])


def _square_error(places: np.ndarray, original: TriangleMesh, weights: np.ndarray) -> float:
    """Mean squared distance of the points from their places, along the original's normals."""
    normals = np.repeat(triangle_normals(original), len(POINTS), axis=0)
    along = np.einsum("ij,ij->i", places - _spread(original.triangles, original.vertices), normals)
    return float((weights * along**2).sum() / weights.sum())
