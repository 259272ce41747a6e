"""The mapped anchor frame of a group: what the other frames of the group are aligned with, prepared once for all of them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from ..geometry.borders import boundary_edges
from ..geometry.mesh import sample_surface, submesh, triangle_normals
from ..geometry.voxels import Grid, fill, fill_closed, grid_around
from ..surfacing.hole_caps import without_holes
from ..types import TriangleMesh
from .cap_points import HoleFinder, OrientedPoints
from .free_space import FreeSpace

POINTS_PER_CENTER = 60  # on the anchor frame's surface: about 0.1 s apart on a body of 1000 centers
IOU_RESOLUTION = 128  # voxels along the longest side when overlap is measured: the paper's 0.01 at 1.8 units, nearly
RIM = 0.5  # distance from the border of what is shown, in s, within which it says nothing: noise and cleaning cut it off anew in each frame
LINKS_PER_CENTER = 8  # strongest affinities of a center, along which moves of the centers are smooth


@dataclass(frozen=True)
class ShownSurface:
    """What the anchor frame of an open take shows, in reference positions.

    tree : of points away from its border.  normals : (N, 3) at these.
    """

    tree: cKDTree
    normals: np.ndarray

    @classmethod
    def of(cls, mesh: TriangleMesh, shown: np.ndarray, spacing: float) -> ShownSurface:
        """mesh : the mapped anchor frame.  shown : (T,) bool, its triangles that are no cap.  spacing : s, scene units."""
        surface = submesh(mesh, shown)[0]
        points, normals = surface.vertices[surface.triangles].mean(axis=1), triangle_normals(surface)
        rim = surface.vertices[np.unique(boundary_edges(surface))]
        inner = cKDTree(rim).query(points)[0] > RIM * spacing if len(rim) else np.ones(len(points), dtype=bool)
        return cls(cKDTree(points[inner]), normals[inner])


@dataclass(frozen=True)
class AnchorFrame:
    """The mapped anchor frame, ready to be aligned with.

    tree : of points spread densely over its surface, the closest of which stands for the closest point: only its tangent
    plane matters, and it is several times as fast to find.  normals : (N, 3) of the surface at these points.
    holes : of the anchor frame.  grid, inside : its volume.  laplacian : (C, C) of the graph of strongest affinities.
    shown : of an open take; None for closed bodies.  free : of closed bodies; None for an open take.
    """

    tree: cKDTree
    normals: np.ndarray
    grid: Grid
    inside: np.ndarray
    laplacian: sparse.csr_matrix
    holes: HoleFinder
    shown: ShownSurface | None = None
    free: FreeSpace | None = None

    @classmethod
    def of(cls, mesh: TriangleMesh, whole: np.ndarray, affinity: sparse.csr_matrix, holes: HoleFinder | None = None) -> AnchorFrame:
        """mesh : mapped anchor frame.  whole : (T,) bool, its triangles that do not span a tear.  affinity : (C, C) of the group.

        holes : of the anchor frame; None for none.
        """
        surface = TriangleMesh(mesh.vertices, mesh.triangles[whole])
        points, owners = sample_surface(surface, POINTS_PER_CENTER * affinity.shape[0], np.random.default_rng(0))
        grid = grid_around(mesh.vertices, IOU_RESOLUTION)
        inside = fill(surface, grid)
        laplacian = sparse.csgraph.laplacian(_strongest(affinity))
        finder = holes or HoleFinder(without_holes(mesh), 0.0)
        return cls(cKDTree(points), triangle_normals(surface)[owners], grid, inside, laplacian, finder)

    def counted(self, points: np.ndarray, normals: np.ndarray, on_cap: np.ndarray) -> OrientedPoints:
        """`HoleFinder.counted`, with those marked that are in free space, and over no hole."""
        counted = self.holes.counted(points, normals, on_cap)
        return counted if self.free is None else replace(counted, in_free_space=self.free.holds(counted.points) & (counted.holes < 0))

    def iou(self, mesh: TriangleMesh) -> float:
        """Intersection over union with the volume of a closed mesh, also where that leaves the anchor frame's box."""
        corners = (mesh.vertices - self.grid.origin) / self.grid.spacing
        low, high = np.floor(corners.min(axis=0)).astype(int), np.ceil(corners.max(axis=0)).astype(int)
        grid = Grid(self.grid.origin + low * self.grid.spacing, self.grid.spacing, tuple(np.maximum(high - low, 1)))
        inside = fill_closed(mesh, grid)
        start = np.maximum(low, 0)
        end = np.maximum(np.minimum(high, self.grid.shape), start)
        theirs, ours = (tuple(map(slice, start - corner, end - corner)) for corner in (low, 0))
        common = np.count_nonzero(inside[theirs] & self.inside[ours])
        union = np.count_nonzero(inside) + np.count_nonzero(self.inside) - common
        return common / union if union else 1.0


def _strongest(affinity: sparse.csr_matrix) -> sparse.csr_matrix:
    """Each center with its LINKS_PER_CENTER strongest neighbors, symmetric, without the diagonal."""
    pairs = sparse.coo_matrix(affinity - sparse.diags(affinity.diagonal()))
    order = np.lexsort((pairs.col, -pairs.data, pairs.row))
    rank = np.arange(pairs.nnz) - np.searchsorted(pairs.row[order], pairs.row[order])
    kept = order[rank < LINKS_PER_CENTER]
    graph = sparse.csr_matrix((pairs.data[kept] / LINKS_PER_CENTER, (pairs.row[kept], pairs.col[kept])), pairs.shape)
    return graph.maximum(graph.T)
