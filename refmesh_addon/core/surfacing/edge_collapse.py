"""Fewer triangles by quadric edge collapses, many at a time.

Garland & Heckbert, "Surface simplification using quadric error metrics", SIGGRAPH 1997. Instead of a queue, each round
collapses all edges that are the cheapest around them: these do not touch each other, so they can be done together.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from ..geometry.half_edges import HalfEdges
from ..geometry.mesh import submesh, triangle_areas, triangle_normals, triangle_shapes, vertex_triangle_incidence
from ..geometry.vectors import row_dot
from ..types import TriangleMesh

EVENNESS = 0.02  # cost of length in flat places against the cost of leaving the planes, so that triangles stay even
LEAST_COSINE = 0.3  # between the normals of a triangle before and after
LEAST_QUALITY = 0.3  # 1 for a regular triangle; a collapse must not leave worse ones, unless they were as bad before
PULL = 1e-3  # of the new vertex to the edge's middle, where the planes leave it free


def collapsed(mesh: TriangleMesh, triangles: int, frozen: np.ndarray) -> tuple[TriangleMesh, np.ndarray]:
    """The surface with at most `triangles` triangles, or as few as its shape and topology allow; and which vertices are left, (R,).

    mesh : each edge with one or two triangles. Closed surfaces stay closed manifolds; vertices at a border stay.
    frozen : (V,) True for vertices that stay as they are.
    """
    middle, scale = mesh.vertices.mean(axis=0), mesh.diagonal
    vertices, faces = (mesh.vertices - middle) / scale, mesh.triangles.astype(np.int64)
    planes = _vertex_planes(mesh.moved(vertices))
    refused = np.zeros(0, dtype=np.int64)
    while len(faces) > triangles:
        edges, opposite = _inner_edges(faces, len(vertices))
        places, costs = _placed(vertices, planes, edges)
        costs[np.isin(edges @ [len(vertices), 1], refused) | frozen[edges].any(axis=1)] = np.inf
        tried = _cheapest_around(edges, costs, faces, len(vertices))
        fit = _keeps_topology(edges[tried], opposite[tried], faces, len(vertices))
        fit[fit] = _keeps_shape(vertices, faces, edges[tried[fit]], places[tried[fit]])
        if not len(tried):
            break
        refused = np.concatenate([refused, edges[tried[~fit]] @ [len(vertices), 1]])
        chosen = tried[fit][np.argsort(costs[tried[fit]], kind="stable")][: (len(faces) - triangles + 1) // 2]
        kept, gone = edges[chosen].T
        vertices[kept], planes[kept] = places[chosen], planes[kept] + planes[gone]
        faces = _renamed(faces, gone, kept, len(vertices))
    places = np.where(frozen[:, None], mesh.vertices, vertices * scale + middle)
    return submesh(TriangleMesh(places, faces))


def _vertex_planes(mesh: TriangleMesh) -> np.ndarray:
    """(V, 4, 4) sums over a vertex's triangles of area times the outer product of their planes."""
    normals = triangle_normals(mesh)
    planes = np.column_stack([normals, -row_dot(normals, mesh.vertices[mesh.triangles[:, 0]])])
    products = (triangle_areas(mesh)[:, None, None] * planes[:, :, None] * planes[:, None]).reshape(-1, 16)
    return (vertex_triangle_incidence(mesh) @ products).reshape(-1, 4, 4)


def _inner_edges(faces: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """(E, 2) edges with two triangles and no end at a border, and the (E, 2) corners opposite to them."""
    table = HalfEdges(faces, count)
    inner_edges, border = table.edges[table.face_counts == 2], np.zeros(count, dtype=bool)
    border[table.edges[table.face_counts != 2]] = True
    inner = ~border[inner_edges].any(axis=1)
    return inner_edges[inner], table.previous[table.pairs[inner]]


def _placed(vertices: np.ndarray, planes: np.ndarray, edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Best place (E, 3) of the vertex that an edge would shrink to, and its cost (E,)."""
    both = planes[edges[:, 0]] + planes[edges[:, 1]]
    middle, along = vertices[edges].mean(axis=1), vertices[edges[:, 1]] - vertices[edges[:, 0]]
    weight = np.trace(both[:, :3, :3], axis1=1, axis2=2)  # the area of all planes, as normals have length 1
    pull = np.maximum(PULL * weight, np.finfo(float).tiny)
    matrix = both[:, :3, :3] + pull[:, None, None] * np.eye(3)
    places = np.linalg.solve(matrix, (pull[:, None] * middle - both[:, :3, 3])[:, :, None])[:, :, 0]
    far = np.linalg.norm(places - middle, axis=1) > np.linalg.norm(along, axis=1)
    places[far] = middle[far]
    point = np.column_stack([places, np.ones(len(places))])
    return places, np.einsum("ei,eij,ej->e", point, both, point) + EVENNESS * weight * (along**2).sum(axis=1)


def _cheapest_around(edges: np.ndarray, costs: np.ndarray, faces: np.ndarray, count: int) -> np.ndarray:
    """Indices of the edges that are cheaper than every edge at a neighbor of their ends."""
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
    """(E,) True where the ends have only the two opposite corners as common neighbors, which keep three neighbors (link condition)."""
    start, end = faces[:, [0, 1, 2, 1, 2, 0]].ravel(), faces[:, [1, 2, 0, 0, 1, 2]].ravel()
    links = sparse.csr_matrix((np.ones(len(start)), (start, end)), shape=(count, count))
    links.data[:] = 1
    common = np.asarray(links[edges[:, 0]].multiply(links[edges[:, 1]]).sum(axis=1)).ravel()
    return (common == 2) & (np.diff(links.indptr)[opposite] > 3).all(axis=1)


def _keeps_shape(vertices: np.ndarray, faces: np.ndarray, edges: np.ndarray, places: np.ndarray) -> np.ndarray:
    """(E,) True where no triangle that stays turns over or becomes a sliver. Edges must not have neighbors in common."""
    owner = np.full(len(vertices), -1)
    owner[edges] = np.arange(len(edges))[:, None]
    touched = faces[(owner[faces] >= 0).sum(axis=1) == 1]
    edge = owner[touched].max(axis=1)
    before = vertices[touched]
    after = np.where((owner[touched] >= 0)[:, :, None], places[edge][:, None], before)
    (old, old_quality), (new, new_quality) = triangle_shapes(before), triangle_shapes(after)
    bad = (row_dot(old, new) < LEAST_COSINE) | (new_quality < np.minimum(LEAST_QUALITY, old_quality))
    return np.bincount(edge[bad], minlength=len(edges)) == 0


def _renamed(faces: np.ndarray, gone: np.ndarray, kept: np.ndarray, count: int) -> np.ndarray:
    """The triangles that are left when vertices become others."""
    target = np.arange(count)
    target[gone] = kept
    faces = target[faces]
    return faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
