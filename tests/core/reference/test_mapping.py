"""Both mappings: identity, rigid motions, the paper's spline by its definition, and tears where bodies part."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy import sparse

from refmesh_addon.core.geometry.mesh import is_watertight, signed_volume, vertex_components
from refmesh_addon.core.reference import mapping
from refmesh_addon.core.reference.mapping import INWARD, NEIGHBORS, FrameMap, bind, spline_mapped
from refmesh_addon.core.reference.tears import torn
from refmesh_addon.core.tracking import lloyd
from refmesh_addon.core.tracking.affinity import near_pairs
from refmesh_addon.core.tracking.volume import sample_volume
from refmesh_addon.core.types import TriangleMesh

from ..shapes import TILT, box, joined, moved, torus

CENTERS = 80
both = pytest.mark.parametrize("name", ["affinity", "rbf"])


class Body:
    """A mesh with centers spread through it and their affinity in one frame."""

    def __init__(self, mesh, count=CENTERS):
        volume = sample_volume(mesh, 32, count)
        self.mesh, self.spacing = mesh, volume.center_spacing(count)
        self.centers = lloyd.spread(volume, count)
        self.affinity = near_pairs(self.centers, self.spacing).weights()

    def map(self, name="affinity"):
        return FrameMap(self.mesh, self.centers, self.affinity, self.spacing, name)


@pytest.fixture(scope="module")
def ring():
    return Body(moved(torus(), TILT))


@pytest.fixture(scope="module")
def stack():
    """Two boxes on top of each other as one surface, of which centers know that they part."""
    body = Body(box((1.0, 1.0, 2.0), subdivisions=4))
    upper = body.centers[:, 2] > 0
    body.affinity = sparse.csr_matrix(body.affinity.multiply(upper[:, None] == upper[None, :]))
    return body


def bent(points):
    angle = 0.2 * points[:, 0]
    return np.stack([np.cos(angle) * points[:, 0], points[:, 1], points[:, 2] + np.sin(angle) * points[:, 0]], axis=1)


@both
def test_centers_that_stay_leave_the_mesh_alone(ring, name):
    frame = ring.map(name)
    assert_allclose(frame.to(ring.centers).vertices, ring.mesh.vertices, atol=1e-9)
    assert frame.whole(ring.mesh).all()
    assert_array_equal(frame.to(ring.centers).triangles, ring.mesh.triangles)


@both
@pytest.mark.parametrize("shift", [0.0, 1e4])
def test_a_rigid_motion_of_the_centers_carries_the_mesh(ring, name, shift):
    move = lambda points: points @ TILT.T + shift
    carried = ring.map(name).to(move(ring.centers))
    assert_allclose(carried.vertices, move(ring.mesh.vertices), atol=1e-6)
    assert ring.map(name).whole(carried).all()
    assert_allclose(ring.map(name).rotations_to(move(ring.centers)), np.broadcast_to(TILT, (len(ring.mesh.vertices), 3, 3)), atol=1e-9)


@both
@pytest.mark.parametrize("scale", [1e-3, 10.0])
def test_scaling_everything_scales_the_result(ring, name, scale):
    scaled = FrameMap(moved(ring.mesh, scale=scale), scale * ring.centers, ring.affinity, scale * ring.spacing, name)
    expected = scale * ring.map(name).to(bent(ring.centers)).vertices
    assert_allclose(scaled.to(scale * bent(ring.centers)).vertices, expected, rtol=1e-6, atol=1e-6 * scale)


@both
def test_turning_the_target_turns_the_result(ring, name):
    plain, turned = (ring.map(name).to(targets).vertices for targets in (bent(ring.centers), bent(ring.centers) @ TILT.T))
    assert_allclose(turned, plain @ TILT.T, atol=1e-8)


def test_both_mappings_follow_a_gentle_bend(ring):
    for name in ("affinity", "rbf"):
        error = np.linalg.norm(ring.map(name).to(bent(ring.centers)).vertices - bent(ring.mesh.vertices), axis=1)
        assert error.mean() < 0.15 * ring.spacing
        assert error.max() < 0.3 * ring.spacing


def test_binding_is_a_weighted_mean_of_near_centers(ring):
    binding = bind(ring.mesh, ring.centers, ring.affinity, ring.spacing)
    assert binding.weights.shape == (len(ring.mesh.vertices), CENTERS)
    assert (binding.weights.data > 0).all()
    assert_allclose(binding.weights.sum(axis=1), 1.0)
    assert np.diff(binding.weights.indptr).max() <= NEIGHBORS
    own = np.asarray(binding.weights[np.arange(len(binding.owners)), binding.owners]).ravel()
    assert_array_equal(own, binding.weights.max(axis=1).toarray().ravel())


def test_a_vertex_belongs_to_the_center_just_below_it():
    mesh = box((1.0, 1.0, 1.0), subdivisions=2)
    top = np.flatnonzero((mesh.vertices[:, 2] == 0.5) & (np.abs(mesh.vertices[:, :2]) < 0.4).all(axis=1))
    height = 0.5 + INWARD * np.array([-1.2, 0.6])  # below the surface, and above it but nearer
    centers = np.array([[0.0, 0.0, h] for h in height])
    owners = bind(mesh, centers, sparse.identity(2, format="csr"), 1.0).owners
    assert_array_equal(owners[top], 0)


def test_fewer_centers_than_neighbors(ring):
    lone = FrameMap(ring.mesh, ring.centers[:1], sparse.identity(1, format="csr"), 1.0)
    assert_allclose(lone.to(ring.centers[:1] + 2.0).vertices, ring.mesh.vertices + 2.0)


def test_the_spline_hits_its_centers_and_keeps_affine_maps(ring):
    target = bent(ring.centers)
    assert_allclose(spline_mapped(ring.centers, ring.centers, target), target, atol=1e-8)
    affine = np.array([[1.1, 0.2, 0], [0, 0.9, 0.1], [0.3, 0, 1.0]])
    assert_allclose(spline_mapped(ring.mesh.vertices, ring.centers, ring.centers @ affine), ring.mesh.vertices @ affine, atol=1e-8)


def spline_by_definition(points, source, target):
    """Equation (4): sum of w_c r^2 log r plus an affine part, with weights orthogonal to affine maps."""

    def kernel(a, b):
        r = np.linalg.norm(a[:, None] - b[None], axis=2)
        return np.where(r > 0, r**2 * np.log(np.where(r > 0, r, 1.0)), 0.0)

    affine = np.hstack([np.ones((len(source), 1)), source])
    system = np.block([[kernel(source, source), affine], [affine.T, np.zeros((4, 4))]])
    solved = np.linalg.solve(system, np.vstack([target, np.zeros((4, 3))]))
    return kernel(points, source) @ solved[:-4] + np.hstack([np.ones((len(points), 1)), points]) @ solved[-4:]


def test_the_spline_same_as_its_definition(ring):
    source, target = ring.centers, bent(ring.centers) + 0.05 * np.random.default_rng(0).normal(size=ring.centers.shape)
    points = ring.mesh.vertices[::7]
    assert_allclose(spline_mapped(points, source, target), spline_by_definition(points, source, target), atol=1e-8)


def test_batches_of_the_spline_change_nothing(ring, monkeypatch):
    target = bent(ring.centers)
    whole = spline_mapped(ring.mesh.vertices, ring.centers, target)
    monkeypatch.setattr(mapping, "POINTS_AT_ONCE", 100)
    assert_allclose(spline_mapped(ring.mesh.vertices, ring.centers, target), whole, atol=1e-12)


def test_affinity_tears_where_the_volume_parts_and_nowhere_else(stack):
    upper = stack.centers[:, 2] > 0
    lift = np.array([0.0, 0.0, 3 * stack.spacing])
    frame = stack.map()
    carried = frame.to(stack.centers + lift * upper[:, None])
    side = upper[frame.binding.owners]
    assert_allclose(carried.vertices, stack.mesh.vertices + lift * side[:, None], atol=1e-9)
    across = side[stack.mesh.triangles].any(axis=1) & ~side[stack.mesh.triangles].all(axis=1)
    assert across.any()
    assert_array_equal(frame.whole(carried), ~across)
    heights = stack.mesh.vertices[stack.mesh.triangles[across]][:, :, 2]
    assert np.abs(heights).max() < 0.5 * stack.spacing + 0.2, "the tear runs between the bodies"


def test_the_spline_stretches_instead(stack):
    upper = stack.centers[:, 2] > 0
    frame = stack.map("rbf")
    carried = frame.to(stack.centers + np.array([0.0, 0.0, 0.3 * stack.spacing]) * upper[:, None])
    assert frame.whole(carried).all()


def test_two_bodies_apart_move_each_on_its_own():
    mesh = joined(box((1, 1, 1), subdivisions=2), box((1, 1, 1), subdivisions=2, center=(1.3, 0, 0)))
    body = Body(mesh)
    right = body.centers[:, 0] > 0.65
    body.affinity = sparse.csr_matrix(body.affinity.multiply(right[:, None] == right[None, :]))
    carried = body.map().to(np.where(right[:, None], body.centers @ TILT.T + [1.0, 0, 0], body.centers))
    there = mesh.vertices[:, 0] > 0.65
    assert_allclose(carried.vertices, np.where(there[:, None], mesh.vertices @ TILT.T + [1.0, 0, 0], mesh.vertices), atol=1e-9)


def test_torn_needs_both_a_share_and_a_length():
    triangle = TriangleMesh(np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), [[0, 1, 2]])
    tiny = triangle.moved(1e-3 * triangle.vertices)
    assert torn(triangle, 3 * triangle.vertices, 1.0).tolist() == [True]
    assert torn(triangle, 1.5 * triangle.vertices, 0.1).tolist() == [False], "half as long again, though long"
    assert torn(tiny, 3 * tiny.vertices, 1.0).tolist() == [False], "three times as long, though short"
    assert torn(triangle, 0.1 * triangle.vertices, 1.0).tolist() == [False], "shrinking tears nothing"


def test_bodies_that_part_are_closed_each_by_itself(stack):
    """The upper box lifts off: what is enclosed stays as much as it was, and nothing spans the gap."""
    targets = stack.centers + np.where(stack.centers[:, 2:] > 0, [0.0, 0.0, 2.0], 0.0)
    frame = stack.map()
    lifted = frame.to(targets)
    closed = frame.closed(lifted)
    assert not frame.whole(lifted).all()
    assert is_watertight(closed)
    assert vertex_components(closed)[0] == 2
    assert signed_volume(closed) == pytest.approx(signed_volume(stack.mesh), rel=0.1)
    assert frame.closed(stack.mesh) is stack.mesh


def test_an_unknown_mapping_is_refused_with_the_known_ones(ring):
    with pytest.raises(ValueError, match="mapping must be one of 'affinity', 'rbf'; got 'afinity'"):
        ring.map("afinity")
