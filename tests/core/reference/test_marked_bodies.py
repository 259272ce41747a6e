"""Two bodies that touch in every frame: from a few marks, which center belongs to which."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from scipy import sparse
from scipy.spatial.transform import Rotation

from refmesh_addon.core.reference.marked_bodies import marked_bodies, marked_centers
from refmesh_addon.core.reference.separation import within_bodies
from refmesh_addon.core.tracking.neighbors import PARTED, lasting_pairs

STEP = 0.1


def block(low, high) -> np.ndarray:
    """(N, 3) centers on a grid that fills a box, shaken a little."""
    axes = [np.arange(a + STEP / 2, b, STEP) for a, b in zip(low, high, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return grid + np.random.default_rng(len(grid)).uniform(-0.2, 0.2, grid.shape) * STEP


def moving(centers: np.ndarray) -> np.ndarray:
    """(3, C, 3) the centers carried through three frames as one."""
    turns = Rotation.from_rotvec([[0, 0, 0], [0, 0.3, 0.1], [0.4, 0.5, 0]]).as_matrix()
    return np.stack([centers @ turn.T + [frame, 0.0, 0.0] for frame, turn in enumerate(turns)])


LARGE, SMALL, TALL = block((0, 0, 0), (1.5, 1.5, 0.7)), block((0.4, 0.4, 0.7), (1.0, 1.0, 1.3)), block((0.5, 0.5, 1.3), (0.9, 0.9, 2.1))
TWO, THREE = np.concatenate([LARGE, SMALL]), np.concatenate([LARGE, SMALL, TALL])
TRUE_TWO, TRUE_THREE = (np.repeat(np.arange(len(parts)), list(map(len, parts))) for parts in ((LARGE, SMALL), (LARGE, SMALL, TALL)))


@pytest.mark.parametrize("picks", [1, 5])
@pytest.mark.parametrize("seed", range(3))
def test_a_few_marks_find_two_boxes_that_move_as_one(picks, seed):
    rng = np.random.default_rng(seed)
    seeds = [rng.choice(np.flatnonzero(TRUE_TWO == body), picks, replace=False) for body in (0, 1)]
    result = marked_bodies(moving(TWO), STEP, seeds)
    assert np.mean(result != TRUE_TWO) < 0.03
    for body, centers in enumerate(seeds):
        assert (result[centers] == body).all()


def test_three_bodies_on_top_of_each_other():
    result = marked_bodies(moving(THREE), STEP, [[100], [len(LARGE) + 50], [len(THREE) - 1]])
    height = np.abs(THREE[:, 2, None] - [0.7, 1.3]).min(axis=1)  # above or below a contact
    assert np.mean(result != TRUE_THREE) < 0.05 and height[result != TRUE_THREE].max() < 2 * STEP


def test_all_centers_marked_are_taken_as_they_are():
    odd = np.arange(len(TWO)) % 2
    assert_array_equal(marked_bodies(moving(TWO), STEP, [np.flatnonzero(odd == body) for body in (0, 1)]), odd)


def test_what_hangs_together_with_nothing_marked_belongs_to_no_body():
    far = np.concatenate([TWO, SMALL + [5.0, 0.0, 0.0], TALL + [9.0, 0.0, 0.0]])
    result = marked_bodies(moving(far), STEP, [[0], [len(LARGE)], [len(TWO)]])
    assert_array_equal(result[len(TWO) :], [2] * len(SMALL) + [-1] * len(TALL))


@pytest.mark.parametrize("scale", [1e-3, 1e4])
def test_size_and_place_do_not_matter(scale):
    seeds = [[3], [len(TWO) - 3]]
    assert_array_equal(marked_bodies(scale * moving(TWO) + 3 * scale, scale * STEP, seeds), marked_bodies(moving(TWO), STEP, seeds))


def test_affinity_across_bodies_goes_and_the_rest_stays():
    affinity = sparse.random(len(TWO), len(TWO), 0.05, random_state=0, format="csr")
    kept = within_bodies(affinity, TRUE_TWO).toarray()
    across = TRUE_TWO[:, None] != TRUE_TWO
    assert not kept[across].any()
    assert_array_equal(kept[~across], affinity.toarray()[~across])
    assert within_bodies(affinity, None) is affinity


def test_marks_mean_the_nearest_center_and_contradictions_are_refused():
    first, second = marked_centers(TWO, STEP, [LARGE[[3, 3, 8]] + 0.01 * STEP, SMALL[[5]]])
    assert_array_equal(first, [3, 8])
    assert_array_equal(second, [len(LARGE) + 5])
    with pytest.raises(ValueError, match="lies outside the volume"):
        marked_centers(TWO, STEP, [LARGE[[3]], SMALL[[5]] + 3.0])
    with pytest.raises(ValueError, match="two bodies are marked at"):
        marked_centers(TWO, STEP, [LARGE[[3, 4]], LARGE[[4, 5]]])


def test_pairs_that_part_are_no_lasting_pairs():
    positions = np.stack([TWO, TWO + np.outer(TRUE_TWO, [0.0, 0.0, 1.0])])
    pairs, farthest = lasting_pairs(positions, STEP)
    assert (TRUE_TWO[pairs[:, 0]] == TRUE_TWO[pairs[:, 1]]).all() and farthest.max() < PARTED * STEP
