"""A body with known motion: a closed bar, meshed as finely and as unevenly as wanted, bent into an arc."""

import numpy as np

from refmesh_addon.core.geometry.mesh import mean_edge_length
from refmesh_addon.core.types import TriangleMesh

FOLDED = [100, 300]  # vertices that `with_folds` moves


def bar(rings=24, around=12, uneven=0.0, seed=0):
    """A closed bar of length 4 along x with an elliptic section and round ends.

    uneven : how far vertices lie beside their regular places on the surface, as a share of the spacing.
    """
    off_along, off_around = uneven * np.random.default_rng(seed).uniform(-1, 1, (2, rings * around))
    x = -np.cos((np.repeat(np.arange(rings), around) + 1 + off_along) * np.pi / (rings + 1))
    turn = (np.tile(np.arange(around), rings) + 0.5 * np.repeat(np.arange(rings) % 2, around) + off_around) * 2 * np.pi / around
    radius = (1 - x**6) ** 0.5
    ends = np.array([[-2.0, 0, 0], [2.0, 0, 0]])
    vertices = np.vstack([np.column_stack([2 * x, 0.6 * radius * np.cos(turn), 0.4 * radius * np.sin(turn)]), ends])
    index = np.arange(rings * around).reshape(rings, around)
    triangles = []
    for ring in range(rings - 1):
        a, b = index[ring], index[ring + 1]
        c, d = np.roll(a, -1), np.roll(b, -1)
        triangles += [[a, c, b], [c, d, b]] if ring % 2 == 0 else [[a, d, b], [a, c, d]]
    first, last, tip = index[0], index[-1], np.full(around, rings * around)
    triangles += [[np.roll(first, -1), first, tip], [last, np.roll(last, -1), tip + 1]]
    return TriangleMesh(vertices, np.concatenate([np.stack(corners, axis=1) for corners in triangles]))


def bent(points, angle=1.2):
    """The bar bent into an arc about z."""
    bow = points[:, 0] / 4 * angle
    radius = 4 / angle - points[:, 1]
    return np.column_stack([np.sin(bow) * radius, 4 / angle - np.cos(bow) * radius, points[:, 2]])


def with_folds(mesh, vertices):
    """(R, 3) vertices, two of them moved just across their neighbors."""
    moved = vertices.copy()
    moved[FOLDED] += 1.3 * mean_edge_length(mesh) * np.array([1.0, 0.0, 0.0])
    return moved
