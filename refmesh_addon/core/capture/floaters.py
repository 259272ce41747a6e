"""Floaters: small pieces beside a capture, there in one frame and gone in the next, that are noise rather than part of a body.

No center is small enough to follow one. Left in, they stick to the reference mesh as warts, and pull spikes out of it in their frame.
"""

from __future__ import annotations

import numpy as np

from ..geometry.holes import capped
from ..geometry.mesh import component_volumes, submesh, triangle_areas, vertex_components
from ..types import TriangleMesh

LARGEST_VOLUME = 2.5e-4  # share of the enclosed volume: a quarter of what one of 1000 centers represents
LARGEST_AREA = 5e-3  # share of the surface; a sheet encloses nothing but may be a skirt
MOST_AREA = 0.05  # share of the surface of all floaters together; beyond that, the small pieces are what was captured


def without_floaters(mesh: TriangleMesh) -> TriangleMesh:
    """The mesh without components of a tiny share of its volume and surface; the mesh itself if it has none."""
    count, label = vertex_components(mesh)
    if count == 1:
        return mesh
    component = label[mesh.triangles[:, 0]]
    area = np.bincount(component, triangle_areas(mesh), count)
    volume = np.abs(component_volumes(capped(mesh), label))  # a cap's first corner is a vertex of the mesh, which has a label
    floats = (volume < LARGEST_VOLUME * volume.sum()) & (area < LARGEST_AREA * area.sum())
    if not floats.any() or area[floats].sum() > MOST_AREA * area.sum():
        return mesh
    return submesh(mesh, ~floats[component])[0]
