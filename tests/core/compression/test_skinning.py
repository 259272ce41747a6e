import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from refmesh_addon.core.compression.hierarchy import neighbors
from refmesh_addon.core.compression.node_fit import fitted_motion, reach_of, spread_nodes
from refmesh_addon.core.compression.node_motion import PARAMETER_BITS, coded_motion, rotation_matrices, rotation_parameters
from refmesh_addon.core.compression.skinning import (
    ROTATION_BITS,
    WEIGHT_BITS,
    NodeMotion,
    at_rest,
    blended,
    edge_lengths,
    moved,
    node_weights,
)
from tests.core import shapes
from tests.core.compression.recording import Player, Recorder


@pytest.fixture(scope="module")
def skinned():
    """Whole positions of a ball, lengths of its edges, 20 nodes and their weights."""
    mesh = shapes.ball(3)
    points = np.rint(5000 * mesh.vertices) + 6000
    lengths = edge_lengths(neighbors(mesh.triangles.astype(np.int64), len(points)), points)
    nodes = spread_nodes(lengths, 20)
    return points, lengths, nodes, node_weights(lengths, nodes, reach_of(lengths, nodes))


def test_weights_are_whole_and_sum_to_one(skinned):
    weights = skinned[3].toarray()
    np.testing.assert_array_equal(weights, np.rint(weights))
    np.testing.assert_array_equal(weights.sum(axis=1), 1 << WEIGHT_BITS)
    assert (weights >= 0).all() and ((weights > 0).sum(axis=1) <= 4).all()


def test_nodes_have_the_most_weight_where_they_are(skinned):
    _, _, nodes, weights = skinned
    np.testing.assert_array_equal(weights[nodes].toarray().argmax(axis=1), np.arange(len(nodes)))


def test_every_component_has_a_node():
    mesh = shapes.joined(shapes.ball(1), shapes.ball(2, center=(5.0, 0.0, 0.0)))
    lengths = edge_lengths(neighbors(mesh.triangles.astype(np.int64), len(mesh.vertices)), np.rint(1000 * mesh.vertices))
    assert set(spread_nodes(lengths, 2) >= 42) == {False, True}
    assert len(spread_nodes(lengths, 1)) == 1


def test_a_vertex_that_no_node_reaches_moves_with_the_first():
    mesh = shapes.joined(shapes.ball(1), shapes.ball(1, center=(5.0, 0.0, 0.0)))
    lengths = edge_lengths(neighbors(mesh.triangles.astype(np.int64), len(mesh.vertices)), np.rint(1000 * mesh.vertices))
    weights = node_weights(lengths, np.array([3, 5]), 1e9)
    assert weights[50, 0] == 1 << WEIGHT_BITS


def test_one_rigid_motion_is_reproduced(skinned):
    points, _, nodes, weights = skinned
    turn = Rotation.from_rotvec([0.4, -1.1, 0.3]).as_matrix()
    frames = (points @ turn.T + [10.0, -300.0, 77.0])[None]
    rotations, shifts = fitted_motion(weights, points, frames, nodes)
    maps = blended(weights, points[nodes], (np.rint(rotations[0] * (1 << ROTATION_BITS)), np.rint(shifts[0])))
    assert np.abs(moved(maps, points) - frames[0]).max() < 3
    assert np.abs(at_rest(maps, frames[0]) - points).max() < 3


@pytest.mark.parametrize("angle", [0.0, 0.1, 1.0, 3.0, np.pi])
def test_rotations_come_back_from_their_parameters(angle):
    matrix = Rotation.from_rotvec(angle * np.array([[0.6, 0.0, 0.8]])).as_matrix()
    parameters = np.rint(rotation_parameters(matrix) * (1 << PARAMETER_BITS))
    np.testing.assert_allclose(rotation_matrices(parameters) / (1 << ROTATION_BITS), matrix, atol=3e-4)


def test_motion_comes_back_within_its_steps(skinned):
    points, _, nodes, _ = skinned
    rng = np.random.default_rng(5)
    rotations = np.stack([Rotation.from_rotvec(0.2 * rng.standard_normal((20, 3))).as_matrix() for _ in range(6)])
    target = NodeMotion(rotations, 40 * rng.standard_normal((6, 20, 3)))
    recorder = Recorder()
    motion = coded_motion(recorder, points[nodes], 6, (64, 4), target)
    assert np.abs(motion.shifts - target.shifts).max() < 4 * np.sqrt(6)
    assert np.abs(motion.rotations / (1 << ROTATION_BITS) - rotations).max() < 4 * np.sqrt(6) * 64 / (1 << PARAMETER_BITS)
    played = coded_motion(Player(recorder), points[nodes], 6, (64, 4), None)
    np.testing.assert_array_equal(played.rotations, motion.rotations)
    np.testing.assert_array_equal(played.shifts, motion.shifts)
