"""Which ways lie along a surface at its vertices: two on a smooth part, one on a crease, none at a corner."""

from __future__ import annotations

import numpy as np

from ..types import TriangleMesh
from .mesh import triangle_areas, triangle_normals, vertex_triangle_incidence
from .vectors import TINY

SHARP = 0.1  # share of the scatter of the normals around a vertex, along a direction, at which that way no longer lies along the surface


def tangential_part(mesh: TriangleMesh, steps: np.ndarray) -> np.ndarray:
    """(V, 3) the part of (V, 3) steps in directions that the normals around a vertex do not point to: all of a plane, one of a crease."""
    normals, area = triangle_normals(mesh), triangle_areas(mesh)
    products = (area[:, None, None] * normals[:, :, None] * normals[:, None]).reshape(-1, 9)
    values, axes = np.linalg.eigh((vertex_triangle_incidence(mesh) @ products).reshape(-1, 3, 3))
    share = values / np.maximum(values.sum(axis=1, keepdims=True), TINY)
    free = np.clip(1.0 - share / SHARP, 0.0, 1.0)
    return np.einsum("vij,vj->vi", axes, free * np.einsum("vij,vi->vj", axes, steps))
