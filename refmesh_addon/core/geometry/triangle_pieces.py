"""Triangles cut into pieces of similar size, with their bounding spheres: a few large triangles then do not widen a search for all."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..types import FrozenArrays
from .vectors import column_dot

COARSEST = 2.0  # longest edge of a piece, in median longest edges of the triangles
MOST_PIECES = 4  # pieces per triangle on average; beyond that, pieces stay larger and searches are slower ...
SPARE_PIECES = 1000  # ... and this many more for a mesh of a few triangles
BATCH = 0.7  # pieces whose longest edge is at least this share of the longest of all are cut in the same round
DEGENERATE = 1e-9  # squared sine below which a triangle counts as one without area


@dataclass(frozen=True)
class Pieces(FrozenArrays):
    """N pieces of triangles.

    nodes : (3, M) positions, those of the vertices first.  corners : (3, N) nodes of each piece, its longest edge first.
    owners : (N,) triangle that each piece is part of.  longest : (N,) length of its longest edge, scene units.
    """

    nodes: np.ndarray
    corners: np.ndarray
    owners: np.ndarray
    longest: np.ndarray


def longest_edge_first(axes: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(3, N) triangles with (3, V) vertices, rotated so that the longest edge joins the first two corners, and its (N,) length."""
    corners = [axes.take(corner, axis=1) for corner in triangles]
    squares = np.stack([column_dot(end - start, end - start) for start, end in zip(corners, corners[1:] + corners[:1])])
    order = (squares.argmax(axis=0) + np.arange(3)[:, None]) % 3
    return np.take_along_axis(triangles, order, axis=0), np.sqrt(squares.max(axis=0))


def bisected(nodes: np.ndarray, triangles: np.ndarray, longest: np.ndarray) -> Pieces:
    """Large triangles bisected at the midpoint of their longest edge, the largest first, until none is large.

    nodes : (3, V).  triangles, longest : as `longest_edge_first` returns them. An edge that two triangles share gets a midpoint for each.
    """
    owners, pieces = np.arange(len(longest)), triangles
    fine, most = COARSEST * np.median(longest), MOST_PIECES * len(longest) + SPARE_PIECES
    while True:  # ends: each round adds a piece, up to `most`
        large = longest > max(fine, BATCH * longest.max())
        if not large.any() or len(owners) + large.sum() > most:
            return Pieces(nodes, pieces, owners, longest)
        start, end, apex = pieces[:, large]
        middle = nodes.shape[1] + np.arange(len(start))
        nodes = np.hstack([nodes, (nodes[:, start] + nodes[:, end]) / 2])
        halves = np.hstack([np.stack([start, middle, apex]), np.stack([middle, end, apex])])
        halves, lengths = longest_edge_first(nodes, halves)
        pieces = np.hstack([pieces[:, ~large], halves])
        owners = np.concatenate([owners[~large], np.tile(owners[large], 2)])
        longest = np.concatenate([longest[~large], lengths])


def smallest_spheres(axes: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(4, N) center and radius of the smallest enclosing sphere of each of (3, N) triangles with (3, V) vertices, longest edge first."""
    corners = [axes.take(corner, axis=1) for corner in triangles]
    edge, side = corners[1] - corners[0], corners[2] - corners[0]
    long, short, shared = column_dot(edge, edge), column_dot(side, side), column_dot(edge, side)
    area = long * short - shared**2
    acute = (short > shared) & (area > DEGENERATE * long * short)  # else, and without area, the midpoint of the longest edge is the center
    doubled = np.where(acute, 2.0 * area, 1.0)
    along = np.where(acute, short * (long - shared), 0.5) / doubled
    across = np.where(acute, long * (short - shared), 0.0) / doubled
    center = corners[0] + along * edge + across * side
    squares = [column_dot(corner - center, corner - center) for corner in corners]
    return np.vstack([center, np.sqrt(np.maximum.reduce(squares))])
