"""How many triangles a surface needs: as many as its curvature asks for at a given error, and enough to bend.

Where a surface has curvature k, a triangle with edges h departs from it by h^2 k / 8. Sharp edges do not count: lines of edges follow them
exactly, however large the triangles beside them.
"""

from __future__ import annotations

import numpy as np

from ..geometry.feature_lines import SHARP
from ..geometry.half_edges import HalfEdges
from ..geometry.mesh import triangle_areas, triangle_normals
from ..geometry.vectors import TINY, row_dot
from ..types import TriangleMesh

ERROR = 3.5e-5  # departure from the surface, as a share of the bounding-box diagonal: that of a ball of 30,000 triangles
LONGEST_EDGE = 0.02  # as a share of the diagonal, however flat: a face may bend in another frame
CURVED = 0.99  # share of the area whose curvature the triangles must suffice for; they are as large everywhere
EQUILATERAL = np.sqrt(3) / 4  # area of a triangle with edges of length 1


def needed_triangles(mesh: TriangleMesh) -> int:
    """Triangles of equal size that represent a surface, for as finely as it is captured.

    >>> from refmesh_addon.core.types import TriangleMesh
    >>> needed_triangles(TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]]))
    2887
    """
    areas, diagonal = triangle_areas(mesh), mesh.diagonal
    total = float(areas.sum())
    if not total > 0:
        return 0
    curvature = _curvature(mesh, areas)
    order = np.argsort(curvature, kind="stable")
    rank = min(int(np.searchsorted(np.cumsum(areas[order]), CURVED * total)), len(order) - 1)
    square = 8 * ERROR * diagonal / max(float(curvature[order[rank]]), float(TINY))
    return int(round(total / (EQUILATERAL * min(square, (LONGEST_EDGE * diagonal) ** 2))))


def _curvature(mesh: TriangleMesh, areas: np.ndarray) -> np.ndarray:
    """(T,) sum of the principal curvatures around each triangle, 1 / scene units, from the angles at its edges; sharp ones left out."""
    table = HalfEdges.of(mesh)
    pairs = table.pairs.T // 3
    one, other = triangle_normals(mesh)[pairs]
    angles = np.arccos(np.clip(row_dot(one, other), -1.0, 1.0))
    start, end = mesh.vertices[table.edges[table.face_counts == 2]].transpose(1, 0, 2)
    bend = np.where(angles > SHARP, 0.0, angles * np.linalg.norm(end - start, axis=1)) / 2  # half for each of the two triangles
    return np.bincount(pairs.ravel(), np.tile(bend, 2), len(areas)) / np.maximum(areas, TINY)
