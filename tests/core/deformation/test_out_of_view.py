"""What a camera does not show may give way at folds; what it shows stays in view."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from refmesh_addon.core.deformation.arap import ArapSolver
from refmesh_addon.core.deformation.facing import Facing
from refmesh_addon.core.deformation.folds import unfolded
from refmesh_addon.core.deformation.out_of_view import out_of_view
from refmesh_addon.core.deformation.outliers import COVER_RINGS, Surroundings
from refmesh_addon.core.geometry.closest_point import SurfaceIndex
from refmesh_addon.core.geometry.cotangent import triangle_adjacency
from refmesh_addon.core.geometry.mesh import mean_edge_length, submesh
from tests.core.capture.test_depth_artifacts import sheet
from tests.core.shapes import TILT, moved

COUNT, RIM, END = 24, 12, 15  # squares a side, those that the source has, and those that the mesh has


def strip(end):
    """The rows of a sheet before `end`."""
    return sheet(COUNT, cut=[(row, column) for row in range(end, COUNT) for column in range(COUNT)])


SHEET, SOURCE = (submesh(strip(end))[0] for end in (END, RIM))
LENGTH = mean_edge_length(SHEET)
BEYOND = SHEET.vertices[:, 0] - 0.5  # of the rim of the view


def turned_back():
    """The sheet with what lies beyond the rim of the view laid back under it, a little below."""
    vertices = SHEET.vertices.copy()
    out = BEYOND > 1e-9
    vertices[out, 0], vertices[out, 2] = 0.5 - 0.6 * BEYOND[out], -0.1 * LENGTH
    return SHEET.moved(vertices)


def facing_and_mask(mesh, source=SOURCE, held=()):
    facing = Facing(SHEET, np.tile(np.eye(3), (len(SHEET.vertices), 1, 1)), SurfaceIndex(source))
    covered = np.isin(np.arange(len(SHEET.vertices)), held)
    return facing, out_of_view(mesh, facing, Surroundings(triangle_adjacency(SHEET), LENGTH, covered))


def test_what_is_turned_back_at_the_rim_of_the_view_is_out_of_it():
    mesh = turned_back()
    facing, mask = facing_and_mask(mesh)
    assert facing.folded(mesh.vertices).any()
    assert mask[(BEYOND > 1e-9) & (BEYOND < 4 / COUNT)].all()
    assert not mask[BEYOND < -(COVER_RINGS + 1.5) / COUNT].any()


def test_a_fold_out_of_view_is_turned_back_that_stays_otherwise():
    """A vertex pulled back over several others, which is farther than surface in view may be moved."""
    vertices, solver = SHEET.vertices.copy(), ArapSolver(SHEET)
    vertices[np.argmin(np.linalg.norm(vertices[:, :2] - [14 / COUNT, 0.7], axis=1)), 0] -= 4.0 * LENGTH
    facing, mask = facing_and_mask(SHEET.moved(vertices))
    with_limit, without = (facing.folded(unfolded(solver, vertices, SHEET.vertices, facing, hidden)) for hidden in (None, mask))
    assert with_limit.any() and not without.any()


def test_without_folds_only_what_is_held_and_leads_there_is_out_of_view():
    assert not facing_and_mask(SHEET)[1].any()
    corner = facing_and_mask(SHEET, held=[0])[1]
    assert 1 < corner.sum() < 4 * (COVER_RINGS + 1) ** 2 and corner[0]


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_size_and_place_do_not_matter(scale):
    mesh = turned_back()
    rest = moved(SHEET, TILT, scale=scale)
    facing = Facing(rest, np.tile(np.eye(3), (len(rest.vertices), 1, 1)), SurfaceIndex(moved(SOURCE, TILT, scale=scale)))
    around = Surroundings(triangle_adjacency(rest), mean_edge_length(rest), np.zeros(len(rest.vertices), dtype=bool))
    assert_array_equal(out_of_view(moved(mesh, TILT, scale=scale), facing, around), facing_and_mask(mesh)[1])
