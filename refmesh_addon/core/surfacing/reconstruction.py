"""Reconstruction of a closed surface from oriented points."""

from __future__ import annotations

import numpy as np

from ..errors import RefMeshError
from ..geometry.mesh import component_volumes, submesh, triangle_areas, vertex_components
from ..types import TriangleMesh
from .creases import sharpened
from .dual_marching_cubes import zero_surface
from .poisson import solve_screened_poisson

SURPLUS = 1.5  # least triangles of the reconstruction for each one of the budget, so that detail survives the reduction
PADDING = 1.1  # side of the grid, as a multiple of the longest side of the points
DEPTHS = (5, 11)  # coarsest, at which limbs still have some cells, and finest, with cells smaller than the triangles of captures
SMALLEST_VOLUME = 10.0  # cells; components that enclose less, whether bodies or cavities, are below the resolution


def screened_poisson(points: np.ndarray, normals: np.ndarray, depth: int) -> TriangleMesh:
    """Screened Poisson reconstruction (Kazhdan & Hoppe 2013) of (P, 3) points with (P, 3) outward unit normals; closed.

    depth : the padded longest side of the points has 2^depth cells.
    Raises RefMeshError if no surface comes out.
    """
    side = float(np.ptp(points, axis=0).max()) if len(points) else 0.0
    if side > 0:
        cell = cell_size(points, depth)
        grid, values = solve_screened_poisson(points, normals, cell)
        surface = zero_surface(grid, values)
        if len(surface.triangles):
            surface = _without_small_components(sharpened(surface, grid, points, normals), cell)
            if len(surface.triangles):
                return surface
    raise RefMeshError("the surface reconstruction came out empty: use more centers or a smaller --group-size")


def cell_size(points: np.ndarray, depth: int) -> float:
    """Side of a cell of the reconstruction of (P, 3) points at this depth, scene units."""
    return PADDING * float(np.ptp(points, axis=0).max()) / 2**depth


def reconstruction_depth(surface: TriangleMesh, triangles: int) -> int:
    """Depth at which the reconstruction of `surface` has more triangles than the budget, though not many more.

    A surface crosses about one cell of side c per area c^2, and gets about two triangles in it.
    """
    area = float(triangle_areas(surface).sum())
    side = PADDING * float(np.ptp(surface.vertices, axis=0).max())
    depth = np.ceil(np.log2(side * np.sqrt(SURPLUS * triangles / (2 * area))))
    return int(np.clip(depth, *DEPTHS))


def _without_small_components(mesh: TriangleMesh, cell: float) -> TriangleMesh:
    _, component = vertex_components(mesh)
    large = np.abs(component_volumes(mesh, component)) >= SMALLEST_VOLUME * cell**3
    return submesh(mesh, large[component[mesh.triangles[:, 0]]])[0]
