"""Smaller triangles where the captures of a group have much smaller ones.

Captures are finer where there is more to show. A reference mesh with triangles of one size, of about as many, has half as many as they
have between the fingers of a hand, and loses the creases there.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from scipy.spatial import cKDTree

from ..geometry.half_edges import HalfEdges
from ..geometry.mesh import edge_lengths, triangle_areas
from ..types import FrozenArrays, TriangleMesh
from .group import ReferenceMesh
from .refinement import largest, with_split_edges

COARSE = 1.8  # edge lengths of the capture, of an edge that is split: such a capture has three times as many triangles there
MOST = 0.1  # edges that are split, as a share of all: the finest surface first
ROUNDS = 2  # of splits, each of which halves edges
AROUND = 32  # triangles of the capture that tell how fine it is at a center; between even ones, marching cubes leave slivers
NEAREST = 4  # centers that tell how fine it is at a vertex


@dataclass(frozen=True)
class CaptureDensity(FrozenArrays):
    """How fine a capture is.  centers : (C, 3) reference centers.  lengths : (C,) edge length of the capture around each, scene units."""

    centers: Annotated[np.ndarray, "(C, 3) float64"]
    lengths: Annotated[np.ndarray, "(C) float64"]

    @classmethod
    def of(cls, surface: TriangleMesh, tracked: np.ndarray, centers: np.ndarray) -> CaptureDensity:
        """That of a frame's surface.  tracked : (C, 3) centers in that frame.  centers : (C, 3) reference centers."""
        middles = surface.vertices[surface.triangles].mean(axis=1)
        near = cKDTree(middles).query(tracked, k=np.arange(1, min(AROUND, len(middles)) + 1))[1]
        return cls(centers, np.sqrt(4 / np.sqrt(3) * np.median(triangle_areas(surface)[near], axis=1)))

    def at(self, points: np.ndarray) -> np.ndarray:
        """(P,) edge length of the capture at (P, 3) points, scene units."""
        near = cKDTree(self.centers).query(points, k=np.arange(1, min(NEAREST, len(self.centers)) + 1))[1]
        return self.lengths[near].mean(axis=1)


def as_fine_as(density: CaptureDensity, reference: ReferenceMesh) -> ReferenceMesh:
    """The reference mesh with those edges split in the middle that are coarse for a capture; itself where there are none.

    New vertices come after those that there are; the surface stays the same.
    """
    budget = int(MOST * len(HalfEdges.of(reference.mesh).edges))
    for _ in range(ROUNDS):
        table = HalfEdges.of(reference.mesh)
        sizes = edge_lengths(reference.mesh.vertices, table.edges) / density.at(reference.mesh.vertices[table.edges].mean(axis=1))
        split = largest(np.where(sizes > COARSE, sizes, 0.0), budget)
        if not split.any():
            break
        budget -= int(split.sum())
        reference = with_split_edges(reference, table, split)
    return reference
