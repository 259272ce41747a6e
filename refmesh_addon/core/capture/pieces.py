"""The connected pieces of each frame's surface, and which of them continue from frame to frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from scipy.spatial import cKDTree

from ..geometry.holes import capped
from ..geometry.mesh import component_volumes, sample_surface, submesh, triangle_areas, vertex_components
from ..types import FrozenArrays, TriangleMesh

QUERIES = 200  # points on each piece that are searched on the surface of another frame
SAMPLES = 3000  # points on all pieces of a frame that are searched
NEAR = 0.5  # of the smaller piece's radius, how far its surface moves from frame to frame at most where nothing leaps
OVERLAP = 0.5  # share of a piece's points that must lie near another piece for the one to continue in the other
NOTICEABLE = 0.03  # share of the enclosed volume from which a piece that comes or goes shows in the frame's volume
EXPLAINED = 0.5  # share of a piece's volume by which others must grow to have taken it up
LARGE = 0.05  # share of the enclosed volume from which a piece may be a body of its own
ALIKE = 1.5  # ratio of the volumes, and of the areas, of two pieces up to which one may have leapt to the place of the other


@dataclass(frozen=True)
class Pieces(FrozenArrays):
    """The K pieces of one frame.

    volumes : (K,) enclosed with holes capped, scene units cubed.  areas : (K,).
    queries : (K, Q, 3) points on each.  samples : (N, 3) points on all of them, `piece` : (N,) of which.
    """

    volumes: Annotated[np.ndarray, "(K) float64"]
    areas: Annotated[np.ndarray, "(K) float64"]
    queries: Annotated[np.ndarray, "(K, Q, 3) float64"]
    samples: Annotated[np.ndarray, "(N, 3) float64"]
    piece: Annotated[np.ndarray, "(N) integer"]

    @property
    def radii(self) -> np.ndarray:
        """(K,) of spheres with the same areas."""
        return np.sqrt(self.areas / (4.0 * np.pi))

    @property
    def large(self) -> int:
        """How many of them may be bodies of their own."""
        return int((self.volumes >= LARGE * self.volumes.sum()).sum())


def pieces_of(mesh: TriangleMesh) -> Pieces:
    """The pieces of a frame's surface, numbered as by `vertex_components`."""
    count, label = vertex_components(mesh)
    part, rng = label[mesh.triangles[:, 0]], np.random.default_rng(0)
    volumes = np.abs(component_volumes(capped(mesh), label))
    areas = np.bincount(part, triangle_areas(mesh), count)
    queries = np.stack([_points_on(submesh(mesh, part == piece)[0], QUERIES, rng)[0] for piece in range(count)])
    samples, triangles = _points_on(mesh, SAMPLES, rng)
    return Pieces(volumes, areas, queries, samples, part[triangles])


def continuing(before: Pieces, after: Pieces) -> np.ndarray:
    """(N, 2) pairs of a piece of one frame and a piece of the next that it continues in.

    A piece continues where most of its surface lies near another's, or the other way round. One that continues in none may have leapt
    to the place of one like it that has come from nowhere; or, moving fast, it has merged with others, which have then grown with it.
    """
    if len(before.areas) == len(after.areas) == 1:
        return np.zeros((1, 2), dtype=int)
    overlap = np.maximum(_near(before, after), _near(after, before).T)
    linked = overlap >= OVERLAP
    leaving, coming = np.flatnonzero(~linked.any(axis=1)), np.flatnonzero(~linked.any(axis=0))
    for i in leaving[np.argsort(-before.areas[leaving], kind="stable")]:
        free = coming[~linked[:, coming].any(axis=0)]
        like = free[alike(before, i, after, free)]
        if len(like):
            linked[i, like[np.argmin(np.abs(np.log(after.areas[like] / before.areas[i])))]] = True
    leaving, coming = ~linked.any(axis=1), ~linked.any(axis=0)
    growth = after.volumes[~coming].sum() - before.volumes[~leaving].sum()  # of what continues
    linked[leaving & _taken_up(before.volumes, growth), np.argmax(after.areas)] = True
    linked[np.argmax(before.areas), coming & _taken_up(after.volumes, -growth)] = True
    return np.argwhere(linked)


def _taken_up(volumes: np.ndarray, growth: float) -> np.ndarray:
    """(K,) bool, whether what continues has grown with the volume of a piece: it has merged, not left. Too small a piece does not show."""
    return (volumes > NOTICEABLE * volumes.sum()) & (growth > EXPLAINED * volumes)


def _points_on(mesh: TriangleMesh, count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Points spread by area and the triangle of each; corners where there is no area."""
    if triangle_areas(mesh).any():
        return sample_surface(mesh, count, rng)
    triangles = np.arange(count) % len(mesh.triangles)
    return mesh.vertices[mesh.triangles[triangles, 0]], triangles


def _near(pieces: Pieces, others: Pieces) -> np.ndarray:
    """(K, L) share of the points of each piece that lie near each of the others."""
    spacing = np.sqrt(others.areas.sum() / len(others.samples))
    result = np.zeros((len(pieces.areas), len(others.areas)))
    for other in range(len(others.areas)):
        own = others.samples[others.piece == other]
        if not len(own):
            continue
        distance = cKDTree(own).query(pieces.queries.reshape(-1, 3))[0].reshape(len(pieces.areas), -1)
        reach = NEAR * np.minimum(pieces.radii, others.radii[other]) + 2.0 * spacing
        result[:, other] = (distance <= reach[:, None]).mean(axis=1)
    return result


def alike(before: Pieces, i: int, after: Pieces, candidates: np.ndarray) -> np.ndarray:
    """(N,) bool, which of the candidates have about the area and the volume of piece i."""
    areas = np.abs(np.log(after.areas[candidates] / before.areas[i])) <= np.log(ALIKE)
    tiny = np.finfo(float).tiny
    ratio = (after.volumes[candidates] + tiny) / (before.volumes[i] + tiny)
    return areas & (np.abs(np.log(ratio)) <= np.log(ALIKE))
