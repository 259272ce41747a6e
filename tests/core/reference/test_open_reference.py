"""The reference mesh of an open take: what any frame shows, and nothing of what closes the frames."""

import numpy as np
import pytest

from refmesh_addon.core.capture.shell import shell_behind
from refmesh_addon.core.geometry.borders import boundary_edges
from refmesh_addon.core.geometry.closest_point import SurfaceIndex
from refmesh_addon.core.geometry.mesh import is_watertight, sample_surface, triangle_normals
from refmesh_addon.core.reference.open_reference import build_open_reference
from refmesh_addon.core.reference.union_points import PointUnion, without_inner_rims
from refmesh_addon.core.surfacing.reconstruction import screened_poisson

from ..shapes import above, ball, without

BALL = ball(4)
SHELL = 0.15


def union_of(*surfaces):
    union = PointUnion(0.03)
    for seed, surface in enumerate(surfaces):
        body = shell_behind(surface, SHELL)
        points, owners = sample_surface(body, 20_000, np.random.default_rng(seed))
        union.add(points, triangle_normals(body)[owners], owners < len(surface.triangles))
    return without_inner_rims(union.points())


def cap(height):
    return without(BALL, ~above(BALL, height))


@pytest.fixture(scope="module")
def reference():
    return build_open_reference(union_of(cap(0.5), cap(0.0), cap(0.3)), 0.2, 6000, 6, screened_poisson, is_open=True)


def test_the_mesh_covers_what_any_frame_shows_and_ends_where_all_end(reference):
    points = sample_surface(cap(0.05), 2000, np.random.default_rng(0))[0]
    assert SurfaceIndex(reference.mesh).query(points).distances.max() < 0.04
    rim = reference.mesh.vertices[np.unique(boundary_edges(reference.mesh))]
    assert len(rim) and np.abs(rim[:, 2]).max() < 0.12


def test_nothing_of_the_shell_is_left(reference):
    radius = np.linalg.norm(reference.mesh.vertices, axis=1)
    assert radius.min() > 1 - SHELL / 2 and reference.self_intersections == 0


def test_a_layer_stays_closed():
    mesh = build_open_reference(union_of(cap(0.0)), 0.2, 3000, 6, screened_poisson, is_open=False).mesh
    assert is_watertight(mesh)
