"""The union of oriented points: independent of order and number of frames, and without rims in the middle of the surface."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from refmesh_addon.core.geometry.mesh import sample_surface, triangle_normals
from refmesh_addon.core.reference.union_points import PointUnion, distances_behind, sheet_thickness, without_inner_rims

from ..shapes import TILT, box, moved

THICKNESS = 0.1


def plate_points(length, count=20_000, seed=0):
    """Oriented points on a plate from x = 0 to `length`, and whether each lies on its upper side."""
    mesh = moved(box((length, 1.0, THICKNESS)), shift=(length / 2, 0, 0))
    points, owners = sample_surface(mesh, count, np.random.default_rng(seed))
    normals = triangle_normals(mesh)[owners]
    return points, normals, normals[:, 2] > 0.5


def union_of(*frames, cell=0.02):
    union = PointUnion(cell)
    for frame in frames:
        union.add(*frame)
    return union.points()


def test_the_mean_of_a_cell_does_not_depend_on_the_order_of_frames():
    first, second = plate_points(1.0), plate_points(1.0, seed=1)
    one, other = union_of(first, second), union_of(second, first)
    for name in ("points", "normals", "shown"):
        assert_allclose(getattr(one, name), getattr(other, name), atol=1e-12)


def test_memory_depends_on_the_surface_and_not_on_the_number_of_frames():
    few = union_of(*(plate_points(1.0, seed=seed) for seed in range(4)))
    many = union_of(*(plate_points(1.0, seed=seed) for seed in range(16)))
    assert len(many.points) < 1.1 * len(few.points)


@pytest.mark.parametrize("turn", [np.eye(3), TILT])
def test_the_rim_of_a_shorter_frame_goes_and_that_of_the_longest_stays(turn):
    frames = [(points @ turn.T, normals @ turn.T, shown) for points, normals, shown in (plate_points(1.0), plate_points(1.5))]
    union = union_of(*frames)
    assert sheet_thickness(distances_behind(union.points, union.normals)) == pytest.approx(THICKNESS, rel=0.1)
    kept = without_inner_rims(union)
    rim = lambda points, x: (np.abs((points.points @ turn)[:, 0] - x) < 0.015) & ((points.normals @ turn)[:, 0] > 0.5)
    assert rim(union, 1.0).sum() > 50 and rim(kept, 1.0).sum() < 0.05 * rim(union, 1.0).sum()
    assert rim(kept, 1.5).sum() > 0.9 * rim(union, 1.5).sum()
    sides = np.abs((union.normals @ turn)[:, 2]) > 0.9
    assert (np.abs((kept.normals @ turn)[:, 2]) > 0.9).sum() > 0.99 * sides.sum()


def test_both_sides_of_a_thin_plate_stay_apart():
    union = union_of(plate_points(1.0), cell=0.3)
    flat = np.abs(union.normals[:, 2]) > 0.9
    assert_allclose(np.abs(union.points[flat, 2]), THICKNESS / 2, atol=1e-6)
    assert ((union.shown > 0.5) == (union.normals[:, 2] > 0.5))[flat].all()
