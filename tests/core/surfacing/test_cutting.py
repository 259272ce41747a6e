"""Surfaces cut along the zero level of a function."""

import numpy as np
import pytest

from refmesh_addon.core.geometry.borders import boundary_edges
from refmesh_addon.core.geometry.half_edges import HalfEdges
from refmesh_addon.core.geometry.mesh import triangle_areas, triangle_normals, triangle_shapes
from refmesh_addon.core.surfacing.cutting import cut_at_zero

from ..shapes import TILT, ball, moved


@pytest.mark.parametrize("height", [-0.5, 0.0, 0.013, 0.7])
def test_a_ball_is_cut_at_a_plane(height):
    mesh = moved(ball(4), TILT)
    part = cut_at_zero(mesh, mesh.vertices[:, 2] - height)
    rim = part.vertices[np.unique(boundary_edges(part))]
    assert part.vertices[:, 2].min() > height - 1e-12 and np.abs(rim[:, 2] - height).max() < 1e-12
    assert triangle_areas(part).sum() == pytest.approx(2 * np.pi * (1 - height), rel=0.01)
    table = HalfEdges.of(part)
    assert (table.face_counts <= 2).all() and len(np.unique(boundary_edges(part)[:, 0])) == len(boundary_edges(part))
    assert (np.einsum("ij,ij->i", triangle_normals(part), part.vertices[part.triangles].mean(axis=1)) > 0).all(), "all face outward"
    assert triangle_shapes(part.vertices[part.triangles])[1].min() > 0.1, "no slivers"


def test_all_or_nothing_is_kept_where_the_function_has_one_sign():
    mesh = ball(2)
    assert len(cut_at_zero(mesh, np.ones(len(mesh.vertices))).triangles) == len(mesh.triangles)
    assert not len(cut_at_zero(mesh, -np.ones(len(mesh.vertices))).triangles)


def test_scale_changes_nothing_but_the_scale():
    mesh = ball(2)
    values = mesh.vertices[:, 0] - 0.1
    one, other = cut_at_zero(mesh, values), cut_at_zero(moved(mesh, scale=1024.0), 1024.0 * values)
    assert np.array_equal(one.triangles, other.triangles) and np.array_equal(1024.0 * one.vertices, other.vertices)
