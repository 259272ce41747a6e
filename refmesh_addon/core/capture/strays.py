"""Stray triangles, far away from everything else in a capture: flying pixels, markers, corners that were lost.

A few of them make the bounding box, of which distances and gaps are shares, as large as they like, so they go before all else.
"""

from __future__ import annotations

import numpy as np

from ..geometry.borders import boundary_edges
from ..geometry.mesh import submesh, vertex_components
from ..types import TriangleMesh

FAR = 1.0  # gap to the rest, in diagonals of the rest, beyond which a component is far away
SPIKE = 10.0  # the same of a vertex, beyond the range of most vertices
MOST = 5e-3  # share of the triangles that strays are at most; more are a body of their own
ALWAYS = 2  # triangles that are strays in a mesh of any size
RANGE = (0.1, 0.9)  # quantiles between which most vertices lie, on each axis


def without_strays(mesh: TriangleMesh) -> tuple[TriangleMesh, np.ndarray]:
    """The mesh without stray triangles, the mesh itself if it has none; and the (N,) indices of these.

    Closed components stay, however far: they enclose a volume and can be followed.
    """
    count, label = vertex_components(mesh)
    component = label[mesh.triangles[:, 0]]
    stray = _far_components(mesh, component, count)[component] | _has_far_corner(mesh)
    if stray.any():
        is_open = np.zeros(count, dtype=bool)
        is_open[label[boundary_edges(mesh)[:, 0]]] = True
        whole = np.bincount(component, ~stray, count) > 0  # a part of it lies where everything else does
        stray &= (is_open | whole)[component]
    if not 0 < stray.sum() <= max(ALWAYS, MOST * len(stray)):
        return mesh, np.empty(0, dtype=np.int64)
    return submesh(mesh, ~stray)[0], np.flatnonzero(stray)


def stray_note(count: int, place: tuple[float, ...]) -> str:
    """What is said about stray triangles.  place : (3,) of the first of them."""
    strays = "1 stray triangle is" if count == 1 else f"{count} stray triangles are"
    near = ", ".join(f"{value:.4g}" for value in place)
    return f"{strays} far from everything else, near ({near}), and left out"


def _far_components(mesh: TriangleMesh, component: np.ndarray, count: int) -> np.ndarray:
    """(count,) bool, components that are far from the one with the most triangles and from all that are near it, and so on."""
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    for corner in mesh.triangles.T:
        np.minimum.at(low, component, mesh.vertices[corner])
        np.maximum.at(high, component, mesh.vertices[corner])
    far = np.ones(count, dtype=bool)
    far[np.bincount(component, minlength=count).argmax()] = False
    while far.any():  # each round but the last brings a component near
        start, end = low[~far].min(axis=0), high[~far].max(axis=0)
        gaps = np.linalg.norm(np.maximum(np.maximum(start - high[far], low[far] - end), 0.0), axis=1)
        near = np.flatnonzero(far)[gaps <= FAR * np.linalg.norm(end - start)]
        if not len(near):
            break
        far[near] = False
    return far


def _has_far_corner(mesh: TriangleMesh) -> np.ndarray:
    """(T,) bool, triangles with a corner far beyond most vertices, also where they are part of a body."""
    low, high = np.quantile(mesh.vertices, RANGE, axis=0)
    beyond = np.linalg.norm(np.maximum(np.maximum(low - mesh.vertices, mesh.vertices - high), 0.0), axis=1)
    return (beyond > SPIKE * np.linalg.norm(high - low))[mesh.triangles].any(axis=1)
