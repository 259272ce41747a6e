"""A group of frames as one mesh and a few morph targets, in whole numbers, as file formats for games and the web hold them.

Positions over the frames are split into a mean and their strongest courses (Karhunen-Loeve transform), and these are shifted and
scaled so that all weights lie within 0 and 1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.mesh import normalized, vertex_areas, vertex_normals
from ..types import FrozenArrays, TriangleMesh

UNITS = (0.7, 1.0, 1.4, 2.0)  # of whole numbers, in errors; rounding to one unit of 2 leaves little of the error to the courses left out


@dataclass(frozen=True)
class MorphTargets(FrozenArrays):
    """Frame f is origin + unit * (base + the sum over k of weights[f, k] * targets[k]).

    base : (V, 3) int64, at least 0.  targets : (K, V, 3) int64.  weights : (F, K) within 0 and 1.  origin : (3,) scene units.
    unit : scene units.  error : RMS distance from the frames given, along their normals, scene units.
    """

    base: np.ndarray
    targets: np.ndarray
    weights: np.ndarray
    origin: np.ndarray
    unit: float
    error: float

    def frames(self) -> np.ndarray:
        """(F, V, 3) what a program shows, scene units."""
        return self.origin + self.unit * (self.base + np.einsum("fk,kvc->fvc", self.weights, self.targets))


def morph_targets(frames: np.ndarray, triangles: np.ndarray, unit: float, count: int) -> MorphTargets:
    """The best `count` morph targets of (F, V, 3) frames, fewer where the frames have fewer courses.

    triangles : (T, 3).  unit : of whole numbers, scene units.
    """
    mean = frames.mean(axis=0)
    courses, strengths, shapes = np.linalg.svd((frames - mean).reshape(len(frames), -1), full_matrices=False)
    kept = min(count, int((strengths * np.abs(shapes).max(axis=1, initial=0.0) > unit / 2).sum()))
    weights = courses[:, :kept] * strengths[:kept]
    low, spread = weights.min(axis=0, initial=np.inf), np.ptp(weights, axis=0) if kept else np.zeros(0)
    directions = shapes[:kept].reshape(kept, *mean.shape)
    base = mean + np.einsum("k,kvc->vc", low, directions)
    origin = base.min(axis=0)
    whole = np.rint((base - origin) / unit).astype(np.int64)
    targets = np.rint(spread[:, None, None] * directions / unit).astype(np.int64)
    rough = MorphTargets(whole, targets, (weights - low) / spread, origin, unit, 0.0)
    return MorphTargets(whole, targets, rough.weights, origin, unit, rms_along_normals(rough.frames(), frames, triangles))


def fitted_morph_targets(frames: np.ndarray, triangles: np.ndarray, error: float, counts: range) -> MorphTargets:
    """The cheapest morph targets whose RMS error along normals is at most `error`; where none reach it, those that come closest.

    Coarse whole numbers with more targets and fine ones with fewer are tried.  frames : (F, V, 3), vertices in the order in which
    they will be packed.  error : scene units.  counts : numbers of targets, ascending.
    """
    tried = [_fewest(frames, triangles, error, factor * error, counts) for factor in UNITS]
    reached = [model for model in tried if model.error <= error]
    return min(reached, key=packed_bits) if reached else min(tried, key=lambda model: model.error)


def _fewest(frames: np.ndarray, triangles: np.ndarray, error: float, unit: float, counts: range) -> MorphTargets:
    """The fewest morph targets that reach the error; the most of them where none do."""
    for count in counts:
        model = morph_targets(frames, triangles, unit, count)
        if model.error <= error or len(model.targets) < count:
            break
    return model


def packed_bits(model: MorphTargets) -> float:
    """About the bits that the positions take where each vertex is packed as the difference from the one before."""
    differences = [np.diff(positions, axis=0) for positions in (model.base, *model.targets)]
    return float(sum(np.log2(1 + 2 * np.abs(difference)).sum() for difference in differences))


def rms_along_normals(frames: np.ndarray, exact: np.ndarray, triangles: np.ndarray) -> float:
    """RMS over area and frames of the distance between (F, V, 3) frames along the normals of the exact ones, scene units."""
    squares = []
    for given, right in zip(frames, exact):
        mesh = TriangleMesh(right, triangles)
        areas = vertex_areas(mesh)
        along = np.einsum("ij,ij->i", given - right, vertex_normals(mesh))
        squares.append((areas * along**2).sum() / max(areas.sum(), np.finfo(float).tiny))
    return float(np.sqrt(np.mean(squares)))


def mean_normals(frames: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(V, 3) unit normals of the frames' mean direction."""
    return normalized(np.sum([vertex_normals(TriangleMesh(frame, triangles)) for frame in frames], axis=0))
