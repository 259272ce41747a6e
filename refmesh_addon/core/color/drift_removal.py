"""Drift of a frame removed by its colors: vertices slide until the frame's bake is the anchor frame's, wherever the two then agree.

Flow that was misled, by a pattern that repeats or by a contact, ends where the pictures still differ: such slides are taken back.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from ..geometry.closest_point import SurfaceIndex
from ..geometry.cotangent import triangle_adjacency
from ..types import FrozenArrays, TriangleMesh
from .appearance import LUMA, Appearance
from .bake import Capture, baked, placed
from .drift import displaced, slid
from .frame import oriented
from .layout import Layout
from .optical_flow import flow_between
from .texels import Texels

SIZE = 1024  # texels along a side of the pictures that are compared
SLIDES = 3  # each is found in a bake of the mesh as the one before has left it; further ones move vertices by less than a tenth of an edge
# Mean difference of two pictures around a vertex, gray levels, below which they show the same. Noise of cameras and resampling
# leave about two; where flow was misled, half of the vertices have more than 15, and one in ten has 6.
SAME = 6.0
BETTER = 0.7  # share of the difference before that may be left
ROUNDS = 8  # of averaging over neighbors: a repeated pattern matches itself at single places, not over a surrounding


@dataclass(frozen=True)
class Slide(FrozenArrays):
    """vertices : (R, 3) scene units.  agreeing : (R,) bool, vertices whose slides were kept; the others follow their neighbors."""

    vertices: np.ndarray
    agreeing: np.ndarray


@dataclass(frozen=True)
class View:
    """One frame for comparison.

    deformed : the reference mesh there.  blind : (R,) bool, vertices whose color is not the capture's, as they lie in a contact
    or have no surface near.  source : the frame's surface, cleaned.  appearance : the same as in its file.
    """

    deformed: TriangleMesh
    blind: np.ndarray
    source: TriangleMesh
    appearance: Appearance


class AnchorPicture:
    """The picture of a group's anchor frame on the layout of its mesh, with which other frames are compared."""

    def __init__(self, layout: Layout, anchor: View, size: int = SIZE):
        self._layout, self._texels = layout, Texels.of(layout, size)
        self._blind, self._averaging = anchor.blind, _averaging(anchor.deformed)
        self._picture = self._baked(anchor.deformed, _capture(anchor))

    def without_drift(self, view: View) -> Slide:
        """The mesh of another frame with its vertices moved along the source, as far as the pictures agree afterward."""
        capture, source = _capture(view), SurfaceIndex(view.source)
        mask = self._visible(view)
        moved, pictures = view.deformed, [self._evened(self._baked(view.deformed, capture), mask)]
        for _ in range(SLIDES):
            moved = slid(moved, self._layout, self._texels, flow_between(self._picture, pictures[-1], mask), source)
            pictures.append(self._evened(self._baked(moved, capture), mask))
        before, after = (self._difference(picture, mask, view.deformed) for picture in (pictures[0], pictures[-1]))
        agreeing = (after < SAME) & (after < BETTER * before)
        if not agreeing.any():
            return Slide(view.deformed.vertices, agreeing)
        offsets = moved.vertices - view.deformed.vertices
        return Slide(displaced(view.deformed, offsets, agreeing.astype(float), source).vertices, agreeing)

    def _baked(self, mesh: TriangleMesh, capture: _ColoredCapture) -> np.ndarray:
        """(size, size) float32 gray levels."""
        colors = baked(capture.appearance, placed(mesh, self._texels, capture.surface))
        return self._texels.image((colors @ LUMA).astype(np.float32))

    def _visible(self, view: View) -> np.ndarray:
        """(size, size) bool, texels that the capture shows in both frames."""
        blind = (self._blind | view.blind)[view.deformed.triangles].any(axis=1)
        mask = np.zeros(self._picture.size, dtype=bool)
        mask[self._texels.pixels[~blind[self._texels.triangles]]] = True
        return mask.reshape(self._picture.shape)

    def _evened(self, picture: np.ndarray, mask: np.ndarray) -> np.ndarray:
        """The picture at the exposure of the anchor frame's."""
        if not mask.any():
            return picture
        return picture * np.float32(np.median(self._picture[mask] / np.maximum(picture[mask], 1.0)))

    def _difference(self, picture: np.ndarray, mask: np.ndarray, mesh: TriangleMesh) -> np.ndarray:
        """(R,) mean difference from the anchor frame's picture around each vertex, gray levels; infinite where nothing is to be seen."""
        shown = mask.ravel()[self._texels.pixels]
        pixels, corners = self._texels.pixels[shown], mesh.triangles[self._texels.triangles[shown]].ravel()
        change = np.abs(self._picture - picture).ravel()[pixels]
        count = len(mesh.vertices)
        weight = np.bincount(corners, minlength=count).astype(float)
        total = np.bincount(corners, np.repeat(change, 3), count)
        for _ in range(ROUNDS):
            total, weight = self._averaging @ total, self._averaging @ weight
        return np.where(weight > 0, total / np.where(weight > 0, weight, 1.0), np.inf)


@dataclass(frozen=True)
class _ColoredCapture:
    surface: Capture
    appearance: Appearance


def _capture(view: View) -> _ColoredCapture:
    appearance = oriented(view.appearance, view.source)
    return _ColoredCapture(Capture(appearance.mesh), appearance)


def _averaging(mesh: TriangleMesh) -> sparse.csr_matrix:
    """(R, R) matrix that takes a value of each vertex half to the mean of its neighbors."""
    links = triangle_adjacency(mesh).astype(float)
    degree = np.maximum(np.asarray(links.sum(axis=1)).ravel(), 1.0)
    return (0.5 * (sparse.identity(len(degree)) + sparse.diags(1.0 / degree) @ links)).tocsr()
