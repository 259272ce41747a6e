"""Small pieces that float about a capture, there in one frame and gone in the next: noise, and no part of a body.

No center is small enough to follow one. Left in, they stick to the reference mesh as warts, and pull spikes out of it in their frame.
"""

from __future__ import annotations

import numpy as np

from ..geometry.holes import capped
from ..geometry.mesh import component_volumes, submesh, triangle_areas, vertex_components
from ..types import TriangleMesh

LARGEST_VOLUME = 2.5e-4  # share of what a frame encloses: a quarter of what one of 1000 centers stands for
LARGEST_AREA = 5e-3  # share of the surface; a sheet encloses nothing, and may yet be a skirt
MOST_AREA = 0.05  # share of the surface of all specks together; pieces that make up more of it are what was captured


def without_floaters(mesh: TriangleMesh) -> TriangleMesh:
    """The mesh without connected pieces of a tiny share of its volume and surface; the mesh itself where it has none."""
    count, label = vertex_components(mesh)
    if count == 1:
        return mesh
    owner = label[mesh.triangles[:, 0]]
    area = np.bincount(owner, triangle_areas(mesh), count)
    volume = np.abs(component_volumes(capped(mesh), label))  # the first corner of a cap is a vertex of the rim
    speck = (volume < LARGEST_VOLUME * volume.sum()) & (area < LARGEST_AREA * area.sum())
    if not speck.any() or area[speck].sum() > MOST_AREA * area.sum():
        return mesh
    return submesh(mesh, ~speck[owner])[0]
