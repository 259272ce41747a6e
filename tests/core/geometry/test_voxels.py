"""Filling: known volumes, a slow twin that sums solid angles, and captures that are not quite closed."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from refmesh_addon.core.geometry import voxels
from refmesh_addon.core.geometry.holes import capped
from refmesh_addon.core.geometry.mesh import signed_volume, triangle_areas
from refmesh_addon.core.geometry.voxels import Grid, fill, grid_around
from refmesh_addon.core.types import TriangleMesh

from ..shapes import QUARTER_TURN, TILT, above, ball, box, flipped, inside_out, joined, moved, torus, without

BODIES = {
    "ball": ball(2),
    "box": moved(box(), TILT),
    "torus": moved(torus(), TILT),
    "two bodies": moved(joined(ball(2, center=(-1.5, 0, 0)), box(center=(1.5, 0.2, 0))), TILT),
    "cavity": joined(ball(2), inside_out(ball(1, 0.6))),
}
bodies = pytest.mark.parametrize("mesh", BODIES.values(), ids=BODIES.keys())


def filled(mesh, resolution=32):
    return fill(mesh, grid_around(mesh.vertices, resolution))


def winding_numbers(mesh, points):
    """(N,) by the solid angles of all triangles (Van Oosterom & Strackee 1983)."""
    a, b, c = (mesh.vertices[None, mesh.triangles[:, k]] - points[:, None] for k in range(3))
    x, y, z = (np.linalg.norm(side, axis=2) for side in (a, b, c))
    volume = np.einsum("nti,nti->nt", a, np.cross(b, c))
    rest = x * y * z + z * np.einsum("nti,nti->nt", a, b) + x * np.einsum("nti,nti->nt", b, c) + y * np.einsum("nti,nti->nt", c, a)
    return np.arctan2(volume, rest).sum(axis=1) / (2 * np.pi)


@bodies
@pytest.mark.parametrize("resolution", [24, 61])
def test_filled_cells_hold_the_enclosed_volume(mesh, resolution):
    grid = grid_around(mesh.vertices, resolution)
    volume = np.count_nonzero(fill(mesh, grid)) * grid.spacing**3
    shell = triangle_areas(mesh).sum() * grid.spacing
    assert abs(volume - signed_volume(mesh)) < 0.1 * shell


@bodies
def test_same_as_winding_numbers_of_every_cell(mesh):
    grid = grid_around(mesh.vertices, 14)
    everywhere = grid.positions(np.ones(grid.shape, dtype=bool))
    winding = winding_numbers(mesh, everywhere).reshape(grid.shape)
    assert_allclose(winding, np.rint(winding), atol=1e-9)
    assert_array_equal(fill(mesh, grid), np.rint(winding) != 0)


def test_a_capture_with_holes_is_filled_as_its_capped_mesh():
    body = ball(2)
    open_body = without(body, above(body, 0.6) | above(inside_out(body).moved(-body.vertices), 0.7))
    grid = grid_around(body.vertices, 14)
    winding = winding_numbers(capped(open_body), grid.positions(np.ones(grid.shape, dtype=bool))).reshape(grid.shape)
    assert_array_equal(fill(open_body, grid), np.rint(winding) != 0)
    assert fill(open_body, grid).sum() < filled(body, 14).sum()


@bodies
def test_an_inside_out_mesh_encloses_the_same(mesh):
    assert_array_equal(filled(inside_out(mesh)), filled(mesh))


def test_flipped_patches_enclose_the_same():
    body = moved(ball(), TILT)
    patches = above(body, 0.5) | (np.arange(len(body.triangles)) == 17)
    assert_array_equal(filled(flipped(body, patches)), filled(body))


def test_a_body_inside_another_adds_nothing_and_a_hollow_takes_away():
    outer, inner = moved(ball(), TILT), ball(2, 0.6)
    assert_array_equal(filled(joined(outer, inner)), filled(outer))
    grid = grid_around(outer.vertices, 32)
    assert_array_equal(fill(joined(outer, inside_out(inner)), grid), fill(outer, grid) & ~fill(inner, grid))


@bodies
@pytest.mark.parametrize("scale", [1e-3, 0.5, 10.0])
def test_scaling_changes_no_cell(mesh, scale):
    assert_array_equal(filled(moved(mesh, scale=scale)), filled(mesh))


@bodies
def test_far_from_the_origin_hardly_a_cell_changes(mesh):
    assert np.count_nonzero(filled(moved(mesh, shift=(1e5, -3e5, 2e5))) != filled(mesh)) <= 2


@bodies
def test_a_quarter_turn_turns_the_cells(mesh):
    turned = filled(moved(mesh, QUARTER_TURN))
    assert_array_equal(turned, filled(mesh).transpose(1, 0, 2)[::-1])
    upended = filled(mesh.moved(mesh.vertices[:, [2, 0, 1]]))
    assert_array_equal(upended, filled(mesh).transpose(2, 0, 1))


def test_the_order_of_vertices_and_triangles_does_not_matter():
    mesh, rng = BODIES["two bodies"], np.random.default_rng(0)
    order = rng.permutation(len(mesh.vertices))
    triangles = np.argsort(order)[mesh.triangles][rng.permutation(len(mesh.triangles))]
    assert_array_equal(filled(TriangleMesh(mesh.vertices[order], triangles)), filled(mesh))


def test_a_grid_that_shows_a_part_shows_that_part():
    mesh = BODIES["torus"]
    whole = grid_around(mesh.vertices, 40)
    low, high = np.array([7, 5, 3]), np.array([31, 33, 12])
    part = Grid(whole.origin + low * whole.spacing, whole.spacing, tuple(high - low))
    assert_array_equal(fill(mesh, part), fill(mesh, whole)[7:31, 5:33, 3:12])


def test_batches_change_nothing(monkeypatch):
    mesh = BODIES["torus"]
    expected = filled(mesh)
    monkeypatch.setattr(voxels, "PAIRS_AT_ONCE", 300)
    assert_array_equal(filled(mesh), expected)


@bodies
def test_the_grid_covers_the_mesh_and_its_longest_side_has_the_resolution(mesh):
    grid = grid_around(mesh.vertices, 32)
    end = grid.origin + np.array(grid.shape) * grid.spacing
    slack = 1e-9 * mesh.diagonal
    assert max(grid.shape) == 32
    assert (grid.origin <= mesh.vertices.min(axis=0) + slack).all() and (end >= mesh.vertices.max(axis=0) - slack).all()
    assert (np.ptp(mesh.vertices, axis=0) > (np.array(grid.shape) - 1) * grid.spacing).all(), "no cell more than needed"
    assert_allclose(grid.origin + end, mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0), atol=slack)


def test_cell_positions_are_cell_middles():
    grid = Grid(np.array([1.0, 2.0, 3.0]), 0.5, (2, 3, 4))
    marked = np.zeros(grid.shape, dtype=bool)
    marked[0, 0, 0] = marked[1, 2, 3] = True
    assert_allclose(grid.positions(marked), [[1.25, 2.25, 3.25], [1.75, 3.25, 4.75]])


def test_a_single_point_is_refused():
    with pytest.raises(ValueError, match="span no length"):
        grid_around(np.ones((4, 3)), 32)


def test_a_flat_sheet_encloses_nothing():
    sheet = TriangleMesh(np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]) @ TILT.T, [[0, 1, 2], [0, 2, 3]])
    assert not filled(sheet).any()


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("resolution", [4, 12, 28])
def test_scan_lines_through_corners_count_once(seed, resolution):
    # Corners at eighths of the side: at these resolutions some lie exactly on a scan line.
    mesh, rng = box((1.0, 1.0, 1.0), subdivisions=3), np.random.default_rng(seed)
    order = rng.permutation(len(mesh.vertices))
    shuffled = TriangleMesh(mesh.vertices[order], np.argsort(order)[mesh.triangles])
    assert filled(shuffled, resolution).all()
