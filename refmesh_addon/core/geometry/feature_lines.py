"""Feature lines of a mesh: its sharp edges, as far as they form long, smooth lines between smooth faces.

Scans of cloth and hair are full of single sharp edges that are noise. What makes a feature is the whole: a line of sharp edges that runs on
smoothly, over some length, and beside which the surface is much flatter than the edge is sharp. Where a capture has no vertices on an edge,
the chain of its sharp edges is a zigzag about it: to lay a mesh into that line would take it off the edge.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from ..types import FrozenArrays, TriangleMesh
from .graph import connected_components
from .half_edges import HalfEdges
from .mesh import edge_lengths, triangle_normals
from .vectors import TINY, normalized, row_dot

SHARP = np.radians(30)  # least angle between the normals at a sharp edge
STRAIGHT = np.cos(np.radians(50))  # least cosine of the turn at a vertex where a line runs on; it ends at sharper corners and at junctions
LEAST_LENGTH = 0.02  # of a line, as a share of the bounding-box diagonal; four times that below FEW edges, as noise has them;
FEW = 4  # but of any length between the ends of longer lines, as at the tip of a tooth of a gear
ROUGHEST = 0.2  # mean angle at the edges beside a line, as a share of that at its own
# Crookedness up to which sharp edges are lines: those of captures have up to 0.15, and edges that a capture cuts off at random 0.3 to 0.6.
CROOKEDEST = 0.2


@dataclass(frozen=True)
class FeatureEdges(FrozenArrays):
    """edges : (E, 2) on feature lines.  triangles : (E, 2) the two at each."""

    edges: np.ndarray
    triangles: np.ndarray


def feature_edges(mesh: TriangleMesh) -> FeatureEdges:
    """The edges of a mesh that lie on its feature lines.

    >>> from refmesh_addon.core.types import TriangleMesh
    >>> corners = [[0, 0, 1], [4, 0, 1], [0, 2, 0], [4, 2, 0], [0, -2, 0], [4, -2, 0]]
    >>> feature_edges(TriangleMesh(corners, [[0, 1, 3], [0, 3, 2], [0, 5, 1], [0, 4, 5]])).edges.tolist()
    [[0, 1]]
    """
    table = HalfEdges.of(mesh)
    edges = table.edges[table.face_counts == 2].astype(np.int64)
    one, other = triangle_normals(mesh)[table.pairs.T // 3]
    angles = np.arctan2(np.linalg.norm(np.cross(one, other), axis=1), row_dot(one, other))
    sharp = angles > SHARP
    lines = np.full(len(edges), -1)
    lines[sharp] = line_labels(mesh.vertices, edges[sharp])
    count = int(lines.max(initial=-1)) + 1
    lengths = edge_lengths(mesh.vertices, edges)
    on_line = lines >= 0
    total = np.bincount(lines[on_line], lengths[on_line], count)
    sharpness = np.bincount(lines[on_line], (lengths * angles)[on_line], count) / total
    least = LEAST_LENGTH * mesh.diagonal * np.where(np.bincount(lines[on_line], minlength=count) < FEW, 4, 1)
    smooth = _beside(edges, angles, lines, count, len(mesh.vertices)) < ROUGHEST * sharpness
    straight, own = _crookedness(mesh.vertices, edges[on_line]) < CROOKEDEST, lines[on_line]
    long = straight & (smooth & (total > least))[own]
    between = _ends_on(edges[on_line], own, np.unique(edges[on_line][long]))
    chosen = np.flatnonzero(on_line)[long | straight & (smooth & between)[own]]
    return FeatureEdges(edges[chosen], table.pairs[chosen] // 3)


def _ends_on(edges: np.ndarray, lines: np.ndarray, vertices: np.ndarray) -> np.ndarray:
    """(count,) bool, which lines have two ends, both at some of the given vertices.  edges : (E, 2).  lines : (E,) the line of each."""
    pairs, occurrences = np.unique(np.column_stack([np.repeat(lines, 2), edges.ravel()]), axis=0, return_counts=True)
    line, vertex = pairs[occurrences == 1].T
    return np.bincount(line[np.isin(vertex, vertices)], minlength=lines.max(initial=-1) + 1) == 2


def line_labels(vertices: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """(E,) number of the line that each of (E, 2) edges belongs to.

    Two edges are of one line where they meet at a vertex without a third, and without a corner.
    """
    joints = _joints(edges)
    away = normalized(vertices[edges[:, ::-1].T.ravel()] - vertices[edges.T.ravel()])  # from each end along its edge
    runs_on = row_dot(*away[joints.T]) < -STRAIGHT
    return connected_components(joints[runs_on] % len(edges), len(edges))[1]


def _joints(edges: np.ndarray) -> np.ndarray:
    """(J, 2) ends of (E, 2) edges that meet at a vertex without a third. End e is the start of edge e, end E + e its other one."""
    ends = edges.T.ravel()
    order = np.argsort(ends, kind="stable")
    starts = np.flatnonzero(np.r_[True, np.diff(ends[order]) != 0])
    pairs = starts[np.diff(np.r_[starts, len(ends)]) == 2]
    return np.column_stack([order[pairs], order[pairs + 1]])


def _crookedness(vertices: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """(E,) how crooked the net of connected edges is that each of (E, 2) edges belongs to: by how much the offsets of successive vertices
    from the chords of their neighbors differ, in edge lengths.

    0 for straight and for evenly curved lines, of which successive offsets agree; twice the height of a zigzag, of which they alternate.
    Of a whole net, as pieces of a zigzag may be straight by chance.
    """
    ends, others = edges.T.ravel(), edges[:, ::-1].T.ravel()
    joints = _joints(edges)
    before, after = vertices[others[joints.T]]
    chord, step = normalized(after - before), vertices[ends[joints[:, 0]]] - before
    offsets = np.full(vertices.shape, np.nan)
    offsets[ends[joints[:, 0]]] = step - row_dot(step, chord)[:, None] * chord
    jumps = edge_lengths(offsets, edges)
    inner = np.isfinite(jumps)  # edges with a joint at both ends
    lengths = edge_lengths(vertices, edges[inner])
    count, nets = connected_components(edges, len(vertices))
    net = nets[edges[:, 0]]
    total = np.bincount(net[inner], lengths, count)
    return (np.bincount(net[inner], jumps[inner], count) / np.maximum(total, TINY))[net]


def _beside(edges: np.ndarray, angles: np.ndarray, lines: np.ndarray, count: int, vertices: int) -> np.ndarray:
    """(count,) mean angle at the edges that are not sharp and have an end on a line."""
    on_line, rest = np.flatnonzero(lines >= 0), np.flatnonzero(lines < 0)
    ends = sparse.csr_matrix((np.ones(2 * len(on_line)), (lines[np.repeat(on_line, 2)], edges[on_line].ravel())), shape=(count, vertices))
    shape = vertices, len(rest)
    others = sparse.csr_matrix((np.ones(2 * len(rest)), (edges[rest].ravel(), np.repeat(np.arange(len(rest)), 2))), shape=shape)
    touching = (ends.sign() @ others).sign()
    return np.asarray(touching @ angles[rest]).ravel() / np.maximum(np.asarray(touching.sum(axis=1)).ravel(), 1.0)


def line_corners(vertices: np.ndarray, edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(J,) vertices at which three or more of (E, 2) edges meet, and (C,) at which a line of two has a corner.  vertices : (V, 3)."""
    ends, degree = np.unique(edges, return_counts=True)
    pairs = np.flatnonzero(np.isin(edges.T.ravel(), ends[degree == 2]))
    order = pairs[np.argsort(edges.T.ravel()[pairs], kind="stable")].reshape(-1, 2)
    away = normalized(vertices[np.concatenate([edges[:, 1], edges[:, 0]])] - vertices[edges.T.ravel()])
    bends = row_dot(away[order[:, 0]], away[order[:, 1]]) > -STRAIGHT
    return ends[degree > 2], edges.T.ravel()[order[bends, 0]]


def ordered_lines(vertices: np.ndarray, edges: np.ndarray) -> list[np.ndarray]:
    """The lines that (E, 2) edges between (V, 3) vertices form, each as its vertices in order; a closed one ends where it begins."""
    labels = line_labels(vertices, edges)
    return [_ordered(edges[labels == label]) for label in range(int(labels.max(initial=-1)) + 1)]


def _ordered(edges: np.ndarray) -> np.ndarray:
    around: dict[int, list[int]] = {}
    for one, other in edges.tolist():
        around.setdefault(one, []).append(other)
        around.setdefault(other, []).append(one)
    start = next((vertex for vertex, others in around.items() if len(others) == 1), int(edges[0, 0]))
    order = [start]
    while around[order[-1]]:
        following = around[order[-1]].pop(0)
        around[following].remove(order[-1])
        order.append(following)
    return np.array(order)


def line_samples(segments: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Points on (E, 2, 3) segments, both ends among them and at most a step apart, and the (P,) segment of each."""
    counts = np.ceil(np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1) / step).astype(int) + 1
    owner = np.repeat(np.arange(len(segments)), counts)
    share = (np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)) / np.maximum(counts[owner] - 1, 1)
    return segments[owner, 0] + share[:, None] * (segments[owner, 1] - segments[owner, 0]), owner
