"""One short function per arrow of the pipeline: arrays in, arrays out, so that any process can run it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from ..geometry.self_intersection import crossing_triangles
from ..progress import Progress, ignore
from ..settings import ReferenceSettings
from ..surfacing.reconstruction import reconstruction_depth, screened_poisson
from ..surfacing.remeshing import remeshed
from ..tracking.affinity import group_affinity
from ..types import TriangleMesh
from .alignment import AnchorFrame, align
from .budget import oriented_points, supported
from .mapping import FrameMap
from .reference_centers import ReferenceCenters, reference_centers
from .separation import bodies_of, set_apart, within_bodies


@dataclass(frozen=True)
class GroupCenters:
    """What all frames of a group share: centers in reference positions and how they hang together.

    positions : (C, 3) reference centers.  affinity : (C, C) weights within the group.  spacing : s.  anchor : index in the group.
    """

    positions: np.ndarray
    affinity: sparse.csr_matrix
    spacing: float
    anchor: int
    stress: float


def place_centers(
    positions: np.ndarray,
    tracked: sparse.csr_matrix,
    spacing: float,
    settings: ReferenceSettings,
    progress: Progress = ignore,
    bodies: np.ndarray | None = None,
) -> GroupCenters:
    """Reference centers and group affinity from (F, C, 3) tracked positions.

    tracked : (C, C) affinity weights of the tracking.  bodies : (C,) that must be apart, as `marked_bodies` gives them.
    """
    tracked = within_bodies(tracked, bodies)
    found: ReferenceCenters = reference_centers(positions, progress, settings.stress)
    # What the whole take has shown to be two bodies is two in a group that never shows them apart, too.
    known = bodies_of(found.positions, tracked)
    affinity = within_bodies(within_bodies(group_affinity(positions, found.anchor, tracked, spacing).weights(), known), bodies)
    placed = found.positions
    if settings.mapping == "affinity":  # the spline knows no bodies: set apart, they would smear further
        # Within a group any affinity joins: a limb that bends sharply against the anchor frame is no body of its own.
        placed = set_apart(placed, bodies_of(placed, affinity, joined=0.0), spacing)
    return GroupCenters(placed, affinity, spacing, found.anchor, found.stress)


def anchor_frame(mesh: TriangleMesh, centers: np.ndarray, group: GroupCenters, settings: ReferenceSettings) -> AnchorFrame:
    """The anchor frame of a group, mapped to the reference positions: bound, sampled and voxelized once for all frames of the group.

    mesh : the anchor frame's, closed.  centers : (C, 3) tracked centers in that frame, scene units.
    """
    frame = FrameMap(mesh, centers, group.affinity, group.spacing, settings.mapping)
    mapped = frame.to(group.positions)
    return AnchorFrame.of(mapped, frame.whole(mapped), len(centers))


def align_frame(
    mesh: TriangleMesh, centers: np.ndarray, anchor: AnchorFrame, group: GroupCenters, settings: ReferenceSettings, count: int
) -> dict[str, np.ndarray | np.generic]:
    """A frame carried to the reference positions and aligned with the anchor frame.

    mesh : the frame's, closed.  centers : (C, 3) tracked centers in that frame, scene units.  anchor : from `anchor_frame`.
    count : oriented points to sample. Returns its own reference centers `targets` (C, 3), `points` and `normals`
    (count, 3), and the IoU with the anchor frame `before` and `after`.
    """
    frame = FrameMap(mesh, centers, group.affinity, group.spacing, settings.mapping)
    aligned = align(frame, group.positions, anchor, settings.alignment_steps)
    points, normals = oriented_points(aligned.mesh, frame.whole(aligned.mesh), count, np.random.default_rng(0))
    return {
        "targets": aligned.targets,
        "points": points,
        "normals": normals,
        "before": np.float64(aligned.before),
        "after": np.float64(aligned.after),
    }


def build_reference(
    points: np.ndarray, normals: np.ndarray, anchor_mesh: TriangleMesh, spacing: float, triangles: int, depth: int
) -> dict[str, np.ndarray | np.generic]:
    """The reference mesh of a group from the (P, 3) aligned points of its frames. depth : 0 chooses it."""
    depth = depth or reconstruction_depth(anchor_mesh, triangles)
    surface = supported(screened_poisson(points, normals, depth), points, spacing)
    mesh = remeshed(surface, triangles)
    return {"vertices": mesh.vertices, "triangles": mesh.triangles, "self_intersections": np.int64(crossing_triangles(mesh).sum())}
