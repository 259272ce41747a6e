"""Caps: closed, flat where the rim is, round where the surface is, and never outside the rim where they meet it at an angle."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from refmesh_addon.core.geometry.borders import boundary_edges
from refmesh_addon.core.geometry.mesh import is_watertight, signed_volume, triangle_areas, triangle_normals
from refmesh_addon.core.surfacing.hole_caps import smoothly_capped
from refmesh_addon.core.types import TriangleMesh

from ..geometry.test_holes import open_meshes
from ..shapes import TILT, above, ball, box, moved, without


def caps(capped):
    return TriangleMesh(capped.mesh.vertices, capped.mesh.triangles[capped.holes >= 0])


@open_meshes
def test_every_hole_is_closed_and_the_capture_comes_first(mesh):
    capped = smoothly_capped(mesh)
    assert len(boundary_edges(capped.mesh)) == 0
    assert_array_equal(capped.mesh.vertices[: len(mesh.vertices)], mesh.vertices)
    assert_array_equal(capped.mesh.triangles[capped.holes < 0], mesh.triangles)
    assert_array_equal(capped.holes[: len(mesh.triangles)], -1)


def test_a_closed_mesh_stays_as_it_is():
    closed = ball(2)
    assert smoothly_capped(closed).mesh is closed


def test_the_open_bottom_of_a_box_gets_a_flat_cap_of_even_triangles():
    whole = moved(box((2, 3, 1), subdivisions=3), TILT)
    normal = TILT @ [0, 0, -1]
    bottom = triangle_normals(whole) @ normal > 0.9
    capped = smoothly_capped(without(whole, bottom))
    cap = caps(capped)
    assert is_watertight(capped.mesh)
    assert signed_volume(capped.mesh) == pytest.approx(6.0)
    assert np.abs(triangle_normals(cap) @ normal - 1).max() < 1e-9, "flat, and no triangle of it folded over"
    assert triangle_areas(cap).max() < 4 * triangle_areas(cap).mean()


def test_a_hole_in_a_ball_is_closed_as_round_as_the_ball():
    capped = smoothly_capped(without(ball(3), above(ball(3), 0.8)))
    assert np.abs(np.linalg.norm(capped.mesh.vertices, axis=1) - 1).max() < 0.03, "a flat cap would be 0.2 below"


def test_a_cut_off_cone_is_not_continued():
    turns = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    rings = [np.column_stack([r * np.cos(turns), r * np.sin(turns), np.full(40, z)]) for r, z in ((1.0, 0.0), (1.2, 1.0))]
    number, following = np.arange(40), np.roll(np.arange(40), -1)
    walls = np.concatenate([np.column_stack([number, following, following + 40]), np.column_stack([number, following + 40, number + 40])])
    capped = smoothly_capped(TriangleMesh(np.concatenate(rings), walls))
    assert capped.mesh.vertices[:, 2].min() > -1e-9
    assert capped.mesh.vertices[:, 2].max() < 1 + 1e-9
    assert_array_equal(np.unique(capped.holes), [-1, 0, 1])


def test_the_size_of_a_capture_does_not_matter():
    open_ball = without(ball(2), above(ball(2), 0.6))
    small, large = smoothly_capped(open_ball), smoothly_capped(moved(open_ball, scale=1000.0))
    assert_array_equal(small.mesh.triangles, large.mesh.triangles)
    assert np.abs(1000 * small.mesh.vertices - large.mesh.vertices).max() < 1e-6
