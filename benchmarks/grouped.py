"""One group of frames, its reference mesh extracted in one way or another, and how well it fits the frames."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np
from scipy import sparse

from refmesh_addon.core.capture.resolution import needed_triangles
from refmesh_addon.core.deformation.deformer import GroupReference, ReferenceDeformer
from refmesh_addon.core.evaluation.distances import TwoSidedDistance
from refmesh_addon.core.evaluation.metrics import surface_distance
from refmesh_addon.core.geometry.mesh import merged, triangle_areas, vertex_components
from refmesh_addon.core.reference.budget import points_per_frame, triangle_budget
from refmesh_addon.core.reference.group import GroupCenters, GroupTracks, align_frame, anchor_frame, group_surface, place_centers
from refmesh_addon.core.reference.mapping import FrameMap, spline_mapped
from refmesh_addon.core.settings import DeformationSettings, ReferenceSettings, TrackingSettings
from refmesh_addon.core.surfacing.hole_caps import CappedMesh, smoothly_capped
from refmesh_addon.core.surfacing.reconstruction import reconstruction_depth
from refmesh_addon.core.tracking.affinity import near_pairs
from refmesh_addon.core.types import TriangleMesh
from refmesh_addon.io.discovery import find_sequence
from refmesh_addon.io.meshes import read_mesh
from refmesh_addon.pipeline.process.single_thread import SINGLE_THREAD
from refmesh_addon.pipeline.session.parallel import Workers
from refmesh_addon.pipeline.stages.reconstruction import build_with

from .common import tracked

SAMPLES = 50_000


@dataclass(frozen=True)
class Take:
    """Tracked frames.  meshes : as captured.  capped : closed.  positions : (F, C, 3).  affinity : (C, C).  spacing : s."""

    numbers: tuple[int, ...]
    meshes: list[TriangleMesh]
    capped: list[CappedMesh]
    positions: np.ndarray
    affinity: sparse.csr_matrix
    spacing: float

    @property
    def bodies(self) -> list[TriangleMesh]:
        """The closed meshes."""
        return [body.mesh for body in self.capped]

    def part(self, frames: list[int]) -> Take:
        """Some of its frames, by index; the tracking stays that of the whole take."""
        chosen = lambda items: [items[index] for index in frames]
        return Take(
            tuple(chosen(self.numbers)), chosen(self.meshes), chosen(self.capped), self.positions[frames], self.affinity, self.spacing
        )


def tracked_take(source: str | Path, frames: str, settings: TrackingSettings) -> Take:
    """Reads and tracks frames as a job does."""
    captured = find_sequence(source, frames).frames
    meshes = [read_mesh(frame.path) for frame in captured]
    bodies = [smoothly_capped(merged(mesh)[0]) for mesh in meshes]
    states = [state for state, _ in tracked([body.mesh for body in bodies], settings)]
    affinity = states[-1].affinity
    positions = np.stack([state.centers for state in states])
    return Take(tuple(frame.number for frame in captured), meshes, bodies, positions, affinity.weights(), affinity.spacing)


@dataclass(frozen=True)
class Reference:
    """A reference mesh.  targets : (C, 3) the centers in it, for each frame.  before, after : IoU of each with the anchor frame."""

    mesh: TriangleMesh
    centers: GroupCenters
    targets: list[np.ndarray]
    mapping: str = "affinity"
    before: list[float] = field(default_factory=list)
    after: list[float] = field(default_factory=list)

    def carried(self, frame: int, take: Take) -> TriangleMesh:
        """The mesh carried to a frame by the centers alone."""
        if self.mapping == "rbf":
            return self.mesh.moved(spline_mapped(self.mesh.vertices, self.targets[frame], take.positions[frame]))
        carrier = FrameMap(self.mesh, self.targets[frame], self.centers.affinity, self.centers.spacing)
        return carrier.to(take.positions[frame])


def extracted(take: Take, settings: ReferenceSettings, workers: Workers) -> Reference:
    """Ours, or with other settings the paper's: what the reference stage makes of all frames of the take as one group."""
    group = place_centers(GroupTracks(take.positions, take.affinity, take.spacing), settings)
    needed = [needed_triangles(mesh) for mesh in take.meshes]
    budget = triangle_budget(settings.triangles, [len(mesh.triangles) for mesh in take.meshes], needed)
    count = points_per_frame(budget, len(take.meshes))
    mapped = anchor_frame(take.capped[group.anchor], take.positions[group.anchor], group, settings)
    tasks = [(body, centers, mapped, group, settings, count) for body, centers in zip(take.capped, take.positions)]
    aligned = _mapped(workers, align_frame, tasks)
    kept = [index for index, one in enumerate(aligned) if one.iou_after >= settings.least_overlap]
    lines = aligned[group.anchor].features
    surface = group_surface((aligned[index] for index in kept), kept.index(group.anchor), lines, take.spacing)
    depth = settings.poisson_depth or reconstruction_depth(take.bodies[group.anchor], budget)
    (built,) = _mapped(workers, build_with, [(settings.reconstruction, surface, take.spacing, budget, depth)])
    before, after = ([getattr(one, name) for one in aligned] for name in ("iou_before", "iou_after"))
    targets = [one.targets for one in aligned]
    return Reference(built.mesh, group, targets, settings.mapping, before, after)


def frame_as_reference(take: Take, index: int) -> Reference:
    """One frame as the reference, as embedded-deformation codecs have it: nodes carry what is near, whatever body it is of."""
    centers = take.positions[index]
    near = near_pairs(centers, take.spacing).weights()
    return Reference(take.bodies[index], GroupCenters(centers, near, take.spacing, index, 0.0), [centers] * len(take.meshes))


def first_frame(take: Take) -> int:
    """The simplest choice."""
    return 0


def best_frame(take: Take) -> int:
    """The frame most likely to show all that the others show: many components, then low genus, then a large surface.

    After the feasibility score of Collet et al. 2015, which counts the same three.
    """

    def score(body: TriangleMesh) -> tuple[float, ...]:
        components = vertex_components(body)[0]
        edges = np.unique(np.sort(body.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
        euler = len(np.unique(body.triangles)) - len(edges) + len(body.triangles)
        return components, -(components - euler / 2), float(triangle_areas(body).sum())

    return max(range(len(take.bodies)), key=lambda index: score(take.bodies[index]))


def judged(take: Take, reference: Reference, settings: DeformationSettings | None, workers: Workers) -> dict[str, dict]:
    """Distances in % of the diagonal over all frames, of the mesh `carried` by its centers, and, given settings, of the `fitted` one."""
    result = {}
    for name, make in (("carried", _carried), ("fitted", partial(_fitted, settings=settings))):
        if name == "carried" or settings is not None:
            tasks = [(make, take.part([index]), reference, index) for index in range(len(take.meshes))]
            result[name] = _summary(_mapped(workers, _distance, tasks))
    return result


def _carried(take: Take, reference: Reference, target: np.ndarray) -> TriangleMesh:
    return Reference(reference.mesh, reference.centers, [target], reference.mapping).carried(0, take)


def _fitted(take: Take, reference: Reference, target: np.ndarray, settings: DeformationSettings) -> TriangleMesh:
    deformer = ReferenceDeformer(GroupReference("", reference.mesh, reference.centers, settings, reference.mapping))
    return reference.mesh.moved(deformer.to(target, take.meshes[0], take.positions[0]).vertices)


def _distance(make: Callable, take: Take, reference: Reference, index: int) -> TwoSidedDistance:
    mesh = make(take, reference, reference.targets[index])
    return surface_distance(take.meshes[0], mesh, SAMPLES, np.random.default_rng(0))


def _summary(distances: list[TwoSidedDistance]) -> dict[str, float]:
    """Mean over the frames of means and 99th percentiles, and the largest maximum, %."""
    result = {}
    for side in ("source_to_deformed", "deformed_to_source"):
        sides = [getattr(distance, side) for distance in distances]
        result |= {f"{side}_mean": np.mean([one.mean for one in sides]), f"{side}_p99": np.mean([one.p99 for one in sides])}
        result[f"{side}_max"] = max(one.max for one in sides)
    return {name: round(100 * float(value), 5) for name, value in result.items()}


def processes() -> Workers:
    """Worker processes as a job has them, with one thread each."""
    os.environ.update(SINGLE_THREAD)
    return Workers()


def _mapped(workers: Workers, function: Callable, tasks: list[tuple]) -> list:
    results = dict(workers.map(function, tasks, lambda: None))
    return [results[index] for index in range(len(tasks))]
