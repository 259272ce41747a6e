"""Tangential directions of a surface at its vertices: two where it is smooth, one along a crease, none at a corner."""

from __future__ import annotations

import numpy as np

from ..types import TriangleMesh
from .mesh import triangle_areas, triangle_normals, vertex_triangle_incidence
from .vectors import TINY

SHARP = 0.1  # share of the scatter of the normals around a vertex, along a direction, from which on it is not tangential at all


def tangential_part(mesh: TriangleMesh, steps: np.ndarray) -> np.ndarray:
    """(V, 3) the part of (V, 3) steps along directions to which the normals around a vertex are perpendicular.

    All directions in a plane, only that of the crease on a crease.
    """
    normals, area = triangle_normals(mesh), triangle_areas(mesh)
    products = (area[:, None, None] * normals[:, :, None] * normals[:, None]).reshape(-1, 9)
    values, axes = np.linalg.eigh((vertex_triangle_incidence(mesh) @ products).reshape(-1, 3, 3))
    share = values / np.maximum(values.sum(axis=1, keepdims=True), TINY)
    free = np.clip(1.0 - share / SHARP, 0.0, 1.0)
    return np.einsum("vij,vj->vi", axes, free * np.einsum("vij,vi->vj", axes, steps))
