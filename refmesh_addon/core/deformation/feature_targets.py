"""Feature lines of the reference mesh and of a frame: sharp edges, corners and rims of holes stay in line.

Closest points alone leave an edge to chance: a vertex on it faces neither of the two sides, and is pulled to one or the other. Here
each goes to the closest point of the frame's own line beside it; one at a corner goes to the corner.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..geometry.feature_lines import feature_edges, line_corners, line_samples
from ..geometry.vectors import normalized
from ..surfacing.hole_caps import CappedMesh
from ..types import TriangleMesh
from .correspondence import Compatible

REACH = 1.5  # mean edge lengths that a vertex may be off its line
ALIGNED = 0.7  # least cosine between two lines
SAMPLES = 4  # points per mean edge length on the lines of the frame
CANDIDATES = 48  # of these that are tried for a vertex, so that another line close by is passed over


class FeatureTargets:
    """The lines of one frame, as targets for the feature edges of a reference mesh."""

    def __init__(self, features: np.ndarray, frame: CappedMesh, length: float, compatible: Compatible | None = None):
        """features : (K, 2) edges of the reference mesh.  frame : with its holes capped; their rims are lines as well.

        length : mean edge length of the reference mesh, scene units.  compatible : of its vertices and the frame's triangles.
        """
        closed, captured = frame.mesh, np.count_nonzero(frame.holes < 0)
        lines = feature_edges(closed)
        triangles = lines.triangles.min(axis=1)  # those of the capture come before those of caps
        edges = lines.edges[triangles < captured]
        self._length, self._compatible = length, compatible
        self._vertices, places = np.unique(features, return_inverse=True)
        self._places = places.reshape(-1, 2)
        self._is_junction = np.bincount(places.ravel(), minlength=len(self._vertices)) > 2
        self._segments, self._triangles = closed.vertices[edges], triangles[triangles < captured]
        self._directions = normalized(self._segments[:, 1] - self._segments[:, 0])
        junctions, bends = line_corners(closed.vertices, edges)
        self._junctions, self._bends = closed.vertices[junctions], closed.vertices[bends]
        self._points, self._owners = line_samples(self._segments, length / SAMPLES)

    def goals(self, mesh: TriangleMesh) -> tuple[np.ndarray, np.ndarray]:
        """(H,) feature vertices that have a line beside them, or are nearest to a corner, and the (H, 3) points there.

        mesh : the deformed reference.
        """
        own = mesh.vertices[self._vertices]
        goals = self._on_lines(own, self._tangents(own))
        for corners, chosen in ((self._bends, np.arange(len(own))), (self._junctions, np.flatnonzero(self._is_junction))):
            if len(corners) and len(chosen):
                distance, nearest = cKDTree(own[chosen]).query(corners)
                near = np.flatnonzero(distance < REACH * self._length)
                near = near[np.argsort(-distance[near], kind="stable")]  # where two go to one vertex, the nearer one comes last and stays
                goals[chosen[nearest[near]]] = corners[near]
        reached = np.isfinite(goals[:, 0])
        return self._vertices[reached], goals[reached]

    def _on_lines(self, own: np.ndarray, tangents: np.ndarray) -> np.ndarray:
        """(K, 3) the closest points to feature vertices on lines that run along with their own; NaN where there is none."""
        if not len(self._points):
            return np.full(own.shape, np.nan)
        count = min(CANDIDATES, len(self._points))
        distance, near = cKDTree(self._points).query(own, k=np.arange(1, count + 1))
        segment = self._owners[near]
        start, direction = self._segments[segment, 0], self._directions[segment]
        lengths = np.linalg.norm(self._segments[segment, 1] - start, axis=2)
        along = np.clip(np.einsum("vki,vki->vk", own[:, None] - start, direction), 0.0, lengths)
        points = start + along[:, :, None] * direction
        offsets = np.linalg.norm(own[:, None] - points, axis=2)
        aligned = np.abs(np.einsum("vi,vki->vk", tangents, direction)) > ALIGNED
        fits = aligned & (offsets < REACH * self._length) & self._allowed(segment)
        best = np.where(fits, offsets, np.inf).argmin(axis=1)
        return np.where(fits.any(axis=1)[:, None], points[np.arange(len(own)), best], np.nan)

    def _allowed(self, segment: np.ndarray) -> np.ndarray:
        if self._compatible is None:
            return np.ones(segment.shape, dtype=bool)
        vertices = np.repeat(self._vertices, segment.shape[1])
        return self._compatible(vertices, self._triangles[segment.ravel()]).reshape(segment.shape)

    def _tangents(self, own: np.ndarray) -> np.ndarray:
        """(K, 3) direction of the line at each of the (K, 3) feature vertices."""
        ways = normalized(own[self._places[:, 1]] - own[self._places[:, 0]])
        scatter = np.zeros((len(own), 3, 3))
        for end in self._places.T:
            np.add.at(scatter, end, ways[:, :, None] * ways[:, None])
        return np.linalg.eigh(scatter)[1][:, :, 2]

