"""A group of frames as one mesh and a few morph targets, in whole numbers, as file formats for games and the web hold them.

Positions over the frames are split into a mean and their strongest courses (Karhunen-Loeve transform), and these are shifted and
scaled so that all weights lie within 0 and 1.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..geometry.mesh import normalized, vertex_areas, vertex_normals
from ..types import FrozenArrays, TriangleMesh
from .rate_distortion_rounding import rate_distortion_rounded

UNITS = (1.4, 2.0, 2.6, 3.2)  # of whole numbers, in errors; rounding to a unit of 3.2 leaves little of it to the courses left out


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


@dataclass(frozen=True)
class Courses(FrozenArrays):
    """Frames as their mean and their courses, the strongest first, and what errors are measured by.

    frames : (F, V, 3).  mean : (V, 3).  weights : (F, K).  shapes : (K, V, 3).  normals : (F, V, 3).  areas : (F, V) of the vertices.
    """

    frames: np.ndarray
    mean: np.ndarray
    weights: np.ndarray
    shapes: np.ndarray
    normals: np.ndarray
    areas: np.ndarray

    @classmethod
    def of(cls, frames: np.ndarray, triangles: np.ndarray) -> Courses:
        """Of (F, V, 3) frames with (T, 3) triangles."""
        mean = frames.mean(axis=0)
        courses, strengths, shapes = np.linalg.svd((frames - mean).reshape(len(frames), -1), full_matrices=False)
        meshes = [TriangleMesh(frame, triangles) for frame in frames]
        normals, areas = (np.stack([figure(mesh) for mesh in meshes]) for figure in (vertex_normals, vertex_areas))
        return cls(frames, mean, courses * strengths, shapes.reshape(-1, *mean.shape), normals, areas)

    def cut(self, count: int) -> np.ndarray:
        """(F, V, 3) what the strongest courses alone show."""
        return self.mean + np.tensordot(self.weights[:, :count], self.shapes[:count], axes=1)

    def error(self, shown: np.ndarray) -> float:
        """RMS over area and frames of the distance of (F, V, 3) positions along the normals, scene units."""
        along = np.einsum("fvc,fvc->fv", shown - self.frames, self.normals)
        sums = self.areas.sum(axis=1)
        return float(np.sqrt(np.mean((self.areas * along**2).sum(axis=1) / np.maximum(sums, np.finfo(float).tiny))))


def morph_targets(courses: Courses, unit: float, count: int) -> MorphTargets:
    """The best `count` morph targets, fewer where the frames have fewer courses.  unit : of whole numbers, scene units."""
    reach = np.abs(courses.weights).max(axis=0, initial=0.0) * np.abs(courses.shapes).max(axis=(1, 2), initial=0.0)
    kept = min(count, int((reach > unit / 2).sum()))
    weights, shapes = courses.weights[:, :kept], courses.shapes[:kept]
    low, spread = weights.min(axis=0, initial=np.inf), np.ptp(weights, axis=0) if kept else np.zeros(0)
    base = courses.mean + np.einsum("k,kvc->vc", low, shapes)
    origin = base.min(axis=0)
    exact = np.concatenate([(base - origin)[None], spread[:, None, None] * shapes]) / unit
    between = (weights - low) / spread
    whole = rate_distortion_rounded(exact, np.column_stack([np.ones(len(between)), between]), courses.normals).astype(np.int64)
    start = whole[0].min(axis=0)
    rough = MorphTargets(whole[0] - start, whole[1:], between, origin + unit * start, unit, 0.0)
    return replace(rough, error=courses.error(rough.frames()))


def fitted_morph_targets(courses: Courses, error: float, counts: range) -> MorphTargets:
    """The cheapest morph targets whose RMS error along normals is at most `error`; where none reach it, those that come closest.

    Coarse whole numbers with more targets and fine ones with fewer are tried.  courses : vertices in the order in which they will be
    packed.  error : scene units.  counts : numbers of targets, ascending.
    """
    enough = [count for count in counts if courses.error(courses.cut(count)) <= error] or [counts[-1]]  # before anything is rounded
    tried = [_fewest(courses, error, factor * error, enough) for factor in UNITS]
    reached = [model for model in tried if model.error <= error]
    return min(reached, key=packed_bits) if reached else min(tried, key=lambda model: model.error)


def _fewest(courses: Courses, error: float, unit: float, counts: list[int]) -> MorphTargets:
    """The fewest morph targets that reach the error; the most of them where none do."""
    for count in counts:
        model = morph_targets(courses, unit, count)
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
