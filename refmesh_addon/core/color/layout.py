"""A texture layout of a reference mesh, and how good it is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from ..geometry.mesh import triangle_areas, vertex_components
from ..geometry.vectors import TINY, row_dot
from ..types import FrozenArrays, TriangleMesh


@dataclass(frozen=True)
class Layout(FrozenArrays):
    """Where each triangle of a reference mesh lies in the texture.

    uvs : (U, 2) float64, 0 to 1, u to the right and v up, as in Blender.
    triangles : (S, 3) int32, indices into `uvs`; row t belongs to triangle t of the mesh, corner by corner.
    """

    uvs: Annotated[np.ndarray, "(U, 2) float64"]
    triangles: Annotated[np.ndarray, "(S, 3) int32 < U"]

    @property
    def corners(self) -> np.ndarray:
        """(S, 3, 2) place of each corner of each triangle."""
        return self.uvs[self.triangles]

    def charts(self) -> np.ndarray:
        """(S,) number of the chart that each triangle belongs to."""
        flat = TriangleMesh(np.column_stack([self.uvs, np.zeros(len(self.uvs))]), self.triangles)
        return vertex_components(flat)[1][self.triangles[:, 0]]

    def pixels(self, size: int) -> np.ndarray:
        """(S, 3, 2) corners in a square picture of this many pixels, x from the left and y from the top edge."""
        return self.corners * [size, -size] + [0.0, size]


@dataclass(frozen=True)
class LayoutQuality:
    """charts : number of them.  lone_triangles : charts of one triangle.  mirrored : share of triangles that face away.
    area_used : share of the texture.  stretch : symmetric Dirichlet energy, mean by area, 1 where lengths are kept.
    """

    charts: int
    lone_triangles: int
    mirrored: float
    area_used: float
    stretch: float


def measured(mesh: TriangleMesh, layout: Layout) -> LayoutQuality:
    """Quality of a layout of this mesh; triangles without area on either side count for the number of charts only."""
    sizes = np.bincount(layout.charts())
    areas = signed_areas(layout.corners)
    return LayoutQuality(
        charts=int(np.count_nonzero(sizes)),
        lone_triangles=int(np.count_nonzero(sizes == 1)),
        mirrored=float((areas < 0).mean()),
        area_used=float(np.abs(areas).sum()),
        stretch=float(stretches(mesh, layout.corners, np.zeros(len(areas), np.int64))[0]),
    )


def signed_areas(corners: np.ndarray) -> np.ndarray:
    """(T,) areas of triangles in the texture, negative for mirrored ones.  corners : (T, 3, 2)."""
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return 0.5 * (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])


def stretches(mesh: TriangleMesh, corners: np.ndarray, charts: np.ndarray) -> np.ndarray:
    """(C,) symmetric Dirichlet energy of each chart, (s1^2 + s2^2 + 1/s1^2 + 1/s2^2) / 4, each at the one scale that makes it least.

    s1 and s2 are the singular values of the map of a triangle (Smith and Schaefer, "Bijective parameterization with free
    boundaries", SIGGRAPH 2015); their squares add up to the squared Frobenius norm.
    corners : (T, 3, 2) places in the texture.  charts : (T,) int, 0 to C - 1. NaN for a chart without area.
    """
    surface, areas = triangle_areas(mesh), signed_areas(corners)
    whole = (surface > 0) & (areas != 0)
    a, b, c = mesh.vertices[mesh.triangles[whole]].transpose(1, 0, 2)
    u, v = (corners[whole, corner] - corners[whole, 0] for corner in (1, 2))
    ee, ef, ff = _dots(b - a, c - a)
    uu, uv, vv = _dots(u, v)
    norm = (ff * uu - 2 * ef * uv + ee * vv) / np.maximum(4 * surface[whole] ** 2, TINY)
    inverse = norm / np.maximum((areas[whole] / surface[whole]) ** 2, TINY)
    owner, weights, count = charts[whole], surface[whole], charts.max(initial=0) + 1
    forward, backward, total = (np.bincount(owner, part, count) for part in (norm * weights, inverse * weights, weights))
    with np.errstate(invalid="ignore"):
        return 0.5 * np.sqrt(forward * backward) / total  # scaling the map trades one sum for the other: the least is their geometric mean


def _dots(u: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return row_dot(u, u), row_dot(u, v), row_dot(v, v)
