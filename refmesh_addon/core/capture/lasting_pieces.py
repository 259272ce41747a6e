"""Small pieces of an open capture that last: noise flies for one frame, so a piece that the frames beside it show as well is surface.

Without this, a piece whose area is about the limit for flying pieces would come and go with every frame in which it passes that.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from ..geometry.closest_point import SurfaceIndex
from ..geometry.mesh import mean_edge_length, submesh, triangle_areas, vertex_components
from ..types import TriangleMesh
from .depth_artifacts import FLYING, LONGEST, Artifacts, frayed

LEAST = 0.5 * FLYING  # share of the area of a frame below which a piece is noise however long it lasts
COVERED = 0.5  # share of the vertices of a piece that must lie near the surface of another frame for this to show it


def doubtful_pieces(mesh: TriangleMesh, artifacts: Artifacts) -> list[np.ndarray]:
    """The triangles of each flying piece that may be surface, by index.  artifacts : of the mesh by itself."""
    rows = np.flatnonzero(artifacts.flying)
    part, _ = submesh(mesh, rows)
    count, label = vertex_components(part)
    areas, piece = triangle_areas(mesh), label[part.triangles[:, 0]]
    large = np.bincount(piece, areas[rows], count) >= LEAST * areas[~artifacts.any].sum()
    return [rows[piece == number] for number in np.flatnonzero(large)]


def possible_surface(mesh: TriangleMesh, artifacts: Artifacts) -> TriangleMesh:
    """All of a frame that is surface, or may be.  artifacts : of the mesh by itself."""
    chosen = ~artifacts.any
    for piece in doubtful_pieces(mesh, artifacts):
        chosen[piece] = True
    return submesh(mesh, chosen)[0]


def with_lasting_pieces(mesh: TriangleMesh, artifacts: Artifacts, beside: Iterable[TriangleMesh]) -> Artifacts:
    """The artifacts of a frame without the doubtful pieces that all the frames beside it show.

    artifacts : of the mesh by itself.  beside : the `possible_surface` of the frames before and after, read only where a piece is
    doubtful; without any, nothing lasts.
    """
    pieces = doubtful_pieces(mesh, artifacts)
    shown = [SurfaceIndex(other) for other in beside] if pieces else []
    if not shown:
        return artifacts
    near, lasting = LONGEST * mean_edge_length(mesh), np.zeros(len(mesh.triangles), dtype=bool)
    for piece in pieces:
        points = mesh.vertices[np.unique(mesh.triangles[piece])]
        lasting[piece] = all(np.mean(index.query(points, near).triangles >= 0) >= COVERED for index in shown)
    return replace(artifacts, flying=artifacts.flying & ~lasting, frayed=artifacts.frayed | frayed(mesh, lasting))
