"""The zero surface of a signed-distance field as triangles, by the dual of marching cubes on a turned and shifted grid.

One vertex for each patch of surface in a cell, one quad for each crossed grid edge
(Nielson, "Dual marching cubes", IEEE Visualization 2004).
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.spatial.transform import Rotation

from refmesh_addon.core.surfacing.dual_marching_cubes import EDGES, patches, split_quads
from refmesh_addon.core.surfacing.sparse_grid import CORNERS
from refmesh_addon.core.types import TriangleMesh

from .shapes import Field

EVEN_ROUNDS = 3  # rounds of evening out; the shortest edges then are above a quarter of a cell, contacts apart
NEWTON_STEPS = 2  # vertices lie within a fraction of a cell of the surface; two steps bring them onto it
GRADIENT_STEP = 1e-3  # of a cell, for central differences


def iso_surface(field: Field, center: np.ndarray, reach: float, cell: float, rng: np.random.Generator) -> TriangleMesh:
    """Mesh the solid where `field` is negative, inside the sphere of radius `reach` about `center`.

    cell : grid spacing, about the length of the edges. rng turns and shifts the grid: another state, another set of vertices.
    Triangles face outward. Raises ValueError where the solid reaches the border of the grid.
    """
    count = int(np.ceil(2 * reach / cell)) + 2
    turn = Rotation.from_quat(rng.normal(size=4))
    corner = (rng.uniform(-0.5, 0.5, 3) - (count - 1) / 2) * cell
    nodes = np.indices((count,) * 3).reshape(3, -1).T
    values = field(turn.apply(nodes * cell + corner) + center).reshape((count,) * 3)
    inside = values < 0
    if inside.sum() != inside[1:-1, 1:-1, 1:-1].sum():
        raise ValueError(f"the solid must lie within reach {reach} of {center}")
    places, quads = _dual_quads(values)
    vertices = turn.apply(places * cell + corner) + center
    for _ in range(EVEN_ROUNDS):
        vertices = _pulled_onto_surface(field, _means_of_neighbors(vertices, quads), cell)
    return TriangleMesh(vertices, split_quads(quads, vertices))


def _dual_quads(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (V, 3) in grid units, and a quad of them for each grid edge that the surface crosses, (Q, 4)."""
    flat, inside = values.ravel(), (values < 0).ravel()
    steps = np.array([values.shape[1] * values.shape[2], values.shape[2], 1])
    corner_steps = CORNERS @ steps
    owners, places, quads = [], [], []
    for axis in range(3):
        step, side, other = steps[axis], steps[(axis + 1) % 3], steps[(axis + 2) % 3]
        edges = np.flatnonzero(inside[:-step] != inside[step:])
        place = np.column_stack(np.unravel_index(edges, values.shape)).astype(float)
        place[:, axis] += flat[edges] / (flat[edges] - flat[edges + step])
        cells = edges[:, None] - np.array([side + other, other, 0, side])  # counter-clockwise seen from the edge's far end
        local_edges = 4 * axis + np.array([3, 2, 0, 1])
        cases = inside[cells[:, :, None] + corner_steps] @ (1 << np.arange(8))
        around = len(EDGES) * cells + patches()[cases, local_edges]
        owners.append(around.ravel())
        places.append(np.repeat(place, 4, axis=0))
        quads.append(np.where(inside[edges, None], around, around[:, ::-1]))
    keys, owner = np.unique(np.concatenate(owners), return_inverse=True)
    place = np.concatenate(places)
    sums = np.column_stack([np.bincount(owner, weights=place[:, k]) for k in range(3)])
    return sums / np.bincount(owner)[:, None], np.searchsorted(keys, np.concatenate(quads))


def _means_of_neighbors(vertices: np.ndarray, quads: np.ndarray) -> np.ndarray:
    start, end = quads.ravel(), np.roll(quads, -1, axis=1).ravel()
    links = coo_matrix((np.ones(len(start)), (start, end)), shape=(len(vertices),) * 2).tocsr()
    return links @ vertices / np.asarray(links.sum(axis=1))


def _pulled_onto_surface(field: Field, points: np.ndarray, cell: float) -> np.ndarray:
    offsets = np.eye(3) * (GRADIENT_STEP * cell)
    for _ in range(NEWTON_STEPS):
        slope = np.column_stack([field(points + offset) - field(points - offset) for offset in offsets]) / (2 * GRADIENT_STEP * cell)
        move = -field(points)[:, None] * slope / np.maximum((slope**2).sum(axis=1, keepdims=True), 1e-12)
        length = np.linalg.norm(move, axis=1, keepdims=True)
        points = points + move * np.minimum(1.0, 0.5 * cell / np.maximum(length, 1e-300))  # at most half a cell: creases have no slope
    return points
