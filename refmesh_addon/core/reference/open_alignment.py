"""Alignment of the frames of an open take with the anchor frame, by what both show.

A camera cuts a body off where its view ends, so volumes overlap most where the borders of two views coincide, also when the body has
turned beneath them; and centers that are spread evenly over each view lag behind the body in the same way. So the overlap of volumes
judges nothing here: steps are kept that bring what both frames show, away from the border of the anchor frame, nearer to the same planes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.mesh import vertex_normals
from ..types import TriangleMesh
from .alignment import POINTS_PER_CENTER, SOFTEST, STEP_SHARES, STIFFEST, Alignment, moved_centers, plane_gaps
from .anchor_frame import AnchorFrame, ShownSurface
from .mapping import FrameMap

FAR = 0.25  # distance from a partner's plane, in s, from which on a point counts less than half
KEPT = 0.9  # share of the partners that have to remain in a step


@dataclass(frozen=True)
class _Gaps:
    """vertices : (N,) of the mapped frame that have a partner.  normals : (N, 3) and gaps : (N,) of the partner's tangent plane.
    scale : at which a gap counts half, scene units.
    """

    vertices: np.ndarray
    normals: np.ndarray
    gaps: np.ndarray
    scale: float

    @property
    def weights(self) -> np.ndarray:
        """(N,) of a Cauchy kernel: what one frame alone shows hardly pulls."""
        return 1.0 / (1.0 + (self.gaps / self.scale) ** 2)

    @property
    def cost(self) -> float:
        """Mean of the same kernel's cost; infinite without partners."""
        return float(np.log1p((self.gaps / self.scale) ** 2).mean()) if len(self.gaps) else np.inf


def align_open(frame: FrameMap, targets: np.ndarray, anchor: AnchorFrame, surface: np.ndarray, steps: int) -> Alignment:
    """Moves a frame's reference centers so that what it shows lies on what the anchor frame shows.

    targets : (C, 3) reference centers to start from.  anchor : with `shown`.  surface : (V,) bool, vertices of the frame that are on
    no cap.  steps : at most. The mean cost of the distance between both surfaces never grows.
    """
    mesh = start = frame.to(targets)
    chosen = np.flatnonzero(surface)[:: max(1, int(surface.sum()) // (POINTS_PER_CENTER * len(targets)))]
    gaps = _gaps(mesh, chosen, frame.spacing, anchor.shown)
    for rigidity in np.geomspace(STIFFEST, SOFTEST, steps):
        scaled = np.sqrt(gaps.weights)
        weights = frame.binding.weights[gaps.vertices].multiply(scaled[:, None]).tocsr()
        move = moved_centers(weights, gaps.normals, scaled * gaps.gaps, rigidity * anchor.laplacian)
        for share in STEP_SHARES:
            candidate = frame.to(targets + share * move)
            there = _gaps(candidate, chosen, frame.spacing, anchor.shown)
            if there.cost < gaps.cost and len(there.gaps) >= KEPT * len(gaps.gaps):
                targets, mesh, gaps = targets + share * move, candidate, there
                break
    before, after = (anchor.iou(frame.closed(at)) for at in (start, mesh))
    return Alignment(targets, mesh, frame.whole(mesh), before, after)


def _gaps(mesh: TriangleMesh, chosen: np.ndarray, spacing: float, shown: ShownSurface | None) -> _Gaps:
    if shown is None:
        raise ValueError("the anchor frame does not say what it shows; build it with `surface`")
    matched, normals, gaps = plane_gaps(mesh.vertices[chosen], vertex_normals(mesh)[chosen], spacing, shown.tree, shown.normals)
    return _Gaps(chosen[matched], normals, gaps, FAR * spacing)
