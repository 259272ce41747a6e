"""One frame's color on the reference mesh: at the texels of a layout, or at the vertices."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from ..evaluation.sampled_surface import SampledSurface
from ..evaluation.visibility import unseen
from ..geometry.closest_point import SurfaceIndex
from ..geometry.mesh import triangle_normals, triangles_at, vertex_normals
from ..geometry.vectors import row_dot
from ..types import FrozenArrays, TriangleMesh
from .appearance import Appearance
from .bake import Capture, Places, baked, baked_sharp, placed
from .layout import Layout
from .texels import Texels
from .unlit import PictureError, eight_views, picture_error

PICTURE_SIZE = 512  # pixels along a side of the pictures that source and result are compared in
HIDDEN = 0.5  # weight of hidden corners from which a texel is hidden


@dataclass(frozen=True)
class BakedFrame(FrozenArrays):
    """colors : (N, 3) uint8, of N texels or vertices.  seen : (N,) bool, whether the capture shows the place; False throughout
    for a frame without color.  error : of unlit pictures of the result against the source, None for vertex colors.
    """

    colors: Annotated[np.ndarray, "(N, 3) uint8"]
    seen: Annotated[np.ndarray, "(N) bool"]
    error: PictureError | None = None


def without_color(count: int) -> BakedFrame:
    """A frame that has no color, at this many texels or vertices."""
    return BakedFrame(np.zeros((count, 3), np.uint8), np.zeros(count, bool))


def bake_texels(deformed: TriangleMesh, layout: Layout, texels: Texels, source: TriangleMesh, appearance: Appearance) -> BakedFrame:
    """Color of every texel. Hidden ones have that of the closest place too, so that nothing is left black.

    source : the frame's surface, cleaned.  appearance : the same frame as in its file.
    """
    appearance = oriented(appearance, source)
    places = placed(deformed, texels, Capture(appearance.mesh))
    hidden = hidden_vertices(deformed, source)[deformed.triangles[texels.triangles]].astype(np.float32)
    weight = hidden[:, 0] + texels.shares[:, 0] * (hidden[:, 1] - hidden[:, 0]) + texels.shares[:, 1] * (hidden[:, 2] - hidden[:, 0])
    colors = baked_sharp(appearance, places, texels)
    error = picture_error(appearance, textured(deformed, layout, texels.image(colors)), PICTURE_SIZE, eight_views())
    return BakedFrame(colors, places.matched & (weight < HIDDEN), error)


def bake_vertices(deformed: TriangleMesh, source: TriangleMesh, appearance: Appearance) -> BakedFrame:
    """Color of every vertex, as `bake_texels`."""
    appearance = oriented(appearance, source)
    places: Places = Capture(appearance.mesh).searched(deformed.vertices, vertex_normals(deformed))
    return BakedFrame(baked(appearance, places), places.matched & ~hidden_vertices(deformed, source))


def textured(mesh: TriangleMesh, layout: Layout, image: np.ndarray) -> Appearance:
    """A mesh that shows an (H, W, 3) uint8 picture by its layout."""
    count = len(mesh.triangles)
    colors = np.full((count, 3, 3), 255, np.uint8)
    return Appearance(mesh, layout.corners.astype(np.float32), np.zeros(count, np.int32), colors, (image,))


def oriented(appearance: Appearance, source: TriangleMesh) -> Appearance:
    """The frame as in its file, with triangles facing as in the cleaned source, where patches of the file faced inward."""
    middles = appearance.mesh.vertices[appearance.mesh.triangles].mean(axis=1)
    same = SurfaceIndex(source).query(middles).triangles
    against = row_dot(triangle_normals(appearance.mesh), triangle_normals(source)[same]) < 0
    return appearance.reoriented(against) if against.any() else appearance


def hidden_vertices(deformed: TriangleMesh, source: TriangleMesh) -> np.ndarray:
    """(R,) bool, vertices that lie in a contact or over a hole of the source, where no camera has seen anything, and their neighbors.

    Around a contact the closest place is on either body, so the color there is not to be trusted.
    """
    index, surface = SurfaceIndex(source), SurfaceIndex(deformed)
    some = np.zeros(len(deformed.vertices), np.int64)
    some[deformed.triangles.ravel()] = np.repeat(np.arange(len(deformed.triangles)), 3)
    samples = SampledSurface(deformed.vertices, some, triangle_normals(deformed)[some])
    result = unseen(surface, index, samples, index.query(deformed.vertices))
    result[deformed.triangles[triangles_at(deformed, result)]] = True
    return result
