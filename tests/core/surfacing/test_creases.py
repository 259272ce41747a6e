"""Edges that the implicit function rounds come back sharp; what is round stays round."""

import numpy as np
import pytest
import trimesh
from numpy.testing import assert_array_equal

from refmesh_addon.core.geometry.closest_point import SurfaceIndex
from refmesh_addon.core.geometry.self_intersection import crossing_triangles
from refmesh_addon.core.surfacing.creases import sharpened
from refmesh_addon.core.surfacing.dual_marching_cubes import zero_surface
from refmesh_addon.core.surfacing.poisson import solve_screened_poisson
from refmesh_addon.core.surfacing.reconstruction import screened_poisson
from refmesh_addon.core.surfacing.remeshing import remeshed
from refmesh_addon.core.types import TriangleMesh

from ..bodies import BODIES, oriented_points
from ..shapes import TILT, box, moved

CUBE = moved(box((1.0, 1.0, 1.0)), TILT)
CELL = 1.0 / 20


def surfaces(body, count=20_000, noise=0.0):
    """Before and after, with the points that both are made of."""
    points, normals = oriented_points(body, count)
    points = points + noise * np.random.default_rng(1).normal(size=(count, 1)) * normals
    grid, values = solve_screened_poisson(points, normals, CELL)
    smooth = zero_surface(grid, values)
    return smooth, sharpened(smooth, grid, points, normals)


def farthest(mesh, body):
    """Greatest distance from corners and edges of a body to the mesh: what rounding costs."""
    sharp = body.vertices[np.unique(body.triangles)]
    return SurfaceIndex(mesh).query(sharp).distances.max()


@pytest.mark.parametrize("noise", [0.0, 0.02 * CELL])
def test_edges_and_corners_of_a_cube_come_back(noise):
    smooth, sharp = surfaces(CUBE, noise=noise)
    assert farthest(sharp, CUBE) < 0.35 * farthest(smooth, CUBE)
    off = [np.percentile(SurfaceIndex(CUBE).query(mesh.vertices).distances, 95) for mesh in (smooth, sharp)]
    assert off[1] < min(0.7 * off[0], 0.1 * CELL)
    assert_array_equal(sharp.triangles, smooth.triangles)
    assert not crossing_triangles(sharp).any()


@pytest.mark.parametrize("name", BODIES)
def test_round_bodies_keep_their_vertices(name):
    scaled = BODIES[name].moved(BODIES[name].vertices / 2)
    smooth, sharp = surfaces(scaled)
    assert (smooth.vertices == sharp.vertices).all(axis=1).mean() > 0.99


def test_a_wire_as_thin_as_a_cell_is_not_made_a_ridge():
    shape = trimesh.creation.torus(0.5, CELL)
    wire = TriangleMesh(np.asarray(shape.vertices), np.asarray(shape.faces))
    smooth, sharp = surfaces(wire)
    grown = SurfaceIndex(wire).query(sharp.vertices).distances.max()
    assert grown < max(1.5 * SurfaceIndex(wire).query(smooth.vertices).distances.max(), 0.3 * CELL)


def test_remeshing_keeps_edges_sharp():
    points, normals = oriented_points(CUBE, 20_000)
    result = remeshed(screened_poisson(points, normals, 5), 3000)
    assert farthest(result, CUBE) < 0.25 * np.sqrt(6.0 / 3000)
    assert np.percentile(SurfaceIndex(CUBE).query(result.vertices).distances, 95) < 0.1 * np.sqrt(6.0 / 3000)
