"""Small pieces of an open capture that last: noise flies for one frame, so a piece that the frames around it show as well is surface.

Without this, a piece whose area is about the limit for flying pieces would come and go with every frame in which it passes that. Two
limits decide instead of one, as in Canny's hysteresis along edges, here in time: pieces above the upper one are surface for certain,
those below the lower one are noise, and of those between, the ones that frames nearby show are surface.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from ..geometry.mesh import mean_edge_length, submesh, triangle_areas, vertex_areas, vertex_components
from ..types import TriangleMesh
from .depth_artifacts import FLYING, LONGEST, Artifacts, frayed

LEAST = 0.1 * FLYING  # share of the area of a frame below which a piece is noise however long it lasts: less than a fingertip
# The same in squares of the mean edge: anything smaller may be a single pixel of the depth image. A cube of one voxel has 4 on each side.
LEAST_SQUARES = LONGEST**2
COVERED = 0.5  # share of the area of a piece that another frame must have in its place for this to show it
WINDOW = 2  # frames before and after that say whether a piece lasts
LASTING = 0.5  # share of them that must show it


@dataclass(frozen=True)
class PossibleSurface:
    """What is surface of a frame, or may be.

    pieces : the triangles of each doubtful piece, by index into those of the frame.  near : scene units, how far a piece moves between
    frames at most.
    points : (N, 3) vertices.  areas : (N,) around them.  piece : (N,) number of the doubtful piece of each, -1 for surface for certain.
    """

    pieces: list[np.ndarray]
    near: float
    points: np.ndarray
    areas: np.ndarray
    piece: np.ndarray

    def shown_shares(self, other: PossibleSurface, certain: bool) -> np.ndarray:
        """(P,) area that another frame has in the place of each doubtful piece, as a share of the piece's.

        In its place is what lies near it, and nearer to it than to all else of this frame: a rim that was there already shows no piece
        beside it.  certain : whether only what is surface for certain in the other frame counts.
        """
        chosen = other.piece < 0 if certain else slice(None)
        distances, nearest = cKDTree(self.points).query(other.points[chosen], distance_upper_bound=self.near)
        near = np.isfinite(distances)
        piece, areas = self.piece[nearest[near]], other.areas[chosen][near]
        inside, own = piece >= 0, self.piece >= 0
        shown = np.bincount(piece[inside], areas[inside], len(self.pieces))
        return shown / np.bincount(self.piece[own], self.areas[own], len(self.pieces))


def possible_surface(mesh: TriangleMesh, artifacts: Artifacts) -> PossibleSurface:
    """All of a frame that is surface, or may be.  artifacts : of the mesh by itself."""
    pieces, length = _doubtful_pieces(mesh, artifacts), mean_edge_length(mesh)
    number = np.full(len(mesh.triangles), -1)
    for index, piece in enumerate(pieces):
        number[piece] = index
    part, _ = submesh(mesh, chosen := ~artifacts.any | (number >= 0))
    of_vertices = np.full(len(part.vertices), -1)
    of_vertices[part.triangles] = number[chosen][:, None]
    return PossibleSurface(pieces, LONGEST * length, part.vertices, vertex_areas(part), of_vertices)


def with_lasting_pieces(
    mesh: TriangleMesh, artifacts: Artifacts, own: PossibleSurface, around: Iterable[tuple[int, PossibleSurface]]
) -> Artifacts:
    """The artifacts of a frame without the doubtful pieces that last.

    artifacts : of the mesh by itself.  own : its possible surface.  around : that of each other frame within WINDOW frames, and how many
    frames away it is; read only where a piece is doubtful. A piece lasts that is surface for certain in the frame before or after,
    or that half of the frames around show at all.
    """
    if not own.pieces:
        return artifacts
    shown, count, lasts = np.zeros(len(own.pieces)), 0, np.zeros(len(own.pieces), dtype=bool)
    for offset, other in around:
        shown, count = shown + (own.shown_shares(other, certain=False) >= COVERED), count + 1
        if abs(offset) == 1:
            lasts |= own.shown_shares(other, certain=True) >= COVERED
    lasts |= shown >= max(LASTING * count, 1)
    lasting = np.zeros(len(mesh.triangles), dtype=bool)
    for index in np.flatnonzero(lasts):
        lasting[own.pieces[index]] = True
    return replace(artifacts, flying=artifacts.flying & ~lasting, frayed=artifacts.frayed | frayed(mesh, lasting))


def _doubtful_pieces(mesh: TriangleMesh, artifacts: Artifacts) -> list[np.ndarray]:
    """The triangles of each flying piece that may be surface, by index."""
    rows = np.flatnonzero(artifacts.flying)
    part, _ = submesh(mesh, rows)
    count, label = vertex_components(part)
    areas, piece = triangle_areas(mesh), label[part.triangles[:, 0]]
    least = max(LEAST * areas[~artifacts.any].sum(), LEAST_SQUARES * mean_edge_length(mesh) ** 2)
    large = np.bincount(piece, areas[rows], count) >= least
    return [rows[piece == number] for number in np.flatnonzero(large)]
