"""The feature lines of a group: those of its anchor frame that its other frames have too."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from scipy.spatial import cKDTree

from ..geometry.feature_lines import FeatureEdges, feature_edges, line_samples
from ..geometry.mesh import submesh, triangle_shapes
from ..geometry.vectors import TINY
from ..types import FrozenArrays, TriangleMesh
from .mapping import INWARD, FrameMap

BESIDE = 0.5  # s, farthest from a line that a frame's surface beside it is kept
NEAR = 0.5  # s, farthest from a frame's own lines that an edge of the anchor frame may be for the frame to have it too
SAMPLES = 4  # points per s on the lines of a frame, to measure that distance
SHARED = 0.5  # least share of the other frames that have an edge
ONE_BODY = 0.02  # least affinity of the centers on both sides of a line: between bodies that touch, there is a crease but no edge


@dataclass(frozen=True)
class FrameFeatures(FrozenArrays):
    """The feature lines of a frame in reference positions.

    mesh : the surface beside them.  edges : (E, 2) edges of it, of which they consist.
    """

    mesh: TriangleMesh
    edges: Annotated[np.ndarray, "(E, 2) int32"]


def frame_features(frame: FrameMap, mapped: TriangleMesh, whole: np.ndarray) -> FrameFeatures:
    """Those of a frame, except along tears and where bodies touch.

    mapped : the frame's mesh, carried to the reference positions.  whole : (T,) bool, its triangles that do not span a tear.
    """
    nothing = FrameFeatures(TriangleMesh(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int32)), np.zeros((0, 2), dtype=np.int32))
    if frame.mapping != "affinity":  # the published method has no sharp edges
        return nothing
    features = feature_edges(frame.mesh)
    if not len(features.edges):
        return nothing
    edges = features.edges[_within_a_body(frame, features) & whole[features.triangles].all(axis=1)]
    beside = np.zeros(len(mapped.vertices), dtype=bool)
    beside[edges] = True
    if len(edges):
        ends = cKDTree(line_samples(mapped.vertices[edges], frame.spacing / SAMPLES)[0])
        beside |= np.isfinite(ends.query(mapped.vertices, distance_upper_bound=BESIDE * frame.spacing)[0])
    patch, kept = submesh(mapped, beside[mapped.triangles].any(axis=1) & whole)
    number = np.zeros(len(mapped.vertices), dtype=np.int32)
    number[kept] = np.arange(len(kept))
    return FrameFeatures(patch, number[edges])


def _within_a_body(frame: FrameMap, features: FeatureEdges) -> np.ndarray:
    """(E,) bool, whether the centers nearest to a point inside on either side of an edge belong together."""
    tree, middles = cKDTree(frame.centers), frame.mesh.vertices[features.edges].mean(axis=1)
    owners = []
    for triangles in features.triangles.T:
        corners = frame.mesh.vertices[frame.mesh.triangles[triangles]]
        away = corners.mean(axis=1) - middles
        depth = INWARD * frame.spacing
        step = np.minimum(1.0, depth / np.maximum(np.linalg.norm(away, axis=1), TINY))[:, None] * away
        owners.append(tree.query(middles + step - depth * triangle_shapes(corners)[0])[1])
    return np.asarray(frame.affinity[owners[0], owners[1]]).ravel() > ONE_BODY


class SharedFeatures:
    """Collects which features of the anchor frame of a group its other frames have too; these are looked at one after the other.

    anchor : the features of that frame.  spacing : s, scene units.
    """

    def __init__(self, anchor: FrameFeatures, spacing: float):
        self._anchor, self._spacing, self._count = anchor, spacing, 0
        self._middles = anchor.mesh.vertices[anchor.edges].mean(axis=1)
        self._votes = np.zeros(len(anchor.edges), dtype=int)

    def add(self, frame: FrameFeatures) -> None:
        """Another frame."""
        self._count += 1
        if len(self._anchor.edges):
            self._votes += _near(self._middles, frame, self._spacing)

    @property
    def lines(self) -> FrameFeatures:
        """The features that enough of the other frames have; all where there are no others."""
        if not self._count:
            return self._anchor
        return FrameFeatures(self._anchor.mesh, self._anchor.edges[self._votes >= SHARED * self._count])


def _near(points: np.ndarray, frame: FrameFeatures, spacing: float) -> np.ndarray:
    """(N,) bool, whether (N, 3) points lie near the lines of a frame."""
    if not len(frame.edges):
        return np.zeros(len(points), dtype=bool)
    tree = cKDTree(line_samples(frame.mesh.vertices[frame.edges], spacing / SAMPLES)[0])
    return np.isfinite(tree.query(points, distance_upper_bound=NEAR * spacing)[0])

