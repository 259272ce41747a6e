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
    u, v = layout.corners[:, 1] - layout.corners[:, 0], layout.corners[:, 2] - layout.corners[:, 0]
    areas = 0.5 * (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
    return LayoutQuality(
        charts=int(np.count_nonzero(sizes)),
        lone_triangles=int(np.count_nonzero(sizes == 1)),
        mirrored=float((areas < 0).mean()),
        area_used=float(np.abs(areas).sum()),
        stretch=_stretch(mesh, u, v, areas),
    )


def _stretch(mesh: TriangleMesh, u: np.ndarray, v: np.ndarray, areas: np.ndarray) -> float:
    """Symmetric Dirichlet energy, (s1^2 + s2^2 + 1/s1^2 + 1/s2^2) / 4, of the map at the one scale that makes it least.

    s1 and s2 are the singular values of the map of a triangle (Smith and Schaefer, "Bijective parameterization with free
    boundaries", SIGGRAPH 2015); their squares add up to the squared Frobenius norm.
    """
    surface = triangle_areas(mesh)
    whole = (surface > 0) & (areas != 0)
    a, b, c = mesh.vertices[mesh.triangles[whole]].transpose(1, 0, 2)
    e, f = b - a, c - a
    ee, ef, ff = (row_dot(x, y) for x, y in ((e, e), (e, f), (f, f)))
    uu, uv, vv = (row_dot(x, y) for x, y in ((u, u), (u, v), (v, v)))
    norm = (ff * uu[whole] - 2 * ef * uv[whole] + ee * vv[whole]) / np.maximum(4 * surface[whole] ** 2, TINY)
    inverse = norm / np.maximum((areas[whole] / surface[whole]) ** 2, TINY)
    forward, backward = np.average(norm, weights=surface[whole]), np.average(inverse, weights=surface[whole])
    return float(0.5 * np.sqrt(forward * backward))  # scaling the map trades one sum for the other; the least is their geometric mean
