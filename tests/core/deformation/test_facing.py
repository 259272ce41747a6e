"""Which triangles face the wrong way: the rotations tell, or the source where surface curls."""

import numpy as np
from numpy.testing import assert_array_equal

from refmesh_addon.core.deformation.arap import ArapSolver
from refmesh_addon.core.deformation.facing import Facing
from refmesh_addon.core.deformation.folds import unfolded
from refmesh_addon.core.geometry.closest_point import SurfaceIndex
from refmesh_addon.core.geometry.mesh import triangle_normals
from tests.core.bending_bar import bar, with_folds
from tests.core.shapes import TILT

REFERENCE = bar(30, 16, uneven=0.1)
UNROTATED = np.tile(np.eye(3), (len(REFERENCE.vertices), 1, 1))


def test_what_faces_where_its_rotations_take_it_is_not_folded():
    rotated = np.tile(TILT, (len(REFERENCE.vertices), 1, 1))
    assert not Facing(REFERENCE, rotated).folded(REFERENCE.vertices @ TILT.T).any()


def test_a_triangle_that_faces_the_wrong_way_is_folded():
    moved = REFERENCE.moved(with_folds(REFERENCE, REFERENCE.vertices))
    expected = np.einsum("ij,ij->i", triangle_normals(moved), triangle_normals(REFERENCE)) < 0
    assert 2 <= expected.sum() < 20
    assert_array_equal(Facing(REFERENCE, UNROTATED).folded(moved.vertices), expected)


def test_what_curls_as_the_source_does_is_not_folded():
    moved = with_folds(REFERENCE, REFERENCE.vertices)
    crumpled = SurfaceIndex(REFERENCE.moved(moved))
    facing = Facing(REFERENCE, UNROTATED, crumpled)
    assert facing.turned_over(moved).any()
    assert not facing.folded(moved).any()
    assert_array_equal(facing.curled(moved), facing.turned_over(moved))
    assert unfolded(ArapSolver(REFERENCE), moved, REFERENCE.vertices, facing) is moved
    smooth = Facing(REFERENCE, UNROTATED, SurfaceIndex(REFERENCE))
    assert_array_equal(smooth.folded(moved), smooth.turned_over(moved))
    assert not smooth.curled(moved).any()
