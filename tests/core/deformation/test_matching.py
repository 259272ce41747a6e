"""Partners are found where the motion is known, and none is given away twice."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from refmesh_addon.core.deformation.keypoints import PUBLISHED_KEYPOINTS, find_keypoints
from refmesh_addon.core.deformation.matching import PUBLISHED_SEARCH, MatchSettings, in_reach, match_keypoints
from refmesh_addon.core.deformation.patches import surface_patches
from refmesh_addon.core.geometry.mesh import mean_edge_length
from refmesh_addon.core.types import TriangleMesh

from .. import shapes

LENGTH = 1 / 30  # about the mean edge length of the lumps below
TURN = Rotation.from_euler("xyz", [25, -40, 70], degrees=True).as_matrix()


def lump(columns, seed):
    """A ball with dents and bumps and a body of its own triangles, by `seed`; no symmetry."""
    rng = np.random.default_rng(seed)
    theta, phi = np.meshgrid(np.linspace(0, np.pi, columns + 1), np.linspace(0, 2 * np.pi, 2 * columns, endpoint=False), indexing="ij")
    theta[1:-1] += 0.2 * np.pi / columns * rng.normal(size=theta[1:-1].shape)
    phi = phi + 0.2 * np.pi / columns * rng.normal(size=phi.shape) + seed
    way = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=2)
    ahead = np.random.default_rng(77).normal(size=(45, 3))
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    height = np.random.default_rng(78).uniform(-0.15, 0.15, 45)
    radius = 0.5 + sum(h * np.exp(-((way - a) ** 2).sum(axis=2) / 0.05) for h, a in zip(height, ahead))
    index = np.arange(way[..., 0].size).reshape(way.shape[:2])
    a, b, c, d = index[:-1], index[1:], np.roll(index[1:], -1, axis=1), np.roll(index[:-1], -1, axis=1)
    triangles = np.concatenate([np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)]).reshape(-1, 3)
    inside = np.clip(index, 2 * columns - 1, index.size - 2 * columns).ravel()  # one vertex for each pole
    triangles = inside[triangles]
    whole = (triangles[:, 0] != triangles[:, 1]) & (triangles[:, 1] != triangles[:, 2]) & (triangles[:, 2] != triangles[:, 0])
    return TriangleMesh((radius[..., None] * way).reshape(-1, 3), triangles[whole])


def motion(points):
    """A turn, a bend and a shift, smooth and not rigid."""
    bent = points + 0.04 * np.sin(4 * points[:, [1, 2, 0]])
    return bent @ TURN.T + [3.0, -1.0, 2.0]


@pytest.fixture(scope="module")
def bodies():
    reference = lump(48, 0)
    other = lump(52, 1)
    frame = other.moved(motion(other.vertices))
    return [surface_patches(mesh, find_keypoints(mesh, LENGTH), 10 * LENGTH) for mesh in (reference, frame)]


def turns(count):
    return np.broadcast_to(TURN, (count, 3, 3))


def test_lumps_are_what_they_should_be():
    assert 0.5 * LENGTH < mean_edge_length(lump(48, 0)) < 1.5 * LENGTH


@pytest.mark.parametrize("settings", [MatchSettings(), MatchSettings(guided=False)])
def test_partners_lie_where_the_motion_carries_them(bodies, settings):
    reference, frame = bodies
    truth = motion(reference.positions)
    astray = truth + 0.7 * LENGTH * np.random.default_rng(6).normal(size=truth.shape)
    matches = match_keypoints(reference, frame, astray, turns(len(truth)), settings)
    gaps = np.linalg.norm(truth[matches.reference] - frame.positions[matches.frame], axis=1)
    possible = np.linalg.norm(truth[:, None] - frame.positions, axis=2).min(axis=1) < 3 * LENGTH
    assert (gaps < 3 * LENGTH).mean() >= 0.95
    assert (gaps < 3 * LENGTH).sum() >= 0.5 * possible.sum()


@pytest.mark.parametrize("guided", [True, False])
@pytest.mark.parametrize("fixed_point", [True, False])
def test_a_rigid_copy_matches_itself_exactly(bodies, guided, fixed_point):
    mesh = lump(48, 0)
    reference = bodies[0]
    copy = surface_patches(mesh.moved(mesh.vertices @ TURN.T + 5), reference.vertices, reference.radius)
    matches = match_keypoints(
        reference, copy, copy.positions, turns(len(copy.positions)), MatchSettings(guided=guided, fixed_point=fixed_point)
    )
    assert_array_equal(matches.reference, np.arange(len(reference.vertices)))
    assert_array_equal(matches.frame, matches.reference)
    assert_allclose(matches.errors, 0, atol=1e-6)


def test_the_unlimited_search_needs_no_prediction(bodies):
    mesh = lump(48, 0)
    reference = bodies[0]
    copy = surface_patches(mesh.moved(mesh.vertices @ TURN.T + 5), reference.vertices, reference.radius)
    count = len(reference.vertices)
    matches = match_keypoints(reference, copy, np.zeros((count, 3)), np.broadcast_to(np.eye(3), (count, 3, 3)), MatchSettings(guided=False))
    assert_array_equal(matches.frame, matches.reference)
    assert len(matches.reference) == count


def test_the_published_search_tells_the_corners_of_a_box_apart():
    """All corners fit each other after some turn; from no turn and from the tracked one, only those that stayed are found."""
    before, after = (shapes.box((2.0, 2.0, 0.5), 5) for _ in range(2))
    rng = np.random.default_rng(11)
    before, after = (mesh.moved(mesh.vertices + 0.002 * rng.normal(size=mesh.vertices.shape)) for mesh in (before, after))
    after = after.moved(after.vertices + [0.3, -0.2, 0.1])
    length = mean_edge_length(before)
    reference, frame = (surface_patches(mesh, find_keypoints(mesh, length, PUBLISHED_KEYPOINTS), 12 * length) for mesh in (before, after))
    places = reference.positions + [0.3, -0.2, 0.1]
    still = np.broadcast_to(np.eye(3), (len(places), 3, 3))
    right = []
    for settings in (PUBLISHED_SEARCH, replace(PUBLISHED_SEARCH, any_rotation=True)):
        matches = match_keypoints(reference, frame, places, still, settings)
        gaps = np.linalg.norm(places[matches.reference] - frame.positions[matches.frame], axis=1)
        right.append((gaps < 3 * length).mean())
    assert right[0] > 0.75 > 0.6 > right[1]


def test_each_has_one_partner_at_most_and_no_error_exceeds_the_threshold(bodies):
    reference, frame = bodies
    truth = motion(reference.positions)
    loose = match_keypoints(reference, frame, truth, turns(len(truth)), MatchSettings(reach=2.0, threshold=9.0))
    strict = match_keypoints(reference, frame, truth, turns(len(truth)), MatchSettings(reach=2.0, threshold=0.3))
    for matches in (loose, strict):
        assert len(np.unique(matches.reference)) == len(np.unique(matches.frame)) == len(matches.errors)
        assert (np.diff(matches.reference) > 0).all()
    assert loose.errors.max() > 0.3 >= strict.errors.max()
    kept = loose.errors <= 0.3
    assert_array_equal(loose.reference[kept], strict.reference)
    assert_array_equal(loose.frame[kept], strict.frame)


def test_guided_candidates_lie_within_reach(bodies):
    reference, frame = bodies
    places = motion(reference.positions)
    matches = match_keypoints(reference, frame, places, turns(len(places)), MatchSettings(reach=0.1, threshold=9.0))
    assert len(matches.errors)
    assert np.linalg.norm(places[matches.reference] - frame.positions[matches.frame], axis=1).max() <= 0.1 * reference.radius


def test_key_points_out_of_reach_are_in_no_match(bodies):
    reference, frame = bodies
    places, settings = motion(reference.positions)[::3], MatchSettings(threshold=9.0)
    near = in_reach(frame.positions, places, reference.radius, settings)
    gaps = np.linalg.norm(frame.positions[:, None] - places, axis=2).min(axis=1)
    assert_array_equal(near, gaps <= settings.reach * reference.radius)
    assert near.any() and not near.all()
    third = surface_patches(lump(48, 0), reference.vertices[::3], reference.radius)
    assert near[match_keypoints(third, frame, places, turns(len(places)), settings).frame].all()
    assert in_reach(frame.positions, places, reference.radius, MatchSettings(guided=False)).all()
    assert not in_reach(frame.positions, places[:0], reference.radius, settings).any()


def test_scaling_both_changes_neither_partners_nor_errors(bodies):
    mesh = [lump(48, 0), lump(52, 1)]
    mesh[1] = mesh[1].moved(motion(mesh[1].vertices))
    plain, large = (
        [surface_patches(m.moved(scale * m.vertices), p.vertices, scale * p.radius) for m, p in zip(mesh, bodies)] for scale in (1.0, 100.0)
    )
    places = motion(bodies[0].positions)
    ours = match_keypoints(*plain, places, turns(len(places)))
    theirs = match_keypoints(*large, 100 * places, turns(len(places)))
    assert_array_equal(ours.reference, theirs.reference)
    assert_array_equal(ours.frame, theirs.frame)
    assert_allclose(ours.errors, theirs.errors, atol=1e-6)


def test_nothing_to_match_and_wrong_shapes(bodies):
    reference, frame = bodies
    none = surface_patches(lump(48, 0), np.empty(0, dtype=int), reference.radius)
    count = len(reference.vertices)
    assert len(match_keypoints(reference, none, reference.positions, turns(count)).errors) == 0
    assert len(match_keypoints(none, frame, np.empty((0, 3)), turns(0)).errors) == 0
    far = match_keypoints(reference, frame, reference.positions + 1e3, turns(count))
    assert len(far.errors) == 0
    with pytest.raises(ValueError, match="places"):
        match_keypoints(reference, frame, reference.positions[:-1], turns(count))
    with pytest.raises(ValueError, match="rotations"):
        match_keypoints(reference, frame, reference.positions, np.eye(3))
