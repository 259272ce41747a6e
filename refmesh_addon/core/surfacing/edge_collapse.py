"""Decimation by quadric edge collapses, many at a time.

Garland & Heckbert, "Surface simplification using quadric error metrics", SIGGRAPH 1997. Instead of taking edges from a queue, each round
collapses all that are cheaper than every edge around them: these are independent of each other.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from ..geometry.half_edges import HalfEdges
from ..geometry.mesh import submesh, triangle_areas, triangle_normals, triangle_shapes, vertex_triangle_incidence
from ..geometry.vectors import TINY, row_dot
from ..types import TriangleMesh

EVENNESS = 0.02  # weight of an edge's squared length against the distance from the planes, so that flat regions get even triangles
LEAST_COSINE = 0.3  # between the normals of a triangle before and after a collapse
LEAST_QUALITY = 0.3  # of a triangle after a collapse, 1 for an equilateral one, unless it was as bad before
PULL = 1e-3  # weight that draws the new vertex to the midpoint of its edge where the planes do not determine it


def collapsed(mesh: TriangleMesh, triangles: int, frozen: np.ndarray) -> tuple[TriangleMesh, np.ndarray]:
    """The surface with at most `triangles` triangles, or as few as its shape and topology allow; and which vertices remain, (R,).

    mesh : each edge with one or two triangles. Closed manifolds stay closed manifolds; boundary vertices stay.
    frozen : (V,) bool, vertices that stay as they are.
    """
    center, scale = mesh.vertices.mean(axis=0), mesh.diagonal
    vertices, faces = (mesh.vertices - center) / scale, mesh.triangles.astype(np.int64)
    quadrics, refused = _Quadrics(mesh.moved(vertices)), np.zeros(0, dtype=np.int64)
    while len(faces) > triangles:  # ends: each round refuses an edge for good or removes one
        edges, opposite = _inner_edges(faces, len(vertices))
        keys = edges @ [len(vertices), 1]
        positions, costs = quadrics.best_positions(vertices, edges, keys)
        costs[np.isin(keys, refused) | frozen[edges].any(axis=1)] = np.inf
        tried = _cheapest_around(edges, costs, faces, len(vertices))
        if not len(tried):
            break
        fits = _keeps_topology(edges[tried], opposite[tried], faces, len(vertices))
        fits[fits] = _keeps_shape(vertices, faces, edges[tried[fits]], positions[tried[fits]])
        refused = np.concatenate([refused, keys[tried[~fits]]])
        chosen = tried[fits]
        chosen = chosen[np.argsort(costs[chosen], kind="stable")][: (len(faces) - triangles + 1) // 2]  # a collapse removes two triangles
        kept, gone = edges[chosen].T
        vertices[kept] = positions[chosen]
        quadrics.merge(kept, gone)
        faces = _renamed(faces, gone, kept, len(vertices))
    return submesh(TriangleMesh(np.where(frozen[:, None], mesh.vertices, vertices * scale + center), faces))


class _Quadrics:
    """The quadric of each vertex, and the costs of edges, kept until one of their ends changes."""

    def __init__(self, mesh: TriangleMesh):
        self._planes = _vertex_planes(mesh)
        self._changed = np.ones(len(mesh.vertices), dtype=bool)  # since the last call of `best_positions`
        self._keys, self._positions, self._costs = np.zeros(0, dtype=np.int64), np.zeros((0, 3)), np.zeros(0)

    def best_positions(self, vertices: np.ndarray, edges: np.ndarray, keys: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Best position (E, 3) of the vertex that an edge would collapse to, and its cost (E,); computed where an end has changed only.

        keys : (E,) ascending, equal for the same edge in all calls.
        """
        changed = self._changed[edges].any(axis=1)
        known = np.searchsorted(self._keys, keys[~changed])
        positions, costs = np.empty((len(edges), 3)), np.empty(len(edges))
        positions[~changed], costs[~changed] = self._positions[known], self._costs[known]
        positions[changed], costs[changed] = _best_positions(vertices, self._planes, edges[changed])
        self._changed[:] = False
        self._keys, self._positions, self._costs = keys, positions, costs.copy()
        return positions, costs

    def merge(self, kept: np.ndarray, gone: np.ndarray) -> None:
        """Vertices `kept` take over the quadrics of `gone` ones, after they have moved."""
        self._planes[kept] += self._planes[gone]
        self._changed[kept] = True


def _vertex_planes(mesh: TriangleMesh) -> np.ndarray:
    """(V, 4, 4) quadrics: sums over the triangles at a vertex of area times the outer product of the plane with itself."""
    normals = triangle_normals(mesh)
    planes = np.column_stack([normals, -row_dot(normals, mesh.vertices[mesh.triangles[:, 0]])])
    products = (triangle_areas(mesh)[:, None, None] * planes[:, :, None] * planes[:, None]).reshape(-1, 16)
    return (vertex_triangle_incidence(mesh) @ products).reshape(-1, 4, 4)


def _inner_edges(faces: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """(E, 2) edges with two triangles and no end on the boundary, and the (E, 2) corners opposite to them."""
    table = HalfEdges(faces, count)
    edges, boundary = table.edges[table.face_counts == 2], np.zeros(count, dtype=bool)
    boundary[table.edges[table.face_counts != 2]] = True
    inner = ~boundary[edges].any(axis=1)
    return edges[inner], table.previous[table.pairs[inner]]


def _best_positions(vertices: np.ndarray, planes: np.ndarray, edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Best position (E, 3) of the vertex that an edge would collapse to, and its cost (E,)."""
    both = planes[edges[:, 0]] + planes[edges[:, 1]]
    midpoint, along = vertices[edges].mean(axis=1), vertices[edges[:, 1]] - vertices[edges[:, 0]]
    weight = np.trace(both[:, :3, :3], axis1=1, axis2=2)  # the area of all planes, as their normals have unit length
    pull = np.maximum(PULL * weight, TINY)
    matrix = both[:, :3, :3] + pull[:, None, None] * np.eye(3)
    positions = np.linalg.solve(matrix, (pull[:, None] * midpoint - both[:, :3, 3])[:, :, None])[:, :, 0]
    far = np.linalg.norm(positions - midpoint, axis=1) > np.linalg.norm(along, axis=1)
    positions[far] = midpoint[far]
    point = np.column_stack([positions, np.ones(len(positions))])
    return positions, np.einsum("ei,eij,ej->e", point, both, point) + EVENNESS * weight * (along**2).sum(axis=1)


def _cheapest_around(edges: np.ndarray, costs: np.ndarray, faces: np.ndarray, count: int) -> np.ndarray:
    """Indices of the edges that are cheaper than all others at their ends and at the neighbors of these."""
    rank = np.empty(len(edges), dtype=np.int64)
    rank[np.argsort(costs, kind="stable")] = np.arange(len(edges))
    least = np.full(count, len(edges))
    for end in edges.T:
        np.minimum.at(least, end, rank)
    around = least.copy()
    of_face = least[faces].min(axis=1)
    for corner in faces.T:
        np.minimum.at(around, corner, of_face)
    return np.flatnonzero((rank == around[edges].min(axis=1)) & np.isfinite(costs))


def _keeps_topology(edges: np.ndarray, opposite: np.ndarray, faces: np.ndarray, count: int) -> np.ndarray:
    """(E,) bool, whether the two opposite corners are the only common neighbors of the ends, and keep three neighbors (link condition)."""
    start, end = faces[:, [0, 1, 2, 1, 2, 0]].ravel(), faces[:, [1, 2, 0, 0, 1, 2]].ravel()
    links = sparse.csr_matrix((np.ones(len(start)), (start, end)), shape=(count, count))
    links.data[:] = 1
    common = np.asarray(links[edges[:, 0]].multiply(links[edges[:, 1]]).sum(axis=1)).ravel()
    return (common == 2) & (np.diff(links.indptr)[opposite] > 3).all(axis=1)


def _keeps_shape(vertices: np.ndarray, faces: np.ndarray, edges: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """(E,) bool, whether no remaining triangle flips or becomes a sliver. No two of the edges may have a neighbor in common."""
    owner = np.full(len(vertices), -1)
    owner[edges] = np.arange(len(edges))[:, None]
    touched = faces[(owner[faces] >= 0).sum(axis=1) == 1]
    edge = owner[touched].max(axis=1)
    before = vertices[touched]
    after = np.where((owner[touched] >= 0)[:, :, None], positions[edge][:, None], before)
    (old, old_quality), (new, new_quality) = triangle_shapes(before), triangle_shapes(after)
    bad = (row_dot(old, new) < LEAST_COSINE) | (new_quality < np.minimum(LEAST_QUALITY, old_quality))
    return np.bincount(edge[bad], minlength=len(edges)) == 0


def _renamed(faces: np.ndarray, gone: np.ndarray, kept: np.ndarray, count: int) -> np.ndarray:
    """The triangles that remain when each `gone` vertex becomes the `kept` one."""
    target = np.arange(count)
    target[gone] = kept
    faces = target[faces]
    return faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
