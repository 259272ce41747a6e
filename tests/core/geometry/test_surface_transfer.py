"""Values carried from one surface to another by nearest surface."""

from __future__ import annotations

import numpy as np
import pytest

from refmesh_addon.core.geometry.surface_transfer import SurfaceTransfer, islands
from refmesh_addon.core.types import TriangleMesh


def plane(count: int, tilt: float = 0.0) -> TriangleMesh:
    """A unit square of 2 count^2 triangles; with a tilt, its inner vertices lie elsewhere in the square."""
    axis = np.linspace(0.0, 1.0, count + 1)
    x, y = (grid.ravel() for grid in np.meshgrid(axis, axis, indexing="ij"))
    x, y = x + tilt * np.sin(np.pi * x) * np.sin(np.pi * y), y - tilt * np.sin(np.pi * x) * np.sin(np.pi * y)
    corner = (np.arange(count)[:, None] * (count + 1) + np.arange(count)).ravel()
    lower = np.column_stack([corner, corner + count + 1, corner + 1])
    upper = np.column_stack([corner + 1, corner + count + 1, corner + count + 2])
    return TriangleMesh(np.column_stack([x, y, np.zeros_like(x)]), np.vstack([lower, upper]))


def at_corners(mesh: TriangleMesh) -> np.ndarray:
    """(T, 3, 3) positions of the corners."""
    return mesh.vertices[mesh.triangles]


def test_linear_functions_arrive_unchanged_at_vertices_and_corners():
    source, target = plane(4), plane(7, 0.05)
    transfer = SurfaceTransfer(source, target)
    linear = at_corners(source)[..., :2] @ np.array([[2.0, -1.0], [0.5, 3.0]]) + 1.0
    expected = target.vertices[:, :2] @ np.array([[2.0, -1.0], [0.5, 3.0]]) + 1.0
    np.testing.assert_allclose(transfer.vertices.interpolated(linear), expected, atol=1e-9)
    np.testing.assert_allclose(transfer.corners(linear).interpolated(linear), expected[target.triangles.ravel()], atol=1e-9)


def test_the_same_surface_gives_back_every_value():
    mesh = plane(5, 0.04)
    transfer = SurfaceTransfer(mesh, mesh)
    labels = np.random.default_rng(1).integers(0, 9, len(mesh.vertices))[mesh.triangles][..., None]
    np.testing.assert_array_equal(transfer.vertices.nearest(labels)[mesh.triangles], labels)
    np.testing.assert_array_equal(transfer.triangles.triangles, np.arange(len(mesh.triangles)))


def test_no_triangle_stretches_across_a_seam():
    source, target = plane(6), plane(5, 0.03)
    right = at_corners(source)[..., 0].mean(axis=1) > 0.5
    layout = at_corners(source)[..., :2] + 10.0 * right[:, None, None]  # the right half is an island of its own
    assert len(np.unique(islands(source, layout))) == 2
    carried = SurfaceTransfer(source, target).corners(layout).interpolated(layout).reshape(-1, 3, 2)
    assert np.ptp(carried, axis=1).max() < 0.5  # across the seam it would be 10
    center = at_corners(target).mean(axis=1)[:, 0]
    np.testing.assert_array_equal(carried[:, :, 0].min(axis=1) > 5, center > 0.5)


def test_islands_do_not_depend_on_the_direction_of_an_edge():
    mesh = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], [[0, 1, 2], [1, 2, 3]])  # the second one is flipped
    values = np.array([0.0, 1.0, 2.0, 3.0])[mesh.triangles][..., None]
    assert len(np.unique(islands(mesh, values))) == 1
    values[1, 0] = 9.0
    assert len(np.unique(islands(mesh, values))) == 2


def test_a_source_without_triangles_is_refused():
    with pytest.raises(ValueError, match="no triangles"):
        SurfaceTransfer(TriangleMesh(np.zeros((1, 3)), np.empty((0, 3))), plane(1))
