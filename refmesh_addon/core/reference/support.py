"""Which components of a reconstructed surface are bodies: those that points support and that are large enough to hold a center."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..geometry.mesh import component_volumes, submesh, vertex_components
from ..types import TriangleMesh

NEAR = 0.5  # distance, in s, within which a point supports a vertex of the reconstruction
MIN_SUPPORT = 0.5  # share of a component's vertices that must be supported, or it is a bubble of the reconstruction
MIN_VOLUME = 0.25  # s^3; what encloses less has no center to move it: a fold that frames place differently, not a body


def without_bubbles(mesh: TriangleMesh, points: np.ndarray, spacing: float) -> TriangleMesh:
    """The mesh without components that hardly any of the (P, 3) points lies near, and without those too small to hold a center.

    spacing : s, scene units. The largest component stays whatever its size.
    """
    count, component = vertex_components(mesh)
    distance = cKDTree(points).query(mesh.vertices, distance_upper_bound=NEAR * spacing)[0]
    support = np.bincount(component, np.isfinite(distance), count) / np.bincount(component, minlength=count)
    volumes = np.abs(component_volumes(mesh, component))
    bodies = (support >= MIN_SUPPORT) & (volumes >= min(MIN_VOLUME * spacing**3, volumes.max(initial=0.0)))
    return submesh(mesh, bodies[component[mesh.triangles[:, 0]]])[0]
