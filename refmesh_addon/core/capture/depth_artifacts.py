"""What depth cameras add to a surface that is not there: skirts across depth edges, flying pieces, frayed borders.

All limits are relative to the surface's own spacing (its median edge) and area, so that any unit and any camera will do.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from ..geometry.half_edges import HalfEdges
from ..geometry.mesh import area_vectors, submesh, triangles_at, vertex_components
from ..geometry.vectors import TINY, normalized, row_dot
from ..types import FrozenArrays, TriangleMesh

# A skirt joins two surfaces at different depths, so its triangles are long, and seen edge on from where the rest is seen.
LONGEST = 4.0  # median edges
GRAZING = 0.35  # cosine between a triangle and the direction of view, 70 degrees, below which it is seen edge on
FLYING = 0.01  # share of the area of a frame below which a piece by itself is noise; a hand of a person has more
MOST = 0.25  # share of the area that flies or is frayed; beyond that the capture consists of such pieces
MOST_SKIRTS = 0.5  # the same of skirts; beyond that the surface is seen edge on
FRAYED = 2  # rings of triangles that a strip or a spike at the border is thinner than twice


@dataclass(frozen=True)
class Artifacts(FrozenArrays):
    """Which triangles are not surface, (T,) bool each; none is marked twice."""

    skirts: np.ndarray
    flying: np.ndarray
    frayed: np.ndarray

    @property
    def any(self) -> np.ndarray:
        """(T,) bool, all of them."""
        return self.skirts | self.flying | self.frayed

    def shares(self, areas: np.ndarray) -> dict[str, float]:
        """Share of the area that each kind has.  areas : (T,)."""
        total = max(float(areas.sum()), TINY)
        return {item.name: float(areas[getattr(self, item.name)].sum() / total) for item in fields(self)}


def depth_artifacts(mesh: TriangleMesh) -> Artifacts:
    """The artifacts of a surface of which neighbors face alike. Those of a closed layer have no borders, so only pieces may fly."""
    vectors = area_vectors(mesh)
    areas = np.linalg.norm(vectors, axis=1)
    kept = ~(skirts := _skirts(mesh, vectors, areas))
    kept &= ~(flying := _flying(mesh, kept, areas))
    ragged = frayed(mesh, kept)
    ragged &= areas[ragged].sum() <= MOST * areas.sum()
    flying |= _flying(mesh, kept & ~ragged, areas)
    return Artifacts(skirts, flying, ragged & ~flying)


def _skirts(mesh: TriangleMesh, vectors: np.ndarray, areas: np.ndarray) -> np.ndarray:
    corners = mesh.vertices[mesh.triangles]
    sides = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
    long = sides.max(axis=1) > LONGEST * np.median(sides)
    view = vectors[~long].sum(axis=0)
    if np.linalg.norm(view) < GRAZING * areas[~long].sum():  # seen from all round: there is no direction of view
        return np.zeros(len(areas), dtype=bool)
    skirts = long & (row_dot(vectors, normalized(view[None])) < GRAZING * areas)
    return skirts & (areas[skirts].sum() <= MOST_SKIRTS * areas.sum())


def _flying(mesh: TriangleMesh, kept: np.ndarray, areas: np.ndarray) -> np.ndarray:
    """Of the kept triangles, those of connected pieces without area worth the name."""
    rows = np.flatnonzero(kept)
    part, _ = submesh(mesh, rows)
    count, label = vertex_components(part)
    piece = label[part.triangles[:, 0]]
    area = np.bincount(piece, areas[rows], count)
    small = area < FLYING * area.sum()
    result = np.zeros(len(kept), dtype=bool)
    if area[small].sum() <= MOST * area.sum():
        result[rows] = small[piece]
    return result


def frayed(mesh: TriangleMesh, kept: np.ndarray) -> np.ndarray:
    """Of the kept triangles, strips and spikes at the border: the morphological opening of the surface lacks them."""
    inner = kept.copy()
    for _ in range(FRAYED):
        inner &= ~triangles_at(mesh, _border_vertices(mesh, inner))
    opened = inner
    for _ in range(FRAYED):
        corners = np.zeros(len(mesh.vertices), dtype=bool)
        corners[mesh.triangles[opened]] = True
        opened = kept & triangles_at(mesh, corners)
    return kept & ~opened


def _border_vertices(mesh: TriangleMesh, chosen: np.ndarray) -> np.ndarray:
    """(V,) bool, vertices at an edge with exactly one of the chosen triangles."""
    table = HalfEdges(mesh.triangles[chosen], len(mesh.vertices))
    result = np.zeros(len(mesh.vertices), dtype=bool)
    result[table.edges[table.face_counts == 1]] = True
    return result
