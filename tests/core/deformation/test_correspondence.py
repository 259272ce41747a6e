"""Partners between a reference and a source surface: each check on its own."""

import numpy as np
from numpy.testing import assert_allclose

from refmesh_addon.core.deformation.correspondence import Correspondence
from refmesh_addon.core.deformation.partners import Limits
from refmesh_addon.core.deformation.surface_samples import SurfaceSampler
from refmesh_addon.core.geometry.borders import barycentric, border_edges, on_border
from refmesh_addon.core.geometry.closest_point import SurfaceIndex
from refmesh_addon.core.types import TriangleMesh
from tests.core.shapes import box

LIMITS = Limits(distance=0.5, cosine=0.5)


def sheet(cells=6, height=0.0):
    """A flat open square of side 1 at z = height, normals up."""
    x, y = np.meshgrid(np.linspace(0, 1, cells + 1), np.linspace(0, 1, cells + 1), indexing="ij")
    index = np.arange(x.size).reshape(x.shape)
    a, b, c, d = index[:-1, :-1].ravel(), index[1:, :-1].ravel(), index[1:, 1:].ravel(), index[:-1, 1:].ravel()
    vertices = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, height)])
    return TriangleMesh(vertices, np.vstack([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]))


def flipped(mesh):
    return TriangleMesh(mesh.vertices, mesh.triangles[:, ::-1])


def with_seam(mesh):
    """Each triangle with three vertices of its own: the same surface, nothing shared."""
    return TriangleMesh(mesh.vertices[mesh.triangles].reshape(-1, 3), np.arange(3 * len(mesh.triangles)).reshape(-1, 3))


def between(source, reference, compatible=None):
    return Correspondence(SurfaceIndex(source), SurfaceSampler(reference), compatible)


def inner(mesh):
    return np.flatnonzero(np.all((mesh.vertices[:, :2] > 0.01) & (mesh.vertices[:, :2] < 0.99), axis=1))


def test_barycentric_weights_give_the_point_back():
    rng = np.random.default_rng(0)
    corners, weights = rng.normal(size=(50, 3, 3)), rng.dirichlet(np.ones(3), 50)
    assert_allclose(barycentric(np.einsum("nk,nki->ni", weights, corners), corners), weights, atol=1e-9)
    flat = np.zeros((1, 3, 3))
    assert_allclose(barycentric(np.zeros((1, 3)), flat).sum(), 1.0)


def test_border_is_the_outline_and_seams_are_not():
    for mesh in (sheet(), with_seam(sheet())):
        assert border_edges(mesh).sum() == 4 * 6
        middle, side = np.array([[0.52, 0.43, 0.0]]), np.array([[0.52, 0.0, 0.0]])
        for point, expected in ((middle, False), (side, True)):
            closest = SurfaceIndex(mesh).query(point)
            assert on_border(mesh, border_edges(mesh), closest.triangles, closest.points)[0] == expected


def test_vertices_over_a_hole_have_no_partner():
    source = sheet(6)
    hole = np.linalg.norm(source.vertices[source.triangles].mean(axis=1)[:, :2] - 0.5, axis=1) < 0.2
    open_source = TriangleMesh(source.vertices, source.triangles[~hole])
    reference = sheet(23, height=0.01)
    pairs = between(with_seam(open_source), reference).from_reference(reference, LIMITS)
    over = np.linalg.norm(reference.vertices[:, :2] - 0.5, axis=1) < 0.1
    assert over.sum() > 10
    assert not over[pairs.corners[:, 0]].any()
    assert len(pairs.corners) > 0.7 * len(inner(reference))
    assert_allclose(pairs.distances, 0.01, atol=1e-12)


def test_partners_need_nearness_and_agreeing_normals():
    reference = sheet(5, height=0.1)
    source = sheet(7)
    correspondence = between(source, reference)
    for side in (correspondence.from_reference, correspondence.from_source):
        assert len(side(reference, LIMITS).corners) > 10
        assert len(side(reference, Limits(0.05, 0.5)).corners) == 0
    turned = between(source, flipped(reference))
    for side in (turned.from_reference, turned.from_source):
        assert len(side(flipped(reference), LIMITS).corners) == 0


def test_rows_turn_vertices_into_the_points_below_their_targets():
    reference = sheet(5, height=0.1)
    for side in (Correspondence.from_reference, Correspondence.from_source):
        pairs = side(between(sheet(7), reference), reference, LIMITS)
        points = pairs.rows(len(reference.vertices)) @ reference.vertices
        assert_allclose(points - pairs.targets, np.tile([0.0, 0.0, 0.1], (len(points), 1)), atol=1e-12)


def test_trust_falls_with_the_distance_and_ends_at_the_limit():
    def weights(height):
        reference = sheet(5, height)
        pairs = between(sheet(7), reference).from_reference(reference, LIMITS)
        return pairs.weights / between(sheet(7), reference).from_reference(reference, Limits(1e9, 0.5)).weights

    trust = [weights(share * LIMITS.distance) for share in (0.01, 0.5, 0.99)]
    for share, expected in zip(trust, (1.0, 0.5625, 0.0), strict=True):
        assert_allclose(share, expected, atol=1e-3)


def test_refused_pairs_are_left_out_in_both_directions():
    reference, source = sheet(5, height=0.1), sheet(7)

    def left_half_only(vertices, triangles):
        assert vertices.shape == triangles.shape
        return (reference.vertices[vertices, 0] < 0.5) & (source.vertices[source.triangles[triangles, 0], 0] < 0.5)

    correspondence = between(source, reference, left_half_only)
    for side in (correspondence.from_reference, correspondence.from_source):
        targets = side(reference, LIMITS).targets
        assert len(targets) > 5
        assert targets[:, 0].max() < 0.7


def test_what_has_no_partner_and_sticks_out_belongs_just_below():
    source, inset = box((1.0, 1.0, 1.0), 3, (0.5, 0.5, -0.5)), 0.05
    targets = {}
    for height in (0.1, -0.04, -0.06):
        inner_side = flipped(sheet(5, height))  # faces against the source: a second layer, which the source does not show
        correspondence = between(source, inner_side)
        assert len(correspondence.from_reference(inner_side, LIMITS).targets) == 0
        pairs = correspondence.from_reference(inner_side, LIMITS, inset)
        targets[height] = pairs.targets[:, 2]
        assert_allclose(np.abs(pairs.normals), np.tile([0.0, 0.0, 1.0], (len(pairs.normals), 1)), atol=1e-12)
    assert min(len(targets[0.1]), len(targets[-0.04])) > 20
    assert_allclose(np.concatenate(list(targets.values())), -inset, atol=1e-12)
    assert len(targets[-0.06]) == 0


def test_the_bottom_of_a_crease_belongs_to_its_walls():
    source, wall = sheet(7), sheet(5)
    wall = wall.moved(np.column_stack([wall.vertices[:, 2] - 0.01, wall.vertices[:, 1], wall.vertices[:, 0] - 0.5]))  # upright, beside it
    for mesh, reached in ((wall, True), (flipped(sheet(5, 0.1)), False)):  # what is turned away never
        correspondence = between(source, mesh)
        assert len(correspondence.from_source(mesh, LIMITS).targets) == 0
        assert (len(correspondence.from_source(mesh, LIMITS, beside=True).targets) > 10) == reached


def test_what_sticks_out_of_another_body_stays():
    inner_side = flipped(sheet(5, 0.1))
    nowhere = lambda vertices, triangles: np.zeros(len(vertices), dtype=bool)
    pairs = between(sheet(7), inner_side, nowhere).from_reference(inner_side, LIMITS, 0.05)
    assert len(pairs.targets) == 0


def test_what_a_frame_shows_beyond_the_border_pulls_it_only_where_the_reference_is_open():
    reference, source = sheet(), sheet(12)
    source = source.moved(source.vertices * [1.2, 1.0, 1.0])  # goes on beyond x = 1
    for is_open in (False, True):
        pairs = Correspondence(SurfaceIndex(source), SurfaceSampler(reference), is_open=is_open).from_source(reference, LIMITS)
        beyond = (pairs.targets[:, 0] > 1.05) & (np.abs(pairs.targets[:, 1] - 0.5) < 0.4)
        assert beyond.any() == is_open
        assert_allclose(np.abs(pairs.normals[beyond]), np.tile([1.0, 0.0, 0.0], (beyond.sum(), 1)), atol=1e-9)
    shorter = source.moved(source.vertices * [0.5, 1.0, 1.0])
    pairs = Correspondence(SurfaceIndex(shorter), SurfaceSampler(reference), is_open=True).from_reference(reference, LIMITS)
    assert (pairs.targets[:, 0] < 0.61).all() and (pairs.distances < 1e-9).all(), "nothing pulls a border back"
