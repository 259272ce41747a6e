"""Drift that has grown over many frames, from what it grows by between neighbors: optical flow does not reach that far at once."""

from __future__ import annotations

import numpy as np

from ..geometry.mesh import vertex_normals
from ..types import TriangleMesh
from .bake import Capture
from .texels import interpolated


def carried(vertices: np.ndarray, neighbor: TriangleMesh, slid: np.ndarray) -> np.ndarray:
    """(R, 3) where spots of the skin are in one frame that are at `vertices` (R, 3) in its neighbor, both in scene units.

    neighbor : the reference mesh as deformed to the neighbor; the spots lie on it, anywhere.
    slid : (R, 3) where the spots below the neighbor's own vertices are in the frame.
    """
    places = Capture(neighbor).searched(vertices, vertex_normals(neighbor.moved(vertices)))
    return interpolated(slid[neighbor.triangles[places.triangles]], places.shares)
