"""Which part of a deformed mesh a frame of an open take shows, from the two surfaces alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from ..geometry.borders import border_edges, on_border
from ..geometry.closest_point import SurfaceIndex
from ..geometry.mesh import mean_edge_length, triangle_normals, vertex_normals
from ..geometry.vectors import row_dot
from ..geometry.vertex_smoothing import VertexSmoother
from ..types import FrozenArrays, TriangleMesh

# Distances from the source, in mean edges of the deformed mesh, up to which a vertex is shown, and from which on it is not.
NEAR, FAR = 0.75, 1.5
# The same beyond the border of the source, along the surface: borders fray by less than an edge.
INSIDE, OUTSIDE = 0.25, 1.0
SPANNING = 1.5  # distance of a triangle's centroid, in the same unit, from which on its corners are not shown; half at 1
FACING = 0.2  # least cosine between the normals of both: what is seen edge on is still seen
BLENDING = 2  # steps in which the visibility fades toward what is not shown; nothing gains by it
SHOWN = 0.5  # visibility from which on a vertex counts as shown


@dataclass(frozen=True)
class VisibleVertices(FrozenArrays):
    """visibility : (R,) float32 of each vertex, 0 where the frame does not show it to 1 where it does."""

    visibility: Annotated[np.ndarray, "(R) float32"]


def shown_vertices(deformed: TriangleMesh, source: TriangleMesh) -> VisibleVertices:
    """How far each vertex of a deformed mesh lies on what a frame shows.

    deformed : the reference in the frame.  source : the frame without what was left out of it.
    Nor are the corners of a triangle shown that spans a gap of the source.
    """
    index, length = SurfaceIndex(source), mean_edge_length(deformed)
    visibility = _shown(index, deformed, length)
    across = index.query(deformed.vertices[deformed.triangles].mean(axis=1)).distances / length
    np.minimum.at(visibility, deformed.triangles, np.clip(SPANNING - across, 0.0, 1.0)[:, None])
    return VisibleVertices(np.minimum(VertexSmoother(deformed).smoothed(visibility, BLENDING), visibility).astype(np.float32))


def median_of_three(first: np.ndarray, second: np.ndarray, third: np.ndarray) -> np.ndarray:
    """The middle one of three values, element by element: of three frames in a row, it leaves out what is so in one of them only."""
    return np.maximum(np.minimum(first, second), np.minimum(np.maximum(first, second), third))


def _shown(source: SurfaceIndex, deformed: TriangleMesh, length: float) -> np.ndarray:
    """(R,) from 0 to 1, how far each vertex lies on the source.  length : mean edge, scene units."""
    closest = source.query(deformed.vertices)
    alike = row_dot(vertex_normals(deformed), triangle_normals(source.mesh)[closest.triangles]) > FACING
    beyond = on_border(source.mesh, border_edges(source.mesh), closest.triangles, closest.points)
    near, far = np.where(beyond, INSIDE, NEAR), np.where(beyond, OUTSIDE, FAR)
    return np.clip((far - closest.distances / length) / (far - near), 0.0, 1.0) * alike
