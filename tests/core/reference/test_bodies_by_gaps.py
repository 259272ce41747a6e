"""Contacts that open by less than tracking tells from one body, and limbs that a capture has torn off."""

from functools import cache

import numpy as np
from numpy.testing import assert_array_equal
from scipy.spatial.transform import Rotation

from refmesh_addon.core.geometry.mesh import vertex_components
from refmesh_addon.core.reference.bodies_by_gaps import bodies_by_gaps
from refmesh_addon.core.types import TriangleMesh
from sample_scenes.generators.shapes import ball, block, capsule, union
from sample_scenes.generators.surface import iso_surface

from ..shapes import joined

STEP = 0.1
FLOOR = block((0, 0, -0.3), (0.6, 0.6, 0.3), 0.05)
HEIGHTS = (0.42, 0.5, 0.56, 0.57, 0.47)  # of a ball of radius 0.5 above a box: pressed into it in all frames but two
THIGH, SHIN = capsule((-1.0, 0, 0), (0, 0, 0), 0.24), capsule((0, 0, 0), (1.0, 0, 0), 0.2)


TORN = union(capsule((-1.0, 0, 0), (-0.4, 0, 0), 0.24), capsule((0.3, 0, 0), (1.0, 0, 0), 0.2))
GAP = union(block((-0.53, 0, 0), (0.5, 0.24, 0.24), 0.05), block((0.53, 0, 0), (0.5, 0.2, 0.2), 0.05))  # narrower than centers resolve


@cache
def mesh_of(kind: str, row: int) -> TriangleMesh:
    leg = TORN if row == 1 else union(THIGH, SHIN)
    solid = union(FLOOR, ball((0, 0, HEIGHTS[row]), 0.5)) if kind == "ball" else leg
    return iso_surface(solid, np.array([0, 0, 0.2]), 1.6, 0.05, np.random.default_rng(row))


def filled(solid) -> np.ndarray:
    """(N, 3) centers in a solid, shaken a little."""
    axes = np.arange(-1.5, 1.5, STEP)
    points = np.stack(np.meshgrid(axes, axes, axes, indexing="ij"), axis=-1).reshape(-1, 3)
    points = points + np.random.default_rng(0).uniform(-0.2, 0.2, points.shape) * STEP
    return points[solid(points) < -0.3 * STEP]


def ball_on_a_box() -> tuple[np.ndarray, np.ndarray]:
    """(F, C, 3) centers, and which of them are the ball's. It is pressed flat where it would be inside the box."""
    rest, floor = filled(ball((0, 0, 0), 0.5)), filled(FLOOR)
    balls = [np.column_stack([rest[:, :2], np.maximum(rest[:, 2] + height, 0.3 * STEP)]) for height in HEIGHTS]
    return np.stack([np.concatenate([floor, one]) for one in balls]), np.arange(len(floor) + len(rest)) >= len(floor)


def found(positions: np.ndarray, kind: str, rows: list[int], known: np.ndarray | None = None):
    known = np.zeros(positions.shape[1], dtype=int) if known is None else known
    return bodies_by_gaps(positions, STEP, known, rows, lambda row: mesh_of(kind, row))


def test_a_ball_that_hardly_leaves_its_box_is_a_body():
    positions, is_ball = ball_on_a_box()
    result = found(positions, "ball", [2, 3])
    assert result.bodies.max() == 1 and (result.bodies != result.bodies[0]).tolist() == is_ball.tolist()
    assert_array_equal(result.rows, [[2, 3], [2, 3]])


def test_a_leg_without_a_knee_in_one_frame_stays_whole():
    leg = filled(union(THIGH, SHIN))
    assert vertex_components(mesh_of("leg", 1))[0] == 2
    assert not found(np.stack([leg] * 3), "leg", [1]).bodies.any()


def test_bodies_that_no_frame_joins_are_two_however_narrow_the_gap():
    leg = filled(union(THIGH, SHIN))
    gap = lambda row: iso_surface(GAP, np.zeros(3), 1.6, 0.05, np.random.default_rng(row))
    known = np.zeros(len(leg), dtype=int)
    result = bodies_by_gaps(np.stack([leg] * 3), STEP, known, range(3), gap)
    assert_array_equal(result.bodies != result.bodies[0], leg[:, 0] > 0)
    assert_array_equal(result.rows, [[0, 2]] * 2)


def test_a_layer_over_a_body_has_no_gap():
    solids = [capsule((-1.0, 0, 0), (1.0, 0, 0), radius) for radius in (0.3, 0.4)]
    both = joined(*(iso_surface(solid, np.zeros(3), 1.6, 0.06, np.random.default_rng(0)) for solid in solids))
    inside = filled(solids[1])
    assert not bodies_by_gaps(np.stack([inside] * 2), STEP, np.zeros(len(inside), dtype=int), range(2), lambda row: both).bodies.any()


def test_bodies_that_are_known_are_not_divided_and_scale_and_place_change_nothing():
    positions, is_ball = ball_on_a_box()
    known = is_ball.astype(int)
    assert_array_equal(found(positions, "ball", [2, 3], known).rows, [[-1, -1]] * 2)
    turn = Rotation.from_rotvec([0.3, 0.2, 1.0])
    moved = lambda points: 40.0 * turn.apply(points) + 700.0
    meshes = lambda row: mesh_of("ball", row).moved(moved(mesh_of("ball", row).vertices))
    turned = np.stack([moved(frame) for frame in positions])
    result = bodies_by_gaps(turned, 40.0 * STEP, np.zeros(len(is_ball), dtype=int), [2, 3], meshes)
    assert_array_equal(result.bodies, found(positions, "ball", [2, 3]).bodies)
