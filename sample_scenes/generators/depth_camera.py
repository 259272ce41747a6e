"""A virtual depth camera: what one such camera sees of a mesh, with the faults of real ones.

The depth image has noise that grows with the square of the depth, as that of triangulating sensors does, and pixels at depth edges that
flicker: gone in one frame, between the two depths in another. Neighboring pixels become triangles, also across depth edges up to a limit,
so that there are skirts and flying pieces to remove.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from refmesh_addon.core.color.raster import rasterized
from refmesh_addon.core.geometry.mesh import submesh
from refmesh_addon.core.types import TriangleMesh

from .bodies import Sequence

DIRECTION, DISTANCE = np.array([0.3, -0.5, 1.0]), 2.6  # of the camera before a sequence, the distance in its reach


@dataclass(frozen=True)
class DepthCamera:
    """place, target : (3,) scene units; the camera stands at `place` and looks at `target`.
    width : pixels, as many as the height.  field : of view, radians.  noise : standard deviation of the depth as a share of it.
    flicker : share of the pixels at depth edges that are missing, and of those that lie between the two depths.
    bridged : largest step of depth that triangles span, in widths of a pixel at that depth.
    """

    place: tuple[float, float, float]
    target: tuple[float, float, float]
    width: int = 160
    field: float = 0.8
    noise: float = 2e-4
    flicker: float = 0.3
    bridged: float = 12.0

    def seen(self, mesh: TriangleMesh, seed: int) -> TriangleMesh:
        """The triangulated depth image of a mesh, facing the camera; equal for equal seeds."""
        rng, image = np.random.default_rng(seed), self.depths(mesh)
        edge = _at_edges(image, self._step(image))
        draw = rng.random(image.shape)
        image = image * (1.0 + self.noise * rng.standard_normal(image.shape))
        between = edge & (draw > 1.0 - self.flicker)
        image = np.where(between, _mean_with_neighbor(image), image)
        image = np.where(edge & (draw < self.flicker), np.inf, image)
        return self._triangulated(image)

    def depths(self, mesh: TriangleMesh) -> np.ndarray:
        """(width, width) depth along the direction of view, scene units; inf where there is nothing."""
        local = (mesh.vertices - np.array(self.place)) @ self._axes().T
        pixels = self._focal * local[:, :2] / local[:, 2:] + self.width / 2
        fragments = rasterized(pixels[mesh.triangles], self.width, self.width)
        shares = np.column_stack([1.0 - fragments.shares.sum(axis=1), fragments.shares]).astype(np.float64)
        inverse = (shares / local[mesh.triangles[fragments.triangles], 2]).sum(axis=1)  # linear in the picture, which depth is not
        nearest = np.zeros(self.width**2)
        np.maximum.at(nearest, fragments.pixels, inverse)
        with np.errstate(divide="ignore"):
            return (1.0 / nearest).reshape(self.width, self.width)

    @property
    def _focal(self) -> float:
        return self.width / 2 / np.tan(self.field / 2)

    def _axes(self) -> np.ndarray:
        """(3, 3) rows: to the right, down and ahead."""
        ahead = np.array(self.target, dtype=float) - self.place
        ahead /= np.linalg.norm(ahead)
        aside = np.cross(ahead, np.eye(3)[np.argmin(np.abs(ahead))])
        aside /= np.linalg.norm(aside)
        return np.stack([aside, np.cross(ahead, aside), ahead])

    def _step(self, image: np.ndarray) -> np.ndarray:
        return self.bridged * image / self._focal

    def _triangulated(self, image: np.ndarray) -> TriangleMesh:
        there = np.isfinite(image)
        rows, columns = np.indices(image.shape)
        depth = np.where(there, image, 0.0)
        rays = np.stack([columns + 0.5 - self.width / 2, rows + 0.5 - self.width / 2, np.full(image.shape, self._focal)], axis=-1)
        vertices = (rays * (depth / self._focal)[..., None]).reshape(-1, 3) @ self._axes() + self.place
        number = np.arange(image.size).reshape(image.shape)
        a, b, c, d = number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]
        triangles = np.concatenate([np.stack(corners, axis=-1).reshape(-1, 3) for corners in ((a, d, b), (b, d, c))])
        flat, limit = depth.ravel()[triangles], self._step(depth).ravel()[triangles].max(axis=1)
        kept = there.ravel()[triangles].all(axis=1) & (np.ptp(flat, axis=1) < limit)
        return submesh(TriangleMesh(vertices, triangles), kept)[0]


def camera_before(sequence: Sequence) -> DepthCamera:
    """A camera that has all of a sequence in view, from above and a little to one side."""
    place = np.array(sequence.center) + DISTANCE * sequence.reach * DIRECTION / np.linalg.norm(DIRECTION)
    return DepthCamera(tuple(place.tolist()), sequence.center)


def _shifted(image: np.ndarray) -> list[np.ndarray]:
    padded = np.pad(image, 1, mode="edge")
    return [padded[:-2, 1:-1], padded[2:, 1:-1], padded[1:-1, :-2], padded[1:-1, 2:]]


def _at_edges(image: np.ndarray, step: np.ndarray) -> np.ndarray:
    """Pixels with a depth beside others with none, or with one that is another by more than `step`."""
    there = np.isfinite(image)
    finite = np.where(there, image, 1e9)
    apart = np.max([np.abs(finite - other) for other in _shifted(finite)], axis=0) > np.where(there, step, np.inf)
    return there & apart


def _mean_with_neighbor(image: np.ndarray) -> np.ndarray:
    """Each depth averaged with that of the farthest of its neighbors that has one."""
    farthest = np.max([np.where(np.isfinite(other), other, -np.inf) for other in _shifted(image)], axis=0)
    return (image + np.where(np.isfinite(farthest), farthest, image)) / 2
