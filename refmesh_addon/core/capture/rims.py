"""How ragged the rims of a capture's holes are: a frame with clean rims shows best how a hole is to be closed."""

from __future__ import annotations

import numpy as np

from ..geometry.borders import boundary_edges
from ..geometry.graph import connected_components
from ..geometry.mesh import triangle_areas
from ..types import TriangleMesh


def rim_excess(mesh: TriangleMesh) -> float:
    """How much longer the rims of a mesh are than circles around the same areas, in square roots of its own area; 0 without holes.

    By the isoperimetric inequality no rim is shorter than that: flaps and notches make it longer, and further holes add to the sum.
    The area that a rim encloses is the length of its area vector, which needs no cap.

    >>> square = TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> round(rim_excess(square), 3)
    0.455
    """
    edges = boundary_edges(mesh)
    if not len(edges):
        return 0.0
    count, rims = connected_components(edges, len(mesh.vertices))
    rim = rims[edges[:, 0]]
    start, end = (mesh.vertices - mesh.vertices[edges].mean(axis=(0, 1)))[edges].transpose(1, 0, 2)
    lengths = np.bincount(rim, np.linalg.norm(end - start, axis=1), count)
    areas = np.linalg.norm([np.bincount(rim, axis, count) for axis in np.cross(start, end).T / 2], axis=0)
    excess = np.maximum(lengths - 2 * np.sqrt(np.pi * areas), 0.0)
    return float(excess.sum() / np.sqrt(triangle_areas(mesh).sum()))
