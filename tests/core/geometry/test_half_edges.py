"""The half-edge table: the same as walking around every face with a dictionary, on surfaces of every kind."""

from collections import defaultdict

import numpy as np
import pytest

from refmesh_addon.core.geometry.half_edges import HalfEdges

from ..shapes import above, ball, box, flipped, joined, torus, without

RNG = np.random.default_rng(7)
SURFACES = {
    "closed": ball(1).triangles,
    "with boundary": without(torus(), RNG.random(1024) < 0.3).triangles,
    "partly flipped": flipped(ball(1), above(ball(1), 0.3)).triangles,
    "two bodies": joined(ball(1), box()).triangles,
    "three faces at one edge": np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]]),
    "collapsed triangles": np.array([[0, 0, 1], [2, 2, 2], [1, 2, 3]]),
    "arbitrary": RNG.integers(0, 12, (60, 3)),
    "quads": RNG.integers(0, 20, (50, 4)),
    "nothing": np.zeros((0, 3), dtype=int),
}
every_surface = pytest.mark.parametrize("faces", SURFACES.values(), ids=SURFACES.keys())


def faces_by_edge(faces):
    """(lower vertex, higher vertex) -> its half-edges, found one by one."""
    result = defaultdict(list)
    corners = faces.shape[1]
    for face, vertices in enumerate(faces.tolist()):
        for corner, start in enumerate(vertices):
            result[tuple(sorted((start, vertices[(corner + 1) % corners])))].append(corners * face + corner)
    return dict(sorted(result.items()))


def table_of(faces):
    return HalfEdges(faces, int(faces.max(initial=-1)) + 3)  # the last vertices have no faces


@every_surface
def test_edges_their_faces_and_pairs_are_those_of_a_walk_around_every_face(faces):
    table, expected = table_of(faces), faces_by_edge(faces)
    assert table.edges.dtype == np.int32 and table.edges.shape == (len(expected), 2)
    assert list(map(tuple, table.edges.tolist())) == list(expected)
    assert table.face_counts.tolist() == [len(half_edges) for half_edges in expected.values()]
    assert table.pairs.tolist() == [half_edges for half_edges in expected.values() if len(half_edges) == 2]
    for number, half_edges in enumerate(expected.values()):
        assert (table.edge[half_edges] == number).all()


@every_surface
def test_half_edges_follow_each_other_around_their_face(faces):
    table, corners = table_of(faces), faces.shape[1]
    for half_edge in range(faces.size):
        face, corner = divmod(half_edge, corners)
        assert table.start[half_edge] == faces[face, corner]
        assert table.end[half_edge] == faces[face, (corner + 1) % corners]
        assert table.previous[half_edge] == faces[face, corner - 1]


def test_euler_characteristic_of_a_torus_is_zero():
    mesh = torus()
    assert len(mesh.vertices) - len(HalfEdges.of(mesh).edges) + len(mesh.triangles) == 0


def test_a_face_with_an_unknown_vertex_is_refused():
    with pytest.raises(ValueError, match="0 to 2; got 1 to 9"):
        _ = HalfEdges(np.array([[0, 1, 9]]), 3).edges
