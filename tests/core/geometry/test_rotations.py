"""Closest rotations: the law that defines them, a slow twin, and inputs that do not determine them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import sparse

from refmesh_addon.core.geometry.rotations import closest_rotations, rigid_motions


def random_rotations(rng, count):
    return closest_rotations_by_svd(rng.normal(size=(count, 3, 3)))


def closest_rotations_by_svd(m):
    u, _, vt = np.linalg.svd(m)
    u[:, :, 2] *= np.sign(np.linalg.det(u @ vt))[:, None]
    return u @ vt


def planar(rng, count):
    return np.einsum("nki,nkj->nij", rng.normal(size=(count, 2, 3)), rng.normal(size=(count, 2, 3)))


@pytest.mark.parametrize(
    "make",
    [
        lambda rng: rng.normal(size=(20_000, 3, 3)),  # half of them reflections
        lambda rng: np.eye(3) + 0.05 * rng.normal(size=(20_000, 3, 3)),
        lambda rng: planar(rng, 20_000),
        lambda rng: 1e-120 * rng.normal(size=(500, 3, 3)),
        lambda rng: 1e120 * rng.normal(size=(500, 3, 3)),
    ],
    ids=["any", "near identity", "rank two", "tiny", "huge"],
)
def test_same_as_singular_value_decomposition(make):
    m = make(np.random.default_rng(0))
    determined = np.linalg.svd(m / np.abs(m).max(axis=(1, 2), keepdims=True))[1][:, 1] > 1e-3
    assert determined.mean() > 0.98
    assert_allclose(closest_rotations(m)[determined], closest_rotations_by_svd(m)[determined], atol=1e-9)


def test_always_a_proper_rotation_even_without_rank():
    rng = np.random.default_rng(1)
    line = np.einsum("ni,nj->nij", rng.normal(size=(200, 3)), rng.normal(size=(200, 3)))
    m = np.concatenate([np.zeros((3, 3, 3)), -np.eye(3)[None], np.diag([1.0, 1.0, -1.0])[None], line, 1e-300 * line])
    r = closest_rotations(m)
    assert_allclose(r @ r.transpose(0, 2, 1), np.broadcast_to(np.eye(3), r.shape), atol=1e-12)
    assert_allclose(np.linalg.det(r), 1.0, atol=1e-12)
    # Each is as close as the decomposition's choice: the same tr(R^T M).
    assert_allclose(np.einsum("nij,nij->n", r, m), np.einsum("nij,nij->n", closest_rotations_by_svd(m), m), atol=1e-9)


def test_undetermined_inputs_stay_nearest_to_the_identity():
    assert_allclose(closest_rotations(np.zeros((1, 3, 3)))[0], np.eye(3))
    axis = np.array([1.0, 2.0, -1.0]) / np.sqrt(6.0)
    assert_allclose(closest_rotations(np.outer(axis, axis)[None])[0], np.eye(3), atol=1e-3)


def test_turning_the_input_turns_the_answer():
    rng = np.random.default_rng(2)
    m, q = rng.normal(size=(300, 3, 3)), random_rotations(rng, 300)
    assert_allclose(closest_rotations(q @ m), q @ closest_rotations(m), atol=1e-8)
    assert_allclose(closest_rotations(7.0 * m), closest_rotations(m), atol=1e-9)


def test_the_answer_does_not_depend_on_its_neighbors_in_the_batch():
    m = np.random.default_rng(3).normal(size=(20_000, 3, 3))
    assert np.array_equal(closest_rotations(m)[9000:9007], closest_rotations(m[9000:9007]))


def test_no_matrices_and_wrong_shapes():
    assert closest_rotations(np.empty((0, 3, 3))).shape == (0, 3, 3)
    with pytest.raises(ValueError, match=r"m must be \(N, 3, 3\)"):
        closest_rotations(np.eye(3))


def kabsch(weights, source, target):
    """Plain loop over the neighborhoods."""
    moved = np.empty_like(source)
    for i, row in enumerate(weights):
        row = row / row.sum()
        s, t = row @ source, row @ target
        covariance = sum(w * np.outer(b - t, a - s) for w, a, b in zip(row, source, target, strict=True))
        moved[i] = closest_rotations_by_svd(covariance[None])[0] @ (source[i] - s) + t
    return moved


def test_rigid_motions_same_as_a_loop_of_kabsch_fits():
    rng = np.random.default_rng(4)
    source, target = rng.normal(size=(2, 60, 3))
    weights = rng.random((60, 60)) * (rng.random((60, 60)) < 0.2) + np.eye(60)
    motions = rigid_motions(sparse.csr_matrix(weights), source, target)
    assert_allclose(motions.apply(source), kabsch(weights, source, target), atol=1e-9)


def test_rigid_motions_recover_a_rigid_motion_far_from_the_origin():
    rng = np.random.default_rng(5)
    source = rng.normal(size=(50, 3)) + 1e5
    q = random_rotations(rng, 1)[0]
    target = source @ q.T + [3.0, 4.0, -5e5]
    motions = rigid_motions(sparse.csr_matrix(np.ones((50, 50))), source, target)
    assert_allclose(motions.rotations, np.broadcast_to(q, (50, 3, 3)), atol=1e-9)
    assert_allclose(motions.apply(source), target, atol=1e-8)


def test_a_neighborhood_without_weight_does_not_turn():
    source = np.random.default_rng(6).normal(size=(4, 3))
    motions = rigid_motions(sparse.csr_matrix((4, 4)), source, source + [1.0, 0.0, 0.0])
    assert_allclose(motions.apply(source), source + [1.0, 0.0, 0.0])


def test_rigid_motions_refuse_shapes_that_do_not_fit():
    with pytest.raises(ValueError, match="to match weights"):
        rigid_motions(sparse.eye(4).tocsr(), np.zeros((3, 3)), np.zeros((3, 3)))
