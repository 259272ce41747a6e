"""A closed surface through oriented points."""

from __future__ import annotations

import numpy as np

from ..errors import RefMeshError
from ..geometry.mesh import component_volumes, submesh, triangle_areas, vertex_components
from ..types import TriangleMesh
from .creases import sharpened
from .dual_marching_cubes import zero_surface
from .poisson import solve_screened_poisson

SURPLUS = 1.5  # triangles that the reconstruction should have for each triangle of the budget, so that detail survives
PADDING = 1.1  # the octree's side against the longest side of the points
DEPTHS = (5, 11)
SPECK = 10.0  # cells; a component that encloses less, body or hollow, is below what the cells resolve


def screened_poisson(points: np.ndarray, normals: np.ndarray, depth: int) -> TriangleMesh:
    """Screened Poisson reconstruction (Kazhdan & Hoppe 2013) of (P, 3) points with (P, 3) outward unit normals; closed.

    depth : cells are the longest side of the points, padded, / 2^depth.
    Raises RefMeshError when there is no surface.
    """
    side = float(np.ptp(points, axis=0).max()) if len(points) else 0.0
    if side > 0:
        cell = PADDING * side / 2**depth
        grid, values = solve_screened_poisson(points, normals, cell)
        surface = zero_surface(grid, values)
        if len(surface.triangles):
            surface = _without_specks(sharpened(surface, grid, points, normals), cell)
            if len(surface.triangles):
                return surface
    raise RefMeshError("the surface reconstruction came out empty: use more centers or a smaller --group-size")


def reconstruction_depth(surface: TriangleMesh, triangles: int) -> int:
    """Octree depth at which the reconstruction of `surface` has more triangles than the budget, but not many more.

    A cell of side c crosses the surface about once per c^2 of area and leaves about two triangles there.
    """
    area = float(triangle_areas(surface).sum())
    side = PADDING * float(np.ptp(surface.vertices, axis=0).max())
    depth = np.ceil(np.log2(side * np.sqrt(SURPLUS * triangles / (2 * area))))
    return int(np.clip(depth, *DEPTHS))


def _without_specks(mesh: TriangleMesh, cell: float) -> TriangleMesh:
    _, component = vertex_components(mesh)
    large = np.abs(component_volumes(mesh, component)) >= SPECK * cell**3
    return submesh(mesh, large[component[mesh.triangles[:, 0]]])[0]
