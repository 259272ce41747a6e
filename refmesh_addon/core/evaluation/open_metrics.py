"""Distances between a frame of an open take and its deformed reference: from all that was kept of it, and from what it shows."""

from __future__ import annotations

import numpy as np

from ..geometry.borders import boundary_edges
from ..geometry.closest_point import SurfaceIndex
from ..geometry.mesh import triangle_areas
from ..types import TriangleMesh
from .distances import Distances, TwoSidedDistance
from .far_places import missing_places, places_among
from .metrics import SEED, MeasuredFrame
from .psnr import d1_d2_psnr
from .sampled_surface import SampledSurface
from .shown_surface import SHOWN

BORDER_SAMPLES = 20_000  # points on the borders of both surfaces together


def measure_open(
    captured: TriangleMesh, kept: TriangleMesh, deformed: TriangleMesh, visibility: np.ndarray, samples: int, is_open: bool = True
) -> MeasuredFrame:
    """The distances of one frame and the error of each deformed vertex.

    captured : the frame as it came.  kept : what was kept of it, which distances are measured to.
    visibility : (R,) of the deformed vertices.  samples : points on each surface.
    is_open : whether the surfaces have borders to compare; a layer has none but by mistake.
    All shares are of the diagonal of `captured`. Raises ValueError for a mesh without area.
    """
    rng, diagonal = np.random.default_rng(SEED), captured.diagonal
    source, index = SurfaceIndex(kept), SurfaceIndex(deformed)
    on_kept, on_deformed = (SampledSurface.of(mesh, samples, rng) for mesh in (kept, deformed))
    outward, inward = index.query(on_kept.points).distances / diagonal, source.query(on_deformed.points).distances / diagonal
    shown = (visibility >= SHOWN)[deformed.triangles].all(axis=1)
    on_shown = shown[on_deformed.triangles]
    d1, d2 = d1_d2_psnr(on_kept, SampledSurface(*(values[on_shown] for values in vars(on_deformed).values())), diagonal)
    distances = TwoSidedDistance(
        source_to_deformed=Distances.of(outward),
        deformed_to_source=Distances.of(inward),
        visible_to_source=Distances.of(inward[on_shown]),
        unseen=float(1.0 - on_shown.mean()),
        d1_psnr=d1,
        d2_psnr=d2,
        kept=float(triangle_areas(kept).sum() / triangle_areas(captured).sum()),
        border=_border_distances(kept, TriangleMesh(deformed.vertices, deformed.triangles[shown]), diagonal) if is_open else None,
    )
    errors, shown_at = source.query(deformed.vertices).distances / diagonal, visibility >= SHOWN
    return MeasuredFrame(distances, errors, places_among(deformed, errors, shown_at), missing_places(source, index))


def _border_distances(kept: TriangleMesh, shown: TriangleMesh, diagonal: float) -> Distances | None:
    """Both ways between the borders of two surfaces, shares of the diagonal; None where one of them has no border.

    The maximum is the Hausdorff distance of the borders, up to the spacing of the samples.
    """
    lines = [_Lines.of(mesh) for mesh in (kept, shown)]
    if not all(len(line.start) for line in lines):
        return None
    there, back = lines[1].distances(lines[0].samples()), lines[0].distances(lines[1].samples())
    return Distances.of(np.concatenate([there, back]) / diagonal)


class _Lines:
    """Line segments, as degenerate triangles of a surface index."""

    def __init__(self, start: np.ndarray, end: np.ndarray):
        self.start, self.end = start, end

    @classmethod
    def of(cls, mesh: TriangleMesh) -> _Lines:
        edges = boundary_edges(mesh)
        return cls(mesh.vertices[edges[:, 0]], mesh.vertices[edges[:, 1]])

    def samples(self) -> np.ndarray:
        """(N, 3) points spread evenly along the segments."""
        lengths = np.cumsum(np.linalg.norm(self.end - self.start, axis=1))
        at = (np.arange(BORDER_SAMPLES // 2) + 0.5) / (BORDER_SAMPLES // 2) * lengths[-1]
        row = np.searchsorted(lengths, at).clip(max=len(lengths) - 1)
        share = ((lengths[row] - at) / np.maximum(np.diff(lengths, prepend=0.0)[row], np.finfo(float).tiny))[:, None]
        return share * self.start[row] + (1 - share) * self.end[row]

    def distances(self, points: np.ndarray) -> np.ndarray:
        """(N,) of points from the nearest segment."""
        count = len(self.start)
        rows = np.arange(count)
        mesh = TriangleMesh(np.concatenate([self.start, self.end]), np.column_stack([rows, rows + count, rows + count]))
        return SurfaceIndex(mesh).query(points).distances
