"""Drift of a frame removed by its colors: vertices slide until the frame's bake is the anchor frame's, wherever the two then agree.

Flow that was misled, by a pattern that repeats or by a contact, ends where the pictures still differ: such slides are not kept.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

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
SLIDES = 2  # by default, each from a bake of the mesh as the one before has left it; further ones move by less than a tenth of an edge
# Mean difference of two pictures around a vertex, gray levels, below which they show the same. Noise of cameras and resampling
# leave about two; where flow was misled, half of the vertices have more than 15, and one in ten has 6.
SAME = 6.0
ROUNDS = 8  # of averaging over neighbors: a repeated pattern matches itself at single places, not over a surrounding


@dataclass(frozen=True)
class Slide(FrozenArrays):
    """vertices : (R, 3) scene units.  agreeing : (R,) bool, vertices that show the same as in the anchor frame; the others follow them."""

    vertices: Annotated[np.ndarray, "(R, 3) float64"]
    agreeing: Annotated[np.ndarray, "(R) bool"]


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


class Canvas:
    """What pictures of one reference mesh are compared on, worked out once.

    size : texels along a side.
    """

    def __init__(self, mesh: TriangleMesh, layout: Layout, size: int = SIZE):
        self.layout, self.texels, self.averaging = layout, Texels.of(layout, size), _averaging(mesh)


class AnchorPicture:
    """The picture of one frame, the anchor, on the layout of its mesh, with which other frames are compared."""

    def __init__(self, canvas: Canvas, anchor: View):
        self._layout, self._texels, self._averaging, self._blind = canvas.layout, canvas.texels, canvas.averaging, anchor.blind
        self._picture = self._baked(anchor.deformed, _capture(anchor))

    def without_drift(self, view: View, guess: np.ndarray | None = None, slides: int = SLIDES) -> Slide:
        """The mesh of another frame with its vertices moved along the source, as far as the pictures agree afterward.

        guess : (R, 3) scene units, about where they go, for slides that are too long for the flow; None starts where they are.
        slides : how often they are moved; one is enough after a good guess.
        """
        capture, source = _capture(view), SurfaceIndex(view.source)
        mask = self._visible(view)
        shown = lambda mesh: self._evened(self._baked(mesh, capture), mask)
        moved, before = view.deformed, shown(view.deformed)
        after = before
        if guess is not None:
            moved = moved.moved(guess)
            after = shown(moved)
        for _ in range(slides):
            moved = slid(moved, self._layout, self._texels, flow_between(self._picture, after, mask), source)
            after = shown(moved)
        old, new = (self._difference(picture, mask, view.deformed) for picture in (before, after))
        agreeing = (new < SAME) & (new <= old)
        if not agreeing.any():
            return Slide(view.deformed.vertices, agreeing)
        following = displaced(view.deformed, moved.vertices - view.deformed.vertices, agreeing.astype(float), source)
        return Slide(np.where(agreeing[:, None], moved.vertices, following.vertices), agreeing)

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
