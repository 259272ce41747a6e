"""One frame's color on the layout of its reference mesh.

Each texel has a place on the deformed mesh, the closest place on the captured surface with a compatible normal, and the
color of the capture there. One texel of each block is looked up exactly; the others walk over the capture from its place.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.borders import barycentric
from ..geometry.closest_point import SurfaceIndex
from ..geometry.mesh import triangle_normals
from ..geometry.surface_walk import SurfaceWalk
from ..geometry.vectors import row_dot
from ..types import FrozenArrays, TriangleMesh
from .appearance import Appearance
from .texels import Texels, interpolated

COMPATIBLE = 0.0  # least cosine between the normals of a texel and of its place on the capture
REACH = 0.02  # share of the diagonal, greatest distance of a place that matches
BLOCK = 1 << 15  # texels worked on at once: what is made of them stays in the processor's cache
SLACK = 1e-3  # share of the diagonal that a walk may end farther away than the triangle inequality allows, before it is searched anew


@dataclass(frozen=True)
class Places(FrozenArrays):
    """Where points lie on a captured surface.

    triangles : (N,) int32.  shares : (N, 2) float32, weights of the second and third corner.
    matched : (N,) bool, whether the surface there is near and faces the same way.
    """

    triangles: np.ndarray
    shares: np.ndarray
    matched: np.ndarray


class Capture:
    """One captured frame, prepared once for many queries."""

    def __init__(self, mesh: TriangleMesh):
        self.mesh, self.index, self.walk, self.normals = mesh, SurfaceIndex(mesh), SurfaceWalk.of(mesh), triangle_normals(mesh)
        self._reach = REACH * mesh.diagonal

    def searched(self, points: np.ndarray, normals: np.ndarray) -> Places:
        """Exact closest places of (N, 3) points with (N, 3) unit normals, on what faces the same way where that is near enough."""
        nearest = self.index.query(points)
        closest, triangles = np.array(nearest.points), nearest.triangles.astype(np.int32)
        matched = self.compatible(normals, triangles) & (nearest.distances <= self._reach)
        away = np.flatnonzero(~matched)
        again = self.index.query(points[away], self._reach, lambda query, triangle: self.compatible(normals[away[query]], triangle))
        better = again.triangles >= 0
        away = away[better]
        closest[away], triangles[away], matched[away] = again.points[better], again.triangles[better], True
        shares = barycentric(closest, self.mesh.vertices[self.mesh.triangles[triangles]])[:, 1:]
        return Places(triangles, shares.astype(np.float32), matched)

    def walked(self, points: np.ndarray, normals: np.ndarray, start: np.ndarray, reach: np.ndarray) -> Places:
        """Places of (N, 3) points where walks from (N,) triangles end.

        reach : (N,) scene units, how far the closest place can be. What ends farther away, or beside its triangle, is not matched.
        """
        triangles, shares, upright = self.walk.arrived(points, start)
        offset = points - self.at(Places(triangles, shares, np.empty(0)))
        near = row_dot(offset, offset) <= np.minimum(reach, self._reach) ** 2
        return Places(triangles, shares, upright & near & self.compatible(normals, triangles))

    def at(self, places: Places) -> np.ndarray:
        """(N, 3) positions of places, scene units."""
        return interpolated(self.mesh.vertices[self.mesh.triangles[places.triangles]], places.shares)

    def compatible(self, normals: np.ndarray, triangles: np.ndarray) -> np.ndarray:
        """(N,) bool, whether (N,) triangles face as (N, 3) normals do."""
        return row_dot(normals, self.normals[triangles]) > COMPATIBLE


def placed(deformed: TriangleMesh, texels: Texels, capture: Capture) -> Places:
    """The place of every texel of a deformed reference mesh on the capture."""
    normals = triangle_normals(deformed)
    seeds = texels.points(deformed, texels.seeds)
    first = capture.searched(seeds, normals[texels.triangles[texels.seeds]])
    gaps = np.linalg.norm(seeds - capture.at(first), axis=1)
    parts = []
    for at in range(0, len(texels.pixels), BLOCK):
        block = slice(at, at + BLOCK)
        points, seed = texels.points(deformed, block), texels.seed_of[block]
        # the distance to a surface grows by no more than the way that one goes
        reach = gaps[seed] + np.linalg.norm(points - seeds[seed], axis=1) + SLACK * capture.mesh.diagonal
        parts.append(capture.walked(points, normals[texels.triangles[block]], first.triangles[seed], reach))
    return _searched_anew(deformed, texels, capture, normals, parts)


def _searched_anew(deformed: TriangleMesh, texels: Texels, capture: Capture, normals: np.ndarray, parts: list[Places]) -> Places:
    """All places, with those that walks did not match searched exactly."""
    triangles, shares, matched = (np.concatenate([getattr(part, name) for part in parts]) for name in ("triangles", "shares", "matched"))
    lost = np.flatnonzero(~matched)
    again = capture.searched(texels.points(deformed, lost), normals[texels.triangles[lost]])
    triangles[lost], shares[lost], matched[lost] = again.triangles, again.shares, again.matched
    return Places(triangles, shares, matched)


def baked(appearance: Appearance, places: Places) -> np.ndarray:
    """(N, 3) uint8 colors at places on a captured surface; the places are on `appearance.mesh`."""
    return np.rint(exact_colors(appearance, places)).astype(np.uint8)


def baked_sharp(appearance: Appearance, places: Places, texels: Texels) -> np.ndarray:
    """(N, 3) uint8 colors of the texels with which a surface shows those of the capture, without the blur of interpolating twice."""
    return np.clip(np.rint(texels.sharpened(exact_colors(appearance, places))), 0, 255).astype(np.uint8)


def exact_colors(appearance: Appearance, places: Places) -> np.ndarray:
    """(N, 3) float32 colors, 0 to 255, at places on `appearance.mesh`."""
    blocks = [slice(at, at + BLOCK) for at in range(0, len(places.triangles), BLOCK)]
    colors = [appearance.at(places.triangles[block], places.shares[block]) for block in blocks]
    return np.concatenate(colors or [np.empty((0, 3), np.float32)])
