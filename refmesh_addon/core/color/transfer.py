"""Colors of a mesh brought to another one in the same pose, which has fewer triangles or another layout."""

from __future__ import annotations

import numpy as np

from ..geometry.mesh import vertex_normals
from ..types import TriangleMesh
from .appearance import Appearance
from .bake import Capture, baked, placed
from .layout import Layout
from .texels import Texels


def transferred_texture(appearance: Appearance, mesh: TriangleMesh, layout: Layout, size: int) -> np.ndarray:
    """(size, size, 3) uint8 picture for a layout of the mesh; its gutters take the nearest texel."""
    texels = Texels.of(layout, size)
    return texels.image(baked(appearance, placed(mesh, texels, Capture(appearance.mesh))))


def transferred_colors(appearance: Appearance, mesh: TriangleMesh) -> np.ndarray:
    """(V, 3) uint8 colors of the mesh's vertices."""
    return baked(appearance, Capture(appearance.mesh).searched(mesh.vertices, vertex_normals(mesh)))
