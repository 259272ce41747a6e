"""Feature lines: the edges of a box and of its bevels, the rim of a sole; none on a ball, on noise, or where a line is short."""

import numpy as np
import pytest

from refmesh_addon.core.geometry.feature_lines import SHARP, feature_edges, line_corners, line_samples, ordered_lines
from refmesh_addon.core.geometry.half_edges import HalfEdges
from refmesh_addon.core.geometry.mesh import triangle_normals
from refmesh_addon.core.geometry.vectors import row_dot
from refmesh_addon.core.surfacing.hole_caps import smoothly_capped
from refmesh_addon.core.types import TriangleMesh
from sample_scenes.generators.surface import iso_surface

from ..shapes import TILT, ball, box, moved, without


def length_of(mesh):
    return np.linalg.norm(np.diff(mesh.vertices[feature_edges(mesh).edges], axis=1), axis=2).sum()


@pytest.mark.parametrize("subdivisions", range(4))
def test_the_edges_of_a_box_however_finely_it_is_meshed(subdivisions):
    mesh = moved(box((2, 3, 1), subdivisions), TILT)
    assert length_of(mesh) == pytest.approx(4 * (2 + 3 + 1))
    lines = ordered_lines(mesh.vertices, feature_edges(mesh).edges)
    assert sorted(len(line) for line in lines) == [2**subdivisions + 1] * 12, "twelve lines, from corner to corner"


def test_round_surfaces_have_none():
    assert not len(feature_edges(ball(3)).edges)


def test_noise_makes_sharp_edges_but_no_lines():
    mesh = ball(3)
    rough = mesh.moved(mesh.vertices * (1 + 0.04 * np.random.default_rng(0).normal(size=(len(mesh.vertices), 1))))
    sharp = HalfEdges.of(rough).pairs.T // 3
    one, other = triangle_normals(rough)[sharp]
    assert (row_dot(one, other) < np.cos(SHARP)).mean() > 0.3
    assert len(feature_edges(rough).edges) < 0.02 * len(rough.triangles), "a line by chance at most"


def test_the_rim_of_an_open_bottom_is_one_closed_line():
    whole = box((2, 3, 1), subdivisions=3)
    bowl = without(whole, np.abs(triangle_normals(whole) @ [0, 0, 1]) > 0.9)
    capped = smoothly_capped(bowl).mesh
    assert length_of(capped) == pytest.approx(4 * (2 + 3 + 1))


def test_a_closed_line_ends_where_it_begins():
    corners = np.array([[np.cos(a), np.sin(a), 0.0] for a in np.linspace(0, 2 * np.pi, 12, endpoint=False)])
    (line,) = ordered_lines(corners, np.column_stack([np.arange(12), np.roll(np.arange(12), -1)]))
    assert line[0] == line[-1]
    assert sorted(line[:-1].tolist()) == list(range(12))


def test_samples_are_on_their_segments_and_near_each_other():
    segments = np.random.default_rng(0).normal(size=(5, 2, 3))
    points, owners = line_samples(segments, 0.1)
    for number, (start, end) in enumerate(segments):
        own = points[owners == number]
        assert np.abs(own[0] - start).max() == 0
        assert np.abs(own[-1] - end).max() < 1e-12
        assert np.linalg.norm(np.diff(own, axis=0), axis=1).max() <= 0.1 + 1e-12


def test_corners_are_junctions_and_bends():
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0.1, 0], [2, 1, 0], [1, 1, 0], [0, 1, 1]])
    edges = np.array([[0, 1], [1, 2], [2, 3], [3, 4], [4, 0], [0, 5]])
    junctions, bends = line_corners(corners, edges)
    assert junctions.tolist() == [0]
    assert sorted(bends.tolist()) == [2, 3]


def test_edges_that_a_capture_cuts_off_at_random_are_no_lines():
    cube = lambda points: np.abs(points).max(axis=1) - 1.0
    mesh = iso_surface(cube, np.zeros(3), 1.8, 0.14, np.random.default_rng(0))
    one, other = triangle_normals(mesh)[HalfEdges.of(mesh).pairs.T // 3]
    sharp = (row_dot(one, other) < np.cos(SHARP)).sum()
    assert sharp > 200, "its edges are sharp, but zigzags"
    assert len(feature_edges(mesh).edges) < 0.02 * sharp, "a corner by chance at most"


def test_evenly_curved_lines_are_lines():
    angle = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    points = np.concatenate([np.column_stack([ring, np.full(24, z)]) for z in (0.0, 0.25, 0.5)] + [[[0, 0, 0], [0, 0, 0.5]]])
    start, end = np.arange(24), np.roll(np.arange(24), -1)
    walls = [np.concatenate([np.column_stack(t) for t in ((start, end, end + 24), (start, end + 24, start + 24))]) + 24 * k for k in (0, 1)]
    lids = [np.column_stack([end, start, np.full(24, 72)]), np.column_stack([start + 48, end + 48, np.full(24, 73)])]
    assert len(feature_edges(TriangleMesh(points, np.concatenate([*walls, *lids]))).edges) == 48, "both rims of the drum"


def test_short_lines_between_long_ones_are_lines():
    mesh = box((4.0, 2.0, 0.05))  # of edges too few and too short to be lines by themselves
    assert length_of(mesh) == pytest.approx(4 * (4.0 + 2.0 + 0.05))
